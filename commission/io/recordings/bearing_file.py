"""`bearings.csv` of a recording: reflexes of a goniometer, each with its own time.

Columns `stamp_ns,bearing` and optional `reflector`: time of the reflex [ns], bearing in the scanner frame [rad],
and the id of the reflector where the sensor knows it. Rows may come in any order; a whole turn that met no reflector is
one row with nothing but its stamp.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import numpy as np

from commission.errors import FileFormatError
from commission.geometry.arrays import Growing
from commission.io.csv_table import Block, read_table
from commission.io.table_writer import write_table
from commission.site.bearing_log import NO_BEARINGS, BearingLog
from commission.site.records import Reflex

BEARINGS = "bearings.csv"
BEARING_COLUMNS = ("stamp_ns", "bearing")
REFLECTOR_COLUMN = "reflector"
"""Optional column."""


def read_bearings(path: Path) -> BearingLog:
    """Read all reflexes.

    Parameters
    ----------
    path : the table, or the folder of a recording that has one.

    Raises
    ------
    FileFormatError
        there is none, it has no rows, or a cell is wrong; names line and column.
    """
    if path.is_dir():
        path /= BEARINGS
    if not path.is_file():
        raise FileFormatError(path, "", "does not exist", f"reflexes of a goniometer: {','.join(BEARING_COLUMNS)}")
    found = read_reflexes(path)
    if not len(found):
        raise FileFormatError(path, "", "has no rows", "at least one reflex")
    return found


def read_reflexes(path: Path) -> BearingLog:
    """Read all reflexes; none where there is no such table.

    Parameters
    ----------
    path : the table.

    Raises
    ------
    FileFormatError
        a cell is wrong; names line and column.
    """
    if not path.exists():
        return NO_BEARINGS
    stamps, bearings, names = Growing(np.int64), Growing(np.float64), list[str]()
    for block in read_table(path, BEARING_COLUMNS, (REFLECTOR_COLUMN,), ignore_unknown=True, bytes_at_once=1_000_000):
        stamps.append(block.stamps())
        found = block.numbers("bearing", "rad", empty=np.nan)
        named = REFLECTOR_COLUMN in block.columns
        ids = [each.strip() for each in block.texts(REFLECTOR_COLUMN)] if named else [""] * len(block)
        _check(block, found, ids)
        bearings.append(found)
        names.extend(ids)
    order = np.argsort(stamps.array(), kind="stable")
    return BearingLog(
        stamps_ns=stamps.array()[order],
        bearings=bearings.array()[order],
        reflectors=tuple(names[index] for index in order.tolist()),
    )


def _check(block: Block, bearings: np.ndarray, ids: list[str]) -> None:
    """Raise FileFormatError where a turn that met no reflector names one."""
    wrong = [row for row in np.flatnonzero(np.isnan(bearings)).tolist() if ids[row]]
    if wrong:
        raise block.error(wrong[0], "bearing", "is empty beside a reflector", "the bearing at which it was met")


def bearing_line(record: Reflex) -> str:
    """Line of a reflex; `repr` of a number reads back as the same."""
    if record.bearing != record.bearing:
        return f"{record.stamp_ns},,\n"
    return f"{record.stamp_ns},{record.bearing!r},{cell(record.reflector)}\n"


def cell(text: str) -> str:
    """Quote a text where a table needs it."""
    if any(each in text for each in ',;"\n\r'):
        return '"' + text.replace('"', '""') + '"'
    return text


def write_bearings(path: Path, log: BearingLog) -> None:
    """Write reflexes as a table; raises FileFormatError when it cannot be written.

    Parameters
    ----------
    path : the table.
    log : reflexes.
    """
    bearings = ("" if value != value else repr(value) for value in log.bearings.tolist())  # noqa: PLR0124 - NaN
    rows: Iterable[tuple[object, ...]] = zip(log.stamps_ns.tolist(), bearings, log.reflectors, strict=True)
    write_table(path, (*BEARING_COLUMNS, REFLECTOR_COLUMN), rows)

"""`bearings.csv` of a recording: reflexes of a goniometer, each with its own time.

Columns `stamp_ns,bearing` and optional `reflector`: time of the reflex [ns], bearing in the scanner frame [rad],
and the id of the reflector where the sensor knows it. Rows may come in any order.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import numpy as np

from commission.errors import FileFormatError
from commission.geometry.arrays import Growing
from commission.io.csv_table import read_table
from commission.io.table_writer import write_table
from commission.site.bearing_log import BearingLog

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
    stamps, bearings, names = Growing(np.int64), Growing(np.float64), list[str]()
    for block in read_table(path, BEARING_COLUMNS, (REFLECTOR_COLUMN,), ignore_unknown=True, bytes_at_once=1_000_000):
        stamps.append(block.stamps())
        bearings.append(block.numbers("bearing", "rad"))
        names.extend(block.texts(REFLECTOR_COLUMN) if REFLECTOR_COLUMN in block.columns else [""] * len(block))
    if not names:
        raise FileFormatError(path, "", "has no rows", "at least one reflex")
    order = np.argsort(stamps.array(), kind="stable")
    return BearingLog(
        stamps_ns=stamps.array()[order],
        bearings=bearings.array()[order],
        reflectors=tuple(names[index] for index in order.tolist()),
    )


def write_bearings(path: Path, log: BearingLog) -> None:
    """Write reflexes as a table; raises FileFormatError when it cannot be written.

    Parameters
    ----------
    path : the table.
    log : reflexes.
    """
    rows: Iterable[tuple[object, ...]] = zip(
        log.stamps_ns.tolist(), map(repr, log.bearings.tolist()), log.reflectors, strict=True
    )
    write_table(path, (*BEARING_COLUMNS, REFLECTOR_COLUMN), rows)

"""`tags.csv` of a recording: tags that a camera on the vehicle has measured, frame by frame.

Columns `stamp_ns,id,x,y,theta` and optional `sigma_x,sigma_y,sigma_theta`: time of the frame [ns], id of the tag (empty
where the camera cannot read it), its pose in the camera's frame [m, m, rad] and 1-sigma of each. Rows of one stamp are
one frame, and may come in any order; a frame that saw no tag is one row with nothing but its stamp.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from commission.geometry.arrays import Growing
from commission.io.csv_table import Block, read_table
from commission.io.recordings.bearing_file import cell
from commission.site.records import TagSightings
from commission.site.tag_log import NO_TAGS, TagLog

TAGS = "tags.csv"
TAG_COLUMNS = ("stamp_ns", "id", "x", "y", "theta")
SIGMA_COLUMNS = ("sigma_x", "sigma_y", "sigma_theta")
"""Optional columns."""
_UNITS = ("m", "m", "rad")


def read_tags(path: Path) -> TagLog:
    """Read all frames; none where there is no such table.

    Parameters
    ----------
    path : the table.

    Raises
    ------
    FileFormatError
        a cell is wrong; names line and column.
    """
    if not path.exists():
        return NO_TAGS
    stamps, rows, ids = Growing(np.int64), Growing(np.float64, 6), list[str]()
    for block in read_table(path, TAG_COLUMNS, SIGMA_COLUMNS, ignore_unknown=True, bytes_at_once=1_000_000):
        stamps.append(block.stamps())
        values = [block.numbers(name, unit, empty=np.nan) for name, unit in zip(TAG_COLUMNS[2:], _UNITS, strict=True)]
        for name, unit in zip(SIGMA_COLUMNS, _UNITS, strict=True):
            is_said = name in block.columns
            values.append(block.numbers(name, unit, empty=np.nan) if is_said else np.full(len(block), np.nan))
        found = np.stack(values, axis=1)
        names = [name.strip() for name in block.texts("id")]
        _check(block, found, names)
        rows.append(found)
        ids.extend(names)
    return _framed(stamps.array(), rows.array(), np.array(ids, dtype=np.str_))


def _check(block: Block, rows: np.ndarray, ids: list[str]) -> None:
    """Raise FileFormatError where a row is neither a sighting nor empty."""
    missing = np.isnan(rows[:, :3])
    some = np.flatnonzero(missing.any(axis=1) & ~missing.all(axis=1))
    if len(some):
        row = int(some[0])
        column = TAG_COLUMNS[2 + int(np.flatnonzero(missing[row])[0])]
        raise block.error(row, column, "is empty", "x, y and theta, or none of them for a frame that saw no tag")
    named = [row for row in np.flatnonzero(missing.all(axis=1)).tolist() if ids[row]]
    if named:
        raise block.error(named[0], "x", "is empty beside an id", "where the tag was seen")
    small = np.argwhere(rows[:, 3:] <= 0.0)
    if len(small):
        row, column = small[0].tolist()
        raise block.error(row, SIGMA_COLUMNS[column], f"is {rows[row, 3 + column]:g}", "more than 0, or nothing")


def _framed(stamps: np.ndarray, rows: np.ndarray, ids: np.ndarray) -> TagLog:
    """Gather rows of one stamp in one frame; an empty row beside others of its frame says nothing."""
    order = np.argsort(stamps, kind="stable")
    frames, frame = np.unique(stamps, return_inverse=True)
    seen = np.isfinite(rows[order, 0])
    counts = np.bincount(frame[order][seen], minlength=len(frames))
    return TagLog(
        stamps_ns=frames,
        offsets=np.concatenate([[0], np.cumsum(counts)]).astype(np.int64),
        sightings=rows[order][seen],
        ids=ids[order][seen],
    )


def tag_lines(record: TagSightings) -> Iterator[str]:
    """Lines of a frame; `repr` of a number reads back as the same."""
    if not record.ids:
        yield f"{record.stamp_ns},,,,,,,\n"
    for name, values in zip(record.ids, record.sightings.tolist(), strict=True):
        numbers = ("" if value != value else repr(value) for value in values)  # noqa: PLR0124 - NaN is not itself
        yield ",".join((str(record.stamp_ns), cell(name), *numbers)) + "\n"

"""Tables as CSV files, replaced whole or not at all. Reading them is `csv_table`'s business."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterable, Sequence
from pathlib import Path

from commission.io.atomic import atomic_file


def place(value: float) -> str:
    """Cell of a coordinate [m], in tenths of a millimetre whatever grid it belongs to; empty unless it is finite."""
    return repr(round(value, 4) + 0.0) if math.isfinite(value) else ""


def angle(value: float) -> str:
    """Cell of an angle [rad], in microradians; empty unless it is finite."""
    return repr(round(value, 6) + 0.0) if math.isfinite(value) else ""


def figure(value: float) -> str:
    """Cell of what is no place: six significant digits; empty unless it is finite."""
    return f"{value:.6g}" if math.isfinite(value) else ""


def write_table(path: Path, header: Sequence[str], rows: Iterable[Iterable[object]]) -> None:
    """Write a header and rows, one at a time, so that a long table is never held as text.

    Parameters
    ----------
    path : file; its folder is made when missing.
    header : names of the columns.
    rows : cells of each row.

    Raises
    ------
    FileFormatError
        the file cannot be written.
    """
    with atomic_file(path) as file:
        text = io.TextIOWrapper(file, encoding="utf-8", newline="", write_through=True)
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(header)
        writer.writerows(rows)
        text.detach()

"""Tables as spreadsheets save them: `,` or `;`, decimal comma beside `;`, byte-order mark, any order of columns.

Rows are read in blocks, so that a table may be larger than memory; every error names line and column.
"""

from __future__ import annotations

import codecs
import csv
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import IO

import numpy as np

from commission.errors import FileFormatError
from commission.geometry.arrays import FloatArray, IntArray
from commission.io.reading import cannot_read, check_size

SIZE_LIMIT = 64_000_000_000
"""Bytes of a table; a day of odometry at 1 kHz has about 5,000,000,000."""
_LINE_LIMIT = 100_000
"""Characters in one line: nothing that is a table has more."""
_STAMP_LIMIT = 2**62


@dataclass(frozen=True, slots=True)
class Block:
    """Some consecutive rows of a table, as text."""

    path: Path
    """The file."""
    lines: list[int]
    """Line (from 1) of each row."""
    columns: dict[str, list[str]]
    """Cells by column, stripped; a column that the file lacks is absent."""
    decimal_comma: bool
    """Whether `1,5` is one and a half."""

    def __len__(self) -> int:
        """Return the number of rows."""
        return len(self.lines)

    def error(self, row: int, column: str, problem: str, remedy: str) -> FileFormatError:
        """Error in a cell."""
        return FileFormatError(self.path, f"line {self.lines[row]}, column {column}", problem, remedy)

    def numbers(self, column: str, unit: str, *, empty: float | None = None) -> FloatArray:
        """(N,) finite numbers of a column; empty cells become `empty`, or are errors when it is None."""
        cells = self.columns[column]
        if self.decimal_comma:
            cells = [cell.replace(",", ".") for cell in cells]
        try:
            values = np.array(cells, dtype=np.float64)
            if np.isfinite(values).all() and not _has_underscore(cells):
                return values
        except ValueError:
            pass
        return np.array([self._number(row, column, unit, empty) for row in range(len(self))], dtype=np.float64)

    def _number(self, row: int, column: str, unit: str, empty: float | None) -> float:
        cell = self.columns[column][row]
        if not cell:
            if empty is None:
                raise self.error(row, column, "is empty", f"a number [{unit}]")
            return empty
        try:
            value = float("_" if "_" in cell else cell.replace(",", ".") if self.decimal_comma else cell)
        except ValueError:
            raise self.error(row, column, f"is {shortened(cell)}", f"a number [{unit}]") from None
        if not math.isfinite(value):
            raise self.error(row, column, f"is {cell}", f"a finite number [{unit}]")
        return value

    def stamps(self, column: str = "stamp_ns") -> IntArray:
        """(N,) time stamps of a column [ns]."""
        try:
            values = np.array([int(cell) for cell in self.columns[column]], dtype=np.int64)
            if (np.abs(values) < _STAMP_LIMIT).all() and not _has_underscore(self.columns[column]):
                return values
        except (ValueError, OverflowError):
            pass
        for row, cell in enumerate(self.columns[column]):
            try:
                good = abs(int(cell)) < _STAMP_LIMIT and "_" not in cell
            except ValueError:
                good = False
            if not good:
                raise self.error(row, column, f"is {shortened(cell)}", "a whole number of nanoseconds")
        raise AssertionError("a column is wrong, yet each of its cells is right")


def read_table(
    path: Path,
    required: Sequence[str],
    optional: Sequence[str] = (),
    *,
    ignore_unknown: bool = False,
    rows_at_once: int = 4096,
    size_limit: int = SIZE_LIMIT,
) -> Iterator[Block]:
    """Read a table in blocks; blank lines and lines that start with `#` are passed over.

    Parameters
    ----------
    path : the file.
    required, optional : names of the columns.
    ignore_unknown : whether other columns are passed over instead of refused.
    rows_at_once : rows of a block, which bound the memory used.
    size_limit : largest file [bytes].

    Raises
    ------
    FileFormatError
        the file cannot be read, a column is missing, unknown or named twice, or a row has too few or too many cells.
    """
    check_size(path, size_limit)
    try:
        with path.open("rb") as file:
            yield from _blocks(path, _lines(path, file), (required, optional, ignore_unknown), rows_at_once)
    except OSError as error:
        raise cannot_read(path, error) from error


def _has_underscore(cells: list[str]) -> bool:
    """Whether a cell holds `1_000`: a number to Python, a mistake in a table."""
    return "_" in "".join(cells)


def shortened(cell: str) -> str:
    """Cell as a message shows it."""
    return repr(cell if len(cell) <= 40 else f"{cell[:37]}...")


def _lines(path: Path, file: IO[bytes]) -> Iterator[tuple[int, str]]:
    """Number and text of each line that is neither blank nor a comment."""
    number = 0
    while raw := file.readline(_LINE_LIMIT + 1):
        number += 1
        if len(raw) > _LINE_LIMIT:
            raise FileFormatError(path, f"line {number}", f"is longer than {_LINE_LIMIT} characters", "a table")
        if number == 1:
            raw = raw.removeprefix(codecs.BOM_UTF8)
        try:
            line = raw.decode("utf-8").strip()
        except UnicodeDecodeError as error:
            found = f"byte 0x{raw[error.start]:02x} is not UTF-8"
            raise FileFormatError(path, f"line {number}", found, "a table saved as UTF-8") from error
        if "\0" in line:
            raise FileFormatError(path, f"line {number}", "holds a zero byte", "a table saved as text")
        # Old spreadsheets end their lines with a bare carriage return: one "line" then holds the whole table.
        if "\r" in line:
            raise FileFormatError(path, f"line {number}", "holds a bare carriage return", "lines that end with \\n")
        if line and not line.startswith("#"):
            yield number, line


def _blocks(
    path: Path,
    lines: Iterator[tuple[int, str]],
    wanted: tuple[Sequence[str], Sequence[str], bool],
    rows_at_once: int,
) -> Iterator[Block]:
    number, header = next(lines, (0, ""))
    if not header:
        raise FileFormatError(path, "", "is empty", f"a table with the columns {', '.join(wanted[0])}")
    delimiter = ";" if ";" in header else ","
    names = [name.strip().lower() for name in _cells(path, number, header, delimiter)]
    kept = _kept_columns(path, number, names, wanted)
    rows: list[list[str]] = []
    places: list[int] = []
    for number, line in lines:
        # The csv module is needed only where a cell is quoted; a plain split is three times as fast.
        cells = _cells(path, number, line, delimiter) if '"' in line else line.split(delimiter)
        if len(cells) != len(names):
            remedy = f"{len(names)} cells, one for each of: {', '.join(names)}"
            raise FileFormatError(path, f"line {number}", f"has {len(cells)} cells", remedy)
        rows.append(cells)
        places.append(number)
        if len(rows) == rows_at_once:
            yield _block(path, places, rows, (kept, delimiter))
            rows, places = [], []
    if rows:
        yield _block(path, places, rows, (kept, delimiter))


def _block(path: Path, places: list[int], rows: list[list[str]], layout: tuple[dict[str, int], str]) -> Block:
    kept, delimiter = layout
    columns = {name: [row[index].strip() for row in rows] for name, index in kept.items()}
    return Block(path, places, columns, decimal_comma=delimiter == ";")


def _cells(path: Path, number: int, line: str, delimiter: str) -> list[str]:
    try:
        return next(csv.reader([line], delimiter=delimiter, strict=True))
    except csv.Error as error:
        raise FileFormatError(path, f"line {number}", f"is no row of a table ({error})", "matching quotes") from error


def _kept_columns(
    path: Path, number: int, names: list[str], wanted: tuple[Sequence[str], Sequence[str], bool]
) -> dict[str, int]:
    """Position of each column that the reader asked for."""
    required, optional, ignore_unknown = wanted
    where = f"line {number}"
    known = (*required, *optional)
    for name in required:
        if name not in names:
            found = f"the header {shortened(','.join(names))} has no column {name}"
            raise FileFormatError(path, where, found, f"the columns {', '.join(required)}")
    for name in names:
        if name not in known and not ignore_unknown:
            raise FileFormatError(path, where, f"column {shortened(name)} is unknown", f"one of: {', '.join(known)}")
        if name in known and names.count(name) > 1:
            raise FileFormatError(path, where, f"column {name} is there {names.count(name)} times", "each column once")
    return {name: names.index(name) for name in known if name in names}

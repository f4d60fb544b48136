"""Tables as spreadsheets save them: `,` or `;`, decimal comma beside `;`, byte-order mark, any order of columns.

Rows are read in blocks, so that a table may be larger than memory; every error names line and column.
"""

from __future__ import annotations

import codecs
import csv
import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import IO

import numpy as np

from commission.errors import FileFormatError
from commission.geometry.arrays import FloatArray, IntArray
from commission.io.findings import Findings
from commission.io.reading import cannot_read, check_size, decoded
from commission.site.quantity import LARGEST, STAMP_LIMIT

SIZE_LIMIT = 64_000_000_000
"""Bytes of a table; a day of odometry at 1 kHz has about 5,000,000,000."""
LINE_LIMIT = 100_000
"""Characters in one line: nothing that is a table has more."""
_THOUSANDS = re.compile(r"[-+]?[1-9][0-9]{0,2}(\.[0-9]{3})+")
_GROUPED = re.compile(r"[-+]?[0-9]{1,3}(\.[0-9]{3})+,[0-9]*")
_STATED_DELIMITER = re.compile(r"sep=([,;\t|])?", re.IGNORECASE)


@dataclass(frozen=True, slots=True)
class Block:
    """Some consecutive rows of a table, as text."""

    path: Path
    """The file."""
    lines: Sequence[int]
    """Line (from 1) of each row."""
    columns: dict[str, list[str]]
    """Cells by column, as they are; a column that the file lacks is absent."""
    decimal_comma: bool
    """Whether `1,5` is one and a half."""

    def __len__(self) -> int:
        """Return the number of rows."""
        return len(self.lines)

    def error(self, row: int, column: str, problem: str, remedy: str) -> FileFormatError:
        """Error in a cell.

        Parameters
        ----------
        row, column : index of the row in this block, name of the column.
        problem, remedy : what was found, what is expected.
        """
        return FileFormatError(self.path, f"line {self.lines[row]}, column {column}", problem, remedy)

    def texts(self, column: str) -> list[str]:
        """Cells of a column without spaces around them."""
        return [cell.strip() for cell in self.columns[column]]

    def numbers(self, column: str, unit: str, *, empty: float | None = None) -> FloatArray:
        """Finite numbers of a column.

        Parameters
        ----------
        column : its name.
        unit : for the message.
        empty : what an empty cell counts as; None: an error.

        Returns
        -------
        values : (N,) array.
        """
        cells = self.columns[column]
        if self.decimal_comma:
            self._refuse_doubtful_thousands(column, cells, unit)
            cells = [_with_point(cell) for cell in cells]
        try:
            values = np.array(cells, dtype=np.float64)
            if (np.abs(values) <= LARGEST).all() and not _has_underscore(cells):
                return values
        except ValueError:
            pass
        return np.array([self._number(row, column, unit, empty) for row in range(len(self))], dtype=np.float64)

    def _number(self, row: int, column: str, unit: str, empty: float | None) -> float:
        cell = self.columns[column][row].strip()
        if not cell:
            if empty is None:
                raise self.error(row, column, "is empty", f"a number [{unit}]")
            return empty
        try:
            value = float("_" if "_" in cell else _with_point(cell) if self.decimal_comma else cell)
        except ValueError:
            raise self.error(row, column, f"is {shortened(cell)}", f"a number [{unit}]") from None
        if not abs(value) <= LARGEST:
            expected = f"at most {LARGEST:g}" if math.isfinite(value) else "a finite number"
            found = cell if len(cell) <= 40 else shortened(cell)
            raise self.error(row, column, f"is {found}", f"{expected} [{unit}]")
        return value

    def _refuse_doubtful_thousands(self, column: str, cells: list[str], unit: str) -> None:
        """Refuse 1.500 beside 2,5: whether that is one and a half or fifteen hundred decides over the plant."""
        doubtful = [row for row, cell in enumerate(cells) if "." in cell and _THOUSANDS.fullmatch(cell.strip())]
        if doubtful and any("," in cell for cell in cells):
            found = f"is {shortened(cells[doubtful[0]].strip())} in a column of decimal commas"
            raise self.error(doubtful[0], column, found, f"a number without points for thousands [{unit}]")

    def stamps(self, column: str = "stamp_ns") -> IntArray:
        """(N,) time stamps of a column [ns]."""
        try:
            values = np.array(list(map(int, self.columns[column])), dtype=np.int64)
            if ((values > -STAMP_LIMIT) & (values < STAMP_LIMIT)).all() and not _has_underscore(self.columns[column]):
                return values
        except (ValueError, OverflowError):
            pass
        stamps: list[int] = []
        for row, cell in enumerate(self.texts(column)):
            try:
                stamps.append(int(cell))
                good = abs(stamps[-1]) < STAMP_LIMIT and "_" not in cell
            except ValueError:
                good = False
            if not good:
                raise self.error(
                    row, column, f"is {shortened(cell)}", f"a whole number of nanoseconds, less than {STAMP_LIMIT}"
                )
        # Around a number stood what is blank to a text, and not to a number: a control character of a damaged file.
        return np.array(stamps, dtype=np.int64)


def read_table(
    path: Path,
    required: Sequence[str],
    optional: Sequence[str] = (),
    *,
    ignore_unknown: bool = False,
    bytes_at_once: int = 100_000,
    size_limit: int = SIZE_LIMIT,
    found: Findings | None = None,
) -> Iterator[Block]:
    """Read a table in blocks.

    Blank lines and lines that start with `#` are passed over, as are what Excel adds: a first line `sep=;`, columns
    without a name at the end, and rows of empty cells.

    Parameters
    ----------
    path : the file.
    required, optional : names of the columns, two or more required ones.
    ignore_unknown : whether other columns are passed over instead of refused.
    bytes_at_once : how much of the file is read for one block, which bounds the memory used.
    size_limit : largest file [bytes].
    found : takes what was doubted; with it, text that is not UTF-8 is taken for Windows-1252, else it is refused.

    Raises
    ------
    FileFormatError
        the file cannot be read, a column is missing, unknown or named twice, or a row has too few or too many cells.
    """
    check_size(path, size_limit)
    layout: _Header | None = None
    try:
        with path.open("rb") as file:
            for first, text in _chunks(path, file, bytes_at_once, found):
                lines, start = text.split("\n"), 0
                if layout is None:
                    rows = (i for i, line in enumerate(lines) if is_row(line) and stated_delimiter(line) is None)
                    start = next(rows, len(lines))
                    if start == len(lines):
                        continue
                    layout = _layout(path, first + start, lines[start], (required, optional, ignore_unknown))
                    start += 1
                if block := _block(path, first + start, lines[start:], layout):
                    yield block
    except OSError as error:
        raise cannot_read(path, error) from error
    if layout is None:
        raise FileFormatError(path, "", "is empty", f"a table with the columns {', '.join(required)}")


def _has_underscore(cells: list[str]) -> bool:
    """Whether a cell holds `1_000`: a number to Python, a mistake in a table."""
    return "_" in "".join(cells)


def _with_point(cell: str) -> str:
    """Number with a decimal comma as Python reads it; points before a comma separate thousands."""
    return cell.replace(".", "").replace(",", ".") if _GROUPED.fullmatch(cell.strip()) else cell.replace(",", ".")


def shortened(cell: str) -> str:
    """Cell as a message shows it."""
    return repr(cell if len(cell) <= 40 else f"{cell[:37]}...")


def _chunks(path: Path, file: IO[bytes], size: int, found: Findings | None) -> Iterator[tuple[int, str]]:
    """Number of the first line and text of some whole lines, without the last line's end."""
    number, rest, is_first = 1, b"", True
    while data := file.read(size):
        cut = data.rfind(b"\n")
        if cut < 0:
            rest += data
        else:
            text = _decoded(path, number, rest + data[:cut], is_first, found)
            yield number, text
            number, rest, is_first = number + text.count("\n") + 1, data[cut + 1 :], False
        if len(rest) > LINE_LIMIT + size:
            raise FileFormatError(path, f"line {number}", f"is longer than {LINE_LIMIT} characters", "a table")
    if rest:
        yield number, _decoded(path, number, rest, is_first, found)


def _decoded(path: Path, number: int, data: bytes, is_first: bool, found: Findings | None) -> str:
    """Text of some lines; says which line is none."""
    if is_first:
        data = data.removeprefix(codecs.BOM_UTF8)
    text = decoded(path, number, data, found).replace("\r\n", "\n").removesuffix("\r")
    # Old spreadsheets end their lines with a bare carriage return: one "line" would hold the whole table.
    for character, name in (("\0", "zero byte"), ("\r", "bare carriage return")):
        if character in text:
            where = f"line {number + text.count(chr(10), 0, text.index(character))}"
            raise FileFormatError(path, where, f"holds a {name}", "text whose lines end with \\n")
    return text


def is_row(line: str) -> bool:
    """Whether a line is neither blank nor a comment."""
    return bool(line) and not line.isspace() and not line.lstrip().startswith("#")


def stated_delimiter(line: str) -> str | None:
    """What separates cells, by Excel's own first line `sep=;`; none for any other line."""
    # A tab is stated as itself: it must not be stripped off.
    match = _STATED_DELIMITER.fullmatch(line.strip(" \r\n").strip('"'))
    return match[1] if match else None


@dataclass(frozen=True, slots=True)
class _Header:
    """What the header says."""

    names: list[str]
    kept: dict[str, int]
    delimiter: str
    named: int
    """Columns up to the last one that has a name; behind them Excel leaves empty ones."""


def _layout(path: Path, number: int, header: str, wanted: tuple[Sequence[str], Sequence[str], bool]) -> _Header:
    delimiter = ";" if ";" in header else ","
    names = [name.strip().lower() for name in _cells(path, number, header, delimiter)]
    named = names[: max((i for i, name in enumerate(names) if name), default=0) + 1]
    return _Header(names, _kept_columns(path, number, named, wanted), delimiter, len(named))


def _block(path: Path, number: int, lines: list[str], layout: _Header) -> Block | None:
    """Rows of some lines; None when there are none."""
    width, delimiter = len(layout.names), layout.delimiter
    numbers: Sequence[int] = range(number, number + len(lines))
    if layout.named == width and _is_plain(lines, width, delimiter):
        cells = delimiter.join(lines).split(delimiter)
    else:
        numbers, cells = [], []
        for place, line in enumerate(lines, start=number):
            if is_row(line):
                row = _cells(path, place, line, delimiter)
                # One column without a name is a first column of numbers, never an empty row: a scan that saw nothing.
                if width > 1 and not any(cell.strip() for cell in row):
                    continue
                if any(cell.strip() for cell in row[layout.named :]) or not layout.named <= len(row):
                    remedy = f"{layout.named} cells, one for each of: {', '.join(layout.names[: layout.named])}"
                    raise FileFormatError(path, f"line {place}", f"has {len(row)} cells", remedy)
                numbers.append(place)
                cells += [*row[:width], *[""] * (width - len(row))]
    if not numbers:
        return None
    columns = {name: cells[index::width] for name, index in layout.kept.items()}
    return Block(path, numbers, columns, decimal_comma=delimiter == ";")


def _is_plain(lines: list[str], width: int, delimiter: str) -> bool:
    """Whether every line is a row without quotes, as nearly always: they are then split all at once."""
    joined = "".join(lines)
    has_width = {line.count(delimiter) for line in lines} == {width - 1}
    # A row of empty cells, as Excel leaves them, is passed over; one column alone has none.
    is_full = width == 1 or delimiter * (width - 1) not in lines
    return has_width and is_full and '"' not in joined and "#" not in joined and max(map(len, lines)) <= LINE_LIMIT


def _cells(path: Path, number: int, line: str, delimiter: str) -> list[str]:
    if len(line) > LINE_LIMIT:
        raise FileFormatError(path, f"line {number}", f"is longer than {LINE_LIMIT} characters", "a table")
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

"""Reflectors pasted from a spreadsheet: tabs, semicolons or commas, decimal comma, units in the header.

What a spreadsheet leaves open (names, sizes, the unit of a bare number) is filled in and said.
"""

from __future__ import annotations

import csv
import math
import re
from pathlib import Path

from commission.errors import FileFormatError
from commission.io.csv_table import Block, shortened, stated_delimiter
from commission.io.findings import Findings
from commission.io.imk import ReflectorImport
from commission.io.reflector_tables import OPTIONAL, REQUIRED, reflectors_of

TEXT_LIMIT = 8_000_000
"""Characters of a pasted table: more than a clipboard of 100,000 reflectors."""
FAR = 1000.0
"""A coordinate beyond this is doubted when the table names no unit [m]: halls are smaller, millimetres are not."""

_SOURCE = Path("pasted table")
_COLUMNS = (*REQUIRED, *OPTIONAL)
_ALIASES = {
    **{name: name for name in _COLUMNS},
    **dict.fromkeys(("name", "no", "nr", "no.", "nr.", "number", "label", "reflector"), "id"),
    **dict.fromkeys(("diameter", "size", "width"), "diameter"),
    **{"r": "radius", "type": "kind", "z": "height", "comment": "note", "remark": "note"},
}
_HEADER = re.compile(r"(?P<name>[a-z.]+?)[\s_]*(?:[\[(]?(?P<unit>mm|cm|m|rad|deg|°)[\])]?)?")
_DIVISORS = {"mm": 1000.0, "cm": 100.0, "deg": 180.0 / math.pi, "°": 180.0 / math.pi}
_POSITIONS = {2: ("x", "y"), 3: ("id", "x", "y"), 4: ("id", "x", "y", "radius")}
_NUMBER = re.compile(r"[-+]?[0-9.,]+(?:[eE][-+]?[0-9]+)?")
_LENGTHS = ("x", "y", "radius", "diameter", "height", "sigma")


def parse_table(text: str) -> ReflectorImport:
    """Read reflectors from pasted text.

    Parameters
    ----------
    text : rows of cells. A header may name the columns of `reflectors.csv`, some other usual names ("Nr", "diameter")
        and units ("x_mm", "X [mm]", "heading deg"); without one the columns are x, y or id, x, y or id, x, y, radius.

    Returns
    -------
    imported : reflectors [m, rad, map frame] and what was filled in: ids, radii, a unit that looks wrong.

    Raises
    ------
    FileFormatError
        names line and column of the pasted text, what was found and what is expected.
    """
    if len(text) > TEXT_LIMIT:
        raise FileFormatError(_SOURCE, "", f"has {len(text)} characters", f"at most {TEXT_LIMIT}")
    lines, rows, delimiter = _rows(text)
    names, units = _header(rows[0])
    if names:
        lines, rows = lines[1:], rows[1:]
    else:
        names = _names_by_position(rows[0])
        units = {}
    while len(names) > 1 and not names[-1]:
        names = names[:-1]
    for index, (line, row) in enumerate(zip(lines, rows, strict=True)):
        # Excel leaves columns of empty cells at the end.
        if len(row) > len(names) and not any(row[len(names) :]):
            rows[index] = row[: len(names)]
        elif len(row) != len(names):
            remedy = f"{len(names)} cells: {', '.join(names)}"
            raise FileFormatError(_SOURCE, f"line {line}", f"has {len(row)} cells", remedy)
    columns = {name: [row[i] for row in rows] for i, name in enumerate(names)}
    numbers = [cell for name in names if name in _LENGTHS for cell in columns[name]]
    # A table that writes points for decimals has its commas for something else: those cells are then errors.
    comma = delimiter != "," and not any("." in cell for cell in numbers)
    found = Findings()
    said = tuple("radius" if name == "diameter" else name for name in names)
    block = Block(_SOURCE, lines, columns, decimal_comma=comma)
    _apply_units(block, units)
    _fill_in(block, units, found)
    reflectors = reflectors_of([block], found)
    return ReflectorImport(reflectors, found.lines(), said)


def _rows(text: str) -> tuple[list[int], list[list[str]], str]:
    """Number and cells of each row that is not blank, and what separates cells."""
    kept = [(i, line) for i, line in enumerate(text.removeprefix("\ufeff").splitlines(), start=1) if line.strip()]
    stated = stated_delimiter(kept[0][1]) if kept else None
    if stated is not None:
        kept = kept[1:]
    if not kept:
        raise FileFormatError(_SOURCE, "", "is empty", "rows of id, x, y, radius")
    delimiter = stated or next((mark for mark in "\t;" if mark in kept[0][1]), ",")
    lines: list[int] = []
    rows: list[list[str]] = []
    for number, line in kept:
        try:
            cells = next(csv.reader([line], delimiter=delimiter, strict=True))
        except csv.Error as error:
            raise FileFormatError(_SOURCE, f"line {number}", f"is no row ({error})", "matching quotes") from error
        cells = [cell.strip() for cell in cells]
        if any(cells):
            lines.append(number)
            rows.append(cells)
    if not rows:
        raise FileFormatError(_SOURCE, "", "is empty", "rows of id, x, y, radius")
    return lines, rows, delimiter


def _header(cells: list[str]) -> tuple[list[str], dict[str, str]]:
    """Columns and their units if this row is a header (it names x and y), otherwise nothing."""
    matches = [_HEADER.fullmatch(cell.lower()) for cell in cells]
    names = [_ALIASES.get(match["name"], "") if match else "" for match in matches]
    if "x" not in names or "y" not in names:
        return [], {}
    last = max(i for i, cell in enumerate(cells) if cell)
    for cell, name in zip(cells[: last + 1], names, strict=False):
        if not name:
            remedy = f"one of: {', '.join(_COLUMNS)}, diameter"
            raise FileFormatError(_SOURCE, "header", f"column {shortened(cell)} is unknown", remedy)
        if names.count(name) > 1:
            raise FileFormatError(_SOURCE, "header", f"column {name} is there twice", "each column once")
    if "radius" in names and "diameter" in names:
        raise FileFormatError(_SOURCE, "header", "names both radius and diameter", "one of them")
    return names, {name: match["unit"] or "" for name, match in zip(names, matches, strict=True) if match}


def _names_by_position(cells: list[str]) -> list[str]:
    while len(cells) > 1 and not cells[-1]:
        cells = cells[:-1]
    names = _POSITIONS.get(len(cells))
    coordinates = cells[-2:] if len(cells) == 2 else cells[1:3]
    if names is None or not all(_NUMBER.fullmatch(cell) for cell in coordinates):
        remedy = "a header with x and y, or rows of: x, y; id, x, y; id, x, y, radius"
        raise FileFormatError(_SOURCE, "first row", f"is {shortened(' | '.join(cells))}", remedy)
    return list(names)


def _apply_units(block: Block, units: dict[str, str]) -> None:
    """Rewrite the cells of columns in other units than m and rad; what is no number stays, to be complained about."""
    for name, unit in units.items():
        divisor = _DIVISORS.get(unit, 1.0)
        if divisor != 1.0:
            block.columns[name] = [_divided(cell, divisor, block.decimal_comma) for cell in block.columns[name]]
    if "diameter" in block.columns:
        cells = block.columns.pop("diameter")
        block.columns["radius"] = [_divided(cell, 2.0, block.decimal_comma) for cell in cells]


def _divided(cell: str, divisor: float, comma: bool) -> str:
    if not _NUMBER.fullmatch(cell):
        return cell
    try:
        return repr(float(cell.replace(",", ".") if comma else cell) / divisor)
    except ValueError:
        return cell


def _fill_in(block: Block, units: dict[str, str], found: Findings) -> None:
    """Give names and sizes that the table lacks, and doubt coordinates that look like millimetres."""
    if "id" not in block.columns:
        block.columns["id"] = [f"R{i}" for i in range(1, len(block) + 1)]
        found.add("", "the table has no ids; the reflectors are called R1, R2, ...")
    if "radius" not in block.columns:
        block.columns["radius"] = [""] * len(block)
        found.add("", "the table has no radius; that of its reflectors is unknown")
    for axis in "xy":
        farthest = max((abs(float(value)) for value in block.numbers(axis, "m")), default=0.0)
        if farthest > FAR and not units.get(axis):
            found.add("", f"{axis} reaches {farthest:g} m; if these are millimetres, call the column {axis}_mm")

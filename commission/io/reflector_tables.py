"""The table `reflectors.csv`: one reflector a row, as an engineer keeps it in a spreadsheet. Read and written."""

from __future__ import annotations

import csv
import dataclasses
import io
import math
from collections.abc import Iterable, Mapping
from pathlib import Path

from commission.errors import FileFormatError
from commission.io.atomic import write_text
from commission.io.csv_table import Block, read_table, shortened
from commission.io.findings import Findings
from commission.site.fields import in_file
from commission.site.reflectors import Reflector, ReflectorKind, ReflectorMap

REQUIRED = ("id", "x", "y", "radius")
OPTIONAL = ("kind", "heading", "height", "sigma", "layer", "note", "locked")
SIZE_LIMIT = 64_000_000
"""Bytes of a reflector table: about 1,000,000 reflectors."""

_UNITS = {"x": "m", "y": "m", "radius": "m", "heading": "rad", "height": "m", "sigma": "m"}
_TEXTS = ("kind", "layer", "note", "locked")
_UNKNOWN = {"radius", "heading"}
_YES, _NO = ("yes", "true", "1"), ("", "no", "false", "0")
_DEFAULTS: Mapping[str, float] = {"radius": math.nan, "heading": math.nan, "height": 0.2, "sigma": 0.0}
"""What an empty cell means; NaN: nobody knows."""


def read_reflectors(path: Path, found: Findings | None = None) -> ReflectorMap:
    """Read a reflector table.

    Parameters
    ----------
    path : CSV file with the columns id, x, y, radius and, if wanted, kind, heading, height, sigma, layer, note,
        locked [m, rad, map frame], in any order. An empty radius or heading, or no heading at all, is unknown.
    found : takes what was doubted; with it, text that is not UTF-8 and headings in degrees are read as what they are.

    Returns
    -------
    reflectors : in the order of the file; a table without rows gives an empty map.

    Raises
    ------
    FileFormatError
        names line and column, what was found and what is expected.
    """
    return reflectors_of(read_table(path, REQUIRED, OPTIONAL, size_limit=SIZE_LIMIT, found=found), found)


def reflectors_of(blocks: Iterable[Block], found: Findings | None = None) -> ReflectorMap:
    """Reflectors from the rows of a table, wherever it comes from; parameters and errors as for `read_reflectors`."""
    reflectors: list[Reflector] = []
    lines: dict[str, int] = {}
    for block in blocks:
        numbers = {
            name: block.numbers(name, unit, empty=_DEFAULTS.get(name)).tolist()
            for name, unit in _UNITS.items()
            if name in block.columns
        }
        unknown = {
            name: [None if math.isnan(each) else each for each in numbers[name]] for name in _UNKNOWN & numbers.keys()
        }
        numbers |= unknown
        texts = {name: block.texts(name) for name in ("id", *_TEXTS) if name in block.columns}
        for row in range(len(block)):
            cells = {name: values[row] for name, values in texts.items()}
            reflector = _reflector(block, row, cells, {name: values[row] for name, values in numbers.items()})
            if reflector.id in lines:
                problem = f"{shortened(reflector.id)} is used twice (first on line {lines[reflector.id]})"
                raise block.error(row, "id", problem, "unique ids")
            lines[reflector.id] = block.lines[row]
            reflectors.append(reflector)
    return ReflectorMap(_with_radians(reflectors, found))


def _with_radians(reflectors: list[Reflector], found: Findings | None) -> tuple[Reflector, ...]:
    """Take headings for degrees where one is more than a turn: nobody writes 270 for an angle in radians."""
    farthest = max((abs(r.heading) for r in reflectors if r.heading is not None), default=0.0)
    if found is None or farthest <= 2.0 * math.pi + 1e-3:
        return tuple(reflectors)
    found.add("column heading", f"reaches {farthest:g}; the headings are taken for degrees, expected are radians")
    return tuple(
        r if r.heading is None else dataclasses.replace(r, heading=math.radians(r.heading)) for r in reflectors
    )


def write_reflectors(reflectors: ReflectorMap, path: Path) -> None:
    """Write a reflector table: tenths of a millimetre, and no optional column whose values are all the usual ones."""
    rounded = [in_file(reflector) for reflector in reflectors.reflectors]
    usual = Reflector(id="usual", x=0.0, y=0.0)
    optional = [name for name in OPTIONAL if any(getattr(r, name) != getattr(usual, name) for r in rounded)]
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow([*REQUIRED, *optional])
    for reflector in rounded:
        cells = [_written(path, reflector, name) for name in (*REQUIRED, *optional)]
        writer.writerow(cells)
    write_text(path, text.getvalue())


def _written(path: Path, reflector: Reflector, name: str) -> str:
    """Cell that reads back as the value."""
    value = getattr(reflector, name)
    if value is None:
        return ""
    if isinstance(value, bool):
        return _YES[0] if value else _NO[0]
    if isinstance(value, float | int):
        return repr(float(value))
    text = str(value)
    if text != text.strip() or any(character < " " for character in text) or (name == "id" and text.startswith("#")):
        found = f"{name} {shortened(text)} of reflector {shortened(reflector.id)} cannot stand in a table"
        remedy = "text without line breaks, without spaces at its ends and, as an id, without # in front"
        raise FileFormatError(path, "", found, remedy)
    return text


def _reflector(block: Block, row: int, texts: dict[str, str], numbers: Mapping[str, float | None]) -> Reflector:
    kind = texts.pop("kind", "") or ReflectorKind.CYLINDER
    if kind not in list(ReflectorKind):
        raise block.error(row, "kind", f"is {shortened(kind)}", f"one of: {', '.join(ReflectorKind)}")
    locked = texts.pop("locked", "").lower()
    if locked not in _YES + _NO:
        raise block.error(row, "locked", f"is {shortened(locked)}", "yes or no")
    try:
        return Reflector(kind=ReflectorKind(kind), locked=locked in _YES, **numbers, **texts)  # type: ignore[arg-type]
    except ValueError as error:
        problem, _, remedy = str(error).partition("; expected ")
        column, _, found = problem.partition(" ")
        raise block.error(row, column, found, remedy) from error

"""SICK `.imk` layouts (NAV sensors): reflectors in whole millimetres, read and written.

Rows are `globID x_mm y_mm type subtype size_mm layer1 [layer2 ...]`. The format has no direction of flat reflectors, no
height, no survey uncertainty and no text; both directions say what was made up or left behind.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from pathlib import Path

from commission.errors import FileFormatError
from commission.io.atomic import write_text
from commission.io.findings import Findings, shown
from commission.io.reading import read_text
from commission.site.quantity import counted_text
from commission.site.reflectors import Reflector, ReflectorKind, ReflectorMap

SIZE_LIMIT = 16_000_000
"""Bytes of a layout: some 400,000 reflectors, when a NAV350 stores 12,000."""
COLUMNS = ("globID", "x_mm", "y_mm", "type", "subtype", "size_mm", "layer1")
FEWEST = 3
"""Reflectors that a NAV sensor needs for a position; fewer are no layout to it."""

_LANDMARK = 1
_SUBTYPES = {1: ReflectorKind.FLAT, 2: ReflectorKind.CYLINDER}
"""Column `subtype`; `type` is 1 for every reflector. Deduced, not specified: the layout of a real NAV350 with round
reflectors of 60 mm has type 1 and subtype 2 in each row."""
_LAST_WORD = 2**16 - 1
_LAST_MM = 2**31 - 1
_WHOLE = re.compile(r"[0-9]{1,5}")


@dataclass(frozen=True, slots=True)
class ReflectorImport:
    """Reflectors from a file of another system."""

    reflectors: ReflectorMap
    """In the order of the file."""
    warnings: tuple[str, ...] = ()
    """What was made up or could not be read, one line each."""
    fields: tuple[str, ...] = ("id", "x", "y", "radius", "kind", "layer")
    """Fields that the file speaks of, for `reflector_diff.difference`; those of a layout. Without `id` the ids are
    made up."""


def read_imk(path: Path) -> ReflectorImport:
    """Read a layout.

    Parameters
    ----------
    path : `.imk` file.

    Returns
    -------
    imported : the number of a reflector becomes its id, its layers become `layer` ("1", "1+2"; layer 0 alone is none).

    Raises
    ------
    FileFormatError
        names line and column, what was found and what is expected.
    """
    found = Findings()
    reflectors: list[Reflector] = []
    lines: dict[str, int] = {}
    for number, line in enumerate(read_text(path, SIZE_LIMIT).splitlines(), start=1):
        cells = line.split()
        if not cells or line.startswith("#") or cells[0].startswith("globID"):
            continue
        reflector = _reflector(path, number, cells, found)
        if reflector.id in lines:
            problem = f"{reflector.id} is used twice (first on line {lines[reflector.id]})"
            raise FileFormatError(path, f"line {number}, column globID", problem, "unique numbers")
        lines[reflector.id] = number
        reflectors.append(reflector)
    if len(reflectors) < FEWEST:
        found.add(
            "", f"the layout has {counted_text(len(reflectors), 'reflector')}; a NAV sensor needs {FEWEST} or more"
        )
    return ReflectorImport(ReflectorMap(tuple(reflectors)), found.lines())


def write_imk(reflectors: ReflectorMap, path: Path) -> tuple[str, ...]:
    """Write a layout.

    Parameters
    ----------
    reflectors : what to write. An id that is a whole number is kept, others are numbered.
    path : `.imk` file.

    Returns
    -------
    losses : what the format cannot carry, one line each.

    Raises
    ------
    FileFormatError
        a coordinate is beyond what the format can hold, or the file cannot be written.
    """
    found = Findings()
    numbers = _numbers(reflectors, found)
    layers = _layers(reflectors, found)
    rows = ["\t".join(COLUMNS)]
    for reflector in reflectors.reflectors:
        x, y = (_millimetres(path, reflector, axis, found) for axis in ("x", "y"))
        # A size of 0 would be no reflector; what is smaller than half a millimetre is written as 1.
        size = max(1, round(2000.0 * reflector.reckoned_radius))
        if reflector.radius is None:
            found.add(f"reflector {shown(reflector.id)}", f"the radius is unknown; a size of {size} mm is written")
        elif abs(size - 2000.0 * reflector.radius) > 1e-6:
            found.add("", "sizes are rounded to whole millimetres")
        subtype = next(code for code, kind in _SUBTYPES.items() if kind is reflector.kind)
        cells = (numbers[reflector.id], x, y, _LANDMARK, subtype, size, *layers[reflector.id])
        rows.append("\t".join(str(cell) for cell in cells))
    _note_losses(reflectors, found)
    write_text(path, "\n".join(rows) + "\n")
    return found.lines()


def _reflector(path: Path, line: int, cells: list[str], found: Findings) -> Reflector:
    """Reflector of one row."""
    if len(cells) < len(COLUMNS):
        problem = f"has {len(cells)} columns"
        raise FileFormatError(path, f"line {line}", problem, f"{len(COLUMNS)} or more: {' '.join(COLUMNS)}")
    named = dict(zip(COLUMNS, cells, strict=False))
    x, y, size = (_number(path, line, name, named[name]) for name in ("x_mm", "y_mm", "size_mm"))
    ident, kind, subtype = (_whole(path, line, name, named[name]) for name in ("globID", "type", "subtype"))
    layers = [_whole(path, line, f"layer{i}", cell) for i, cell in enumerate(cells[6:], start=1)]
    if not 0.0 < size <= 2000.0:
        raise FileFormatError(path, f"line {line}, column size_mm", f"is {size:g}", "more than 0 and at most 2000")
    if kind != _LANDMARK or subtype not in _SUBTYPES:
        found.add(f"line {line}", f"type {kind}, subtype {subtype} is unknown; taken for a cylinder")
        subtype = 2
    if _SUBTYPES[subtype] is ReflectorKind.FLAT:
        found.add(f"line {line}", "the format does not say which way a flat reflector faces; its direction is unknown")
    layer = "" if layers == [0] else "+".join(str(layer) for layer in layers)
    return Reflector(
        id=str(ident), x=x / 1000.0, y=y / 1000.0, radius=size / 2000.0, kind=_SUBTYPES[subtype], layer=layer
    )


def _number(path: Path, line: int, name: str, cell: str) -> float:
    """Finite number of at most 31 bits [mm]; NAV sensors write whole ones, other tools also fractions."""
    try:
        value = float("nan" if "_" in cell else cell)
    except ValueError:
        value = math.nan
    if not abs(value) <= _LAST_MM:
        raise FileFormatError(path, f"line {line}, column {name}", f"is {shown(cell)}", "a number of millimetres")
    return value


def _whole(path: Path, line: int, name: str, cell: str) -> int:
    if not _WHOLE.fullmatch(cell) or int(cell) > _LAST_WORD:
        remedy = f"a whole number from 0 to {_LAST_WORD}"
        raise FileFormatError(path, f"line {line}, column {name}", f"is {shown(cell)}", remedy)
    return int(cell)


def _millimetres(path: Path, reflector: Reflector, axis: str, found: Findings) -> int:
    value = 1000.0 * float(getattr(reflector, axis))
    if abs(value) > _LAST_MM:
        where = f"reflector {shown(reflector.id)}"
        raise FileFormatError(path, where, f"{axis} is {value / 1000.0:g} m", f"at most {_LAST_MM // 1000} m")
    if abs(round(value) - value) > 1e-6:
        found.add("", "positions are rounded to whole millimetres")
    return round(value)


def _numbers(reflectors: ReflectorMap, found: Findings) -> dict[str, int]:
    """Number of each reflector: its id where that is one, otherwise the next that is free."""
    if len(reflectors) > _LAST_WORD:
        raise FileFormatError("layout.imk", "", f"has {len(reflectors)} reflectors", f"at most {_LAST_WORD}")
    numbers: dict[str, int] = {}
    for reflector in reflectors.reflectors:
        if (
            _WHOLE.fullmatch(reflector.id)
            and str(int(reflector.id)) == reflector.id
            and int(reflector.id) <= _LAST_WORD
        ):
            numbers[reflector.id] = int(reflector.id)
    free = iter(sorted(set(range(1, len(reflectors) + len(numbers) + 1)) - set(numbers.values())))
    for reflector in reflectors.reflectors:
        if reflector.id not in numbers:
            numbers[reflector.id] = next(free)
            found.add(f"reflector {shown(reflector.id)}", "ids become numbers")
    return numbers


def _layers(reflectors: ReflectorMap, found: Findings) -> dict[str, list[int]]:
    """Layer numbers of each reflector: "1+2" is on two layers, other names get a number each."""
    parsed: dict[str, list[int]] = {"": [0]}
    for name in dict.fromkeys(r.layer for r in reflectors.reflectors if r.layer):
        parts = name.split("+")
        if all(_WHOLE.fullmatch(part) and int(part) <= _LAST_WORD for part in parts):
            parsed[name] = [int(part) for part in parts]
    used = {layer for layers in parsed.values() for layer in layers}
    free = (number for number in range(1, 2 * _LAST_WORD) if number not in used)
    for reflector in reflectors.reflectors:
        if reflector.layer not in parsed:
            parsed[reflector.layer] = [next(free)]
            found.add("", f"layer {shown(reflector.layer)} becomes layer {parsed[reflector.layer][0]}")
    return {reflector.id: parsed[reflector.layer] for reflector in reflectors.reflectors}


def _note_losses(reflectors: ReflectorMap, found: Findings) -> None:
    """Say which fields stay behind."""
    usual = Reflector(id="usual", x=0.0, y=0.0)
    for name in ("heading", "height", "sigma", "note", "locked"):
        count = sum(getattr(r, name) != getattr(usual, name) for r in reflectors.reflectors)
        if count:
            found.add("", f"{name} of {counted_text(count, 'reflector')} is not carried by the format")
    if len(reflectors) < FEWEST:
        found.add(
            "", f"the layout has {counted_text(len(reflectors), 'reflector')}; a NAV sensor needs {FEWEST} or more"
        )

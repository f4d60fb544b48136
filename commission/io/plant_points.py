"""Points that were surveyed in the plant: name, x and y, from a pasted table or a file of one."""

from __future__ import annotations

from pathlib import Path

from commission.errors import FileFormatError
from commission.io.imk import ReflectorImport
from commission.io.pasted_table import parse_table
from commission.io.table_import import read_any_table

REMEDY = "rows of name, x, y: the names say which reflector or station each point is"


def surveyed_points(text: str) -> list[tuple[str, float, float]]:
    """Read pasted points; units and decimal commas as in a pasted table of reflectors.

    Raises
    ------
    FileFormatError
        names the line, what was found and what is expected.
    """
    return _named(parse_table(text), Path("pasted table"))


def read_surveyed(path: Path) -> list[tuple[str, float, float]]:
    """Read a file of points; see `surveyed_points`."""
    return _named(read_any_table(path), path)


def _named(found: ReflectorImport, path: Path) -> list[tuple[str, float, float]]:
    if "id" not in found.fields:
        raise FileFormatError(path, "", "names no points", REMEDY)
    return [(each.id, each.x, each.y) for each in found.reflectors.reflectors]

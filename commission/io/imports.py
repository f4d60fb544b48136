"""From what a person uploads, names or pastes to reflectors, routes or a project: which format it is, and its limits.

The name that a browser gives to a file tells its format and stands in messages; it never becomes a path.
"""

from __future__ import annotations

import tempfile
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

from commission.errors import FileFormatError
from commission.io.findings import Findings
from commission.io.imk import ReflectorImport, read_imk
from commission.io.json_document import read_json
from commission.io.lif import is_layout, read_lif
from commission.io.pasted_table import parse_table
from commission.io.project_archive import ProjectImport, read_project_archive
from commission.io.reading import read_bytes
from commission.io.route_edges import RouteImport
from commission.io.table_import import read_any_table
from commission.io.vda5050 import read_order
from commission.progress import Progress, silent

SIZE_LIMIT = 32_000_000
"""Bytes of a file: a layout of about 50,000 edges, a table of about 400,000 rows."""
REFLECTOR_LIMIT = 12_000
"""Reflectors of one import: what a NAV350 stores, compared within half a second."""
ROUTE_LIMIT = 5_000
"""Routes of one import."""
NAME_LIMIT = 60
PASTED = "pasted text"
"""What text is called that has no file name."""

Imported: TypeAlias = ReflectorImport | RouteImport | ProjectImport

_FORMATS = {
    **dict.fromkeys((".csv", ".tsv", ".txt"), "table.csv"),
    ".imk": "layout.imk",
    ".lif": "layout.lif",
    ".json": "order.json",
    ".zip": "project.zip",
}
"""Name under which a file of each ending is kept while it is read."""
ENDINGS = tuple(_FORMATS)


@dataclass(frozen=True, slots=True)
class LayoutChoice:
    """Which part of a LIF file is read."""

    vehicle_type: str | None = None
    """Vehicle type whose edges are read; the one with the most edges when None."""
    layout: str | None = None
    """Identifier of the layout that is read; all of them when None."""


WHOLE = LayoutChoice()


def shown_name(name: str) -> str:
    """Return the name of a stranger's file as messages and undo steps show it: one short line with its ending."""
    last = name.replace("\\", "/").rstrip("/").rpartition("/")[2]
    text = " ".join("".join(c if c.isprintable() else " " for c in last).split()) or "file"
    return text if len(text) <= NAME_LIMIT else f"{text[: NAME_LIMIT - 12]}…{text[-11:]}"


def read_import(name: str, content: bytes, choice: LayoutChoice = WHOLE, *, progress: Progress = silent) -> Imported:
    """Read reflectors, routes or a whole project from the content of a file.

    Parameters
    ----------
    name : as the file is called; its ending tells the format.
    content : the file.
    choice : which part of a LIF file is wanted.
    progress : called between the steps; may raise to cancel.

    Raises
    ------
    FileFormatError
        names the file as it is called, place, what was found and what is expected.
    UsageError
        the file has no such vehicle type or layout.
    """
    title = shown_name(name)
    kept_as = _FORMATS.get(Path(title).suffix.lower())
    if kept_as is None:
        raise FileFormatError(title, "", "is of a kind that is not read here", _instead(title))
    if len(content) > SIZE_LIMIT:
        raise FileFormatError(title, "", f"has {len(content)} bytes", f"at most {SIZE_LIMIT} bytes")
    with tempfile.TemporaryDirectory(prefix="commission.") as folder:
        path = Path(folder) / kept_as
        path.write_bytes(content)
        try:
            progress(0.1, "reading")
            imported = _read(path, choice, progress)
        except FileFormatError as error:
            raise FileFormatError(title, error.where, error.problem, error.remedy) from error
    return _bounded(title, imported)


def read_pasted(text: str, *, progress: Progress = silent) -> Imported:
    """Read what was pasted: cells of a spreadsheet, a table, a SICK layout, a LIF layout or a VDA 5050 order."""
    start = text.lstrip("\ufeff \t\r\n")
    if start.startswith("{"):
        return read_import(f"{PASTED}.json", text.encode(errors="replace"), progress=progress)
    if start.startswith("globID"):
        return read_import(f"{PASTED}.imk", text.encode(errors="replace"), progress=progress)
    progress(0.1, "reading")
    return _bounded(PASTED, parse_table(text))


def read_named(path: Path, choice: LayoutChoice = WHOLE, *, progress: Progress = silent) -> Imported:
    """Read a file of the computer that serves the page.

    Parameters
    ----------
    path : as the engineer typed it.
    choice, progress : as in `read_import`.

    Raises
    ------
    FileFormatError
        as `read_import`, or the file is of a kind that is not read here.
    """
    with suppress(RuntimeError):  # there is no such user: then the file does not exist either
        path = path.expanduser()
    if path.suffix.lower() not in _FORMATS:
        raise FileFormatError(path, "", "is of a kind that is not read here", _instead(path.name))
    return read_import(path.name, read_bytes(path, SIZE_LIMIT), choice, progress=progress)


def _read(path: Path, choice: LayoutChoice, progress: Progress) -> Imported:
    if path.suffix == ".zip":
        return read_project_archive(path, progress=progress)
    if path.suffix == ".imk":
        return read_imk(path)
    if path.suffix == ".csv":
        return read_any_table(path)
    if path.suffix == ".lif" or is_layout(read_json(path, Findings())):
        return read_lif(path, vehicle_type=choice.vehicle_type, layout=choice.layout)
    return read_order(path)


def _bounded(title: str, imported: Imported) -> Imported:
    """Refuse what the page could no longer show."""
    if isinstance(imported, ReflectorImport) and len(imported.reflectors) > REFLECTOR_LIMIT:
        problem = f"holds {len(imported.reflectors)} reflectors"
        raise FileFormatError(title, "", problem, f"at most {REFLECTOR_LIMIT}")
    if isinstance(imported, RouteImport) and len(imported.routes) > ROUTE_LIMIT:
        raise FileFormatError(title, "", f"holds {len(imported.routes)} routes", f"at most {ROUTE_LIMIT}")
    return imported


def _instead(name: str) -> str:
    """Say what to bring instead of a file of a kind that is not read here."""
    if name.lower().endswith(".smap"):
        return f"the project that `commission convert {name} FOLDER` makes of a SEER map"
    return f"a file that ends in {', '.join(ENDINGS[:-1])} or {ENDINGS[-1]}"

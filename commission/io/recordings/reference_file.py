"""The file `reference.json` of a recording: where on the vehicle its reference measures, and how late its clock is."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

import msgspec

from commission.errors import FileFormatError
from commission.io.atomic import write_text
from commission.io.conversion import convert
from commission.io.reading import read_text
from commission.io.recordings.versioned_json import json_of, refuse_other_versions
from commission.site.reference_mount import ReferenceMount

REFERENCE_MOUNT = "reference.json"
SCHEMA = 1
"""Version of the file."""
SIZE_LIMIT = 10_000
"""Bytes of the file."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ReferenceDocument:
    """Keys of `reference.json`, in SI units."""

    schema: int = SCHEMA
    """Version of the file."""
    antenna: tuple[float, ...] = (0.0, 0.0)
    """Point whose position the reference measures: x, y and maybe z in the base frame [m]."""
    clock_offset: float = 0.0
    """How much later than they were measured its poses are stamped [s]."""


def write_reference_mount(path: Path, mount: ReferenceMount) -> None:
    """Write where a reference measures; raises FileFormatError when the file cannot be written."""
    write_text(path, reference_mount_text(mount))


def reference_mount_text(mount: ReferenceMount) -> str:
    """Return where a reference measures as the text of the file."""
    values = {"schema": SCHEMA, **msgspec.to_builtins(mount)}
    return json.dumps(values) + "\n"


def read_reference_mount(path: Path) -> ReferenceMount:
    """Read where a reference measures.

    Raises
    ------
    FileFormatError
        the file is damaged, of another version, or holds something that is not expected; names the key.
    """
    return reference_mount_of(path, read_text(path, SIZE_LIMIT))


def reference_mount_of(path: Path, text: str) -> ReferenceMount:
    """Return what the text of such a file says; raises FileFormatError like `read_reference_mount`, naming the path."""
    values, document = json_of(path, text, '{"antenna": [x, y], "clock_offset": s}')
    if not isinstance(values, dict):
        raise document.error((), f"is {values!r}", "an object with antenna and clock_offset")
    refuse_other_versions(document, values.get("schema", SCHEMA), SCHEMA)
    keys = convert(document, ReferenceDocument)
    try:
        return ReferenceMount(antenna=keys.antenna, clock_offset=keys.clock_offset)
    except ValueError as error:
        found, _, expected = str(error).partition("; expected ")
        raise FileFormatError(path, "", found, expected) from error

"""What a GLB file announces, looked at before trimesh makes arrays of it: a few hundred bytes can announce gigabytes.

Only counts are read here (glTF 2.0, sections 3.6.2 and 4.4); the geometry itself is trimesh's.
"""

from __future__ import annotations

import struct
from pathlib import Path
from typing import IO, Any

import msgspec

from commission.errors import FileFormatError

_HEADER = struct.Struct("<4sIIII")
_JSON = 0x4E4F534A


def check_announced(path: Path, file: IO[bytes], most_triangles: int) -> None:
    """Refuse a model whose parts would take more than their data or the limit; the file is at its start afterwards.

    Parameters
    ----------
    path, file : the model, opened at its start.
    most_triangles : limit for all parts together; what several parts share counts for each of them.

    Raises
    ------
    FileFormatError
        it is no GLB, an array of it has no data, or there are too many corners.
    """
    size = path.stat().st_size
    header = file.read(_HEADER.size)
    document: Any = None
    if len(header) == _HEADER.size:
        magic, _, _, length, kind = _HEADER.unpack(header)
        if magic == b"glTF" and kind == _JSON and length <= size:
            document = _decoded(file.read(length))
    file.seek(0)
    if not isinstance(document, dict):
        raise FileFormatError(path, "", "is no readable GLB (it does not begin with one)", "a complete model")
    accessors = _list(document, "accessors")
    parts = [part for mesh in _list(document, "meshes") for part in _list(mesh, "primitives")]
    for key in ("POSITION", "indices"):
        used = [_accessor(accessors, part, key) for part in parts]
        if any("bufferView" not in accessor for accessor in used if accessor is not None):
            raise FileFormatError(path, f"accessor of {key}", "has no data", "corners that are in the file")
        count = sum(_count(accessor) for accessor in used if accessor is not None)
        if count > 3 * most_triangles:
            problem = f"announces {count} entries"
            raise FileFormatError(path, f"accessors of {key}", problem, f"at most {3 * most_triangles}")


def _decoded(text: bytes) -> Any:
    try:
        return msgspec.json.decode(text)
    except (msgspec.DecodeError, ValueError, RecursionError):
        return None


def _list(value: Any, key: str) -> list[Any]:
    """List under a key; what is none is trimesh's to complain about."""
    found = value.get(key) if isinstance(value, dict) else None
    return found if isinstance(found, list) else []


def _accessor(accessors: list[Any], part: Any, key: str) -> dict[str, Any] | None:
    """Description of the array that a part uses for its corners or its triangles; None when there is none."""
    holder = part if key == "indices" or not isinstance(part, dict) else part.get("attributes")
    index = holder.get(key) if isinstance(holder, dict) else None
    # A negative index counts from the end for Python, and so for trimesh.
    if not isinstance(index, int) or not -len(accessors) <= index < len(accessors):
        return None
    return accessors[index] if isinstance(accessors[index], dict) else None


def _count(accessor: dict[str, Any]) -> int:
    count = accessor.get("count")
    return count if isinstance(count, int) and count > 0 else 0

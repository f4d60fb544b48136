"""What the files of a project hold, as one short text each: whether somebody else has changed them since.

It reads files and compares; what to do about a change is the engineer's decision.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from pathlib import Path

from commission.errors import FileFormatError
from commission.io.project_file import FILE_NAME
from commission.io.reading import inside, read_bytes
from commission.io.yaml_document import read_yaml

_LARGEST = 512_000_000
_ABSENT = "absent"


@dataclass(frozen=True, slots=True)
class Fingerprint:
    """State of a project's files at one moment."""

    folder: Path
    """The project's folder."""
    digests: tuple[tuple[str, str], ...]
    """Name relative to the folder, and digest of the content, of each file that belongs to the project."""

    @staticmethod
    def of(folder: Path) -> Fingerprint:
        """Read the files of a project; one that is missing or unreadable is a state like any other."""
        names = _names(folder)
        return Fingerprint(folder, tuple((name, _digest(folder / name)) for name in names))

    @property
    def digest(self) -> str:
        """SHA-256 of all files and their names: what an exported result says it is of."""
        return hashlib.sha256(repr(self.digests).encode()).hexdigest()

    def changed_files(self) -> tuple[str, ...]:
        """Names of the files that are not as they were: changed, gone, or come."""
        before, now = dict(self.digests), dict(Fingerprint.of(self.folder).digests)
        return tuple(name for name in sorted(before | now) if before.get(name, _ABSENT) != now.get(name, _ABSENT))


def recording_digest(path: Path) -> str:
    """SHA-256 of a recording: of a file its content, of a folder the names and contents of all its files.

    Parameters
    ----------
    path : a file or a folder.
    """
    if not path.is_dir():
        return _streamed(path)
    files = sorted(each for each in path.rglob("*") if each.is_file())
    named = [(each.relative_to(path).as_posix(), _streamed(each)) for each in files]
    return hashlib.sha256(repr(named).encode()).hexdigest()


def _streamed(path: Path) -> str:
    """SHA-256 of a file of any size."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _names(folder: Path) -> tuple[str, ...]:
    """Files that the project refers to, `project.yaml` first; a reference out of the folder is not followed."""
    yaml_path = folder / FILE_NAME
    found = [FILE_NAME]
    for key in ("floor_map", "reflectors"):
        name = _reference(yaml_path, key)
        if name is not None and _is_inside(folder, name, yaml_path):
            found.append(name)
            image = _reference(folder / name, "image") if key == "floor_map" else None
            if image is not None and _is_inside(folder, image, folder / name):
                found.append((Path(name).parent / image).as_posix())
    return tuple(found)


def _reference(path: Path, key: str) -> str | None:
    try:
        value = read_yaml(path).value
    except FileFormatError:
        return None
    name = value.get(key) if isinstance(value, dict) else None
    return name if isinstance(name, str) else None


def _is_inside(folder: Path, name: str, owner: Path) -> bool:
    try:
        inside(folder, name, owner, "")
    except FileFormatError:
        return False
    return True


def _digest(path: Path) -> str:
    try:
        return hashlib.sha256(read_bytes(path, _LARGEST)).hexdigest()
    except FileFormatError:
        return _ABSENT

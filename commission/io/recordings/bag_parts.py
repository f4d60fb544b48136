"""The files that a bag of ROS 2 was split into: their order, and which of them are not there. No message is read."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path, PurePath
from typing import Any

import yaml

from commission.errors import FileFormatError
from commission.io.reading import read_text

METADATA = "metadata.yaml"
"""File beside those of a bag that lists them; a recorder writes it when it ends."""
_NUMBERED = re.compile(r"(?P<name>.*_)(?P<number>[0-9]{1,6})(?P<end>\.\w+)")
_METADATA_LIMIT = 4_000_000
"""Bytes of metadata; that of 1,000 files with 100 topics has half of it."""
_LISTED = 4
"""Files that are named, at most."""


def bag_of(path: Path) -> Path:
    """Return the folder of a bag whose metadata are named, or the path itself."""
    is_metadata = path.name == METADATA and path.is_file() and bool(_listed(path))
    return path.parent if is_metadata else path


def files_of(folder: Path, *endings: str) -> list[Path]:
    """Files of a folder in the order of their numbers: `bag_2` comes before `bag_10`.

    Parameters
    ----------
    folder : of the bag.
    endings : how their names end: `.mcap`.
    """
    found = (file for ending in endings for file in folder.glob(f"*{ending}"))
    return sorted(found, key=lambda file: (len(file.name), file.name))


def missing_parts(folder: Path, files: Sequence[Path]) -> tuple[str, ...]:
    """Say which files of a bag are not there: by its metadata, or by the numbers in their names.

    Parameters
    ----------
    folder : of the bag.
    files : those that are there.
    """
    there = {file.name for file in files}
    listed = _listed(folder / METADATA)
    lost = [name for name in listed if name not in there and PurePath(name).suffix in {file.suffix for file in files}]
    how = f"which {METADATA} lists"
    if not listed:
        # A first file that is not there leaves no trace but in the numbers of the others.
        numbered = [found for file in files if (found := _NUMBERED.fullmatch(file.name)) is not None]
        if len({(found["name"], found["end"]) for found in numbered}) == 1:
            numbers = {int(found["number"]) for found in numbered}
            name, end = numbered[0]["name"], numbered[0]["end"]
            lost = [f"{name}{number}{end}" for number in range(max(numbers)) if number not in numbers]
        how = "by the numbers of the others"
    more = f" and {len(lost) - _LISTED} more" if len(lost) > _LISTED else ""
    names = ", ".join(lost[:_LISTED])
    verb = "is" if len(lost) == 1 else "are"
    return (f"{names}{more}, {how}, {verb} not there: what was recorded in it is missing",) if lost else ()


def unmerged(files: Sequence[Path]) -> tuple[str, ...]:
    """Say beside which files of sqlite3 lies what a recorder that was stopped had not yet put into them."""
    beside = [file.with_name(f"{file.name}{end}") for file in files for end in ("-wal", "-journal")]
    told: list[str] = []
    for path in beside:
        if path.is_file() and path.stat().st_size:
            told.append(
                f"{path.name} holds what the recorder had not yet put into the bag, and is not read: "
                f'open the bag once by `sqlite3 FILE.db3 "pragma wal_checkpoint"` to put it in'
            )
    return tuple(told)


def _listed(path: Path) -> list[str]:
    """Names of files that metadata lists; none where it cannot be read."""
    try:
        information: Any = yaml.safe_load(read_text(path, _METADATA_LIMIT))["rosbag2_bagfile_information"]
        return [PurePath(str(name)).name for name in information["relative_file_paths"]]
    except (FileFormatError, yaml.YAMLError, LookupError, TypeError, ValueError, RecursionError):
        return []

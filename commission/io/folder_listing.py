"""What is in a folder: names, kinds and sizes, for who looks for a file. Nothing of a file is read."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from commission.errors import FileFormatError

MOST_LISTED = 2_000
"""Entries of a folder that are listed; of more the first by name."""


@dataclass(frozen=True, slots=True)
class ListedFile:
    """One file or folder in a folder."""

    name: str
    """Its name."""
    is_folder: bool
    """Whether it is a folder."""
    size: int
    """Bytes; 0 of a folder."""
    changed: float
    """When it was changed last [s since 1970]."""


@dataclass(frozen=True, slots=True)
class FolderListing:
    """What is in a folder."""

    folder: Path
    """Which one."""
    entries: tuple[ListedFile, ...]
    """Folders first, each by name; hidden ones and what cannot be looked at are left out."""
    left_out: int = 0
    """Entries beyond `MOST_LISTED`."""


def list_folder(folder: Path, is_shown: Callable[[Path], bool]) -> FolderListing:
    """Return what is in a folder.

    Parameters
    ----------
    folder : which one.
    is_shown : from the path of an entry to whether it is listed.

    Raises
    ------
    FileFormatError
        it is none, or may not be looked at.
    """
    try:
        with os.scandir(folder) as found:
            names = [each for each in found if not each.name.startswith(".")]
    except OSError as error:
        problem = (error.strerror or "cannot be read").lower()
        raise FileFormatError(folder, "", problem, "expected a folder") from error
    entries = [entry for each in names if (entry := _entry(each)) is not None and is_shown(folder / entry.name)]
    entries.sort(key=lambda entry: (not entry.is_folder, entry.name.lower()))
    return FolderListing(folder, tuple(entries[:MOST_LISTED]), max(0, len(entries) - MOST_LISTED))


def _entry(found: os.DirEntry[str]) -> ListedFile | None:
    """Look at an entry; none where it has gone, or its link leads nowhere."""
    try:
        status, is_folder = found.stat(), found.is_dir()
    except OSError:
        return None
    return ListedFile(found.name, is_folder, 0 if is_folder else status.st_size, status.st_mtime)

"""Where journals lie: beside the project, or in the user's own folder while the project's folder is gone."""

from __future__ import annotations

import hashlib
import os
import tempfile
from dataclasses import dataclass
from pathlib import Path

FILE_NAME = ".commission.journal"


@dataclass(frozen=True, slots=True)
class FileId:
    """Tells a file from another one of the same name."""

    device: int
    """Number of the file system."""
    number: int
    """Number of the file in it."""

    @staticmethod
    def of(path: Path | int) -> FileId:
        """Return that of a path, or of an open file; raises OSError when there is none."""
        found = os.stat(path)
        return FileId(found.st_dev, found.st_ino)


def rescue_folder(folder: Path) -> Path:
    """Return where the edits of a project are kept while its folder is gone: always the same place for one folder."""
    base = os.environ.get("XDG_STATE_HOME") or os.environ.get("LOCALAPPDATA")
    if not base:
        home = Path(os.path.expanduser("~"))
        # A service user without a home still gets a place; it lasts until the next reboot.
        base = home / ".local" / "state" if home.is_dir() else tempfile.gettempdir()
    place = os.path.abspath(folder)
    digest = hashlib.sha256(os.fsencode(place)).hexdigest()[:8]
    return Path(base) / "commission" / "rescued" / f"{Path(place).name[:40] or 'project'}-{digest}"

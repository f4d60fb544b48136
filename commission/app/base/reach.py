"""Where on this computer's disk the page may read and write on behalf of a browser.

Who sits at this computer may name any file of his. Once other computers are let in, a path is somebody else's word: it
stays within the project's folder and those that were named at the start, and so does every link on the way.
"""

from __future__ import annotations

import os
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from commission.app.base.actions import Sender
from commission.errors import UsageError

MOST_LOOKED_AT = 10_000
"""Files of a folder whose links are followed; one with more is no recording and no project."""


@dataclass(frozen=True, slots=True)
class Reach:
    """Folders that browsers may name files in."""

    folders: tuple[Path, ...] | None = None
    """With all links resolved; None: everywhere, since only this computer is let in."""

    @classmethod
    def within(cls, folders: Iterable[Path | None]) -> Reach:
        """Return the reach of these folders.

        Raises
        ------
        UsageError
            one of them is none.
        """
        found: list[Path] = []
        for folder in folders:
            if folder is None:
                continue
            if folder.exists() and not folder.is_dir():
                raise UsageError(f"{folder}: is no folder; expected one with files for the page (--files)")
            found.append(folder.resolve())
        return cls(tuple(dict.fromkeys(found)))

    def checked(self, path: Path, sender: Sender) -> Path:
        """Return a path that a browser may name, as it is after all links.

        Parameters
        ----------
        path : a file or folder, existing or not.
        sender : who names it; what the program itself was started with is not questioned.

        Raises
        ------
        UsageError
            it is, or leads, out of reach; whether anything is there is not said.
        """
        if self.folders is None or sender.browser is None:
            return path
        target = _resolved(typed_path(str(path)))  # who reads it must not find another meaning of ~
        names = ", ".join(str(folder) for folder in self.folders) or "none"
        if not self._holds(target):
            raise UsageError(f"{path}: is out of reach; expected a path in the folders that are shared: {names}")
        astray = next((link for link in _links_in(target) if not self._holds(_resolved(link))), None)
        if astray is not None:
            where = astray.relative_to(target)
            raise UsageError(f"{path}: its link {where} leads out of reach; expected all of it in the folders: {names}")
        return target

    def lists(self, path: Path, sender: Sender) -> bool:
        """Whether a browser may see that something is there: it, after all links, is in reach.

        Parameters
        ----------
        path : a file or folder, existing or not; what is in a folder is asked for by itself.
        sender : who asks.
        """
        if self.folders is None or sender.browser is None:
            return True
        try:
            return self._holds(_resolved(typed_path(str(path))))
        except UsageError:
            return False

    def _holds(self, path: Path) -> bool:
        return self.folders is not None and any(path.is_relative_to(folder) for folder in self.folders)


EVERYWHERE = Reach()
"""The whole disk: for who sits at this computer."""


def _resolved(path: Path) -> Path:
    """Follow all links of a path."""
    try:
        return path.resolve()
    except (OSError, RuntimeError, ValueError) as error:
        raise UsageError(f"{path}: is no path; expected one of a file or folder") from error


def _links_in(folder: Path) -> Iterable[Path]:
    """Links anywhere in a folder; none in a file."""
    if not folder.is_dir():
        return ()
    found: list[Path] = []
    looked_at = 0
    for where, folders, files in os.walk(folder):
        looked_at += len(folders) + len(files)
        if looked_at > MOST_LOOKED_AT:
            raise UsageError(f"{folder}: holds more than {MOST_LOOKED_AT} files; expected a recording or project")
        found += [path for name in (*folders, *files) if (path := Path(where, name)).is_symlink()]
    return found


def typed_path(text: str) -> Path:
    """Return the path that a person has typed; `~` is the home of who runs the program."""
    return Path(os.path.expanduser(text.strip()))

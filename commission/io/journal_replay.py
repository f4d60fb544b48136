"""What a journal gives back after a crash: every intact edit made again, and the file kept wherever one was not.

It reads and moves journals aside; `journal` writes them.
"""

from __future__ import annotations

import os
import shutil
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from datetime import datetime
from pathlib import Path
from typing import IO, Any

from commission.errors import CommissionError, FileFormatError
from commission.io.fingerprint import Fingerprint
from commission.io.journal_lines import FORMAT, OLDEST_FORMAT, LinePlace, Lines, entry_of, read_lines
from commission.io.journal_place import FILE_NAME, FileId, rescue_folder
from commission.io.project_parts import apply
from commission.io.reading import cannot_read, check_size
from commission.site.fields import in_file
from commission.site.project import Project

SIZE_LIMIT = 2_000_000_000
"""Bytes of a journal: a floor map that was changed all over ten thousand times."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Restored:
    """What a journal gave back after a crash."""

    project: Project
    """The project as last edited."""
    edits: int = 0
    """Number of edits made again."""
    last_edit: str = ""
    """Name of the newest of them."""
    last_at: datetime = datetime.min
    """When it was made."""
    on_disk: Fingerprint | None = None
    """The project's files as they were when the journal began; None: unknown, or our own save was at work on them."""
    foreign_changes: tuple[str, ...] = ()
    """Files that somebody else has changed since: ask before they are overwritten."""
    damage: str = ""
    """What of the journal could not be read; empty: nothing."""
    kept: Path | None = None
    """Where the damaged journal is kept; None: it was read to its end."""
    journal: Path | None = None
    """The journal that was read, where it still has its name; the next one supersedes it."""
    source: FileId | None = None
    """Tells that file from another one of its name."""

    def summary(self) -> str:
        """Return what was restored as one line."""
        edits = f"{self.edits} edit{'' if self.edits == 1 else 's'}"
        text = f"Restored {edits} up to {self.last_at:%Y-%m-%d %H:%M:%S}: {self.last_edit}"
        if not self.edits:
            text = "Nothing could be restored of the journal of unsaved edits"
        if self.damage:
            text += f"; {self.damage}"
        if self.kept is not None:
            text += f"; the journal as it was found is kept as {self.kept}"
        if self.foreign_changes:
            text += f"; meanwhile changed on disk by somebody else: {', '.join(self.foreign_changes)}"
        return text


def restore(folder: Path, project: Project) -> Restored | None:
    """Make the edits of a crashed session again.

    Parameters
    ----------
    folder : the project's folder.
    project : the project as its files are now; its floor map is used where the journal holds none.

    Returns
    -------
    restored : None when there is no journal, or all of it is in the project's files. The journal stays until the next
        one begins: pass this value and then the restored project to a new `Journal` before anything else. A journal
        that is damaged anywhere is kept under another name, too.

    Raises
    ------
    FileFormatError
        a journal that cannot be read cannot be put aside either.
    """
    path = folder / FILE_NAME
    if not os.path.lexists(path):
        # The folder was lost while the project was edited; see `Journal`.
        path = rescue_folder(folder) / FILE_NAME
        if not os.path.lexists(path):
            return None
    try:
        check_size(path, SIZE_LIMIT)
        lines = read_lines(path)
        source = FileId.of(path)
        replay = _Replay(path, project, lines)
    except (FileFormatError, OSError) as error:
        reason = error.problem if isinstance(error, FileFormatError) else error.strerror or error
        return Restored(project=project, damage=f"it {reason}", kept=set_aside(path, "damaged"))
    found = replay.result(folder)
    if not replay.damage and (not found.edits or replay.is_saved):
        path.unlink()
        return None
    if not replay.damage:
        return replace(found, journal=path, source=source)
    if found.edits:
        return replace(found, kept=_kept_copy(path), journal=path, source=source)
    return replace(found, kept=set_aside(path, "damaged"))


def set_aside(path: Path, why: str) -> Path:
    """Give a journal another name, so that nothing replaces it; returns it.

    Parameters
    ----------
    path : the journal.
    why : one word that ends up in the name.

    Raises
    ------
    FileFormatError
        the folder takes no other name.
    """
    place = _free_name(path, why)
    try:
        path.rename(place)
    except OSError as error:
        raise cannot_read(path, error) from error
    return place


def _kept_copy(path: Path) -> Path:
    """Keep a damaged journal under another name beside itself; one copy of it is enough, however often it is read."""
    size, modified = path.stat().st_size, path.stat().st_mtime_ns
    for other in path.parent.glob(f"{FILE_NAME}.damaged-*"):
        if (other.stat().st_size, other.stat().st_mtime_ns) == (size, modified):
            return other
    place = _free_name(path, "damaged")
    try:
        try:
            place.hardlink_to(path)
        except OSError:
            shutil.copy2(path, place)
    except OSError as error:
        with suppress(OSError):
            place.unlink(missing_ok=True)
        raise cannot_read(path, error) from error
    return place


def _free_name(path: Path, why: str) -> Path:
    name = f"{FILE_NAME}.{why}-{datetime.now():%Y%m%d-%H%M%S}"
    place, number = path.with_name(name), 1
    while os.path.lexists(place):
        number += 1
        place = path.with_name(f"{name}-{number}")
    return place


class _Replay:
    """The edits of a journal, line by line."""

    def __init__(self, path: Path, project: Project, lines: Lines) -> None:
        self._path = path
        self._project = self._loaded = project
        self._lines = lines
        self._edits = 0
        self._what = ""
        self._at = datetime.min
        self._digests: tuple[tuple[str, str], ...] | None = None
        self._saving = False
        self._refused: list[int] = []
        self._version: object = None
        with path.open("rb") as file:
            for place in lines.places:
                self._read(file, place)
                if self._is_foreign_version():
                    break

    def _is_foreign_version(self) -> bool:
        return self._version is not None and self._version not in range(OLDEST_FORMAT, FORMAT + 1)

    def _read(self, file: IO[bytes], place: LinePlace) -> None:
        """Do what one line says."""
        file.seek(place.offset)
        entry = entry_of(file.read(place.length))
        if entry is None:
            self._refused.append(place.number)
            return
        try:
            if "journal" in entry:
                self._version = entry["journal"]
                if self._is_foreign_version():
                    return
                self._digests = tuple((str(name), str(digest)) for name, digest in entry["on_disk"])
            self._saving = bool(entry.get("saving", self._saving))
            if not isinstance(entry.get("change", {}), dict):
                raise TypeError("a change is no table of what is changed")
            if "change" in entry and self._make(entry["change"], place.number) and "what" in entry:
                self._what, self._at = str(entry["what"]), datetime.fromtimestamp(float(entry["at"]))
                self._edits += bool(entry["change"])
        except (LookupError, TypeError, ValueError, OverflowError, OSError):
            self._refused.append(place.number)

    def _make(self, change: dict[str, Any], number: int) -> bool:
        """Make a change again, part by part where the whole is not possible; returns whether anything was made."""
        try:
            self._project = apply(self._project, change, self._path)
        except CommissionError:
            # What a lost line before had made is missing: what does not need it is still good.
            self._refused.append(number)
            before = self._project
            for name, part in change.items():
                with suppress(CommissionError):
                    self._project = apply(self._project, {name: part}, self._path)
            return self._project is not before
        return True

    @property
    def is_saved(self) -> bool:
        """Whether the project's files hold all of it: killed when all was saved, but for removing the journal."""
        return self._saving and self._loaded in (self._project, in_file(self._project))

    @property
    def damage(self) -> str:
        """What could not be read, in words; empty: nothing."""
        if self._is_foreign_version():
            return f"it was written by another version of this program (its format is {self._version}, ours {FORMAT})"
        if not self._lines.places:
            return "it is empty" if self._path.stat().st_size == 0 else "none of its lines is intact"
        found: list[str] = []
        if self._lines.missing:
            found.append(f"{_listed(self._lines.missing)} damaged or missing")
        if self._refused:
            found.append(f"{_listed(self._refused)} intact, but not possible without what is lost")
        if not found and not self._lines.is_whole:
            found.append("something was changed in it, or its end is cut off")
        return "; ".join(found)

    def result(self, folder: Path) -> Restored:
        """Return what was restored."""
        on_disk = None if self._saving or self._digests is None else Fingerprint(folder, self._digests)
        return Restored(
            project=self._project,
            edits=self._edits,
            last_edit=self._what,
            last_at=self._at,
            on_disk=on_disk,
            foreign_changes=() if on_disk is None else on_disk.changed_files(),
            damage=self.damage,
        )


def _listed(numbers: Sequence[int]) -> str:
    """Numbers of lines as the beginning of a sentence: `lines 3, 5 to 9 are`."""
    runs: list[list[int]] = []
    for number in sorted(numbers):
        if runs and number == runs[-1][1] + 1:
            runs[-1][1] = number
        else:
            runs.append([number, number])
    texts = [str(first) if first == last else f"{first} to {last}" for first, last in runs]
    if len(texts) > 5:
        texts = [*texts[:4], f"and {len(texts) - 4} more places"]
    return f"line {texts[0]} is" if len(numbers) == 1 else f"lines {', '.join(texts)} are"

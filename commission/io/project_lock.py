"""One writer per project: a lock in its folder, of which the system lets go when its holder dies, however that happens.

The file says who holds it; that nobody else does is the business of the system's own lock on it, so that a file which a
killed program has left blocks nobody. Whoever takes over puts a locked file of his own in its place: the holder before
notices at his next look, and lets go of the old file when he has written his last line.
"""

from __future__ import annotations

import json
import os
import socket
import sys
import time
from contextlib import suppress
from dataclasses import asdict, dataclass
from datetime import datetime
from enum import StrEnum
from pathlib import Path

from commission.errors import ProjectError

if sys.platform != "win32":
    import fcntl

FILE_NAME = ".commission.lock"
PATIENCE_S = 5.0
"""Time in which the holder before has to write its last line [s]; one that hangs is waited for no longer."""
_SIZE_LIMIT = 4000


@dataclass(frozen=True, slots=True)
class Holder:
    """Who edits a project."""

    host: str
    """Name of the computer."""
    process: int
    """Number of the process on it."""
    since: str
    """When it began, as a person reads it."""

    def __str__(self) -> str:
        """Say it in a sentence."""
        return f"process {self.process} on {self.host} since {self.since}"


NOBODY_KNOWN = Holder("an unknown computer", 0, "an unknown time")
"""Holder whose file cannot be read."""


class Hold(StrEnum):
    """How a project is held."""

    OURS = "ours"
    """By us."""
    TAKING_OVER = "taking over"
    """By us as soon as the holder before has written its last line."""
    THEIRS = "theirs"
    """By somebody else."""
    NOBODYS = "nobody's"
    """By nobody: there is no folder yet, or nothing can be locked in it; nobody is kept from writing."""


class ProjectLock:
    """The lock of one project's folder.

    Parameters
    ----------
    folder : the project's folder; one that does not exist yet is locked when it does.
    """

    def __init__(self, folder: Path) -> None:
        self.path = folder / FILE_NAME
        self.holder: Holder | None = None
        """Who else holds it; None: nobody else."""
        self.left_by: Holder | None = None
        """Who on another computer held it last and never let go: perhaps killed, perhaps out of reach of this lock."""
        self._file: int | None = None
        self._before: int | None = None
        self._given_up_at = 0.0

    def look(self) -> Hold:
        """Find out how things stand, and take the lock if it is free; call it every second, and before each write."""
        if self._before is not None and (_try_lock(self._before) or time.monotonic() > self._given_up_at):
            os.close(self._before)
            self._before = None
        if self._file is not None and not self._has_name(self._file):
            # Deleted (git clean), exchanged by a sync client, or taken over: whoever holds what is there now decides.
            os.close(self._file)
            self._file = None
        if self._file is None:
            self._take()
        if self._file is not None:
            return Hold.OURS if self._before is None else Hold.TAKING_OVER
        self._forget_before()
        return Hold.NOBODYS if self.holder is None else Hold.THEIRS

    def take_over(self) -> None:
        """Take it from whoever holds it; `look` tells when that is done.

        Raises
        ------
        ProjectError
            the folder cannot be written.
        """
        if self.look() is not Hold.THEIRS:
            return
        new = self.path.with_name(f"{FILE_NAME}.{os.getpid()}.new")
        file = None
        try:
            with suppress(OSError):
                self._before = os.open(self.path, os.O_RDWR)
            file = os.open(new, os.O_RDWR | os.O_CREAT | os.O_TRUNC, 0o644)
            if not _try_lock(file):
                raise OSError("its file cannot be locked")
            _write_holder(file)
            new.replace(self.path)
        except OSError as error:
            if file is not None:
                os.close(file)
                new.unlink(missing_ok=True)
            self._forget_before()
            raise ProjectError(f"{self.path.parent} cannot be taken over: {error.strerror or error}") from error
        self._file, self.holder = file, None
        self._given_up_at = time.monotonic() + PATIENCE_S

    def release(self) -> None:
        """Let go of it."""
        if self._file is not None:
            with suppress(OSError):
                if self._has_name(self._file):
                    self.path.unlink()
            os.close(self._file)
            self._file = None
        self._forget_before()

    def _take(self) -> None:
        """Take the lock unless somebody else holds it."""
        self.holder = None
        while True:
            try:
                file = os.open(self.path, os.O_RDWR | os.O_CREAT, 0o644)
            except OSError:
                return
            try:
                is_taken = _try_lock(file)
            except OSError:
                # A file system without locks: there is nothing to hold.
                os.close(file)
                return
            if not is_taken:
                self.holder = _read_holder(file)
                os.close(file)
                return
            if self._has_name(file):
                break
            # It was let go of, and removed, in between.
            os.close(file)
        last = _read_holder(file)
        self.left_by = last if last not in (NOBODY_KNOWN, None) and last.host != socket.gethostname() else None
        _write_holder(file)
        self._file = file

    def _has_name(self, file: int) -> bool:
        """Whether an open file is the one that the lock's name stands for."""
        try:
            return os.path.samestat(os.stat(self.path), os.fstat(file))
        except OSError:
            return False

    def _forget_before(self) -> None:
        if self._before is not None:
            os.close(self._before)
            self._before = None


def _try_lock(file: int) -> bool:
    """Lock an open file if nobody has; raises OSError where the file system has no locks."""
    if sys.platform == "win32":
        raise OSError("this system has no locks that a killed program lets go of")
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True


def _write_holder(file: int) -> None:
    """Say in the file that it is us."""
    holder = Holder(socket.gethostname(), os.getpid(), f"{datetime.now():%Y-%m-%d %H:%M:%S}")
    data = json.dumps(asdict(holder)).encode() + b"\n"
    os.ftruncate(file, 0)
    os.pwrite(file, data, 0)


def _read_holder(file: int) -> Holder:
    """Read who is said to hold it."""
    with suppress(OSError, ValueError, TypeError, KeyError):
        values = json.loads(os.pread(file, _SIZE_LIMIT, 0))
        return Holder(str(values["host"])[:100], int(values["process"]), str(values["since"])[:40])
    return NOBODY_KNOWN

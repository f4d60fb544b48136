"""Files of compiled kernels: where they lie, how several programs share them, and which are removed.

It knows neither numba nor what a file means: a name stands for one content, so two programs that write the same name
write the same, in any order, and none reads what another has half written.
"""

from __future__ import annotations

import os
import re
import stat
import tempfile
import time
import uuid
import zlib
from collections.abc import Iterator, Sequence
from pathlib import Path

FOLDER = "commission-kernels-2"
"""Folder of the files in this format. Folders of other formats beside it are removed like stale files."""

_KERNEL_FOLDER = re.compile(r"commission-kernels-\d+|[0-9a-f]{16}")
"""What this and earlier versions named a folder of kernels: the second had one per state of all the sources."""

MAX_UNUSED_S = 30 * 86400.0
"""A file that no program has read for this long is removed [s]."""

MAX_TOTAL_BYTES = 512 << 20
"""Beyond this size of all files those not read for longest are removed: thirty states of all kernels fit."""

_USE_IS_NOTED_EVERY_S = 86400.0
_WRITES_BETWEEN_SWEEPS = 200
_UNFINISHED = ".tmp"


def usual_folders() -> tuple[Path, ...]:
    """Folders that may hold folders of kernels, the preferred one first.

    `NUMBA_CACHE_DIR`, else the user's cache; then a folder in the temporary one, which a service user without a home
    or with a read-only one writes to: it compiles anew after each reboot.
    """
    user = os.getuid() if hasattr(os, "getuid") else "user"
    temporary = Path(tempfile.gettempdir()) / f"commission-kernels-{user}"
    chosen = os.environ.get("NUMBA_CACHE_DIR")
    if chosen:
        return Path(chosen), temporary
    try:
        base = os.environ.get("XDG_CACHE_HOME") or os.environ.get("LOCALAPPDATA") or Path.home() / ".cache"
    except RuntimeError:  # a user without a home
        return (temporary,)
    return Path(base) / "commission" / "kernels", temporary


class KernelFiles:
    """Named contents in the first of several folders that can be written to; read from all.

    The last folder lies where anybody may create one: it is used only while it is this user's own.
    Every failure of the file system means "not there" or "not kept": the kernel is then compiled, and nothing else is
    lost. So nothing here raises `OSError`.
    """

    def __init__(self, folders: Sequence[Path]) -> None:
        self.folders = tuple(folders)
        self._writes = 0

    def read(self, name: str) -> bytes | None:
        """Content of a name; None where there is none, or only a damaged one."""
        for folder in self.folders:
            path = folder / FOLDER / name
            try:
                content = path.read_bytes()
                trusted = self._is_trusted(folder)
            except OSError:
                continue
            undamaged = len(content) > 4 and int.from_bytes(content[:4], "little") == zlib.crc32(
                memoryview(content)[4:]
            )
            if trusted and undamaged:
                _note_use(path)
                return content[4:]
        return None

    def write(self, name: str, content: bytes) -> None:
        """Keep a content, which is not empty. Now and then, old ones are removed."""
        # A computer that loses power between the two may leave a file of zeros under the right name.
        checked = zlib.crc32(content).to_bytes(4, "little") + content
        for folder in self.folders:
            try:
                if folder == self.folders[-1]:
                    folder.mkdir(mode=0o700, exist_ok=True)
                (folder / FOLDER).mkdir(parents=True, exist_ok=True)
                if not self._is_trusted(folder):
                    continue
                _replace(folder / FOLDER / name, checked)
                if self._writes % _WRITES_BETWEEN_SWEEPS == 0:
                    sweep(folder)
                self._writes += 1
            except OSError:
                continue
            return

    def _is_trusted(self, folder: Path) -> bool:
        """Tell whether nobody else can have put files here."""
        if folder != self.folders[-1] or not hasattr(os, "getuid"):
            return True
        found = folder.lstat()
        return stat.S_ISDIR(found.st_mode) and found.st_uid == os.getuid() and not found.st_mode & 0o077


def sweep(folder: Path, max_total: int = MAX_TOTAL_BYTES, max_unused_s: float = MAX_UNUSED_S) -> None:
    """Remove kernels that were not used for long, then those not used for longest until the rest is small enough.

    Only folders named like ours are looked into: `NUMBA_CACHE_DIR` may hold the kernels of other programs. A program
    that still wants a removed file compiles it anew.

    Parameters
    ----------
    folder : folder that holds folders of kernels, of this version's format and of others.
    max_total : size of all files that are left [bytes].
    max_unused_s : time since the last use beyond which a file goes in any case [s].
    """
    now = time.time()
    total = 0
    for used, size, path in sorted(_files(folder), reverse=True):
        limit = _USE_IS_NOTED_EVERY_S if path.suffix == _UNFINISHED else max_unused_s
        if now - used > limit or total + size > max_total:
            _remove(path)
        else:
            total += size
    for kernels in _kernel_folders(folder):
        for inner, _, _ in os.walk(kernels, topdown=False):
            if Path(inner).name != FOLDER:
                _remove_empty(Path(inner))


def _kernel_folders(folder: Path) -> list[Path]:
    return [path for path in folder.iterdir() if _KERNEL_FOLDER.fullmatch(path.name) and path.is_dir()]


def _files(folder: Path) -> Iterator[tuple[float, int, Path]]:
    """Time of last use, size and path of each file of kernels."""
    for kernels in _kernel_folders(folder):
        for inner, _, names in os.walk(kernels):
            for name in names:
                path = Path(inner) / name
                try:
                    found = path.lstat()
                except OSError:  # another program sweeps, too
                    continue
                yield found.st_mtime, found.st_size, path


def _replace(path: Path, content: bytes) -> None:
    """Write a file, and give it its name once it is complete."""
    unfinished = path.with_name(f"{uuid.uuid4().hex}{_UNFINISHED}")
    try:
        unfinished.write_bytes(content)
        unfinished.replace(path)
    except OSError:
        _remove(unfinished)
        raise


def _note_use(path: Path) -> None:
    """Set a file's time to now, once a day: what is in use is never the oldest."""
    try:
        if time.time() - path.stat().st_mtime > _USE_IS_NOTED_EVERY_S:
            os.utime(path)
    except OSError:  # a read-only cache, whose owner sweeps it
        pass


def _remove(path: Path) -> None:
    try:
        path.unlink()
    except OSError:
        pass


def _remove_empty(folder: Path) -> None:
    try:
        folder.rmdir()
    except OSError:
        pass

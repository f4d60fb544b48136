"""Opening files that a stranger wrote: limits are checked before anything is read, errors are one line."""

from __future__ import annotations

import codecs
from contextlib import suppress
from pathlib import Path

from commission.errors import FileFormatError
from commission.io.findings import Findings


def read_bytes(path: Path, limit: int) -> bytes:
    """Read a whole file of at most `limit` bytes.

    Raises
    ------
    FileFormatError
        the file is missing, unreadable or too large; too large is found out before anything is read.
    """
    check_size(path, limit)
    try:
        with path.open("rb") as file:
            return file.read(limit + 1)
    except OSError as error:
        raise cannot_read(path, error) from error


def read_text(path: Path, limit: int, found: Findings | None = None) -> str:
    """Read a whole text, with or without byte-order mark.

    Parameters
    ----------
    path : the file.
    limit : largest size [bytes].
    found : as in `decoded`.
    """
    return decoded(path, 1, read_bytes(path, limit).removeprefix(codecs.BOM_UTF8), found)


def decoded(path: Path, line: int, data: bytes, found: Findings | None = None) -> str:
    """Text of some bytes of a file.

    Parameters
    ----------
    path, line : the file, and the line (from 1) on which the bytes begin, for the message.
    data : UTF-8.
    found : takes a note; with it, what is not UTF-8 is taken for Windows-1252, in which Excel saves text, or for UTF-16
        where it begins so, in which Excel saves "Unicode text".

    Raises
    ------
    FileFormatError
        the bytes are not UTF-8, and no text of Windows-1252 is expected or there is none.
    """
    try:
        return data.decode("utf-8")
    except UnicodeDecodeError as error:
        if found is not None and data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
            with suppress(UnicodeDecodeError):
                return data.decode("utf-16")
        if found is not None and b"\0" not in data:
            with suppress(UnicodeDecodeError):
                text = data.decode("cp1252")
                found.add("", f"{path.name} is not UTF-8; it was read as Windows-1252, as Excel saves text")
                return text
        where = f"line {line + data.count(bytes([10]), 0, error.start)}"
        problem = f"byte 0x{data[error.start]:02x} is not UTF-8"
        raise FileFormatError(path, where, problem, "text saved as UTF-8") from error


def check_size(path: Path, limit: int) -> None:
    """Raise FileFormatError unless `path` is an existing regular file of at most `limit` bytes."""
    try:
        if path.is_dir():
            raise FileFormatError(path, "", "is a folder", "a file")
        if not path.exists():
            raise FileFormatError(path, "", "does not exist", "an existing file")
        if not path.is_file():
            raise FileFormatError(path, "", "is no regular file", "a file")
        size = path.stat().st_size
    except (OSError, ValueError) as error:
        raise cannot_read(path, error) from error
    if size > limit:
        raise FileFormatError(path, "", f"has {size} bytes", f"at most {limit} bytes")


def cannot_read(path: Path, error: Exception) -> FileFormatError:
    """Error that says why the system refuses to give a file."""
    reason = getattr(error, "strerror", None) or error
    return FileFormatError(path, "", f"cannot be read ({reason})", "a readable file")


def inside(folder: Path, relative: str, owner: Path, where: str) -> Path:
    """Path of a file that another file refers to.

    Parameters
    ----------
    folder : folder that must contain the file, also after following links.
    relative : the reference, relative to the folder of `owner`.
    owner, where : file and place of the reference, for the message.

    Raises
    ------
    FileFormatError
        the reference is empty, absolute, or leads out of the folder.
    """
    expected = f"a path relative to {owner.parent} that stays inside {folder}"
    try:
        path = owner.parent / relative
        if not relative or Path(relative).is_absolute() or not path.resolve().is_relative_to(folder.resolve()):
            raise FileFormatError(owner, where, f"{relative!r} leads out of the folder", expected)
    except (OSError, ValueError, RuntimeError) as error:
        raise FileFormatError(owner, where, f"{relative!r} is no path ({error})", expected) from error
    return path

"""The lowest layer of DXF: pairs of group code and value, gathered into groups that begin with code 0.

ezdxf reads a whole document before it returns, 25 s for 200,000 entities, and cannot be stopped; a drawing is loaded as
a job with progress. So files are read here, group by group, and ezdxf is asked for what it knows better: binary files.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import IO

from commission.errors import FileFormatError
from commission.io.reading import cannot_read, check_size, read_bytes
from commission.progress import Progress

SIZE_LIMIT = 512_000_000
"""Bytes of a drawing: some 4,000,000 lines."""
BINARY_LIMIT = 64_000_000
"""Bytes of a binary drawing, which is held in memory as a whole."""
_BINARY = b"AutoCAD Binary DXF"
_LINE_LIMIT = 65_536
_TAG_LIMIT = 2_000_000
"""Pairs in one group: a polyline of about 700,000 points."""
_BYTES_PER_REPORT = 250_000

Tag = tuple[int, bytes]


@dataclass(frozen=True, slots=True)
class Group:
    """One entity, table entry or section mark."""

    kind: bytes
    """What follows code 0: b"LINE", b"SECTION", ..."""
    tags: list[Tag]
    """The pairs behind it, without comments."""
    line: int
    """Line (from 1) of its code 0; in a binary file the number of the pair."""

    def first(self, code: int, default: bytes = b"") -> bytes:
        """First value of a code."""
        return next((value for found, value in self.tags if found == code), default)

    def number(self, code: int, default: float = 0.0) -> float:
        """First value of a code as a number; raises ValueError when it is none."""
        value = self.first(code)
        return float(value) if value else default

    def whole(self, code: int, default: int = 0) -> int:
        """First value of a code as a whole number; raises ValueError when it is none."""
        return int(self.number(code, default))

    def name(self, code: int) -> str:
        """First value of a code as text."""
        return text_of(self.first(code))


def text_of(value: bytes) -> str:
    """Text of a value: UTF-8 since AutoCAD 2007, before that a code page, of which the Western one is tried."""
    try:
        return value.decode("utf-8").strip()
    except UnicodeDecodeError:
        return value.decode("cp1252", errors="replace").strip()


def read_groups(path: Path, progress: Progress) -> Iterator[Group]:
    """Read a drawing group by group.

    Parameters
    ----------
    path : DXF file, text or binary.
    progress : told the part of the file that is read; may raise to cancel.

    Raises
    ------
    FileFormatError
        the file is too large, no DXF, or ends before its end mark.
    """
    check_size(path, SIZE_LIMIT)
    try:
        with path.open("rb") as file:
            head = file.read(len(_BINARY))
            file.seek(0)
            tags = _binary_tags(path) if head == _BINARY else _text_tags(path, file, progress)
            yield from _groups(path, tags)
    except OSError as error:
        raise cannot_read(path, error) from error


def _groups(path: Path, tags: Iterator[tuple[int, int, bytes]]) -> Iterator[Group]:
    group: Group | None = None
    for line, code, value in tags:
        if code == 0:
            if group is not None:
                yield group
            group = Group(value.upper(), [], line)
            if group.kind == b"EOF":
                return
        elif group is None:
            if code != 999:
                raise FileFormatError(path, f"line {line}", f"begins with group code {code}", "a DXF drawing")
        elif code != 999:
            group.tags.append((code, value))
            if len(group.tags) > _TAG_LIMIT:
                kind = text_of(group.kind)
                raise FileFormatError(path, f"line {group.line}", f"{kind} has over {_TAG_LIMIT} values", "fewer")
    raise FileFormatError(path, "", "ends without the mark EOF", "a complete DXF drawing")


def _text_tags(path: Path, file: IO[bytes], progress: Progress) -> Iterator[tuple[int, int, bytes]]:
    """Line, code and value of each pair of a text file."""
    size = max(path.stat().st_size, 1)
    line, report_at, position = 1, 0, 0
    while code := file.readline(_LINE_LIMIT):
        value = file.readline(_LINE_LIMIT)
        position += len(code) + len(value)
        if position >= report_at:
            progress(min(position / size, 1.0), "reading the drawing")
            report_at = position + _BYTES_PER_REPORT
        try:
            number = int(code)
        except ValueError:
            found = repr(code[:20].strip().decode("latin-1"))
            raise FileFormatError(path, f"line {line}", f"is {found}", "a group code of a DXF drawing") from None
        if not -10 <= number <= 1100:
            raise FileFormatError(path, f"line {line}", f"group code is {number}", "-5 to 1071")
        if len(value) == _LINE_LIMIT:
            raise FileFormatError(path, f"line {line + 1}", f"is longer than {_LINE_LIMIT} bytes", "a DXF drawing")
        yield line, number, value.strip()
        line += 2


def _binary_tags(path: Path) -> Iterator[tuple[int, int, bytes]]:
    """Number, code and value of each pair of a binary file."""
    from ezdxf.lldxf.const import DXFError
    from ezdxf.lldxf.tagger import binary_tags_loader

    data = read_bytes(path, BINARY_LIMIT)
    try:
        for number, tag in enumerate(binary_tags_loader(data), start=1):
            value = tag.value
            yield number, tag.code, value if isinstance(value, bytes) else str(value).encode("utf-8", "replace")
    except (DXFError, ValueError, IndexError, TypeError, struct.error) as error:
        raise FileFormatError(path, "", f"is no binary DXF ({error})", "a complete DXF drawing") from error

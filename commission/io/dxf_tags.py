"""The lowest layer of DXF: pairs of group code and value, gathered into groups that begin with code 0.

ezdxf reads a whole document before it returns, 25 s for 200,000 entities, and cannot be stopped; a drawing is loaded as
a job with progress. So files are read here, group by group, and ezdxf is asked for what it knows better: binary files.
"""

from __future__ import annotations

import itertools
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import IO

from commission.errors import FileFormatError, reason_of
from commission.io.reading import cannot_read, check_size, read_bytes
from commission.progress import Progress

SIZE_LIMIT = 512_000_000
"""Bytes of a drawing: some 4,000,000 lines."""
BINARY_LIMIT = 64_000_000
"""Bytes of a binary drawing, which is held in memory as a whole."""
_BINARY = b"AutoCAD Binary DXF"
_DWG = b"AC10"
_LINE_LIMIT = 65_536
_TAG_LIMIT = 2_000_000
"""Pairs in one group: a polyline of about 700,000 points."""
_BYTES_PER_REPORT = 250_000

MODERN = ("utf-8", "cp1252")
"""Encodings of texts since AutoCAD 2007, and of drawings that do not say how old they are."""

Tag = tuple[int, bytes]


@dataclass(frozen=True, slots=True)
class DxfGroup:
    """One entity, table entry or section mark."""

    kind: bytes
    """What follows code 0: b"LINE", b"SECTION", ..."""
    tags: list[Tag]
    """The pairs behind it, without comments."""
    line: int
    """Line (from 1) of its code 0; in a binary file the number of the pair."""
    encodings: tuple[str, ...] = MODERN
    """How its texts may be encoded, the likeliest first."""

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
        return text_of(self.first(code), self.encodings)


def text_of(value: bytes, encodings: tuple[str, ...] = MODERN) -> str:
    r"""Text of a value; what older drawings write as \U+5899 or \M+1C7BD is the character that it stands for."""
    for encoding in encodings:
        try:
            text = value.decode(encoding)
            break
        except UnicodeDecodeError:
            continue
    else:
        text = value.decode("cp1252", errors="replace")
    if "\\U+" in text or "\\M+" in text:
        from ezdxf.lldxf.encoding import decode_dxf_unicode, decode_mif_to_unicode

        text = decode_mif_to_unicode(decode_dxf_unicode(text))
    return text.strip()


def encodings_of(header: DxfGroup) -> tuple[str, ...]:
    """Encodings of a drawing's texts by its header: UTF-8 since AutoCAD 2007 (AC1021), a code page before."""
    variables = {name: value for (code, name), (_, value) in itertools.pairwise(header.tags) if code == 9}
    version = text_of(variables.get(b"$ACADVER", b""))
    if version >= "AC1021" or not version.startswith("AC"):
        return MODERN
    from ezdxf.tools.codepage import toencoding

    page = text_of(variables.get(b"$DWGCODEPAGE", b""))
    # Many programs state the Western page and write UTF-8, which Western text hardly ever looks like by chance; other
    # pages are believed first.
    encoding = toencoding(page)
    return MODERN if encoding == "cp1252" else (encoding, *MODERN)


def read_groups(path: Path, progress: Progress) -> Iterator[DxfGroup]:
    """Read a drawing group by group.

    Parameters
    ----------
    path : DXF file, text or binary.
    progress : told the part of the file that is read; may raise to cancel.

    Raises
    ------
    FileFormatError
        the file is too large or no DXF. Whether it is complete is for the caller to see: the last group is then EOF.
    """
    check_size(path, SIZE_LIMIT)
    try:
        with path.open("rb") as file:
            head = file.read(len(_BINARY))
            file.seek(0)
            if head.startswith(_DWG):
                found = "is a DWG drawing, whatever its name says"
                raise FileFormatError(path, "", found, "the drawing saved as DXF (in the CAD program: Save as, DXF)")
            tags = _binary_tags(path) if head == _BINARY else _text_tags(path, file, progress)
            yield from _groups(path, tags)
    except OSError as error:
        raise cannot_read(path, error) from error


def _groups(path: Path, tags: Iterator[tuple[int, int, bytes]]) -> Iterator[DxfGroup]:
    group: DxfGroup | None = None
    encodings = MODERN
    for line, code, value in tags:
        if code == 0:
            if group is not None:
                if group.kind == b"SECTION" and group.first(2).upper() == b"HEADER":
                    encodings = encodings_of(group)
                yield group
            group = DxfGroup(value.upper(), [], line, encodings)
            if group.kind == b"EOF":
                yield group
                return
        elif group is None:
            if code != 999:
                raise FileFormatError(path, f"line {line}", f"begins with group code {code}", "a DXF drawing")
        elif code != 999:
            group.tags.append((code, value))
            if len(group.tags) > _TAG_LIMIT:
                kind = text_of(group.kind)
                raise FileFormatError(path, f"line {group.line}", f"{kind} has over {_TAG_LIMIT} values", "fewer")
    if group is not None:
        yield group


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
        raise FileFormatError(path, "", f"is no binary DXF ({reason_of(error)})", "a complete DXF drawing") from error

"""The lines of a journal: each is an entry with its number, behind a checksum. Written here, and found again in damage.

It knows no project: what an entry says is the business of `journal` and `journal_replay`.
"""

from __future__ import annotations

import json
import re
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

FORMAT = 2
"""Version of what is written."""
OLDEST_FORMAT = 1
"""Version that is still read: its lines have no numbers, and the first one holds the whole project."""

_START = re.compile(rb'[0-9a-f]{8} \{"line":')
_DECODER = json.JSONDecoder()


@dataclass(frozen=True, slots=True)
class LinePlace:
    """Where an intact line stands in a file."""

    offset: int
    """Bytes before it."""
    length: int
    """Its bytes, without what ends it."""
    number: int
    """What it says of itself; in a journal of the oldest format, which line of the file it is. The first is 1."""
    is_line: bool
    """Whether it is a line of the file as it was written, and not a part of a damaged one."""


@dataclass(frozen=True, slots=True)
class Lines:
    """What of a file is intact."""

    places: tuple[LinePlace, ...]
    """Intact lines, each number once, in the order of their numbers."""
    missing: tuple[int, ...]
    """Numbers of lines between the first and the last one that are not there."""
    is_whole: bool
    """Whether every byte of the file belongs to one of them, as it was written."""


def line(number: int, entry: dict[str, Any]) -> bytes:
    """Return an entry as it is written; `number` counts from 1.

    The checksum in front tells half a line, or one that a disk has mangled, from a whole one.
    """
    whole = {"line": number, **entry}
    text = json.dumps(whole, ensure_ascii=True, allow_nan=False, separators=(",", ":")).encode("ascii")
    return b"%08x %s\n" % (zlib.crc32(text), text)


def entry_of(data: bytes) -> dict[str, Any] | None:
    """Entry of a line without its end; None when it is damaged."""
    checksum, _, text = data.partition(b" ")
    if checksum != b"%08x" % zlib.crc32(text):
        return None
    try:
        entry = json.loads(text)
    except (ValueError, RecursionError):
        return None
    return entry if isinstance(entry, dict) else None


def intact_lines(file: IO[bytes]) -> Iterator[LinePlace]:
    """Find the intact lines of a file, in any order; what is between them is passed over."""
    offset = 0
    for position, data in enumerate(file, start=1):
        body = data.removesuffix(b"\n").removesuffix(b"\r")
        entry = entry_of(body)
        if entry is not None:
            yield LinePlace(offset, len(body), _number(entry, position), data == body + b"\n")
        else:
            yield from _in_damage(data, offset)
        offset += len(data)


def read_lines(path: Path) -> Lines:
    """Find what of a journal is intact; raises OSError when it cannot be read."""
    found: dict[int, LinePlace] = {}
    with path.open("rb") as file:
        for place in intact_lines(file):
            found.setdefault(place.number, place)
    places = tuple(found[number] for number in sorted(found))
    last = places[-1].number if places else 0
    missing = tuple(sorted(set(range(1, last + 1)) - found.keys()))
    size = sum(place.length + 1 for place in places if place.is_line)
    is_whole = not missing and size == path.stat().st_size
    return Lines(places, missing, is_whole)


def _in_damage(data: bytes, offset: int) -> Iterator[LinePlace]:
    """Intact lines in what is no line as a whole: what ends a line may be the one byte that was changed."""
    for match in _START.finditer(data):
        start, text = match.start(), match.start() + len(b"00000000 ")
        try:
            _, length = _DECODER.raw_decode(data[text:].decode("latin-1"))
        except (ValueError, RecursionError):
            continue
        body = data[start : text + length]
        entry = entry_of(body)
        if entry is not None:
            yield LinePlace(offset + start, len(body), _number(entry, 0), is_line=False)


def _number(entry: dict[str, Any], position: int) -> int:
    number = entry.get("line", position)
    return number if isinstance(number, int) and number > 0 else position

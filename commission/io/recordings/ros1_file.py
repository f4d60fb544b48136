"""Reading a bag of ROS 1 message by message, from its first byte to where it ends or was cut.

Format: wiki.ros.org/Bags/Format/2.0. The index at its end is not needed: a recorder that was stopped (`.bag.active`)
has written none. It knows records, chunks and connections, no message; nothing of it is in memory but one chunk.
"""

from __future__ import annotations

import bz2
import struct
from collections.abc import Iterator
from typing import IO

from commission.errors import FileFormatError
from commission.io.reading import cannot_read
from commission.io.recordings.mcap_reader import RECORD_LIMIT, McapChannel, Message, MessageFile

MAGIC = b"#ROSBAG V2.0\n"
_MESSAGE, _CHUNK, _CONNECTION = 2, 5, 7
_HEADER_LIMIT = 1_000_000
"""Bytes of the header of a record; it holds a few names and numbers."""


class Ros1File(MessageFile):
    """A bag of ROS 1; it has no summary, as its index may be missing."""

    def messages(self) -> Iterator[Message]:
        """Deliver every message as it was written, up to where the file is cut.

        Raises
        ------
        FileFormatError
            the file cannot be read, is no such bag, or a record is damaged: says at which byte.
        """
        self.is_cut = False
        try:
            with self.path.open("rb") as file:
                if file.read(len(MAGIC)) != MAGIC:
                    raise FileFormatError(self.path, "", "does not begin as a bag of ROS 1 does", "#ROSBAG V2.0")
                for begin, header, data in self._records(file):
                    yield from self._of_record(begin, header, data)
        except OSError as error:
            raise cannot_read(self.path, error) from error

    def _records(self, file: IO[bytes]) -> Iterator[tuple[int, bytes, bytes]]:
        """Where it begins, header and content of each record, up to the last whole one."""
        size = self.path.stat().st_size
        while (begin := file.tell()) < size:
            parts: list[bytes] = []
            for limit in (_HEADER_LIMIT, RECORD_LIMIT):
                length = file.read(4)
                count = struct.unpack("<I", length)[0] if len(length) == 4 else 0
                if count > limit:
                    raise self._error(begin, f"a record of {count} bytes", f"{limit} at most")
                parts.append(file.read(count))
                if len(length) < 4 or len(parts[-1]) < count:
                    self.is_cut = True
                    return
            yield begin, parts[0], parts[1]

    def _of_record(self, begin: int, header: bytes, data: bytes) -> Iterator[Message]:
        """Messages of a record: one, those of a chunk, or none."""
        try:
            fields = _fields(header)
            kind = fields.get(b"op", b"\0")[0]
            if kind == _CHUNK and not data:
                # A recorder says how long a chunk is when it is full.
                self.is_cut = True
            elif kind == _CHUNK:
                content = _unpacked(data, fields[b"compression"], struct.unpack("<I", fields[b"size"])[0])
                place = 0
                while place < len(content):
                    parts, place = _parts(content, place)
                    yield from self._of_record(begin, *parts)
            elif kind == _CONNECTION:
                self._connect(fields, _fields(data))
            elif kind == _MESSAGE:
                seconds, nanoseconds = struct.unpack("<II", fields[b"time"])
                channel = self.channels[struct.unpack("<I", fields[b"conn"])[0]]
                yield Message(channel, seconds * 1_000_000_000 + nanoseconds, data)
        except (struct.error, LookupError, ValueError, EOFError, RuntimeError) as error:
            raise self._error(begin, f"a damaged record ({error})", "a whole bag") from error

    def _connect(self, fields: dict[bytes, bytes], about: dict[bytes, bytes]) -> None:
        self.channels[struct.unpack("<I", fields[b"conn"])[0]] = McapChannel(
            topic=fields[b"topic"].decode("utf-8"),
            encoding="ros1",
            schema=about[b"type"].decode("utf-8"),
            schema_encoding="ros1msg",
            definition=about[b"message_definition"].decode("utf-8", errors="replace"),
        )

    def _error(self, offset: int, found: str, expected: str) -> FileFormatError:
        return FileFormatError(self.path, f"byte {offset}", f"is {found}", expected)


def _fields(header: bytes) -> dict[bytes, bytes]:
    """Fields of a header by their names; raises ValueError where they cannot be."""
    found: dict[bytes, bytes] = {}
    place = 0
    while place < len(header):
        length = struct.unpack_from("<I", header, place)[0]
        name, sign, value = header[place + 4 : place + 4 + length].partition(b"=")
        if not sign or place + 4 + length > len(header):
            raise ValueError("a field of a header is none")
        found[name] = value
        place += 4 + length
    return found


def _parts(content: bytes, place: int) -> tuple[tuple[bytes, bytes], int]:
    """Header and content of a record in a chunk, and where it ends; raises ValueError or struct.error."""
    parts: list[bytes] = []
    for _ in range(2):
        length = struct.unpack_from("<I", content, place)[0]
        parts.append(content[place + 4 : place + 4 + length])
        place += 4 + length
    if place > len(content):
        raise ValueError("a record is longer than its chunk")
    return (parts[0], parts[1]), place


def _unpacked(data: bytes, compression: bytes, size: int) -> bytes:
    """Return the content of a chunk; raises ValueError, EOFError or RuntimeError where it is damaged."""
    if size > RECORD_LIMIT:
        raise ValueError(f"a chunk of {size} bytes; expected {RECORD_LIMIT} at most")
    # No more is unpacked than is said: a few bytes could unpack into gigabytes.
    if compression == b"none":
        content = data
    elif compression == b"bz2":
        try:
            content = bz2.BZ2Decompressor().decompress(data, size + 1)
        except OSError as error:
            raise ValueError(str(error)) from error
    elif compression == b"lz4":
        from lz4.frame import LZ4FrameDecompressor  # pyright: ignore[reportMissingTypeStubs]

        content = LZ4FrameDecompressor().decompress(data, max_length=size + 1)
    else:
        raise ValueError(f"compression {compression!r}, which is not read")
    if len(content) != size:
        raise ValueError(f"a chunk unpacks into another size than {size} bytes")
    return content

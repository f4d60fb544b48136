"""Reading an MCAP file message by message, from its first byte to where it ends or was cut (mcap.dev/spec, version 0).

It knows records, chunks and channels, no message; nothing of it is in memory but one chunk.
"""

from __future__ import annotations

import struct
from binascii import crc32
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import IO

from commission.errors import FileFormatError
from commission.io.reading import cannot_read

MAGIC = b"\x89MCAP0\r\n"
HEADER, FOOTER, SCHEMA, CHANNEL, MESSAGE, CHUNK = 0x01, 0x02, 0x03, 0x04, 0x05, 0x06
MESSAGE_INDEX, CHUNK_INDEX, STATISTICS = 0x07, 0x08, 0x0B
METADATA, METADATA_INDEX, SUMMARY_OFFSET, DATA_END = 0x0C, 0x0D, 0x0E, 0x0F
RECORD_LIMIT = 256_000_000
"""Bytes of one record, a chunk unpacked included; writers make chunks of 1 to 10 MB."""
_HEADER = struct.Struct("<BQ")
_FOOTER_BYTES = 9 + 20 + len(MAGIC)


@dataclass(frozen=True, slots=True, kw_only=True)
class McapChannel:
    """One topic of a file."""

    topic: str
    """Its name."""
    encoding: str
    """How its messages are encoded: `cdr` for ROS 2, `ros1`, `json`."""
    schema: str
    """Name of the type of its messages."""
    schema_encoding: str
    """Language of the definition: `ros2msg`, `ros2idl`."""
    definition: str
    """Text that defines the type; empty where there is none."""


@dataclass(frozen=True, slots=True)
class Message:
    """One message, still encoded."""

    channel: McapChannel
    """Its topic."""
    log_time_ns: int
    """When it was recorded [ns]."""
    data: bytes
    """Its bytes."""


class MessageFile:
    """A file that is read message by message, from its begin.

    Parameters
    ----------
    path : where it is.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.channels: dict[int, McapChannel] = {}
        """What was announced so far, by number; all of it once `read_summary` found a summary."""
        self.counts: dict[int, int] = {}
        """Messages of each channel, where the file has a summary."""
        self.is_cut = False
        """Whether the file ends inside a record: its recorder was stopped."""

    def read_summary(self) -> bool:
        """Read channels and counts without the messages; returns False where nothing says them."""
        return False

    def messages(self) -> Iterator[Message]:
        """Deliver every message as it was written, up to where the file is cut.

        Raises
        ------
        FileFormatError
            the file cannot be read, is of another kind, or a record is damaged: says at which byte.
        """
        raise NotImplementedError


class McapFile(MessageFile):
    """An MCAP file."""

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        self._schemas: dict[int, tuple[str, str, str]] = {}

    def read_summary(self) -> bool:
        """Read channels and counts from the end of the file; returns False where there is no summary.

        Raises
        ------
        FileFormatError
            the file cannot be read, or is no MCAP.
        """
        with self._open() as file:
            size = self.path.stat().st_size
            if size < 2 * len(MAGIC) + _FOOTER_BYTES:
                return False
            file.seek(size - _FOOTER_BYTES)
            footer = file.read(_FOOTER_BYTES)
            kind, length = _HEADER.unpack_from(footer)
            start = struct.unpack_from("<Q", footer, 9)[0]
            if kind != FOOTER or length != 20 or footer[-len(MAGIC) :] != MAGIC or not 0 < start < size:
                return False
            file.seek(start)
            for kind, data in self._records(file):
                self.note(kind, data)
                if kind == FOOTER:
                    break
        return bool(self.channels)

    def messages(self) -> Iterator[Message]:
        """Deliver every message as it was written, up to where the file is cut.

        Raises
        ------
        FileFormatError
            the file cannot be read, is no MCAP, or a record is damaged: says at which byte.
        """
        with self._open() as file:
            for kind, data in self._records(file):
                if kind == CHUNK:
                    yield from self._of_chunk(data, file.tell())
                elif kind == MESSAGE:
                    yield self._message(data, file.tell())
                elif kind in (DATA_END, FOOTER):
                    return
                else:
                    self.note(kind, data)
            self.is_cut = True

    def _open(self) -> IO[bytes]:
        try:
            file = self.path.open("rb")
            if file.read(len(MAGIC)) != MAGIC:
                file.close()
                raise FileFormatError(self.path, "", "does not begin as MCAP does", "an MCAP file")
        except OSError as error:
            raise cannot_read(self.path, error) from error
        return file

    def _records(self, file: IO[bytes]) -> Iterator[tuple[int, bytes]]:
        """Kind and content of each record, up to the last whole one."""
        while len(header := file.read(_HEADER.size)) == _HEADER.size:
            kind, length = _HEADER.unpack(header)
            if kind == 0 or length > RECORD_LIMIT:
                found = f"a record of {length} bytes of kind {kind}"
                raise self._error(file.tell() - _HEADER.size, found, f"records of at most {RECORD_LIMIT} bytes")
            data = file.read(length)
            if len(data) < length:
                return
            yield kind, data

    def _of_chunk(self, data: bytes, offset: int) -> Iterator[Message]:
        """Messages of a chunk."""
        try:
            size, crc = struct.unpack_from("<QI", data, 16)
            compression, place = text_of(data, 28)
            packed = struct.unpack_from("<Q", data, place)[0]
            if size > RECORD_LIMIT or packed > len(data):
                raise self._error(offset, f"a chunk of {size} bytes", f"at most {RECORD_LIMIT} bytes")
            content = unpacked(data[place + 8 : place + 8 + packed], compression, size, crc)
        except (struct.error, ValueError, RuntimeError, EOFError) as error:
            raise self._error(offset, f"a damaged chunk ({error})", "a whole file") from error
        place = 0
        while place + _HEADER.size <= len(content):
            kind, length = _HEADER.unpack_from(content, place)
            place += _HEADER.size
            record = content[place : place + length]
            if len(record) < length:
                raise self._error(offset, "a record that is longer than its chunk", "a whole file")
            place += length
            if kind == MESSAGE:
                yield self._message(record, offset)
            else:
                self.note(kind, record)

    def _message(self, data: bytes, offset: int) -> Message:
        if len(data) < 22:
            raise self._error(offset, f"a message of {len(data)} bytes", "22 bytes or more")
        number, _, log_time, _ = struct.unpack_from("<HIQQ", data)
        channel = self.channels.get(number)
        if channel is None:
            raise self._error(offset, f"a message of channel {number}", "channels that are announced first")
        return Message(channel, log_time, data[22:])

    def note(self, kind: int, data: bytes) -> None:
        """Remember schemas, channels and counts; raises FileFormatError where the record is damaged."""
        try:
            if kind == SCHEMA:
                name, place = text_of(data, 2)
                encoding, place = text_of(data, place)
                definition, _ = text_of(data, place)
                self._schemas[struct.unpack_from("<H", data)[0]] = name, encoding, definition
            elif kind == CHANNEL:
                number, schema = struct.unpack_from("<HH", data)
                topic, place = text_of(data, 4)
                encoding, _ = text_of(data, place)
                name, language, definition = self._schemas.get(schema, ("", "", ""))
                self.channels[number] = McapChannel(
                    topic=topic, encoding=encoding, schema=name, schema_encoding=language, definition=definition
                )
            elif kind == STATISTICS:
                length = struct.unpack_from("<I", data, 42)[0]
                self.counts = dict(struct.iter_unpack("<HQ", data[46 : 46 + length]))
        except (struct.error, UnicodeDecodeError) as error:
            raise FileFormatError(self.path, "", f"has a damaged record ({error})", "a whole MCAP file") from error

    def _error(self, offset: int, found: str, expected: str) -> FileFormatError:
        return FileFormatError(self.path, f"byte {offset}", f"is {found}", expected)


def text_of(data: bytes, place: int) -> tuple[str, int]:
    """Return a text with its length before it, and where it ends; raises struct.error or UnicodeDecodeError."""
    length = struct.unpack_from("<I", data, place)[0]
    end = place + 4 + length
    if end > len(data):
        raise struct.error(f"a text of {length} bytes")
    return data[place + 4 : end].decode("utf-8"), end


def metadata_of(path: Path, data: bytes) -> tuple[str, dict[str, str]]:
    """Return the name and the texts of a record of metadata; raises FileFormatError, naming the path."""
    try:
        name, place = text_of(data, 0)
        end = place + 4 + struct.unpack_from("<I", data, place)[0]
        place, values = place + 4, dict[str, str]()
        while place < min(end, len(data)):
            key, place = text_of(data, place)
            values[key], place = text_of(data, place)
    except (struct.error, UnicodeDecodeError) as error:
        raise FileFormatError(path, "", f"has damaged metadata ({error})", "a whole MCAP file") from error
    return name, values


def unpacked(data: bytes, compression: str, size: int, crc: int) -> bytes:
    """Return the content of a chunk.

    Parameters
    ----------
    data : as it is packed.
    compression : `lz4`, `zstd`, or nothing.
    size, crc : bytes of the content, and its checksum; 0: none.

    Raises
    ------
    ValueError, RuntimeError, EOFError
        it is damaged, or packed in another way.
    """
    if not compression:
        if len(data) != size:
            raise ValueError(f"{len(data)} bytes where {size} are said")
        return _checked(data, crc)
    # No more is unpacked than is said: a few bytes could unpack into gigabytes.
    if compression == "lz4":
        from lz4.frame import LZ4FrameDecompressor  # pyright: ignore[reportMissingTypeStubs]

        content = LZ4FrameDecompressor().decompress(data, max_length=size + 1)
    elif compression == "zstd":
        from rosbags.rosbag2.storage_mcap import zstd

        try:
            content = zstd.ZstdDecompressor().decompress(data, max_length=size + 1)
        except zstd.ZstdError as error:
            raise ValueError(str(error)) from error
    else:
        raise ValueError(f"compression {compression!r}, which is not read")
    if len(content) != size:
        raise ValueError(f"it unpacks into another size than {size} bytes")
    return _checked(content, crc)


def _checked(content: bytes, crc: int) -> bytes:
    if crc and crc32(content) != crc:
        raise ValueError("its checksum is another")
    return content

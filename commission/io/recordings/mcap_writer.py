"""Writing an MCAP file message by message (mcap.dev/spec, version 0): chunks with their index, a summary at the end.

A chunk goes to the disk whole, in one write: whatever stops the program leaves a file that is readable up to its last
whole chunk. It knows topics and types, no message. Nothing is in memory but the chunks that are being filled.
"""

from __future__ import annotations

import struct
from binascii import crc32
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO

from commission.io.atomic import cannot_write
from commission.io.recordings import mcap_reader as mcap

_LIBRARY = "commission"
_PROFILE = "ros2"
_MESSAGE = struct.Struct("<BQHIQQ")
_MESSAGE_BYTES = 22
"""Bytes of a message before its data."""


@dataclass(slots=True, kw_only=True)
class _Chunk:
    """Messages on their way into the file."""

    compression: str
    """How it is packed: `lz4`, or nothing."""
    content: bytearray = field(default_factory=bytearray)
    """Records of the messages."""
    places: dict[int, list[tuple[int, int]]] = field(default_factory=dict[int, list[tuple[int, int]]])
    """Time [ns] and offset of each message of each channel."""
    begin_ns: int = 0
    """Earliest time [ns]."""
    end_ns: int = 0
    """Latest time [ns]."""


class McapWriter:
    """An MCAP file that is being written.

    Parameters
    ----------
    path : its name, for messages.
    file : open for writing, empty.
    chunk_bytes, chunk_ns : a chunk is written when it holds so many bytes, or when its messages span such a time [ns].
    """

    def __init__(
        self, path: Path, file: IO[bytes], *, chunk_bytes: int = 1_000_000, chunk_ns: int = 1_000_000_000
    ) -> None:
        self.path = path
        self.written = 0
        """Bytes in the file."""
        self._file = file
        self._chunk_bytes = chunk_bytes
        self._chunk_ns = chunk_ns
        self._schemas: dict[str, bytes] = {}
        self._channels: list[bytes] = []
        self._counts: list[int] = []
        self._waiting: dict[str, _Chunk] = {}
        self._chunks: list[bytes] = []
        self._span_ns: tuple[int, int] | None = None
        self._metadata: list[bytes] = []
        self._write(mcap.MAGIC + _record(mcap.HEADER, _text(_PROFILE) + _text(_LIBRARY)))

    def add_metadata(self, name: str, values: dict[str, str]) -> None:
        """Write texts that say something about the whole file.

        Parameters
        ----------
        name : of all of them.
        values : by their keys.
        """
        record = _record(mcap.METADATA, _text(name) + _map(values))
        self._metadata.append(struct.pack("<QQ", self.written, len(record)) + _text(name))
        self._write(record)

    def add_channel(self, topic: str, schema: str, definition: str) -> int:
        """Announce a topic; returns its number.

        Parameters
        ----------
        topic : its name.
        schema : name of the type of its messages: `sensor_msgs/msg/LaserScan`.
        definition : what the type is, in the language of ROS 2 messages.
        """
        if schema not in self._schemas:
            number = struct.pack("<H", len(self._schemas) + 1)
            body = number + _text(schema) + _text("ros2msg") + _text(definition)
            self._schemas[schema] = _record(mcap.SCHEMA, body)
            self._write(self._schemas[schema])
        channel = len(self._channels)
        schema_number = list(self._schemas).index(schema) + 1
        numbers = struct.pack("<HH", channel, schema_number)
        self._channels.append(_record(mcap.CHANNEL, numbers + _text(topic) + _text("cdr") + _map({})))
        self._counts.append(0)
        self._write(self._channels[-1])
        return channel

    def add_message(self, channel: int, time_ns: int, data: bytes, *, compression: str = "") -> None:
        """Add a message; it is in the file when its chunk is full.

        Parameters
        ----------
        channel : number of its topic.
        time_ns : when it was recorded [ns], 0 or more.
        data : its bytes.
        compression : of its chunk: `lz4`, or nothing; those of one kind go into one chunk.
        """
        chunk = self._waiting.get(compression)
        if chunk is not None and abs(time_ns - chunk.begin_ns) >= self._chunk_ns:
            # All kinds together, so that a file that is cut ends at one time.
            self.flush()
            chunk = None
        if chunk is None:
            chunk = self._waiting[compression] = _Chunk(compression=compression, begin_ns=time_ns, end_ns=time_ns)
        chunk.begin_ns, chunk.end_ns = min(chunk.begin_ns, time_ns), max(chunk.end_ns, time_ns)
        chunk.places.setdefault(channel, []).append((time_ns, len(chunk.content)))
        sequence = self._counts[channel] & 0xFFFFFFFF
        chunk.content += _MESSAGE.pack(mcap.MESSAGE, _MESSAGE_BYTES + len(data), channel, sequence, time_ns, time_ns)
        chunk.content += data
        self._counts[channel] += 1
        if len(chunk.content) >= self._chunk_bytes:
            self._write_chunk(self._waiting.pop(compression))

    def flush(self) -> None:
        """Write what waits."""
        for compression in list(self._waiting):
            self._write_chunk(self._waiting.pop(compression))

    def finish(self) -> None:
        """Write what waits, and the summary by which the file is opened without reading it through."""
        self.flush()
        self._write(_record(mcap.DATA_END, struct.pack("<I", 0)))
        start = self.written
        groups = (
            (mcap.SCHEMA, list(self._schemas.values())),
            (mcap.CHANNEL, self._channels),
            (mcap.STATISTICS, [_record(mcap.STATISTICS, self._statistics())]),
            (mcap.CHUNK_INDEX, [_record(mcap.CHUNK_INDEX, each) for each in self._chunks]),
            (mcap.METADATA_INDEX, [_record(mcap.METADATA_INDEX, each) for each in self._metadata]),
        )
        offsets: list[bytes] = []
        summary = bytearray()
        for kind, records in groups:
            if records:
                begin = start + len(summary)
                summary += b"".join(records)
                place = struct.pack("<BQQ", kind, begin, start + len(summary) - begin)
                offsets.append(_record(mcap.SUMMARY_OFFSET, place))
        offset_start = start + len(summary)
        summary += b"".join(offsets)
        # The checksum covers the footer up to where it stands itself.
        summary += struct.pack("<BQQQ", mcap.FOOTER, 20, start, offset_start)
        self._write(bytes(summary) + struct.pack("<I", crc32(summary)) + mcap.MAGIC)

    def _statistics(self) -> bytes:
        counts = b"".join(struct.pack("<HQ", channel, count) for channel, count in enumerate(self._counts))
        numbers = struct.pack(
            "<QHIIII",
            sum(self._counts),
            len(self._schemas),
            len(self._channels),
            0,
            len(self._metadata),
            len(self._chunks),
        )
        return numbers + struct.pack("<QQI", *(self._span_ns or (0, 0)), len(counts)) + counts

    def _write_chunk(self, chunk: _Chunk) -> None:
        """Write a chunk and, behind it, where in it the messages of each channel are."""
        content = bytes(chunk.content)
        packed = _packed(content, chunk.compression)
        head = struct.pack("<QQQI", chunk.begin_ns, chunk.end_ns, len(content), crc32(content))
        body = head + _text(chunk.compression) + struct.pack("<Q", len(packed)) + packed
        record = _record(mcap.CHUNK, body)
        offset, places, index = self.written, bytearray(), bytearray()
        for channel, of_channel in chunk.places.items():
            places += struct.pack("<HQ", channel, offset + len(record) + len(index))
            entries = b"".join(struct.pack("<QQ", time, place) for time, place in of_channel)
            index += _record(mcap.MESSAGE_INDEX, struct.pack("<HI", channel, len(entries)) + entries)
        self._write(record + index)
        span = self._span_ns or (chunk.begin_ns, chunk.end_ns)
        self._span_ns = min(span[0], chunk.begin_ns), max(span[1], chunk.end_ns)
        self._chunks.append(
            struct.pack("<QQQQI", chunk.begin_ns, chunk.end_ns, offset, len(record), len(places))
            + places
            + struct.pack("<Q", len(index))
            + _text(chunk.compression)
            + struct.pack("<QQ", len(packed), len(content))
        )

    def _write(self, data: bytes | bytearray) -> None:
        try:
            self._file.write(data)
            self._file.flush()
        except OSError as error:
            raise cannot_write(self.path, error) from error
        self.written += len(data)


def _record(kind: int, body: bytes) -> bytes:
    return struct.pack("<BQ", kind, len(body)) + body


def _text(text: str) -> bytes:
    data = text.encode("utf-8")
    return struct.pack("<I", len(data)) + data


def _map(values: dict[str, str]) -> bytes:
    body = b"".join(_text(key) + _text(value) for key, value in values.items())
    return struct.pack("<I", len(body)) + body


def _packed(content: bytes, compression: str) -> bytes:
    if not compression:
        return content
    from lz4 import frame  # pyright: ignore[reportMissingTypeStubs]

    return frame.compress(content)

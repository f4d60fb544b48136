"""Where each message of an MCAP file is, found without reading messages; a chunk is unpacked when it is asked for.

Files that were cut have no summary; all the same they have, behind each chunk, what is in it. So no summary is read.
"""

from __future__ import annotations

import struct
import threading
import weakref
from collections import OrderedDict
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO

import numpy as np
from numpy.typing import NDArray

from commission.errors import FileFormatError
from commission.geometry.arrays import Growing
from commission.io.reading import cannot_read
from commission.io.recordings import mcap_reader as mcap

_RECORD = struct.Struct("<BQ")
_ENTRY = np.dtype([("time", "<u8"), ("offset", "<u8")])
_KEPT = 3
"""Chunks that stay unpacked: those of scans and of the rest at one time, and the next one."""
CHUNK_LIMIT = 2**31
"""Bytes of a chunk unpacked, at most: places in it have 32 bits."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ChunkPlace:
    """A chunk in the file."""

    begin: int
    """Offset of its content, packed as it is [bytes]."""
    packed: int
    """Size of that [bytes]."""
    unpacked: int
    """Size of the content [bytes]."""
    crc: int
    """Checksum of the content; 0: none."""
    compression: str
    """How it is packed."""


@dataclass(frozen=True, slots=True, eq=False)
class MessagePlaces:
    """Where the messages of one channel are, in the order of the file."""

    chunks: NDArray[np.int32]
    """(N,) index of the chunk of each."""
    offsets: NDArray[np.int32]
    """(N,) offset of its record in the unpacked chunk [bytes]."""


@dataclass(slots=True)
class _Found:
    """Places while they are being found."""

    chunks: Growing[np.int32] = field(default_factory=lambda: Growing(np.int32))
    offsets: Growing[np.int32] = field(default_factory=lambda: Growing(np.int32))


class McapIndex:
    """An MCAP file with the places of its messages; read by several threads.

    Parameters
    ----------
    path : where it is.

    Raises
    ------
    FileFormatError
        the file cannot be read, is no MCAP, or a record is damaged: says at which byte.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.is_cut = False
        """Whether the file ends inside a record: its recorder was stopped."""
        self.has_loose_messages = False
        """Whether messages stand outside of chunks; those have no place here."""
        self.chunks: list[ChunkPlace] = []
        """All whole chunks."""
        self.metadata: dict[str, dict[str, str]] = {}
        """Texts about the whole file, by the name of their group."""
        self.announced = mcap.McapFile(path)
        """Its channels."""
        self._found: dict[int, _Found] = {}
        self._kept: OrderedDict[int, bytes] = OrderedDict()
        self._lock = threading.Lock()
        try:
            self._file: IO[bytes] = path.open("rb")
            weakref.finalize(self, self._file.close)
            self._size = path.stat().st_size
            self._read_through()
        except OSError as error:
            raise cannot_read(path, error) from error
        if any(channel not in self.announced.channels for channel in self._found):
            self._announce_what_chunks_hold()
        self.places = {
            channel: MessagePlaces(found.chunks.array(), found.offsets.array())
            for channel, found in self._found.items()
        }
        """Places of the messages of each channel, by its number."""
        del self._found

    def channels_of(self, topic: str) -> tuple[int, ...]:
        """Numbers of the channels of a topic that have messages."""
        return tuple(n for n, channel in self.announced.channels.items() if channel.topic == topic and n in self.places)

    def content(self, chunk: int, *, is_checked: bool = True) -> bytes:
        """Return the records of a chunk, unpacked.

        Parameters
        ----------
        chunk : its index.
        is_checked : whether its checksum is; without, it does not stay at hand.

        Raises
        ------
        FileFormatError
            it is damaged.
        """
        with self._lock:
            if chunk in self._kept:
                self._kept.move_to_end(chunk)
                return self._kept[chunk]
            place = self.chunks[chunk]
            try:
                self._file.seek(place.begin)
                data = self._file.read(place.packed)
            except OSError as error:
                raise cannot_read(self.path, error) from error
            try:
                if len(data) != place.packed:
                    raise ValueError("it ends early")
                content = mcap.unpacked(data, place.compression, place.unpacked, place.crc if is_checked else 0)
            except (ValueError, RuntimeError, EOFError) as error:
                raise self.error(place.begin, f"a damaged chunk ({error})", "a whole file") from error
            if not is_checked:
                return content
            self._kept[chunk] = content
            while len(self._kept) > _KEPT:
                self._kept.popitem(last=False)
            return content

    def error(self, offset: int, found: str, expected: str) -> FileFormatError:
        """Return the error about something in the file.

        Parameters
        ----------
        offset : where it is [bytes].
        found, expected : what was found, and what is expected.
        """
        return FileFormatError(self.path, f"byte {offset}", f"is {found}", expected)

    def _read_through(self) -> None:
        """Go from record to record of the file, over what the chunks hold."""
        if self._file.read(len(mcap.MAGIC)) != mcap.MAGIC:
            raise FileFormatError(self.path, "", "does not begin as MCAP does", "an MCAP file")
        place, unindexed = len(mcap.MAGIC), False
        while len(header := self._file.read(_RECORD.size)) == _RECORD.size:
            kind, length = _RECORD.unpack(header)
            begin, place = place + _RECORD.size, place + _RECORD.size + length
            if kind == 0 or length > mcap.RECORD_LIMIT:
                found = f"a record of {length} bytes of kind {kind}"
                raise self.error(begin - _RECORD.size, found, f"records of at most {mcap.RECORD_LIMIT} bytes")
            if place > self._size:
                break
            if unindexed and kind != mcap.MESSAGE_INDEX:
                self._walk(len(self.chunks) - 1)
                self._file.seek(begin)
            unindexed = kind == mcap.CHUNK or (unindexed and kind != mcap.MESSAGE_INDEX)
            if kind == mcap.CHUNK:
                self._note_chunk(begin, length)
            elif kind == mcap.MESSAGE_INDEX:
                self._note_index(self._file.read(length), begin)
            elif kind == mcap.MESSAGE:
                self.has_loose_messages = True
            elif kind == mcap.METADATA:
                name, values = mcap.metadata_of(self.path, self._file.read(length))
                self.metadata[name] = values
            elif kind in (mcap.SCHEMA, mcap.CHANNEL):
                self.announced.note(kind, self._file.read(length))
            elif kind in (mcap.DATA_END, mcap.FOOTER):
                return
            self._file.seek(place)
        self.is_cut = True
        if self.chunks:
            # The index of the last chunk may be cut, too.
            self._forget_last_chunk()
            self._walk(len(self.chunks) - 1)

    def _note_chunk(self, begin: int, length: int) -> None:
        head = self._file.read(min(length, 100))
        try:
            size, crc = struct.unpack_from("<QI", head, 16)
            compression, place = mcap.text_of(head, 28)
            packed = struct.unpack_from("<Q", head, place)[0]
        except (struct.error, UnicodeDecodeError) as error:
            raise self.error(begin, f"a damaged chunk ({error})", "a whole file") from error
        if size > mcap.RECORD_LIMIT or place + 8 + packed != length:
            raise self.error(begin, f"a chunk of {size} bytes, packed {packed}", "a whole file")
        content = ChunkPlace(begin=begin + place + 8, packed=packed, unpacked=size, crc=crc, compression=compression)
        self.chunks.append(content)

    def _note_index(self, data: bytes, begin: int) -> None:
        """Take the index of one channel in the last chunk."""
        if not self.chunks or len(data) < 6 or (len(data) - 6) % _ENTRY.itemsize:
            raise self.error(begin, f"an index of {len(data)} bytes", "the places of messages of a chunk")
        entries = np.frombuffer(data, _ENTRY, offset=6)
        size = self.chunks[-1].unpacked
        if len(entries) and int(entries["offset"].max()) + _RECORD.size > size:
            raise self.error(begin, f"an index beyond the {size} bytes of its chunk", "a whole file")
        channel = struct.unpack_from("<H", data)[0]
        # A writer may list messages by their times; they are read as they lie.
        self._add(channel, np.sort(entries["offset"]).astype(np.int32))

    def _walk(self, chunk: int, *, is_indexed: bool = False) -> None:
        """Find what is announced in a chunk, and its messages where no index says where they are."""
        content, place = self.content(chunk), 0
        offsets: dict[int, list[int]] = {}
        while place + _RECORD.size <= len(content):
            kind, length = _RECORD.unpack_from(content, place)
            end = place + _RECORD.size + length
            if kind == mcap.MESSAGE and length >= 22 and end <= len(content):
                channel = struct.unpack_from("<H", content, place + _RECORD.size)[0]
                offsets.setdefault(channel, []).append(place)
            elif kind in (mcap.SCHEMA, mcap.CHANNEL):
                self.announced.note(kind, content[place + _RECORD.size : end])
            place = end
        if not is_indexed:
            for channel, found in offsets.items():
                self._add(channel, np.array(found, np.int32))

    def _announce_what_chunks_hold(self) -> None:
        """Find channels that are announced in chunks only: in the summary, else in the chunk of their first message."""
        if self.announced.read_summary():
            return
        for channel, found in list(self._found.items()):
            chunks = found.chunks.array()
            if channel not in self.announced.channels and len(chunks):
                self._walk(int(chunks[0]), is_indexed=True)

    def _add(self, channel: int, offsets: NDArray[np.int32]) -> None:
        found = self._found.setdefault(channel, _Found())
        found.chunks.append(np.full(len(offsets), len(self.chunks) - 1, np.int32))
        found.offsets.append(offsets)

    def _forget_last_chunk(self) -> None:
        """Take back what the index of the last chunk said."""
        last = len(self.chunks) - 1
        for channel, found in list(self._found.items()):
            chunks, offsets = found.chunks.array(), found.offsets.array()
            before = int(np.searchsorted(chunks, last))
            self._found[channel] = fresh = _Found()
            fresh.chunks.append(chunks[:before])
            fresh.offsets.append(offsets[:before])

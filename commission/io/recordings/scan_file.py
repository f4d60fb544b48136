"""Scans that stay in their `scans.npz` and are read from it in blocks, anywhere, in memory that does not grow.

What is stored is read where it lies; what is compressed is unpacked once, in blocks, into a temporary file that the
system removes with the program. Stamps, angles and numbers of beams are in memory.
"""

from __future__ import annotations

import tempfile
import threading
import weakref
import zipfile
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from commission.errors import FileFormatError
from commission.geometry.arrays import FloatArray, Growing, IntArray
from commission.io.reading import cannot_read
from commission.io.recordings.scan_archive import BYTES_AT_ONCE, ROWS, ScanArchive
from commission.site.record_store import ScanLog, ScanStore
from commission.site.records import Scan

_LOCAL_HEADER = 30
"""Bytes of the fixed part of the header before each member of a zip; the lengths of name and extra field end it."""


IN_MEMORY = 64_000_000
"""Bytes of scans that are kept in memory; those of a larger recording stay in the file."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class ScanFile:
    """The scans of an archive; a `ScanStore`."""

    archive: ScanArchive
    """Where they are; checked from its first to its last scan."""
    places: dict[str, ArrayPlace]
    """Where the rows of each array begin."""
    stamps_ns: IntArray
    """(K,) time of each scan [ns]."""
    angle_min: FloatArray
    """(K,) bearing of the first beam of each scan [rad], scanner frame."""
    angle_increment: FloatArray
    """(K,) bearing step from beam to beam of each scan [rad]."""
    beams: IntArray
    """(K,) number of beams of each scan."""
    scanner: int = 0
    """Which scanner: index into the names that the log has."""

    def __len__(self) -> int:
        """Return the number of scans."""
        return len(self.stamps_ns)

    def block(self, first: int, last: int) -> ScanLog:
        """Return the scans from `first` to before `last`; raises FileFormatError when the file is no longer there."""
        last = max(first, last)
        rows = {name: self._read(name, first, last - first) for name in self.places}
        part = slice(first, last)
        small = {
            "stamp_ns": self.stamps_ns[part],
            "angle_min": self.angle_min[part],
            "angle_increment": self.angle_increment[part],
            "beams": self.beams[part],
        }
        return replace(self.archive.scan_log(rows | small, first), scanner=self.scanner)

    def chosen(self, indices: IntArray) -> ScanLog:
        """Return some scans."""
        return joined_scans([self.block(index, index + 1) for index in indices.tolist()])

    def scan(self, index: int) -> Scan:
        """Return one scan, as long as it was."""
        return self.block(index, index + 1).scan(0)

    def _read(self, name: str, first: int, count: int) -> NDArray[Any]:
        place, column = self.places[name], self.archive.columns[name]
        begin, size = place.begin + first * column.row_bytes, count * column.row_bytes
        try:
            data = place.read(begin, size)
        except OSError as error:
            raise cannot_read(self.archive.path, error) from error
        if len(data) != size:
            raise FileFormatError(self.archive.path, f"array {name}", "ends early", "the file as it was when opened")
        return np.frombuffer(data, column.dtype).reshape(count, *column.shape[1:])


@dataclass(frozen=True, slots=True, eq=False, weakref_slot=True)
class ArrayPlace:
    """Where the rows of an array lie: a file of its own that stays open, read by several threads."""

    begin: int
    """Offset of the first row in the file [bytes]."""
    file: IO[bytes]
    """The archive as it was when opened, though another one replaces it; or the unpacked temporary file."""
    lock: threading.Lock = field(default_factory=threading.Lock)
    """Held from seek to read: jobs and the page read at once, and a file has one position."""

    def __post_init__(self) -> None:
        weakref.finalize(self, self.file.close)

    def read(self, begin: int, size: int) -> bytes:
        """Return some bytes, fewer when the file ends early; raises OSError."""
        with self.lock:
            self.file.seek(begin)
            return self.file.read(size)


def array_place(archive: ScanArchive, zipped: zipfile.ZipFile, name: str) -> ArrayPlace:
    """Find the rows of an array, and unpack them where they are compressed.

    Parameters
    ----------
    archive : whose array it is.
    zipped : the same file, open.
    name : of the array.

    Raises
    ------
    OSError
        what is unpacked finds no room on the disk.
    """
    info = zipped.getinfo(f"{name}.npy")
    column = archive.columns[name]
    size = column.row_bytes * column.shape[0]
    if not archive.is_as_stored(name):
        return ArrayPlace(0, archive.rows_of(zipped, name))
    if info.compress_type == zipfile.ZIP_STORED:
        with archive.path.open("rb") as file:
            file.seek(info.header_offset)
            fixed = file.read(_LOCAL_HEADER)
        variable = int.from_bytes(fixed[26:28], "little") + int.from_bytes(fixed[28:30], "little")
        begin = info.header_offset + _LOCAL_HEADER + variable + info.file_size - size
        return ArrayPlace(begin, archive.path.open("rb"))
    unpacked = tempfile.TemporaryFile()
    with zipped.open(info) as member:
        member.read(info.file_size - size)
        while data := member.read(BYTES_AT_ONCE):
            unpacked.write(data)
    unpacked.flush()
    return ArrayPlace(0, unpacked)


def joined_scans(blocks: Sequence[ScanLog]) -> ScanLog:
    """Return blocks of one scanner as one; at least one block."""

    def column(name: str) -> Any:
        parts = [getattr(block, name) for block in blocks]
        return None if parts[0] is None else np.concatenate(parts)

    return ScanLog(
        stamps_ns=column("stamps_ns"),
        ranges=column("ranges"),
        angle_min=column("angle_min"),
        angle_increment=column("angle_increment"),
        beams=column("beams"),
        intensities=column("intensities"),
        reflector=column("reflector"),
        scanner=blocks[0].scanner,
    )


def load_scans(archive: ScanArchive, scanner: int = 0) -> ScanStore | None:
    """Check all scans of an archive, and keep them in memory or in the file, by their size; None when there are none.

    Parameters
    ----------
    archive : where they are.
    scanner : which scanner they are of: index into the names that the log has.

    Raises
    ------
    FileFormatError
        as `ScanArchive.blocks`, or what is compressed finds no room on the disk.
    """
    if len(archive) == 0:
        return None
    if sum(len(archive) * column.row_bytes for column in archive.columns.values()) <= IN_MEMORY:
        return replace(joined_scans(list(archive.blocks())), scanner=scanner)
    stamps = Growing(np.int64)
    for block in archive.blocks():
        stamps.append(block.stamps_ns)
    with archive.open() as zipped:
        places = {name: array_place(archive, zipped, name) for name in ROWS if name in archive.columns}
    return ScanFile(
        archive=archive,
        places=places,
        stamps_ns=stamps.array(),
        angle_min=archive.angle_min,
        angle_increment=archive.angle_increment,
        beams=archive.beams,
        scanner=scanner,
    )

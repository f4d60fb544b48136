"""The file `scans.npz` of a CSV folder: a zip of numpy arrays, read row by row from the zip. No pickles, ever.

`numpy.load` would unpack whole arrays; a recording of six hours has gigabytes of them.
"""

from __future__ import annotations

import math
import struct
import zipfile
import zlib
from collections.abc import Generator, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

from commission.errors import FileFormatError
from commission.io.reading import cannot_read, check_size
from commission.site.quantity import STAMP_LIMIT
from commission.site.record_log import ScanLog

BEAM_LIMIT = 100_000
"""Beams in one scan."""
LOAD_LIMIT = 16_000_000_000
"""Bytes of scans that `load` unpacks; a larger recording is read scan by scan."""
BOMB_SIZE = 256_000_000
"""Unpacked bytes from which an archive is suspected: no harm is done by less."""
BOMB_RATIO = 200
"""Unpacked bytes for each packed one that no suspected archive may reach. Deflate ends at 1032; scans that saw next to
nothing, 1,000 beams of which 20 came back, reach 40."""
_FILE_LIMIT = 1_000_000_000_000
_BYTES_AT_ONCE = 4_000_000
_GARBAGE = (zipfile.BadZipFile, zlib.error, EOFError, ValueError, struct.error, NotImplementedError, RuntimeError)
"""What zipfile and numpy raise for files that end early or were never a zip (an encrypted one: RuntimeError)."""


@dataclass(frozen=True, slots=True)
class _Column:
    """One array of the archive, still packed."""

    name: str
    shape: tuple[int, ...]
    dtype: np.dtype[Any]

    @property
    def row_bytes(self) -> int:
        return math.prod(self.shape[1:]) * self.dtype.itemsize


class ScanArchive:
    """A `scans.npz`; its headers are checked when it is opened."""

    def __init__(self, path: Path) -> None:
        """Open the archive.

        Parameters
        ----------
        path : the file.

        Raises
        ------
        FileFormatError
            no zip, an array missing or of wrong type or shape, or a pickled array.
        """
        check_size(path, _FILE_LIMIT)
        self.path = path
        with self._open() as archive:
            members = set(archive.namelist())
            self._refuse_bomb(archive)
            self._columns = {
                name: self._header(archive, name)
                for name in ("stamp_ns", "ranges", "angle_min", "angle_increment", "intensities", "reflector")
                if f"{name}.npy" in members
            }
            self._check_columns()
            self.angle_min = self._scalar(archive, "angle_min")
            self.angle_increment = self._scalar(archive, "angle_increment")
        if self.angle_increment == 0.0:
            raise self._error("angle_increment", "is 0", "the step from beam to beam [rad]")

    def __len__(self) -> int:
        """Return the number of scans."""
        return self._columns["stamp_ns"].shape[0]

    def blocks(self) -> Iterator[ScanLog]:
        """Read some scans at a time; memory does not grow with the file.

        Raises
        ------
        FileFormatError
            the archive ends early, stamps do not ascend, or a range is negative.
        """
        rows_at_once = max(1, _BYTES_AT_ONCE // max(1, sum(c.row_bytes for c in self._columns.values())))
        names = [name for name in self._columns if name not in ("angle_min", "angle_increment")]
        last_stamp: int | None = None
        with self._open() as archive, ExitStack() as stack:
            files = {name: stack.enter_context(archive.open(f"{name}.npy")) for name in names}
            for file in files.values():
                _read_header(file)
            for start in range(0, len(self), rows_at_once):
                count = min(rows_at_once, len(self) - start)
                block = self._scan_log({name: self._rows(files[name], name, count) for name in names}, start)
                self._check_order(block, start, last_stamp)
                last_stamp = int(block.stamps_ns[-1])
                yield block

    def load(self) -> ScanLog | None:
        """Read all scans; None when there are none."""
        if len(self) == 0:
            return None
        total = len(self) * sum(c.row_bytes for c in self._columns.values())
        if total > LOAD_LIMIT:
            raise self._error("ranges", f"need {total} bytes", f"at most {LOAD_LIMIT} bytes to load at once")
        shape = self._columns["ranges"].shape
        log = ScanLog(
            stamps_ns=np.empty(len(self), np.int64),
            ranges=np.empty(shape, np.float32),
            angle_min=self.angle_min,
            angle_increment=self.angle_increment,
            intensities=np.empty(shape, np.float32) if "intensities" in self._columns else None,
            reflector=np.empty(shape, np.bool_) if "reflector" in self._columns else None,
        )
        start = 0
        for block in self.blocks():
            rows = slice(start, start + len(block.stamps_ns))
            for name in ("stamps_ns", "ranges", "intensities", "reflector"):
                if getattr(log, name) is not None:
                    getattr(log, name)[rows] = getattr(block, name)
            start = rows.stop
        return log

    @contextmanager
    def _open(self) -> Generator[zipfile.ZipFile]:
        try:
            with zipfile.ZipFile(self.path) as archive:
                yield archive
        except OSError as error:
            raise cannot_read(self.path, error) from error
        except _GARBAGE as error:
            raise FileFormatError(self.path, "", f"is damaged ({error})", "a complete npz archive") from error

    def _refuse_bomb(self, archive: zipfile.ZipFile) -> None:
        """Refuse an archive that would unpack into far more than it is, before anything is unpacked."""
        unpacked = sum(info.file_size for info in archive.infolist())
        packed = self.path.stat().st_size
        if unpacked > BOMB_SIZE and unpacked > BOMB_RATIO * packed:
            found = f"would unpack {packed} bytes into {unpacked}"
            raise FileFormatError(self.path, "", found, f"at most {BOMB_RATIO} times its size: real scans have noise")

    def _header(self, archive: zipfile.ZipFile, name: str) -> _Column:
        info = archive.getinfo(f"{name}.npy")
        with archive.open(info) as file:
            try:
                shape, fortran_order, dtype = _read_header(file)
            except _GARBAGE as error:
                raise self._error(name, f"is no array ({error})", "a plain numpy array") from error
            if dtype.hasobject:
                raise self._error(name, "is pickled", "plain numbers; pickles are not read, they could run programs")
            if fortran_order and len(shape) > 1:
                raise self._error(name, "is stored column by column", "rows (C order): numpy.ascontiguousarray")
            column = _Column(name, shape, dtype)
            if math.prod(shape) * dtype.itemsize != info.file_size - file.tell():
                raise self._error(name, f"has another size than its shape {shape} says", "a complete array")
        return column

    def _check_columns(self) -> None:
        for name in ("stamp_ns", "ranges", "angle_min", "angle_increment"):
            if name not in self._columns:
                raise self._error(name, "is missing", "the arrays stamp_ns, ranges, angle_min, angle_increment")
        if "intensities" not in self._columns and "reflector" not in self._columns:
            raise self._error("", "has neither intensities nor reflector", "at least one of these arrays")
        stamps, ranges = self._columns["stamp_ns"], self._columns["ranges"]
        if stamps.dtype.kind not in "iu" or stamps.dtype.itemsize > 8 or len(stamps.shape) != 1:
            raise self._error("stamp_ns", f"is {stamps.dtype} {stamps.shape}", "int64 (N,) nanoseconds")
        if len(ranges.shape) != 2 or ranges.shape[0] != stamps.shape[0] or not 0 < ranges.shape[1] <= BEAM_LIMIT:
            remedy = f"({stamps.shape[0]}, beams), 1 to {BEAM_LIMIT} beams"
            raise self._error("ranges", f"has shape {ranges.shape}", remedy)
        for name, kinds, wanted in (
            ("ranges", "f", "floats"),
            ("intensities", "fiu", "numbers"),
            ("reflector", "biu", "booleans"),
        ):
            column = self._columns.get(name)
            if column is not None and column.dtype.kind not in kinds:
                raise self._error(name, f"is {column.dtype}", wanted)
            if column is not None and column.shape != ranges.shape:
                raise self._error(name, f"has shape {column.shape}", f"{ranges.shape} like ranges")

    def _scalar(self, archive: zipfile.ZipFile, name: str) -> float:
        column = self._columns[name]
        if column.dtype.kind not in "fiu" or math.prod(column.shape) != 1:
            raise self._error(name, f"is {column.dtype} {column.shape}", "one number [rad]")
        with archive.open(f"{name}.npy") as file:
            _read_header(file)
            value = float(np.frombuffer(file.read(column.dtype.itemsize), column.dtype)[0])
        if not math.isfinite(value) or abs(value) > 4.0 * math.pi:
            raise self._error(name, f"is {value:g}", "an angle in radians")
        return value

    def _rows(self, file: IO[bytes], name: str, count: int) -> NDArray[Any]:
        column = self._columns[name]
        data = file.read(count * column.row_bytes)
        if len(data) != count * column.row_bytes:
            raise self._error(name, "ends early", f"{column.shape[0]} rows")
        return np.frombuffer(data, column.dtype).reshape(count, *column.shape[1:])

    def _scan_log(self, arrays: dict[str, NDArray[Any]], start: int) -> ScanLog:
        # Other systems write infinity or a huge number for "no echo"; here that is NaN.
        ranges = arrays["ranges"].astype(np.float32)
        ranges[np.isinf(ranges)] = np.nan
        if (ranges < 0.0).any():
            row, beam = (int(i) for i in np.argwhere(ranges < 0.0)[0])
            found = f"is {ranges[row, beam]:g} in row {start + row}, beam {beam}"
            raise self._error("ranges", found, "0 m or more, NaN where nothing came back")
        stamps = arrays["stamp_ns"]
        # An unsigned stamp near 2^64 would become a negative one.
        beyond = np.flatnonzero((stamps >= STAMP_LIMIT) | (stamps <= -STAMP_LIMIT))
        if len(beyond):
            found = f"is {stamps[beyond[0]]} in row {start + int(beyond[0])}"
            raise self._error("stamp_ns", found, f"nanoseconds, less than {STAMP_LIMIT}")
        intensities, reflector = arrays.get("intensities"), arrays.get("reflector")
        return ScanLog(
            stamps_ns=stamps.astype(np.int64),
            ranges=ranges,
            angle_min=self.angle_min,
            angle_increment=self.angle_increment,
            intensities=None if intensities is None else intensities.astype(np.float32),
            reflector=None if reflector is None else reflector.astype(np.bool_),
        )

    def _check_order(self, block: ScanLog, start: int, last_stamp: int | None) -> None:
        stamps = block.stamps_ns if last_stamp is None else np.concatenate([[last_stamp], block.stamps_ns])
        wrong = np.flatnonzero(stamps[1:] <= stamps[:-1])
        if len(wrong):
            row = start + int(wrong[0]) + (1 if last_stamp is None else 0)
            found = f"{stamps[wrong[0] + 1]} in row {row} follows {stamps[wrong[0]]}"
            raise self._error("stamp_ns", found, "stamps that ascend from scan to scan")

    def _error(self, name: str, problem: str, remedy: str) -> FileFormatError:
        return FileFormatError(self.path, f"array {name}" if name else "", problem, remedy)


def _read_header(file: IO[bytes]) -> tuple[tuple[int, ...], bool, np.dtype[Any]]:
    """Shape, whether in Fortran order, and type of the array that starts here."""
    version = npy.read_magic(file)
    # Version 2 exists for headers beyond 64 kB, which plain arrays never have; numpy would read one of 4 GB.
    if version == (1, 0):
        return npy.read_array_header_1_0(file)
    raise ValueError(f"version {version[0]}.{version[1]} of the npy format")

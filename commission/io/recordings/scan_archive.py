"""The file `scans.npz` of a CSV folder: a zip of numpy arrays, read row by row from the zip. No pickles, ever.

`numpy.load` would unpack whole arrays; a recording of six hours has gigabytes of them.
"""

from __future__ import annotations

import math
import shutil
import struct
import tempfile
import zipfile
import zlib
from collections.abc import Generator, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

from commission.errors import FileFormatError
from commission.geometry.arrays import FloatArray, IntArray
from commission.io.reading import cannot_read, check_size
from commission.site.quantity import STAMP_LIMIT
from commission.site.record_store import ScanLog, everywhere

BEAM_LIMIT = 100_000
"""Beams in one scan."""
BOMB_SIZE = 256_000_000
"""Unpacked bytes from which an archive is suspected: no harm is done by less."""
BOMB_RATIO = 200
"""Unpacked bytes for each packed one that no suspected archive may reach. Deflate ends at 1032; scans that saw next to
nothing, 1,000 beams of which 20 came back, reach 40."""
_SMALL_LIMIT = 50_000_000
"""Scans of a recording: 23 days at 25 a second; their stamps and angles are in memory."""
_FILE_LIMIT = 1_000_000_000_000
BYTES_AT_ONCE = 4_000_000
"""What is read and unpacked at a time."""
ROWS = ("ranges", "intensities", "reflector")
"""Arrays with a row for each scan and a number for each beam."""
_ANGLES = ("angle_min", "angle_increment")
_GARBAGE = (zipfile.BadZipFile, zlib.error, EOFError, ValueError, struct.error, NotImplementedError, RuntimeError)
"""What zipfile and numpy raise for files that end early or were never a zip (an encrypted one: RuntimeError)."""


@dataclass(frozen=True, slots=True)
class ScanColumn:
    """One array of the archive, still packed."""

    name: str
    """Its name."""
    shape: tuple[int, ...]
    """Its shape, rows first."""
    dtype: np.dtype[Any]
    """Type of its numbers."""
    by_columns: bool = False
    """Whether it is stored column by column, as Fortran and MATLAB do."""

    @property
    def row_bytes(self) -> int:
        """Bytes of one row."""
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
        with self.open() as archive:
            members = set(archive.namelist())
            self._refuse_bomb(archive)
            self.columns = {
                name: self._header(archive, name)
                for name in ("stamp_ns", *ROWS, *_ANGLES, "beams")
                if f"{name}.npy" in members
            }
            self._check_columns()
            self._order = self._row_order(archive)
            self.angle_min, self.angle_increment = (self._angles(archive, name) for name in _ANGLES)
            self.beams = self._beams(archive)
            if self._order is not None:
                self.angle_min, self.angle_increment = self.angle_min[self._order], self.angle_increment[self._order]
                self.beams = self.beams[self._order]
                self.columns |= {
                    name: replace(column, shape=(len(self._order), *column.shape[1:]))
                    for name, column in self.columns.items()
                    if name in {"stamp_ns", *ROWS}
                }
        if (self.angle_increment == 0.0).any():
            raise self._error("angle_increment", "is 0", "the step from beam to beam [rad]")

    def __len__(self) -> int:
        """Return the number of scans."""
        return self.columns["stamp_ns"].shape[0]

    def blocks(self) -> Iterator[ScanLog]:
        """Read some scans at a time; memory does not grow with the file.

        Raises
        ------
        FileFormatError
            the archive ends early, or a range is negative.
        """
        names = [name for name in ("stamp_ns", *ROWS) if name in self.columns]
        rows_at_once = max(1, BYTES_AT_ONCE // sum(self.columns[name].row_bytes for name in names))
        with self.open() as archive, ExitStack() as stack:
            files = {name: stack.enter_context(self.rows_of(archive, name)) for name in names}
            for start in range(0, len(self), rows_at_once):
                count = min(rows_at_once, len(self) - start)
                arrays = {name: self._rows(files[name], name, count) for name in names}
                part = slice(start, start + count)
                arrays |= {"angle_min": self.angle_min[part], "angle_increment": self.angle_increment[part]}
                yield self.scan_log(arrays | {"beams": self.beams[part]}, start)

    def is_as_stored(self, name: str) -> bool:
        """Whether the rows of an array lie in the file as they are to be read."""
        return self._order is None and not self.columns[name].by_columns

    def rows_of(self, zipped: zipfile.ZipFile, name: str) -> IO[bytes]:
        """Open an array at its first row: the member of the archive, or a temporary file with its rows in order.

        Parameters
        ----------
        zipped : the archive, open.
        name : of the array.
        """
        file = zipped.open(f"{name}.npy")
        shape, _, dtype = _read_header(file)
        if self.is_as_stored(name):
            return file
        with file:
            return ordered_rows(file, (shape, dtype, self.columns[name].by_columns), self._order)

    def _row_order(self, archive: zipfile.ZipFile) -> IntArray | None:
        """Rows in the order of their stamps, the first of each stamp; None where they lie so. Says what is mended."""
        self.notes: tuple[str, ...] = ()
        stamps = self._small(archive, "stamp_ns", "iu", "int64 (N,) nanoseconds")
        if len(stamps) < 2 or (stamps[1:] > stamps[:-1]).all():
            return None
        _, order = np.unique(stamps, return_index=True)
        late, again = int((stamps < np.maximum.accumulate(stamps)).sum()), len(stamps) - len(order)
        self.notes = (
            *([f"{late} scans came after a later one and are sorted"] if late else ()),
            *([f"{again} scans have a stamp that is taken and are left out"] if again else ()),
        )
        return order.astype(np.int64)

    @contextmanager
    def open(self) -> Generator[zipfile.ZipFile]:
        """Open the zip; raises FileFormatError when it cannot be read, also for what is done while it is open."""
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

    def _header(self, archive: zipfile.ZipFile, name: str) -> ScanColumn:
        info = archive.getinfo(f"{name}.npy")
        with archive.open(info) as file:
            try:
                shape, fortran_order, dtype = _read_header(file)
            except _GARBAGE as error:
                raise self._error(name, f"is no array ({error})", "a plain numpy array") from error
            if dtype.hasobject:
                raise self._error(name, "is pickled", "plain numbers; pickles are not read, they could run programs")
            column = ScanColumn(name, shape, dtype, by_columns=fortran_order and len(shape) > 1)
            if math.prod(shape) * dtype.itemsize != info.file_size - file.tell():
                raise self._error(name, f"has another size than its shape {shape} says", "a complete array")
        return column

    def _check_columns(self) -> None:
        for name in ("stamp_ns", "ranges", "angle_min", "angle_increment"):
            if name not in self.columns:
                raise self._error(name, "is missing", "the arrays stamp_ns, ranges, angle_min, angle_increment")
        stamps, ranges = self.columns["stamp_ns"], self.columns["ranges"]
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
            column = self.columns.get(name)
            if column is not None and column.dtype.kind not in kinds:
                raise self._error(name, f"is {column.dtype}", wanted)
            if column is not None and column.shape != ranges.shape:
                raise self._error(name, f"has shape {column.shape}", f"{ranges.shape} like ranges")

    def _angles(self, archive: zipfile.ZipFile, name: str) -> FloatArray:
        """(N,) angles: one number in the file is that of all scans."""
        values = self._small(archive, name, "fiu", "one number, or one for each scan [rad]").astype(np.float64)
        wrong = np.flatnonzero(~(np.abs(values) <= 4.0 * math.pi))
        if len(wrong):
            raise self._error(name, f"is {values[wrong[0]]:g}{_row(values, wrong[0])}", "an angle in radians")
        return everywhere(float(values[0]), len(self)) if len(values) == 1 else values

    def _beams(self, archive: zipfile.ZipFile) -> IntArray:
        """(N,) beams of each scan: those behind them are no beams."""
        most = self.columns["ranges"].shape[1]
        if "beams" not in self.columns:
            return np.broadcast_to(np.int64(most), (len(self),))
        values = self._small(archive, "beams", "iu", "whole numbers, one for each scan")
        wrong = np.flatnonzero((values < 1) | (values > most))
        if len(wrong):
            found = f"is {values[wrong[0]]}{_row(values, wrong[0])}"
            raise self._error("beams", found, f"1 to {most}, as many as ranges has columns")
        counts = values.astype(np.int64)
        return np.broadcast_to(counts, (len(self),)) if len(counts) == 1 else counts

    def _small(self, archive: zipfile.ZipFile, name: str, kinds: str, expected: str) -> NDArray[Any]:
        """(1,) or (N,) numbers of an array."""
        column = self.columns[name]
        count = math.prod(column.shape)
        if column.dtype.kind not in kinds or not (count == 1 or column.shape == (len(self),)) or count > _SMALL_LIMIT:
            raise self._error(name, f"is {column.dtype} {column.shape}", expected)
        with archive.open(f"{name}.npy") as file:
            _read_header(file)
            data = file.read(count * column.dtype.itemsize)
        if len(data) != count * column.dtype.itemsize:
            raise self._error(name, "ends early", f"{count} numbers")
        return np.frombuffer(data, column.dtype)

    def _rows(self, file: IO[bytes], name: str, count: int) -> NDArray[Any]:
        column = self.columns[name]
        data = file.read(count * column.row_bytes)
        if len(data) != count * column.row_bytes:
            raise self._error(name, "ends early", f"{column.shape[0]} rows")
        return np.frombuffer(data, column.dtype).reshape(count, *column.shape[1:])

    def scan_log(self, arrays: dict[str, NDArray[Any]], start: int) -> ScanLog:
        """Convert and check some rows of the file.

        Parameters
        ----------
        arrays : rows of each array, by its name.
        start : index of the first one, for messages.

        Raises
        ------
        FileFormatError
            a range is negative, or a stamp too large.
        """
        # Other systems write infinity or a huge number for "no echo"; here that is NaN.
        ranges = arrays["ranges"].astype(np.float32)
        ranges[np.isinf(ranges)] = np.nan
        beams = arrays["beams"]
        beyond_last = np.arange(ranges.shape[1]) >= beams[:, np.newaxis] if (beams < ranges.shape[1]).any() else None
        if beyond_last is not None:
            ranges[beyond_last] = np.nan
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
        intensities = arrays["intensities"].astype(np.float32) if "intensities" in arrays else None
        reflector = arrays["reflector"].astype(np.bool_) if "reflector" in arrays else None
        for column in (intensities, reflector):
            if column is not None and beyond_last is not None:
                column[beyond_last] = 0
        return ScanLog(
            stamps_ns=stamps.astype(np.int64),
            ranges=ranges,
            angle_min=arrays["angle_min"],
            angle_increment=arrays["angle_increment"],
            beams=beams,
            intensities=intensities,
            reflector=reflector,
        )

    def _error(self, name: str, problem: str, remedy: str) -> FileFormatError:
        return FileFormatError(self.path, f"array {name}" if name else "", problem, remedy)


def ordered_rows(
    packed: IO[bytes], layout: tuple[tuple[int, ...], np.dtype[Any], bool], order: IntArray | None
) -> IO[bytes]:
    """Write the rows of an array into a temporary file, in another order or one that lies by columns.

    Parameters
    ----------
    packed : at the first number; all are read.
    layout : shape, type, and whether the numbers lie column by column.
    order : (K,) rows that are wanted; None: all as they are.

    Returns
    -------
    file : at its first row.

    Raises
    ------
    OSError
        there is no room on the disk.
    """
    shape, dtype, by_columns = layout
    with tempfile.TemporaryFile() as unpacked:
        shutil.copyfileobj(packed, unpacked, BYTES_AT_ONCE)
        unpacked.flush()
        if unpacked.tell() < math.prod(shape) * dtype.itemsize:
            raise EOFError("it ends early")
        wanted = np.arange(shape[0]) if order is None else order
        file = tempfile.TemporaryFile()
        if len(wanted):
            rows = np.memmap(unpacked, dtype, "r", shape=shape, order="F" if by_columns else "C")
            at_once = max(1, BYTES_AT_ONCE // max(1, math.prod(shape[1:]) * dtype.itemsize))
            for first in range(0, len(wanted), at_once):
                file.write(np.ascontiguousarray(rows[wanted[first : first + at_once]]).tobytes())
        file.seek(0)
        return file


def _row(values: NDArray[Any], index: int) -> str:
    """Where a wrong number is, where there are several."""
    return "" if len(values) == 1 else f" in row {index}"


def _read_header(file: IO[bytes]) -> tuple[tuple[int, ...], bool, np.dtype[Any]]:
    """Shape, whether in Fortran order, and type of the array that starts here."""
    version = npy.read_magic(file)
    # Version 2 exists for headers beyond 64 kB, which plain arrays never have; numpy would read one of 4 GB.
    if version == (1, 0):
        return npy.read_array_header_1_0(file)
    raise ValueError(f"version {version[0]}.{version[1]} of the npy format")

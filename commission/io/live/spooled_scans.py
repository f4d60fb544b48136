"""Scans of a live scanner, kept in a file that was deleted before it was begun: memory does not grow with the drive.

Of hours, the oldest are forgotten: the file has a fixed number of places that are used in turn.
"""

from __future__ import annotations

import os
import tempfile
import weakref
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from commission.geometry.arrays import FloatArray, IntArray
from commission.site.record_store import ScanLog, stacked
from commission.site.records import Scan

SPOOL_BYTES = 1 << 30
"""Size of the file at most: two hours of 1,000 beams at 25 scans per second."""
FIRST_ROWS = 1_024


class SpooledScans:
    """The file of one scanner's scans, written by one thread and read by any.

    Parameters
    ----------
    scanner : index into the names of the session.
    limit : bytes of the file at most.
    """

    def __init__(self, scanner: int, limit: int = SPOOL_BYTES) -> None:
        self.scanner = scanner
        self._limit = limit
        file = tempfile.TemporaryFile()
        self._number = file.fileno()
        # It lives as long as a result that can ask for a scan.
        weakref.finalize(self, file.close)
        self._count = self._forgotten = 0
        self._slot = self._slots = 0
        self._first: Scan | None = None
        self._stamps = np.empty(FIRST_ROWS, np.int64)
        self._angles = np.empty((FIRST_ROWS, 2))
        self._beams = np.empty(FIRST_ROWS, np.int64)

    def append(self, scan: Scan) -> None:
        """Write one scan behind the others; of one that has more beams than the first, the rest is left out."""
        if self._first is None:
            self._first = scan
            self._slot = len(_bytes_of(scan, scan))
            self._slots = max(self._limit // max(self._slot, 1), 1)
        row = self._count
        if row == len(self._stamps):
            self._stamps = np.concatenate([self._stamps, np.empty_like(self._stamps)])
            self._angles = np.concatenate([self._angles, np.empty_like(self._angles)])
            self._beams = np.concatenate([self._beams, np.empty_like(self._beams)])
        os.pwrite(self._number, _bytes_of(scan, self._first), (self._forgotten + row) % self._slots * self._slot)
        self._stamps[row] = scan.stamp_ns
        self._angles[row] = scan.angle_min, scan.angle_increment
        self._beams[row] = min(len(scan.ranges), len(self._first.ranges))
        self._count = row + 1

    def so_far(self) -> ScansSoFar:
        """Return what is there now: rows that never change again, though old ones may be forgotten."""
        n = self._count
        return ScansSoFar(self, self._forgotten, self._stamps[:n], self._angles[:n], self._beams[:n])

    def forget_until(self, stamp_ns: int) -> None:
        """Forget the scans up to a stamp [ns]; what was given out still has them, as long as the file does."""
        gone = int(np.searchsorted(self._stamps[: self._count], stamp_ns, side="right"))
        self._stamps = _later(self._stamps, gone, self._count)
        self._angles = _later(self._angles, gone, self._count)
        self._beams = _later(self._beams, gone, self._count)
        self._forgotten, self._count = self._forgotten + gone, self._count - gone

    def read(self, index: int, angles: FloatArray, beams: int, stamp_ns: int) -> Scan:
        """Return one scan; all its beams came back from nothing where it is forgotten.

        Parameters
        ----------
        index : its number among all that were ever written.
        angles : (2,) first bearing and step [rad].
        beams : how many it has.
        stamp_ns : its stamp [ns].
        """
        first = self._first
        if first is None:
            raise IndexError("no scan was written")
        width = len(first.ranges)
        if index < self._forgotten + self._count - self._slots:
            content = np.full(width, np.nan, np.float32).tobytes().ljust(self._slot, b"\0")
        else:
            content = os.pread(self._number, self._slot, index % self._slots * self._slot)
        place = 4 * width
        ranges = np.frombuffer(content, np.float32, width)[:beams]
        intensities = reflector = None
        if first.intensities is not None:
            intensities = np.frombuffer(content, np.float32, width, place)[:beams]
            place += 4 * width
        if first.reflector is not None:
            reflector = np.frombuffer(content, np.bool_, width, place)[:beams]
        return Scan(
            stamp_ns=stamp_ns,
            ranges=ranges,
            angle_min=float(angles[0]),
            angle_increment=float(angles[1]),
            intensities=intensities,
            reflector=reflector,
            scanner=self.scanner,
        )


class ScansSoFar:
    """A store of the scans up to some moment.

    Parameters
    ----------
    spool : the file.
    first : number of the first of them among all that were ever written.
    stamps_ns : (K,) [ns].
    angles : (K, 2) first bearing and step [rad].
    beams : (K,) number of beams.
    """

    def __init__(
        self, spool: SpooledScans, first: int, stamps_ns: IntArray, angles: FloatArray, beams: IntArray
    ) -> None:
        self._spool, self._first, self._angles = spool, first, angles
        self.stamps_ns, self.beams = stamps_ns, beams

    def __len__(self) -> int:
        """Return the number of scans."""
        return len(self.stamps_ns)

    @property
    def scanner(self) -> int:
        """Which scanner."""
        return self._spool.scanner

    @property
    def angle_min(self) -> FloatArray:
        """(K,) bearing of the first beam of each scan [rad]."""
        return self._angles[:, 0]

    @property
    def angle_increment(self) -> FloatArray:
        """(K,) bearing step of each scan [rad]."""
        return self._angles[:, 1]

    def block(self, first: int, last: int) -> ScanLog:
        """Return the scans from `first` to before `last`, in memory."""
        return self._gathered(range(first, min(last, len(self))))

    def chosen(self, indices: IntArray) -> ScanLog:
        """Return some scans, in memory."""
        return self._gathered(indices.tolist())

    def scan(self, index: int) -> Scan:
        """Return one scan."""
        return self._spool.read(
            self._first + index, self._angles[index], int(self.beams[index]), int(self.stamps_ns[index])
        )

    def _gathered(self, indices: Sequence[int]) -> ScanLog:
        if not len(indices):
            return ScanLog.even(np.empty(0, np.int64), np.empty((0, 0), np.float32), (0.0, 0.0))
        return stacked([self.scan(index) for index in indices])


def _later(column: NDArray[Any], gone: int, count: int) -> NDArray[Any]:
    """Return a copy of the rows that stay, with room behind them."""
    return np.concatenate([column[gone:count], np.empty_like(column[:FIRST_ROWS])])


def _bytes_of(scan: Scan, first: Scan) -> bytes:
    """Bytes of a scan's arrays, as many as the first one had."""
    width = len(first.ranges)

    def column(values: NDArray[np.float32] | NDArray[np.bool_] | None, fill: float) -> NDArray[np.float32]:
        row = np.full(width, fill, np.float32)
        if values is not None:
            row[: len(values)] = values[:width]
        return row

    content = column(scan.ranges, np.nan).tobytes()
    if first.intensities is not None:
        content += column(scan.intensities, 0.0).tobytes()
    if first.reflector is not None:
        content += column(scan.reflector, 0.0).astype(np.bool_).tobytes()
    return content

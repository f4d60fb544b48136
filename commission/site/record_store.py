"""Scans of a drive, delivered in blocks: from memory or from a file, behind one protocol. Not a file format.

A drive of six hours has gigabytes of ranges; what is wanted of them at once are some thousand scans to detect in, or
the one scan at a cursor. Stamps and angles of all scans are small and always at hand.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from commission.geometry.arrays import FloatArray, IntArray
from commission.site.records import Scan


class ScanStore(Protocol):
    """All scans of one scanner, in ascending order of their stamps."""

    def __len__(self) -> int:
        """Return the number of scans."""
        ...

    @property
    def scanner(self) -> int:
        """Which scanner: index into the names that the log has."""
        ...

    @property
    def stamps_ns(self) -> IntArray:
        """(K,) time of each scan [ns]."""
        ...

    @property
    def angle_min(self) -> FloatArray:
        """(K,) bearing of the first beam of each scan [rad], scanner frame."""
        ...

    @property
    def angle_increment(self) -> FloatArray:
        """(K,) bearing step from beam to beam of each scan [rad]."""
        ...

    @property
    def beams(self) -> IntArray:
        """(K,) number of beams of each scan."""
        ...

    def block(self, first: int, last: int) -> ScanLog:
        """Return the scans from `first` to before `last`, in memory."""
        ...

    def chosen(self, indices: IntArray) -> ScanLog:
        """Return some scans, in memory."""
        ...

    def scan(self, index: int) -> Scan:
        """Return one scan, as long as it was."""
        ...


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class ScanLog:
    """Scans in memory; those with fewer beams than others end with beams that are none: NaN, not reflective."""

    stamps_ns: IntArray
    """(K,) time of each scan [ns], ascending."""
    ranges: NDArray[np.float32]
    """(K, B) distance along each beam [m]; NaN where nothing came back."""
    angle_min: FloatArray
    """(K,) bearing of the first beam of each scan [rad], scanner frame."""
    angle_increment: FloatArray
    """(K,) bearing step from beam to beam of each scan [rad]."""
    beams: IntArray
    """(K,) number of beams of each scan, B at most."""
    intensities: NDArray[np.float32] | None = None
    """(K, B) strength of each echo, or None."""
    reflector: NDArray[np.bool_] | None = None
    """(K, B) reflector flag of each beam, or None."""
    scanner: int = 0
    """Which scanner: index into the names that the log has."""

    def __len__(self) -> int:
        """Return the number of scans."""
        return len(self.stamps_ns)

    @staticmethod
    def even(
        stamps_ns: IntArray,
        ranges: NDArray[np.float32],
        angles: tuple[float, float],
        *,
        intensities: NDArray[np.float32] | None = None,
        reflector: NDArray[np.bool_] | None = None,
    ) -> ScanLog:
        """Scans that all have the same beams.

        Parameters
        ----------
        stamps_ns : (K,) time of each scan [ns], ascending.
        ranges : (K, B) distance along each beam [m]; NaN where nothing came back.
        angles : bearing of the first beam, and step from beam to beam [rad].
        intensities, reflector : (K, B) arrays, or None.
        """
        count = len(stamps_ns)
        return ScanLog(
            stamps_ns=stamps_ns,
            ranges=ranges,
            angle_min=everywhere(angles[0], count),
            angle_increment=everywhere(angles[1], count),
            beams=np.broadcast_to(np.int64(ranges.shape[1]), (count,)),
            intensities=intensities,
            reflector=reflector,
        )

    def block(self, first: int, last: int) -> ScanLog:
        """Return the scans from `first` to before `last` (views, no copies)."""
        return self._part(slice(first, last))

    def chosen(self, indices: IntArray) -> ScanLog:
        """Return some scans."""
        return self._part(indices)

    def scan(self, index: int) -> Scan:
        """Return one scan, as long as it was (views, no copies)."""
        used = slice(int(self.beams[index]))
        return Scan(
            stamp_ns=int(self.stamps_ns[index]),
            ranges=self.ranges[index, used],
            angle_min=float(self.angle_min[index]),
            angle_increment=float(self.angle_increment[index]),
            intensities=None if self.intensities is None else self.intensities[index, used],
            reflector=None if self.reflector is None else self.reflector[index, used],
            scanner=self.scanner,
        )

    def _part(self, rows: slice | IntArray) -> ScanLog:
        return replace(
            self,
            stamps_ns=self.stamps_ns[rows],
            ranges=self.ranges[rows],
            angle_min=self.angle_min[rows],
            angle_increment=self.angle_increment[rows],
            beams=self.beams[rows],
            intensities=None if self.intensities is None else self.intensities[rows],
            reflector=None if self.reflector is None else self.reflector[rows],
        )


def everywhere(value: float, count: int) -> FloatArray:
    """(count,) the same number everywhere, which takes no memory."""
    return np.broadcast_to(np.float64(value), (count,))


def stacked(scans: Sequence[Scan]) -> ScanLog:
    """Gather scans of one scanner, one at least.

    Parameters
    ----------
    scans : in ascending order of their stamps. Numbers of beams and angles may differ.

    Raises
    ------
    ValueError
        a scan has intensities or flags where the first one has none, or none where it has: says which.
    """
    first = scans[0]
    for index, scan in enumerate(scans):
        same = (scan.intensities is None) == (first.intensities is None)
        if not (same and (scan.reflector is None) == (first.reflector is None)):
            raise ValueError(f"scan {index} has other arrays than scan 0; expected one scanner per recording")
    beams = np.array([len(scan.ranges) for scan in scans], dtype=np.int64)
    shape = len(scans), int(beams.max())
    ranges = np.full(shape, np.nan, dtype=np.float32)
    intensities = None if first.intensities is None else np.zeros(shape, dtype=np.float32)
    reflector = None if first.reflector is None else np.zeros(shape, dtype=np.bool_)
    for row, scan in enumerate(scans):
        used = slice(int(beams[row]))
        ranges[row, used] = scan.ranges
        if intensities is not None and scan.intensities is not None:
            intensities[row, used] = scan.intensities
        if reflector is not None and scan.reflector is not None:
            reflector[row, used] = scan.reflector
    return ScanLog(
        stamps_ns=np.array([scan.stamp_ns for scan in scans], dtype=np.int64),
        ranges=ranges,
        angle_min=np.array([scan.angle_min for scan in scans], dtype=np.float64),
        angle_increment=np.array([scan.angle_increment for scan in scans], dtype=np.float64),
        beams=beams,
        intensities=intensities,
        reflector=reflector,
        scanner=first.scanner,
    )

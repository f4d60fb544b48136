"""Scans that stay in their MCAP file and are read from it in blocks, anywhere, in memory that does not grow.

Stamps, angles, numbers of beams and places are in memory.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from commission.geometry.arrays import FloatArray, IntArray
from commission.io.recordings.mcap_index import McapIndex
from commission.site.record_store import ScanLog
from commission.site.records import Scan


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class ScanPlaces:
    """Where the beams of scans are."""

    chunks: NDArray[np.int32]
    """(K,) chunk of the ranges and intensities of each scan."""
    ranges: NDArray[np.int32]
    """(K,) place of its first range in the unpacked chunk [bytes]."""
    intensities: NDArray[np.int32] | None
    """(K,) place of its first intensity; -1 of a scan without any. None: no scan has any."""
    flag_chunks: NDArray[np.int32]
    """(K,) chunk of its flags."""
    reflector: NDArray[np.int32] | None
    """(K,) place of its first flag; -1 of a scan without any. None: no scan has any."""
    limits: NDArray[np.float32]
    """(K, 2) least and largest range that the scanner measures, as the message says [m]."""

    def chosen(self, rows: IntArray | slice) -> ScanPlaces:
        """Return those of some scans."""
        return ScanPlaces(
            chunks=self.chunks[rows],
            ranges=self.ranges[rows],
            intensities=None if self.intensities is None else self.intensities[rows],
            flag_chunks=self.flag_chunks[rows],
            reflector=None if self.reflector is None else self.reflector[rows],
            limits=self.limits[rows],
        )


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class McapScans:
    """The scans of a topic; a `ScanStore`."""

    index: McapIndex
    """The file."""
    places: ScanPlaces
    """Where they are."""
    stamps_ns: IntArray
    """(K,) time of each scan [ns], ascending."""
    angle_min: FloatArray
    """(K,) bearing of the first beam of each scan [rad], scanner frame."""
    angle_increment: FloatArray
    """(K,) bearing step from beam to beam of each scan [rad]."""
    beams: IntArray
    """(K,) number of beams of each scan."""
    most: int
    """Beams of the scan that has most."""
    scanner: int = 0
    """Which scanner: index into the names that the log has."""
    clean: Callable[[NDArray[np.float32], NDArray[np.float32] | None, NDArray[np.float32]], None] | None = None
    """What makes ranges and intensities those of a recording, given the limits of each scan; None: they are."""

    def __len__(self) -> int:
        """Return the number of scans."""
        return len(self.stamps_ns)

    def block(self, first: int, last: int) -> ScanLog:
        """Return the scans from `first` to before `last`; raises FileFormatError when the file is no longer there."""
        return self.chosen(np.arange(first, max(first, last)))

    def chosen(self, indices: IntArray) -> ScanLog:
        """Return some scans."""
        beams, places = self.beams[indices], self.places
        shape = len(indices), self.most
        ranges = np.full(shape, np.nan, np.float32)
        intensities = None if places.intensities is None else np.zeros(shape, np.float32)
        reflector = None if places.reflector is None else np.zeros(shape, np.bool_)
        for row, index in enumerate(indices.tolist()):
            content, count = self.index.content(int(places.chunks[index])), int(beams[row])
            ranges[row, :count] = np.frombuffer(content, "<f4", count, int(places.ranges[index]))
            if intensities is not None and places.intensities is not None and places.intensities[index] >= 0:
                intensities[row, :count] = np.frombuffer(content, "<f4", count, int(places.intensities[index]))
            if reflector is not None and places.reflector is not None and places.reflector[index] >= 0:
                content = self.index.content(int(places.flag_chunks[index]))
                reflector[row, :count] = np.frombuffer(content, np.uint8, count, int(places.reflector[index])) != 0
        if self.clean is not None:
            self.clean(ranges, intensities, places.limits[indices])
        return ScanLog(
            stamps_ns=self.stamps_ns[indices],
            ranges=ranges,
            angle_min=self.angle_min[indices],
            angle_increment=self.angle_increment[indices],
            beams=beams,
            intensities=intensities,
            reflector=reflector,
            scanner=self.scanner,
        )

    def scan(self, index: int) -> Scan:
        """Return one scan, as long as it was."""
        return self.block(index, index + 1).scan(0)

"""A finished recording or virtual drive as columns, for the compiled whole run and for seeking. Not a file format."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from commission.geometry.arrays import FloatArray, IntArray
from commission.site.records import (
    ORDER_WITHIN_A_STAMP,
    Detections,
    Odometry,
    Record,
    ReferencePose,
    Scan,
)
from commission.site.scanner import ONLY_NAME
from commission.site.truth import Truth


def _stamps(records: list[Record]) -> IntArray:
    return np.array([record.stamp_ns for record in records], dtype=np.int64)


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class ScanLog:
    """Scans of one scanner; all have the same beams."""

    stamps_ns: IntArray
    """(K,) time of each scan [ns], ascending."""
    ranges: NDArray[np.float32]
    """(K, B) distance along each beam [m]; NaN where nothing came back."""
    angle_min: float
    """Bearing of the first beam [rad], scanner frame."""
    angle_increment: float
    """Bearing step from beam to beam [rad]."""
    intensities: NDArray[np.float32] | None = None
    """(K, B) strength of each echo, or None."""
    reflector: NDArray[np.bool_] | None = None
    """(K, B) reflector flag of each beam, or None."""
    scanner: int = 0
    """Which scanner: index into the names that the log has."""

    def __len__(self) -> int:
        """Return the number of scans."""
        return len(self.stamps_ns)

    def between(self, first: int, last: int) -> ScanLog:
        """Return the scans from `first` to before `last` (views, no copies)."""
        rows = slice(first, last)
        return replace(
            self,
            stamps_ns=self.stamps_ns[rows],
            ranges=self.ranges[rows],
            intensities=None if self.intensities is None else self.intensities[rows],
            reflector=None if self.reflector is None else self.reflector[rows],
        )

    def scan(self, index: int) -> Scan:
        """Return one scan (views, no copies)."""
        return Scan(
            stamp_ns=int(self.stamps_ns[index]),
            ranges=self.ranges[index],
            angle_min=self.angle_min,
            angle_increment=self.angle_increment,
            intensities=None if self.intensities is None else self.intensities[index],
            reflector=None if self.reflector is None else self.reflector[index],
            scanner=self.scanner,
        )


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class RecordLog:
    """All records of one drive, by kind, each kind in ascending order of its stamps."""

    odometry_stamps_ns: IntArray
    """(M,) [ns]."""
    displacements: FloatArray
    """(M, 3) motion since the row before, in the base frame of the row before [m, m, rad]."""
    scanners: tuple[str, ...] = (ONLY_NAME,)
    """Names of the scanners; records have indices into them. A log that knows no names calls its only one so."""
    scans: tuple[ScanLog, ...] = ()
    """Scans of each scanner that has any, in the order of the names."""
    detection_stamps_ns: IntArray = field(default_factory=lambda: np.empty(0, np.int64))
    """(D,) time of each scan whose detections the sensor reported [ns]."""
    detection_offsets: IntArray = field(default_factory=lambda: np.zeros(1, np.int64))
    """(D + 1,) rows of `range_bearing` of scan i: offsets[i] to offsets[i + 1]."""
    range_bearing: FloatArray = field(default_factory=lambda: np.empty((0, 2)))
    """(n, 2) range [m] and bearing [rad] of each detection, scanner frame."""
    detection_scanners: IntArray = field(default_factory=lambda: np.empty(0, np.int64))
    """(D,) scanner of each; of none said, the first."""
    reference_stamps_ns: IntArray = field(default_factory=lambda: np.empty(0, np.int64))
    """(R,) [ns]."""
    reference_poses: FloatArray = field(default_factory=lambda: np.empty((0, 3)))
    """(R, 3) `T_map_base` [m, m, rad]."""
    truth: Truth | None = None
    """The constants that were drawn for a virtual drive; None of a real vehicle."""
    order: NDArray[np.int64] = field(init=False, repr=False)
    """(E, 2) every record in order of delivery: rank of its kind in ORDER_WITHIN_A_STAMP, index within its kind."""
    stamps_ns: IntArray = field(init=False, repr=False)
    """(E,) stamp of every record in order of delivery [ns]."""
    scan_order: IntArray = field(init=False, repr=False)
    """(S,) every scan in order of delivery: number among all scans, those of the first scanner first."""
    scan_stamps_ns: IntArray = field(init=False, repr=False)
    """(S,) stamp of every scan in order of delivery [ns]."""

    def __post_init__(self) -> None:
        if len(self.detection_scanners) != len(self.detection_stamps_ns):
            object.__setattr__(self, "detection_scanners", np.zeros(len(self.detection_stamps_ns), np.int64))
        self._check_scanners()
        scan_stamps = np.concatenate([np.empty(0, np.int64), *(scans.stamps_ns for scans in self.scans)])
        columns = (
            self.odometry_stamps_ns,
            self.reference_stamps_ns,
            self.detection_stamps_ns,
            scan_stamps,
        )
        stamps = np.concatenate(columns)
        kinds = np.concatenate([np.full(len(column), rank, np.int64) for rank, column in enumerate(columns)])
        indices = np.concatenate([np.arange(len(column), dtype=np.int64) for column in columns])
        order = np.lexsort((indices, kinds, stamps))
        object.__setattr__(self, "order", np.stack([kinds[order], indices[order]], axis=1))
        object.__setattr__(self, "stamps_ns", stamps[order])
        scan_order = indices[order][kinds[order] == ORDER_WITHIN_A_STAMP[Scan]]
        object.__setattr__(self, "scan_order", scan_order)
        object.__setattr__(self, "scan_stamps_ns", scan_stamps[scan_order])

    def _check_scanners(self) -> None:
        """Raise ValueError where a record is of a scanner without a name, or scans are out of order."""
        count = len(self.scanners)
        indices = [scans.scanner for scans in self.scans]
        if indices != sorted(set(indices)):
            raise ValueError(f"scans are of scanners {indices}; expected each once, ascending")
        highest = max(*indices, int(self.detection_scanners.max(initial=0)), 0)
        if highest >= count:
            raise ValueError(f"a record is of scanner {highest}; expected less than {count}, the number of names")

    @staticmethod
    def collect(records: Iterable[Record], scanners: tuple[str, ...] = (ONLY_NAME,)) -> RecordLog:
        """Gather records of any source.

        Parameters
        ----------
        records : in any order; scans of one scanner have the same beams (ValueError says which one differs).
        scanners : names of the scanners.
        """
        kinds: dict[type, list[Record]] = {kind: [] for kind in ORDER_WITHIN_A_STAMP}
        for record in records:
            kinds[type(record)].append(record)
        odometry = [r for r in kinds[Odometry] if isinstance(r, Odometry)]
        detections = [r for r in kinds[Detections] if isinstance(r, Detections)]
        references = [r for r in kinds[ReferencePose] if isinstance(r, ReferencePose)]
        counts = [len(r.range_bearing) for r in detections]
        return RecordLog(
            odometry_stamps_ns=_stamps(kinds[Odometry]),
            displacements=np.array([r.displacement for r in odometry]).reshape(-1, 3),
            scanners=scanners,
            scans=_scan_logs([r for r in kinds[Scan] if isinstance(r, Scan)]),
            detection_stamps_ns=_stamps(kinds[Detections]),
            detection_offsets=np.concatenate([[0], np.cumsum(counts, dtype=np.int64)]).astype(np.int64),
            range_bearing=np.concatenate([r.range_bearing for r in detections]) if detections else np.empty((0, 2)),
            detection_scanners=np.array([r.scanner for r in detections], dtype=np.int64),
            reference_stamps_ns=_stamps(kinds[ReferencePose]),
            reference_poses=np.array([r.pose for r in references]).reshape(-1, 3),
        )

    def __len__(self) -> int:
        """Return the number of records."""
        return len(self.order)

    def record(self, position: int) -> Record:
        """Return the record at a position of the order of delivery."""
        kind, index = self.order[position]
        stamp = int(self.stamps_ns[position])
        if kind == ORDER_WITHIN_A_STAMP[Odometry]:
            return Odometry(stamp, self.displacements[index])
        if kind == ORDER_WITHIN_A_STAMP[ReferencePose]:
            return ReferencePose(stamp, self.reference_poses[index])
        if kind == ORDER_WITHIN_A_STAMP[Detections]:
            rows = slice(self.detection_offsets[index], self.detection_offsets[index + 1])
            return Detections(stamp, self.range_bearing[rows], int(self.detection_scanners[index]))
        for scans in self.scans:
            if index < len(scans):
                return scans.scan(int(index))
            index -= len(scans)
        raise IndexError(f"record {position} is a scan of a log without scans")

    def records(self) -> Iterator[Record]:
        """Deliver every record in order of stamps; within a stamp motion comes first."""
        return (self.record(position) for position in range(len(self)))


def _scan_logs(scans: list[Scan]) -> tuple[ScanLog, ...]:
    """Stack the scans of each scanner."""
    return tuple(
        _scan_log([scan for scan in scans if scan.scanner == scanner])
        for scanner in sorted({scan.scanner for scan in scans})
    )


def _scan_log(scans: list[Scan]) -> ScanLog:
    """Stack scans of one scanner, or say which one does not fit the first."""
    first = scans[0]
    for index, scan in enumerate(scans):
        same = (
            scan.ranges.shape == first.ranges.shape
            and scan.angle_min == first.angle_min
            and scan.angle_increment == first.angle_increment
            and (scan.intensities is None) == (first.intensities is None)
            and (scan.reflector is None) == (first.reflector is None)
        )
        if not same:
            raise ValueError(f"scan {index} has other beams than scan 0; expected one scanner per recording")
    intensities = [scan.intensities for scan in scans if scan.intensities is not None]
    reflector = [scan.reflector for scan in scans if scan.reflector is not None]
    return ScanLog(
        scanner=first.scanner,
        stamps_ns=np.array([scan.stamp_ns for scan in scans], dtype=np.int64),
        ranges=np.stack([scan.ranges for scan in scans]),
        angle_min=first.angle_min,
        angle_increment=first.angle_increment,
        intensities=np.stack(intensities) if intensities else None,
        reflector=np.stack(reflector) if reflector else None,
    )

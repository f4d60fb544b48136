"""A finished recording or virtual drive as columns, for the compiled whole run and for seeking. Not a file format."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from commission.geometry.arrays import FloatArray, IntArray
from commission.site.bearing_log import NO_BEARINGS, BearingLog
from commission.site.record_store import ScanLog, ScanStore, stacked
from commission.site.recorded_mounting import RecordedMounting
from commission.site.recorded_start import RecordedStart
from commission.site.recorded_sweep import RecordedSweep
from commission.site.records import (
    ORDER_WITHIN_A_STAMP,
    Detections,
    Odometry,
    Record,
    ReferencePose,
    Reflex,
    Scan,
    TagSightings,
)
from commission.site.reference_mount import BASE, ReferenceMount
from commission.site.scanner import ONLY_NAME
from commission.site.tag_log import NO_TAGS, TagLog
from commission.site.truth import Truth


def _stamps(records: list[Record]) -> IntArray:
    return np.array([record.stamp_ns for record in records], dtype=np.int64)


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class RecordLog:
    """All records of one drive, by kind, each kind in ascending order of its stamps."""

    odometry_stamps_ns: IntArray
    """(M,) [ns]."""
    displacements: FloatArray
    """(M, 3) motion since the row before, in the base frame of the row before [m, m, rad]."""
    scanners: tuple[str, ...] = (ONLY_NAME,)
    """Names of the scanners; records have indices into them. A log that knows no names calls its only one so."""
    scans: tuple[ScanStore, ...] = ()
    """Scans of each scanner that has any, in the order of the names; in memory or in a file."""
    detection_stamps_ns: IntArray = field(default_factory=lambda: np.empty(0, np.int64))
    """(D,) time of each scan whose detections the sensor reported [ns]."""
    detection_offsets: IntArray = field(default_factory=lambda: np.zeros(1, np.int64))
    """(D + 1,) rows of `range_bearing` of scan i: offsets[i] to offsets[i + 1]."""
    range_bearing: FloatArray = field(default_factory=lambda: np.empty((0, 2)))
    """(n, 2) range [m] and bearing [rad] of each detection, scanner frame."""
    detection_scanners: IntArray = field(default_factory=lambda: np.empty(0, np.int64))
    """(D,) scanner of each; of none said, the first."""
    tags: TagLog = NO_TAGS
    """Frames of the camera that looks for tags."""
    bearings: BearingLog = NO_BEARINGS
    """Reflexes of the goniometer."""
    reference_stamps_ns: IntArray = field(default_factory=lambda: np.empty(0, np.int64))
    """(R,) [ns]."""
    reference_poses: FloatArray = field(default_factory=lambda: np.empty((0, 3)))
    """(R, 3) `T_map_base` [m, m, rad], as recorded: of another point and clock where `reference_mount` says so."""
    reference_mount: ReferenceMount = BASE
    """Where on the vehicle the reference measures, and how late its clock is."""
    truth: Truth | None = None
    """The constants that were drawn for a virtual drive; None of a real vehicle."""
    start: RecordedStart | None = None
    """Where the vehicle was said to be when the recording began; None: nobody says."""
    mountings: tuple[RecordedMounting, ...] = ()
    """Where the recording says that its scanners are mounted."""
    sweeps: tuple[RecordedSweep, ...] = ()
    """How the recording says that its scanners turn."""
    notes: tuple[str, ...] = ()
    """What a reader mended or left out, one line each; none where the recording is as it should be."""
    scan_order: NDArray[np.int32] = field(init=False, repr=False)
    """(S,) every scan in order of delivery: number among all scans, those of the first scanner first."""
    scan_stamps_ns: IntArray = field(init=False, repr=False)
    """(S,) stamp of every scan in order of delivery [ns]."""

    def __post_init__(self) -> None:
        if len(self.detection_scanners) != len(self.detection_stamps_ns):
            object.__setattr__(self, "detection_scanners", np.zeros(len(self.detection_stamps_ns), np.int64))
        self._check_scanners()
        if len(self.scans) == 1:
            # Of a single scanner, the order is that of its stamps: hours of them are not kept twice.
            stamps = self.scans[0].stamps_ns
            scan_order = np.arange(len(stamps), dtype=np.int32)
        else:
            stamps = np.concatenate([np.empty(0, np.int64), *(scans.stamps_ns for scans in self.scans)])
            # Stable: of equal stamps, the first scanner comes first.
            scan_order = np.argsort(stamps, kind="stable").astype(np.int32)
            stamps = stamps[scan_order]
        object.__setattr__(self, "scan_order", scan_order)
        object.__setattr__(self, "scan_stamps_ns", stamps)

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
        records : in any order; of one scanner all scans have flags, or none, and so for intensities (else ValueError).
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
            tags=TagLog.of([r for r in kinds[TagSightings] if isinstance(r, TagSightings)]),
            bearings=BearingLog.of([r for r in kinds[Reflex] if isinstance(r, Reflex)]),
            reference_stamps_ns=_stamps(kinds[ReferencePose]),
            reference_poses=np.array([r.pose for r in references]).reshape(-1, 3),
        )

    @property
    def reference_times_ns(self) -> IntArray:
        """(R,) when the reference poses were measured, by the clock of the recording [ns]."""
        return self.reference_mount.true_stamps(self.reference_stamps_ns)

    def __len__(self) -> int:
        """Return the number of records."""
        return sum(map(len, self._stamps_by_kind))

    @property
    def order(self) -> NDArray[np.int32]:
        """(E, 2) every record in order of delivery: rank of its kind in ORDER_WITHIN_A_STAMP, index within its kind.

        It is found anew each time: hours of it are not kept.
        """
        columns = self._stamps_by_kind
        order = np.empty((len(self), 2), dtype=np.int32)
        order[:, 0] = np.repeat(np.arange(len(columns)), [len(column) for column in columns])
        places = [np.arange(len(column), dtype=np.int32) for column in columns[:-1]]
        order[:, 1] = np.concatenate([*places, self.scan_order])
        # Stable: within a stamp kinds stay in their order, and within a kind records do.
        return order[np.argsort(np.concatenate(columns), kind="stable")]

    @property
    def stamps_ns(self) -> IntArray:
        """(E,) stamp of every record in order of delivery [ns]; sorted anew each time."""
        return np.sort(np.concatenate(self._stamps_by_kind))

    @property
    def first_ns(self) -> int:
        """Stamp of the first record [ns]; there is one at least."""
        return min(int(stamps[0]) for stamps in self._stamps_by_kind if len(stamps))

    @property
    def last_ns(self) -> int:
        """Stamp of the last record [ns]; there is one at least."""
        return max(int(stamps[-1]) for stamps in self._stamps_by_kind if len(stamps))

    @property
    def _stamps_by_kind(self) -> tuple[IntArray, ...]:
        """Stamps of each kind in its own order [ns], by the rank of the kind."""
        own, scans = self.detection_stamps_ns, self.scan_stamps_ns
        seen = self.tags.stamps_ns, self.bearings.stamps_ns
        return self.odometry_stamps_ns, self.reference_stamps_ns, *seen, own, scans

    def _record(self, kind: int, index: int) -> Record:
        """Return a record by the rank of its kind, and its index there."""
        if kind == ORDER_WITHIN_A_STAMP[Odometry]:
            return Odometry(int(self.odometry_stamps_ns[index]), self.displacements[index])
        if kind == ORDER_WITHIN_A_STAMP[ReferencePose]:
            return ReferencePose(int(self.reference_stamps_ns[index]), self.reference_poses[index])
        if kind == ORDER_WITHIN_A_STAMP[TagSightings]:
            seen = slice(self.tags.offsets[index], self.tags.offsets[index + 1])
            return TagSightings(
                int(self.tags.stamps_ns[index]), self.tags.sightings[seen], tuple(self.tags.ids[seen].tolist())
            )
        if kind == ORDER_WITHIN_A_STAMP[Reflex]:
            met = self.bearings
            return Reflex(int(met.stamps_ns[index]), float(met.bearings[index]), met.reflectors[index])
        if kind == ORDER_WITHIN_A_STAMP[Detections]:
            rows = slice(self.detection_offsets[index], self.detection_offsets[index + 1])
            scanner = int(self.detection_scanners[index])
            return Detections(int(self.detection_stamps_ns[index]), self.range_bearing[rows], scanner)
        for scans in self.scans:
            if index < len(scans):
                return scans.scan(int(index))
            index -= len(scans)
        raise IndexError("a scan of a log without scans")

    def records(self) -> Iterator[Record]:
        """Deliver every record in order of stamps; within a stamp motion comes first."""
        return (self._record(int(kind), int(index)) for kind, index in self.order)


def _scan_logs(scans: list[Scan]) -> tuple[ScanLog, ...]:
    """Stack the scans of each scanner."""
    return tuple(
        stacked([scan for scan in scans if scan.scanner == scanner])
        for scanner in sorted({scan.scanner for scan in scans})
    )

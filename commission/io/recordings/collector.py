"""What a stranger's recording holds, gathered in whatever order it comes, and turned into columns. It reads no file.

Motion, detections and reference are small: they are kept and sorted whole. Scans pass through a short queue into a
temporary file, so that memory does not grow with the drive.
"""

from __future__ import annotations

import heapq
import tempfile
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from dataclasses import replace
from enum import StrEnum
from pathlib import Path

import numpy as np

from commission.errors import FileFormatError
from commission.geometry.arrays import FloatArray, Growing, IntArray
from commission.io.atomic import cannot_write
from commission.io.recordings import motion
from commission.io.recordings.scan_archive import ScanArchive
from commission.io.recordings.scan_file import load_scans
from commission.io.recordings.scan_writer import ScanWriter
from commission.site.record_log import RecordLog
from commission.site.record_store import ScanStore
from commission.site.records import Scan

PATIENCE = 64
"""Scans of one scanner that may come before an earlier one: 2.5 s at 25 a second."""

_TOO_LATE = "have intensities, and the first ones have none: they are left out"
SET_BACK_NS = 5_000_000_000
"""Way back of stamps from which it is a clock that was set, and no message that came late [ns]."""


class MotionKind(StrEnum):
    """How a source reports motion."""

    DISPLACEMENTS = "displacements"
    POSES = "poses"
    VELOCITIES = "velocities"
    POSES_AND_VELOCITIES = "poses and velocities"
    WHEEL_ANGLES = "wheel angles"
    WHEEL_SPEEDS = "wheel speeds"


_WIDTH = {
    MotionKind.POSES_AND_VELOCITIES: 6,
    MotionKind.WHEEL_ANGLES: 2,
    MotionKind.WHEEL_SPEEDS: 2,
}


class Collector:
    """Gathers what is read of one recording.

    Parameters
    ----------
    path : the recording, for messages.
    scanners : names of its scanners.
    kind : how it reports motion; None when it does not.
    wheels : size and distance of the wheels, where motion is their turning.
    """

    def __init__(
        self,
        path: Path,
        scanners: tuple[str, ...],
        kind: MotionKind | None,
        wheels: motion.Wheels | None = None,
    ) -> None:
        self.path = path
        self.scanners = scanners
        self.kind = kind
        self.wheels = wheels
        self.told: Counter[str] = Counter()
        """What was mended or left out, and how often."""
        self._motion_stamps = Growing(np.int64)
        self._motion = Growing(np.float64, 3 if kind is None else _WIDTH.get(kind, 3))
        self._reference_stamps = Growing(np.int64)
        self._reference = Growing(np.float64, 3)
        self._detections: list[tuple[int, int, FloatArray]] = []
        self._stack = ExitStack()
        self._folder = Path(self._stack.enter_context(tempfile.TemporaryDirectory(ignore_cleanup_errors=True)))
        self._queues = [_ScanQueue(self._folder / f"{index}.npz", self._stack, self.told) for index in self._indices]

    @property
    def _indices(self) -> range:
        return range(len(self.scanners))

    def close(self) -> None:
        """Remove what lies on the disk for the time of reading."""
        self._stack.close()

    def add_motion(self, stamp_ns: int, values: Sequence[float]) -> None:
        """Take a row of odometry of the collector's kind [m, rad, m/s, rad/s]; what is not finite is left out."""
        row = np.array([values], dtype=np.float64)
        if not np.isfinite(row).all():
            self.told["rows of odometry without a number are left out"] += 1
            return
        self._motion_stamps.append(np.array([stamp_ns]))
        self._motion.append(row)

    def add_reference(self, stamp_ns: int, x: float, y: float, theta: float) -> None:
        """Take a pose of a second system.

        Parameters
        ----------
        stamp_ns : when it was [ns].
        x, y, theta : pose of base, map frame [m, m, rad]; theta is NaN where it is not known.
        """
        if not np.isfinite([x, y]).all():
            self.told["reference poses without a position are left out"] += 1
            return
        self._reference_stamps.append(np.array([stamp_ns]))
        self._reference.append(np.array([[x, y, theta]]))

    def add_detections(self, stamp_ns: int, range_bearing: FloatArray, scanner: int = 0) -> None:
        """Take what a sensor detected in one scan.

        Parameters
        ----------
        stamp_ns : of the scan [ns].
        range_bearing : (N, 2) range [m] and bearing [rad], scanner frame.
        scanner : index into the names.
        """
        self._detections.append((stamp_ns, scanner, range_bearing))

    def add_scan(self, scan: Scan) -> None:
        """Take a scan; its `scanner` is an index into the names."""
        self._queues[scan.scanner].add(scan)

    def log(self, notes: Sequence[str] = ()) -> RecordLog:
        """Return all that was taken as columns; `notes` come before what was mended.

        Raises
        ------
        FileFormatError
            nothing was taken, or a scan cannot be one.
        """
        scans = self._scans()
        stamps, displacements = self._displacements()
        reference = self._sorted("reference poses", self._reference_stamps.array(), self._reference.array())
        detection_stamps, scanners, range_bearing = self._detection_columns()
        firsts = [int(column[0]) for column in (stamps, reference.stamps_ns, detection_stamps) if len(column)] + [
            int(store.stamps_ns[0]) for store in scans
        ]
        if not firsts:
            why = "; ".join(self._mended())
            problem = f"holds no scan, odometry or pose{f' ({why})' if why else ''}"
            raise FileFormatError(self.path, "", problem, "a recording of a drive")
        more = [*notes, *self._set_clocks()]
        if not len(stamps):
            more.append("it holds no odometry: how the vehicle moved is not known")
            stamps, displacements = np.array([min(firsts)]), np.zeros((1, 3))
        counts = [len(rows) for rows in range_bearing]
        return RecordLog(
            odometry_stamps_ns=stamps,
            displacements=displacements,
            scanners=self.scanners,
            scans=scans,
            detection_stamps_ns=detection_stamps,
            detection_offsets=np.concatenate([[0], np.cumsum(counts, dtype=np.int64)]).astype(np.int64),
            range_bearing=np.concatenate(range_bearing) if range_bearing else np.empty((0, 2)),
            detection_scanners=scanners,
            reference_stamps_ns=reference.stamps_ns,
            reference_poses=reference.rows,
            notes=(*more, *self._mended()),
        )

    def _mended(self) -> Iterator[str]:
        """What was mended or left out, in words."""
        return (f"{count} {what}" for what, count in self.told.items() if count)

    def _set_clocks(self) -> Iterator[str]:
        """Say of which records the stamps went back by more than lateness explains."""
        backs = {
            "odometry": _longest_way_back(self._motion_stamps.array()),
            "reference": _longest_way_back(self._reference_stamps.array()),
            **{f"scans of {name}": queue.way_back_ns for name, queue in zip(self.scanners, self._queues, strict=True)},
        }
        for name, way in backs.items():
            if way > SET_BACK_NS:
                yield (
                    f"stamps of the {name} go back by {way * 1e-9:.1f} s: a clock was set, or began anew, in between, "
                    "and what came after it lies before; cut the recording there"
                )

    def _displacements(self) -> tuple[IntArray, FloatArray]:
        """Stamps [ns] and displacements [m, m, rad] from whatever kind of motion came."""
        stamps, rows = self._motion_stamps.array(), self._motion.array()
        if self.kind is MotionKind.DISPLACEMENTS:
            found = motion.composed(stamps, rows)
            self._count("rows of odometry", found, "are composed")
            return found.stamps_ns, found.rows
        found = self._sorted("rows of odometry", stamps, rows)
        if len(found.stamps_ns) == 0 or self.kind is None:
            return np.empty(0, np.int64), np.empty((0, 3))
        return found.stamps_ns, _moved(self.kind, found.stamps_ns, found.rows, self.wheels)

    def _sorted(self, name: str, stamps: IntArray, rows: FloatArray) -> motion.Sorted:
        found = motion.in_order(stamps, rows)
        self._count(name, found, "are left out but for the last of each")
        return found

    def _count(self, name: str, found: motion.Sorted, fate: str) -> None:
        self.told[f"{name} came after a later one and are sorted"] += found.disordered
        self.told[f"{name} have a stamp that is taken and {fate}"] += found.repeated

    def _detection_columns(self) -> tuple[IntArray, IntArray, list[FloatArray]]:
        order = sorted(range(len(self._detections)), key=lambda index: self._detections[index][:2])
        rows = [self._detections[index] for index in order]
        stamps = np.array([row[0] for row in rows], dtype=np.int64)
        return stamps, np.array([row[1] for row in rows], dtype=np.int64), [row[2] for row in rows]

    def _scans(self) -> tuple[ScanStore, ...]:
        found: list[ScanStore] = []
        for index, queue in enumerate(self._queues):
            try:
                if queue.finish():
                    store = load_scans(ScanArchive(queue.file), index)
                    found.extend([] if store is None else [store])
            except FileFormatError as error:
                where = f"scans of {self.scanners[index]}"
                raise FileFormatError(self.path, where, f"{error.where} {error.problem}", error.remedy) from error
            except OSError as error:
                raise cannot_write(self._folder, error) from error
        return tuple(found)


def _longest_way_back(stamps_ns: IntArray) -> int:
    """By how much a stamp lies before a former one, at most [ns]."""
    return int((np.maximum.accumulate(stamps_ns) - stamps_ns).max()) if len(stamps_ns) else 0


def _moved(kind: MotionKind, stamps_ns: IntArray, rows: FloatArray, wheels: motion.Wheels | None) -> FloatArray:
    """(N, 3) displacements [m, m, rad] from sorted rows."""
    if kind is MotionKind.POSES:
        return motion.from_poses(rows)
    if kind is MotionKind.VELOCITIES:
        return motion.from_velocities(stamps_ns, rows)
    if kind is MotionKind.POSES_AND_VELOCITIES:
        # Some drivers fill in the velocity only; a pose that never moves beside one that does says nothing.
        if not np.ptp(rows[:, :3], axis=0).any() and rows[:, 3:].any():
            return motion.from_velocities(stamps_ns, rows[:, 3:])
        return motion.from_poses(rows[:, :3])
    if wheels is None:
        raise ValueError("wheels are not given; expected their names, radius and separation")
    if kind is MotionKind.WHEEL_SPEEDS:
        return motion.from_velocities(stamps_ns, motion.from_wheels(rows, wheels))
    return motion.from_wheel_angles(rows, wheels)


class _ScanQueue:
    """Scans of one scanner on their way into a file, the earliest of the waiting ones first."""

    def __init__(self, file: Path, stack: ExitStack, told: Counter[str]) -> None:
        self.file = file
        self._writer = ScanWriter(file.parent, file, stack)
        self._told = told
        self._waiting: list[tuple[int, int, Scan]] = []
        self._number = 0
        self.way_back_ns = 0
        """By how much a stamp lay before a former one, at most [ns]."""
        self._newest: int | None = None
        self._last: int | None = None
        self._has_intensities = self._has_reflector = False

    def add(self, scan: Scan) -> None:
        if self._newest is not None and scan.stamp_ns < self._newest:
            self._told["scans came after a later one and are sorted"] += 1
            self.way_back_ns = max(self.way_back_ns, self._newest - scan.stamp_ns)
        self._newest = scan.stamp_ns if self._newest is None else max(self._newest, scan.stamp_ns)
        heapq.heappush(self._waiting, (scan.stamp_ns, self._number, scan))
        self._number += 1
        if len(self._waiting) > PATIENCE:
            self._write(heapq.heappop(self._waiting)[2])

    def finish(self) -> bool:
        """Write what waits; returns whether there was any scan."""
        while self._waiting:
            self._write(heapq.heappop(self._waiting)[2])
        self._writer.finish()
        return self._last is not None

    def _write(self, scan: Scan) -> None:
        if self._last is not None and scan.stamp_ns <= self._last:
            late = scan.stamp_ns < self._last
            fate = f"came more than {PATIENCE} scans too late" if late else "have a stamp that is taken"
            self._told[f"scans {fate} and are left out"] += 1
            return
        if not 0 < len(scan.ranges):
            self._told["scans without a beam are left out"] += 1
            return
        if self._last is None:
            # A driver may begin with a scan that lacks what all others have.
            first = [scan, *(each for _, _, each in self._waiting)]
            self._has_intensities = any(each.intensities is not None for each in first)
            self._has_reflector = any(each.reflector is not None for each in first)
        self._last = scan.stamp_ns
        self._writer.add(self._alike(scan))

    def _alike(self, scan: Scan) -> Scan:
        """Return a scan with the arrays that the first ones have."""
        if (scan.intensities is not None) != self._has_intensities:
            fate = "have no intensities, where others do (taken as 0)" if self._has_intensities else _TOO_LATE
            self._told[f"scans {fate}"] += 1
            filled = np.zeros(len(scan.ranges), np.float32) if self._has_intensities else None
            scan = replace(scan, intensities=filled)
        if (scan.reflector is not None) != self._has_reflector:
            self._told["scans have reflector flags where others have none (taken as none)"] += 1
            scan = replace(scan, reflector=np.zeros(len(scan.ranges), np.bool_) if self._has_reflector else None)
        return scan

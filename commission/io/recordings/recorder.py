"""What a vehicle reports and what the localizer makes of it, record by record into an MCAP file.

Foxglove and `ros2 bag` open it; `mcap_recording` reads it back to the last bit. What stops the program leaves a file
that is readable up to the second before. It has no clock: times are those of the records.
"""

from __future__ import annotations

import json
import re
import struct
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from types import TracebackType
from typing import IO

import numpy as np

from commission.errors import FileFormatError
from commission.geometry import se2
from commission.io.atomic import atomic_file, cannot_write
from commission.io.recordings import ros_encoding as ros
from commission.io.recordings.bag_writer import MessageWriter, atomic_bag
from commission.io.recordings.mcap_reader import Message
from commission.io.recordings.mcap_writer import McapWriter
from commission.io.recordings.recorded_start import recorded_start_text
from commission.io.recordings.reference_file import reference_mount_text
from commission.io.recordings.truth_file import truth_text
from commission.localization.estimate import Estimate
from commission.site.recorded_start import RecordedStart
from commission.site.records import Detections, Odometry, Record, Reflex, Scan, TagSightings
from commission.site.reference_mount import BASE, ReferenceMount
from commission.site.scanner import ONLY_NAME, Scanner
from commission.site.truth import Truth

METADATA = "commission"
"""Name of the texts that say what the file holds."""
VERSION = "1"
"""Version of what is written."""
DISPLACEMENTS, REFERENCES = "/commission/displacement", "/commission/reference"
ESTIMATE, POINTS, MODE = "/commission/estimate", "/commission/detections", "/commission/mode"
TAGS, BEARINGS = "/commission/tags", "/commission/bearings"
_ODOMETRY, _REFERENCE, _TF, _TF_STATIC = "/odom", "/reference", "/tf", "/tf_static"
BESIDE = {
    ESTIMATE: ros.POSE_WITH_COVARIANCE,
    POINTS: ros.POINTS,
    MODE: ros.TEXT,
    _TF: ros.TRANSFORMS,
    _TF_STATIC: ros.TRANSFORMS,
}
"""Topics that stand beside the records, and their types: what the localizer says, and where viewers draw scans."""
_CHUNK_BYTES = 4_000_000
"""Bytes of a chunk, at most."""
_LONG_S = 600.0
"""Time of a chunk where nothing is lost that could not be written again [s]: few and large ones open fast."""
_SMALL = "lz4"
"""Compression of everything but scans, whose noise does not shrink: poses have 36 zeros of covariance."""


class Recorder:
    """An MCAP file to which records are appended; a context manager that closes it.

    Parameters
    ----------
    path : the file; one that is there is replaced. With `file`, for messages only.
    scanners : names of the scanners that records have indices of.
    truth : the constants of a virtual drive.
    reference_mount : where the reference measures.
    mounted : the vehicle's scanners, for viewers: where on it their scans are drawn.
    start : where the vehicle is said to be before the first record.
    chunk_s : what comes within this time is written at once, and lost where the program is killed before [s].
    file : an empty file to write into instead; it is not closed.
    writer : what takes the messages instead of an MCAP file.

    Raises
    ------
    FileFormatError
        the file cannot be written: on opening, or by whatever appends to it.
    """

    def __init__(
        self,
        path: Path,
        scanners: Sequence[str] = (ONLY_NAME,),
        *,
        truth: Truth | None = None,
        reference_mount: ReferenceMount = BASE,
        mounted: Sequence[Scanner] = (),
        start: RecordedStart | None = None,
        chunk_s: float = 1.0,
        file: IO[bytes] | None = None,
        writer: MessageWriter | None = None,
    ) -> None:
        self.path = path
        self.scanners = tuple(scanners)
        self.records = 0
        """Records so far."""
        self.first_ns: int | None = None
        """Stamp of the first record [ns]; None before it."""
        self.last_ns: int | None = None
        """Latest stamp [ns]."""
        self._opened: IO[bytes] | None = None
        if writer is None:
            if file is None:
                file = self._opened = _opened(path)
            writer = McapWriter(path, file, chunk_bytes=_CHUNK_BYTES, chunk_ns=round(chunk_s * 1e9))
        self._writer = writer
        self._channels: dict[str, int] = {}
        self._topics = scanner_topics(self.scanners)
        self._pose = np.zeros(3)
        self._odometry_ns: int | None = None
        self._mode: str | None = None
        self._is_open = True
        self._writer.add_metadata(METADATA, self._said(truth, reference_mount, start))
        for scanner in mounted:
            self._add_mounting(scanner)

    @property
    def size(self) -> int:
        """Bytes in the file; what came within the last second is not yet in it."""
        return self._writer.written

    @property
    def duration(self) -> float:
        """Time from the first record to the latest one [s]."""
        return 0.0 if self.first_ns is None or self.last_ns is None else (self.last_ns - self.first_ns) * 1e-9

    def append(self, record: Record) -> None:
        """Append what a vehicle reports, in whatever order it comes.

        Raises
        ------
        FileFormatError
            the disk is full, or the stamp is none that ROS can hold.
        """
        try:
            if isinstance(record, Scan):
                topic = self._topics[record.scanner]
                frame = frame_of(topic)
                self._write(beams_topic(topic), ros.BEAMS, record.stamp_ns, ros.beams(record, frame), "")
                self._write(topic, ros.LASER_SCAN, record.stamp_ns, ros.laser_scan(record, frame), "")
            elif isinstance(record, Odometry):
                self._append_odometry(record)
            elif isinstance(record, Detections):
                topic = self._topics[record.scanner]
                data = ros.detections(record, frame_of(topic))
                self._write(detected_topic(topic), ros.DETECTED, record.stamp_ns, data)
            elif isinstance(record, TagSightings):
                self._write(TAGS, ros.TAGS, record.stamp_ns, ros.tags(record))
            elif isinstance(record, Reflex):
                self._write(BEARINGS, ros.REFLEX, record.stamp_ns, ros.reflex(record))
            else:
                self._write(_REFERENCE, ros.POSE, record.stamp_ns, ros.pose_stamped(record))
                self._write(REFERENCES, ros.REFERENCE, record.stamp_ns, ros.reference(record))
        except ValueError as error:
            found, _, expected = str(error).partition("; expected ")
            raise FileFormatError(self.path, "", f"cannot hold a record: {found}", expected) from error
        self.records += 1
        self.first_ns = record.stamp_ns if self.first_ns is None else min(self.first_ns, record.stamp_ns)
        self.last_ns = record.stamp_ns if self.last_ns is None else max(self.last_ns, record.stamp_ns)

    def append_estimate(self, estimate: Estimate) -> None:
        """Append what the localizer says after a scan: pose, covariance, detections, and the mode when it changes."""
        stamp = estimate.stamp_ns
        mean = estimate.posterior.mean
        self._write(ESTIMATE, ros.POSE_WITH_COVARIANCE, stamp, ros.estimated_pose(estimate))
        self._write(POINTS, ros.POINTS, stamp, ros.detected_points(estimate))
        self._write(_TF, ros.TRANSFORMS, stamp, ros.transform(stamp, (ros.MAP, ros.BASE_LINK), mean))
        mode = estimate.mode.name.lower()
        if mode != self._mode:
            self._write(MODE, ros.TEXT, stamp, ros.text(mode))
            self._mode = mode

    def append_beside(self, message: Message) -> None:
        """Append what stands beside the records of another file, byte by byte; what is not in `BESIDE` is left out.

        Raises
        ------
        FileFormatError
            the disk is full, or the format cannot hold the message.
        """
        topic = message.channel.topic
        if BESIDE.get(topic) != message.channel.schema:
            return
        try:
            self._write(topic, message.channel.schema, message.log_time_ns, message.data)
        except (ValueError, LookupError, struct.error, AssertionError) as error:
            found = f"cannot hold a message of {topic} ({error})"
            raise FileFormatError(self.path, "", found, f"a {message.channel.schema} as it was recorded") from error

    def append_all(self, records: Iterable[Record], beside: Iterable[Message] = ()) -> None:
        """Append records, and among them by their times what stands beside those of another file.

        Parameters
        ----------
        records : in the order of their stamps.
        beside : see `append_beside`.
        """
        waiting = iter(beside)
        first = next(waiting, None)
        for record in records:
            while first is not None and first.log_time_ns < record.stamp_ns:
                self.append_beside(first)
                first = next(waiting, None)
            self.append(record)
        while first is not None:
            self.append_beside(first)
            first = next(waiting, None)

    def flush(self) -> None:
        """Write what waits for its second to be over."""
        self._writer.flush()

    def close(self) -> None:
        """Write what waits, and the summary by which the file opens at once. Closing twice does nothing."""
        if not self._is_open:
            return
        self._is_open = False
        try:
            self._writer.finish()
        finally:
            if self._opened is not None:
                self._opened.close()

    def __enter__(self) -> Recorder:
        """Return itself."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        """Close the file, whatever happened."""
        self.close()

    def _said(
        self, truth: Truth | None, reference_mount: ReferenceMount, start: RecordedStart | None
    ) -> dict[str, str]:
        """What the file says about itself."""
        values = {"version": VERSION, "scanners": json.dumps(self.scanners)}
        if truth is not None:
            values["truth"] = truth_text(truth)
        if reference_mount != BASE:
            values["reference"] = reference_mount_text(reference_mount)
        if start is not None:
            values["start"] = recorded_start_text(start)
        return values

    def _append_odometry(self, record: Odometry) -> None:
        """Append the pose since the begin, the velocity, and the displacement as it is."""
        self._pose = se2.compose(self._pose, record.displacement)
        passed = 0 if self._odometry_ns is None else record.stamp_ns - self._odometry_ns
        velocity = record.displacement * 1e9 / passed if passed > 0 else np.zeros(3)
        self._odometry_ns = record.stamp_ns
        self._write(_ODOMETRY, ros.ODOMETRY, record.stamp_ns, ros.odometry(record.stamp_ns, self._pose, velocity))
        self._write(DISPLACEMENTS, ros.DISPLACEMENT, record.stamp_ns, ros.displacement(record))

    def _add_mounting(self, scanner: Scanner) -> None:
        """Say where a scanner is mounted, for those that draw its scans."""
        if scanner.name not in self.scanners:
            return
        frames = ros.BASE_LINK, frame_of(self._topics[self.scanners.index(scanner.name)])
        data = ros.transform(0, frames, np.asarray(scanner.mounting), upside_down=scanner.upside_down)
        self._write(_TF_STATIC, ros.TRANSFORMS, 0, data)

    def _write(self, topic: str, kind: str, stamp_ns: int, data: bytes, compression: str = _SMALL) -> None:
        if topic not in self._channels:
            self._channels[topic] = self._writer.add_channel(topic, kind, ros.definition_of(kind))
        # A time of recording is unsigned; a stamp before 1970 stands in the header as it is.
        self._writer.add_message(self._channels[topic], max(stamp_ns, 0), data, compression=compression)


def write_mcap(
    path: Path,
    records: Iterable[Record],
    truth: Truth | None = None,
    *,
    scanners: tuple[str, ...] = (ONLY_NAME,),
    reference_mount: ReferenceMount = BASE,
    start: RecordedStart | None = None,
    beside: Iterable[Message] = (),
) -> None:
    """Write a whole recording as an MCAP file, which replaces the one that is there once it is complete.

    Parameters
    ----------
    path : the file.
    records : in the order of their stamps; a source's error passes through and leaves the file as it was.
    truth : the constants of a virtual drive.
    scanners : names of the scanners that records have indices of.
    reference_mount : where the reference measures.
    start : where the vehicle was said to be before the first record.
    beside : what stands beside the records of another file, as it lies there.

    Raises
    ------
    FileFormatError
        the file cannot be written, or a stamp is none that ROS can hold.
    """
    with atomic_file(path) as file:
        recorder = Recorder(
            path, scanners, truth=truth, reference_mount=reference_mount, start=start, chunk_s=_LONG_S, file=file
        )
        recorder.append_all(records, beside)
        recorder.close()


def write_bag(
    path: Path,
    records: Iterable[Record],
    truth: Truth | None = None,
    *,
    scanners: tuple[str, ...] = (ONLY_NAME,),
    reference_mount: ReferenceMount = BASE,
    start: RecordedStart | None = None,
    beside: Iterable[Message] = (),
) -> None:
    """Write a whole recording as a bag of ROS 1 (.bag) or of ROS 2 in sqlite3 (.db3); see `write_mcap`.

    Parameters
    ----------
    path : the file, whose name ends so.
    records : in the order of their stamps; a source's error passes through and leaves the file as it was.
    truth : the constants of a virtual drive.
    scanners : names of the scanners that records have indices of.
    reference_mount : where the reference measures.
    start : where the vehicle was said to be before the first record.
    beside : what stands beside the records of another file, as it lies there.

    Raises
    ------
    FileFormatError
        the file cannot be written, or a stamp is none that ROS can hold.
    """
    with atomic_bag(path) as writer:
        recorder = Recorder(path, scanners, truth=truth, reference_mount=reference_mount, start=start, writer=writer)
        recorder.append_all(_since_1970(path, records) if writer.is_ros1 else records, beside)
        recorder.close()


def _since_1970(path: Path, records: Iterable[Record]) -> Iterator[Record]:
    """Deliver records whose stamps ROS 1 can hold; raises FileFormatError at the first of another one."""
    for record in records:
        if record.stamp_ns < 0:
            found = f"cannot hold a record: its stamp is {record.stamp_ns} ns"
            raise FileFormatError(path, "", found, "1970 or later, where the time of ROS 1 begins")
        yield record


def scanner_topics(scanners: Sequence[str]) -> tuple[str, ...]:
    """Topic of the scans of each scanner: `/scan`, of several `/front/scan`; ROS allows letters, digits and _."""
    if len(scanners) == 1:
        return ("/scan",)
    plain = [re.sub(r"[^A-Za-z0-9_]", "_", name) for name in scanners]
    unique = [name if plain.count(name) == 1 else f"{name}_{index}" for index, name in enumerate(plain)]
    return tuple(f"/{name if not name[:1].isdigit() else f'_{name}'}/scan" for name in unique)


def beams_topic(scan_topic: str) -> str:
    """Topic of what the LaserScans of a topic cannot hold."""
    return f"/commission{scan_topic.removesuffix('scan')}beams"


def detected_topic(scan_topic: str) -> str:
    """Topic of what the scanner of a topic detected itself."""
    return f"/commission{scan_topic.removesuffix('scan')}detected"


def frame_of(scan_topic: str) -> str:
    """Name of the frame of a scanner: `laser`, of several `front_laser`."""
    return f"{scan_topic.removesuffix('/scan').strip('/')}_laser".lstrip("_") if scan_topic != "/scan" else "laser"


def _opened(path: Path) -> IO[bytes]:
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        return path.open("wb")
    except (OSError, ValueError) as error:
        raise cannot_write(path, error) from error

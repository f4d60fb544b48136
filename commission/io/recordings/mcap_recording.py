"""Reading back what our recorder wrote, to the last bit: from the messages that stand beside those of ROS.

Scans stay in the file. Any other MCAP is a bag (`ros_source`), and so is this one where topics are named.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from commission.errors import FileFormatError
from commission.geometry.arrays import Scalar
from commission.io.recordings import motion
from commission.io.recordings.mcap_columns import (
    ExactBeams,
    PairColumns,
    ReflexColumns,
    RowColumns,
    ScanColumns,
    TagColumns,
    in_order_once,
    read_columns,
)
from commission.io.recordings.mcap_index import McapIndex
from commission.io.recordings.mcap_reader import MAGIC, Message
from commission.io.recordings.mcap_scans import McapScans, ScanPlaces
from commission.io.recordings.recorded_start import recorded_start_of
from commission.io.recordings.recorder import (
    BEARINGS,
    BESIDE,
    DISPLACEMENTS,
    ESTIMATE,
    METADATA,
    REFERENCES,
    TAGS,
    VERSION,
    beams_topic,
    detected_topic,
    scanner_topics,
)
from commission.io.recordings.reference_file import reference_mount_of
from commission.io.recordings.scan_file import IN_MEMORY
from commission.io.recordings.truth_file import truth_of
from commission.io.recordings.whole import WholeRecording
from commission.site.bearing_log import BearingLog
from commission.site.record_log import RecordLog
from commission.site.record_store import ScanStore
from commission.site.recorded_start import RecordedStart
from commission.site.reference_mount import BASE, ReferenceMount
from commission.site.scanner import is_name
from commission.site.tag_log import TagLog
from commission.site.truth import Truth

_MESSAGE = struct.Struct("<QHIQ")
"""Begin of a message behind its kind: bytes, channel, count, time of recording; that of sending follows."""
_BEGIN = 400
"""Bytes in which the file says whose it is."""


class McapRecording(WholeRecording):
    """A file of our recorder.

    Parameters
    ----------
    path : where it is.
    copy : the MCAP file that is read, where that is another one; None: itself.

    Raises
    ------
    FileFormatError
        it is damaged, or of a version that this program does not know.
    """

    def __init__(self, path: Path, copy: Path | None = None) -> None:
        self.path = path
        self._file = path if copy is None else copy
        self._index: McapIndex | None = McapIndex(self._file)
        self._said = self._index.metadata.get(METADATA, {})
        version = self._said.get("version")
        if version != VERSION:
            remedy = f"{VERSION}, the version this program knows"
            raise FileFormatError(path, "metadata version", f"is {version!r}", remedy)
        try:
            names = tuple(json.loads(self._said.get("scanners", "")))
        except (ValueError, TypeError, RecursionError):
            names = ()
        if (
            not names
            or not all(isinstance(name, str) and is_name(name) for name in names)
            or len(set(names)) < len(names)
        ):
            raise FileFormatError(path, "metadata scanners", "names no scanners", "their names, as a list")
        self.scanners: tuple[str, ...] = names

    @staticmethod
    def recognizes(path: Path) -> bool:
        """Whether a path is such a file, by its first bytes."""
        if not path.is_file():
            return False
        with path.open("rb") as file:
            begin = file.read(_BEGIN)
        return begin.startswith(MAGIC) and b"\x0a\x00\x00\x00commission" in begin[len(MAGIC) + 30 :]

    def truth(self) -> Truth | None:
        """Return the constants of a virtual drive; None of a real vehicle. Raises FileFormatError."""
        text = self._said.get("truth")
        return None if text is None else truth_of(self.path, text)

    def reference_mount(self) -> ReferenceMount:
        """Return where on the vehicle the reference measures; raises FileFormatError."""
        text = self._said.get("reference")
        return BASE if text is None else reference_mount_of(self.path, text)

    def holds_estimates(self) -> bool:
        """Whether it holds what a localizer said while it was recorded; ask before it is loaded."""
        index = self._index = self._index or McapIndex(self._file)
        return bool(index.channels_of(ESTIMATE))

    def beside(self) -> Iterator[Message]:
        """Deliver what stands beside the records, as it was written, in memory of a chunk and of its places."""
        index = McapIndex(self._file)
        numbers = [number for topic in BESIDE for number in index.channels_of(topic)]
        places = [index.places[number] for number in numbers]
        index.places.clear()
        if not places:
            return
        of = np.repeat(numbers, [len(each.chunks) for each in places])
        chunks = np.concatenate([each.chunks for each in places])
        offsets = np.concatenate([each.offsets for each in places])
        for row in np.lexsort((offsets, chunks)):
            begin, content = int(offsets[row]), index.content(int(chunks[row]))
            head = content[begin + 1 : begin + 1 + _MESSAGE.size]
            size, _, _, log_time_ns = _MESSAGE.unpack(head) if len(head) == _MESSAGE.size else (0, 0, 0, 0)
            if size < 22 or begin + 9 + size > len(content):
                raise index.error(begin, f"a message of {size} bytes", "one of 22 or more, within its chunk")
            data = content[begin + 1 + _MESSAGE.size + 8 : begin + 9 + size]
            yield Message(index.announced.channels[int(of[row])], log_time_ns, data)

    def start(self) -> RecordedStart | None:
        """Return where the vehicle was said to be when the recording began; raises FileFormatError."""
        text = self._said.get("start")
        return None if text is None else recorded_start_of(self.path, text)

    def load(self) -> RecordLog:
        """Read everything but scans into columns; raises FileFormatError."""
        moved, referred, tagged, turned = RowColumns(3), RowColumns(3), TagColumns(), ReflexColumns()
        topics = scanner_topics(self.scanners)
        scans = [(ScanColumns(), ExactBeams()) for _ in topics]
        detected = [PairColumns() for _ in topics]
        takers = {DISPLACEMENTS: moved.take, REFERENCES: referred.take, TAGS: tagged.take, BEARINGS: turned.take}
        for topic, (ranges, beams), pairs in zip(topics, scans, detected, strict=True):
            takers |= {topic: ranges.take, beams_topic(topic): beams.take, detected_topic(topic): pairs.take}
        index, self._index = self._index or McapIndex(self._file), None
        read_columns(index, takers)
        # What scans still need is in their own places.
        index.places.clear()
        notes = [f"{self.path.name} was cut while it was recorded; it is read up to there"] * index.is_cut
        odometry = motion.composed(moved.stamps_ns.array(), moved.rows.array())
        notes += _told("rows of odometry", odometry.disordered, odometry.repeated, "composed")
        reference_stamps, reference_poses = referred.stamps_ns.array(), referred.rows.array()
        rows, late, repeated = in_order_once(reference_stamps)
        notes += _told("reference poses", late, repeated, "left out")
        stores: list[ScanStore] = []
        for scanner, (ranges, beams) in enumerate(scans):
            found, told = self._scans(index, scanner, ranges, beams)
            notes += told
            stores += [] if found is None else [found]
        detections, tags, bearings = self._detections(detected), self._tags(tagged), self._bearings(turned)
        seen = len(detections[0]) + len(tags) + len(bearings)
        if not (len(odometry.stamps_ns) or len(reference_stamps) or stores or seen):
            raise FileFormatError(self.path, "", "holds no record", "a recording of a drive")
        self._check(odometry.rows, "displacements")
        return RecordLog(
            odometry_stamps_ns=odometry.stamps_ns,
            displacements=odometry.rows,
            scanners=self.scanners,
            scans=tuple(stores),
            detection_stamps_ns=detections[0],
            detection_scanners=detections[1],
            detection_offsets=detections[2],
            range_bearing=detections[3],
            tags=tags,
            bearings=bearings,
            reference_stamps_ns=reference_stamps[rows],
            reference_poses=reference_poses[rows],
            reference_mount=self.reference_mount(),
            truth=self.truth(),
            start=self.start(),
            notes=tuple(notes),
        )

    def _scans(
        self, index: McapIndex, scanner: int, found: ScanColumns, exact: ExactBeams
    ) -> tuple[ScanStore | None, list[str]]:
        """Scans of one scanner, in memory or in the file by their size, and what was mended."""
        # The one stands behind the other: where the file is cut between them, one is left over.
        count = min(len(found.stamps_ns.array()), len(exact.stamps_ns.array()))
        stamps = found.stamps_ns.array()[:count]
        if not count:
            return None, []
        if not np.array_equal(stamps, exact.stamps_ns.array()[:count]):
            where = scanner_topics(self.scanners)[scanner]
            raise FileFormatError(self.path, where, "has scans whose angles are missing", "a file as it was recorded")
        rows, late, repeated = in_order_once(stamps)
        beams, flags = found.beams.array()[:count], exact.flags.array()[:count]
        angles = exact.angles.array()[:count]
        if (beams < 1).any() or ((flags != beams) & (flags > 0)).any() or not np.isfinite(angles).all():
            where = scanner_topics(self.scanners)[scanner]
            raise FileFormatError(self.path, where, "has scans of no beams, or with other flags", "as it was recorded")
        places = ScanPlaces(
            chunks=found.chunks.array()[:count],
            ranges=found.ranges.array()[:count],
            intensities=found.intensities.array()[:count] if found.has_intensities else None,
            flag_chunks=exact.chunks.array()[:count],
            reflector=np.where(flags > 0, exact.places.array()[:count], -1) if flags.any() else None,
            limits=found.limits.array()[:count],
        )
        store = McapScans(
            index=index,
            places=replace(places.chosen(rows), limits=_once(places.limits[rows])),
            stamps_ns=stamps[rows],
            angle_min=_once(angles[rows, 0]),
            angle_increment=_once(angles[rows, 1]),
            beams=_once(beams[rows]),
            most=int(beams.max()),
            scanner=scanner,
            clean=self._check_ranges,
        )
        is_small = len(store) * store.most * 9 <= IN_MEMORY
        return store.block(0, len(store)) if is_small else store, _told("scans", late, repeated, "left out")

    def _check_ranges(self, ranges: np.ndarray, _intensities: np.ndarray | None, _limits: np.ndarray) -> None:
        """Raise FileFormatError where a range of scans that are read cannot be."""
        if (ranges < 0.0).any():
            found = f"has a range of {np.nanmin(ranges):g} m"
            raise FileFormatError(self.path, "scans", found, "0 m or more, as it was recorded")

    def _detections(self, found: list[PairColumns]) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Stamps, scanners, offsets and pairs of what the scanners themselves detected, in order of their stamps."""
        stamps = np.concatenate([each.stamps_ns.array() for each in found])
        counts = np.concatenate([each.counts.array() for each in found])
        pairs = np.concatenate([each.pairs.array() for each in found])
        scanners = np.repeat(np.arange(len(found)), [len(each.stamps_ns.array()) for each in found])
        order = np.argsort(stamps, kind="stable")
        begins = (np.cumsum(counts) - counts)[order]
        counts = counts[order]
        offsets = np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)
        rows = np.repeat(begins - offsets[:-1], counts) + np.arange(int(counts.sum()))
        self._check(pairs, "detections")
        if len(pairs) and not pairs[:, 0].min() > 0.0:
            raise FileFormatError(self.path, "detections", f"has a range of {pairs[:, 0].min():g} m", "more than 0 m")
        return stamps[order], scanners[order], offsets, pairs[rows]

    def _tags(self, found: TagColumns) -> TagLog:
        """Frames with tags; raises FileFormatError where a number cannot be."""
        try:
            return found.log()
        except ValueError as error:
            raise FileFormatError(self.path, "tags", str(error), "a file as it was recorded") from error

    def _bearings(self, found: ReflexColumns) -> BearingLog:
        """Reflexes of a goniometer; raises FileFormatError where a number cannot be."""
        try:
            return found.log()
        except ValueError as error:
            raise FileFormatError(self.path, "bearings", str(error), "a file as it was recorded") from error

    def _check(self, values: np.ndarray, name: str) -> None:
        """Raise FileFormatError where a number is not finite."""
        if not np.isfinite(values).all():
            raise FileFormatError(self.path, name, "has a number that is not finite", "a file as it was recorded")


def _once(values: NDArray[Scalar]) -> NDArray[Scalar]:
    """(K, ...) the same values, in the memory of one row where all are one: of hours, each column is 4 MB and more."""
    is_one = len(values) > 1 and bool((values == values[0]).all())
    return np.broadcast_to(values[:1].copy(), values.shape) if is_one else values


def _told(name: str, late: int, repeated: int, fate: str) -> list[str]:
    """What is said of records that were out of order, or had a stamp that was taken."""
    notes = [f"{late} {name} came after a later one and are sorted"] if late else []
    return [*notes, f"{repeated} {name} have a stamp that is taken and are {fate}"] if repeated else notes

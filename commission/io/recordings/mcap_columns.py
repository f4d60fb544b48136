"""What messages of an MCAP file hold as columns: scans, rows of numbers, detections. One pass over the file's chunks.

It knows the fields of a few types, and no record of ours.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator

import numpy as np

from commission.geometry.arrays import FloatArray, Growing, IntArray
from commission.io.recordings.cdr_columns import CdrColumns
from commission.io.recordings.mcap_index import McapIndex
from commission.site.bearing_log import BearingLog
from commission.site.records import Reflex, TagSightings
from commission.site.tag_log import TagLog

BEAM_LIMIT = 100_000
"""Beams in one scan."""


class RowColumns:
    """Messages that are a header and some doubles.

    Parameters
    ----------
    width : numbers of a message.
    """

    def __init__(self, width: int) -> None:
        self.stamps_ns: Growing[np.int64] = Growing(np.int64)
        self.rows: Growing[np.float64] = Growing(np.float64, width)
        self._width = width

    def take(self, _: int, found: CdrColumns) -> None:
        """Take the messages of a chunk; raises ValueError where they are of another type."""
        self.stamps_ns.append(found.stamps_ns())
        self.rows.append(found.rows(found.after_header(8), "<f8", self._width))


class PairColumns:
    """Messages that are a header and two arrays of doubles of one length."""

    def __init__(self) -> None:
        self.stamps_ns: Growing[np.int64] = Growing(np.int64)
        self.counts: Growing[np.int64] = Growing(np.int64)
        self.pairs: Growing[np.float64] = Growing(np.float64, 2)

    def take(self, _: int, found: CdrColumns) -> None:
        """Take the messages of a chunk; raises ValueError where they are of another type."""
        counts, firsts = found.arrays(found.after_header(4), 8)
        others, seconds = found.arrays(firsts + 8 * counts, 8)
        if (counts != others).any():
            raise ValueError("a message has as many ranges as it has no bearings")
        self.stamps_ns.append(found.stamps_ns())
        self.counts.append(counts)
        self.pairs.append(np.stack([found.gathered(firsts, counts), found.gathered(seconds, counts)], axis=1))


class TagColumns:
    """Messages that are a header, an array of doubles, six of each tag, and the ids of these as a list of JSON."""

    def __init__(self) -> None:
        self.stamps_ns: Growing[np.int64] = Growing(np.int64)
        self.counts: Growing[np.int64] = Growing(np.int64)
        self.sightings: Growing[np.float64] = Growing(np.float64, 6)
        self.ids: list[str] = []

    def take(self, _: int, found: CdrColumns) -> None:
        """Take the messages of a chunk; raises ValueError where they are of another type."""
        counts, firsts = found.arrays(found.after_header(4), 8)
        lengths, texts = found.arrays(firsts + 8 * counts, 1)
        for count, begin, length in zip(counts.tolist(), texts.tolist(), lengths.tolist(), strict=True):
            ids = json.loads(found.content[begin : begin + max(length - 1, 0)].tobytes().decode())
            if not isinstance(ids, list) or 6 * len(ids) != count or not all(isinstance(each, str) for each in ids):
                raise ValueError("a message has other ids than tags")
            self.ids.extend(ids)
        self.stamps_ns.append(found.stamps_ns())
        self.counts.append(counts // 6)
        self.sightings.append(found.gathered(firsts, counts).reshape(-1, 6))

    def log(self) -> TagLog:
        """Return the frames in order of their stamps; raises ValueError where a number cannot be."""
        stamps, counts, ids = self.stamps_ns.array(), self.counts.array(), self.ids
        ends, sightings = np.cumsum(counts), self.sightings.array()
        frames = [
            TagSightings(
                int(stamps[k]), sightings[ends[k] - counts[k] : ends[k]], tuple(ids[ends[k] - counts[k] : ends[k]])
            )
            for k in np.argsort(stamps, kind="stable").tolist()
        ]
        return TagLog.of(frames)


class ReflexColumns:
    """Messages that are a header, an array of one bearing or none, and the id of a reflector."""

    def __init__(self) -> None:
        self.stamps_ns: Growing[np.int64] = Growing(np.int64)
        self.bearings: Growing[np.float64] = Growing(np.float64)
        self.reflectors: list[str] = []

    def take(self, _: int, found: CdrColumns) -> None:
        """Take the messages of a chunk; raises ValueError where they are of another type."""
        counts, firsts = found.arrays(found.after_header(4), 8)
        if (counts > 1).any():
            raise ValueError("a message has more than one bearing")
        lengths, texts = found.arrays(firsts + 8 * counts, 1)
        for begin, length in zip(texts.tolist(), lengths.tolist(), strict=True):
            self.reflectors.append(found.content[begin : begin + max(length - 1, 0)].tobytes().decode())
        bearings = np.full(len(counts), np.nan)
        bearings[counts == 1] = found.gathered(firsts, counts)
        self.stamps_ns.append(found.stamps_ns())
        self.bearings.append(bearings)

    def log(self) -> BearingLog:
        """Return the reflexes in order of their stamps; raises ValueError where a number cannot be."""
        stamps, bearings = self.stamps_ns.array().tolist(), self.bearings.array().tolist()
        order = np.argsort(self.stamps_ns.array(), kind="stable").tolist()
        return BearingLog.of([Reflex(stamps[k], bearings[k], self.reflectors[k]) for k in order])


class ScanColumns:
    """Messages that are a `sensor_msgs/LaserScan`."""

    def __init__(self) -> None:
        self.stamps_ns: Growing[np.int64] = Growing(np.int64)
        self.log_times_ns: Growing[np.int64] = Growing(np.int64)
        self.angles: Growing[np.float32] = Growing(np.float32, 2)
        self.limits: Growing[np.float32] = Growing(np.float32, 2)
        self.beams: Growing[np.int64] = Growing(np.int64)
        self.chunks: Growing[np.int32] = Growing(np.int32)
        self.ranges: Growing[np.int32] = Growing(np.int32)
        self.intensities: Growing[np.int32] = Growing(np.int32)
        self.has_intensities = False

    def take(self, chunk: int, found: CdrColumns) -> None:
        """Take the messages of a chunk; raises ValueError where they are of another type."""
        begins = found.after_header(4)
        numbers = found.rows(begins, "<f4", 7)
        counts, ranges = found.arrays(begins + 28, 4)
        others, intensities = found.arrays(ranges + 4 * counts, 4)
        if (counts > BEAM_LIMIT).any():
            raise ValueError(f"a scan has {counts.max()} beams; expected {BEAM_LIMIT} at most")
        has_intensities = (others == counts) & (counts > 0)
        self.stamps_ns.append(found.stamps_ns())
        self.log_times_ns.append(found.log_times_ns())
        self.angles.append(numbers[:, [0, 2]])
        self.limits.append(numbers[:, 5:7])
        self.beams.append(counts)
        self.chunks.append(np.full(len(counts), chunk, np.int32))
        self.ranges.append(ranges.astype(np.int32))
        self.intensities.append(np.where(has_intensities, intensities, -1).astype(np.int32))
        self.has_intensities |= bool(has_intensities.any())


class ExactBeams:
    """Messages of our own that hold what a LaserScan cannot."""

    def __init__(self) -> None:
        self.stamps_ns: Growing[np.int64] = Growing(np.int64)
        self.angles: Growing[np.float64] = Growing(np.float64, 2)
        self.flags: Growing[np.int64] = Growing(np.int64)
        self.chunks: Growing[np.int32] = Growing(np.int32)
        self.places: Growing[np.int32] = Growing(np.int32)

    def take(self, chunk: int, found: CdrColumns) -> None:
        """Take the messages of a chunk; raises ValueError where they are of another type."""
        begins = found.after_header(8)
        counts, places = found.arrays(begins + 16, 1)
        self.stamps_ns.append(found.stamps_ns())
        self.angles.append(found.rows(begins, "<f8", 2))
        self.flags.append(counts)
        self.chunks.append(np.full(len(counts), chunk, np.int32))
        self.places.append(places.astype(np.int32))


class MotionColumns:
    """Messages that are a `nav_msgs/Odometry`."""

    def __init__(self) -> None:
        self.stamps_ns: Growing[np.int64] = Growing(np.int64)
        self.log_times_ns: Growing[np.int64] = Growing(np.int64)
        self.numbers: Growing[np.float64] = Growing(np.float64, 13)

    def take(self, _: int, found: CdrColumns) -> None:
        """Take position, quaternion (x, y, z, w) and twist of the messages of a chunk; ValueError: another type."""
        begins = found.after_text(found.after_header(4), 8)
        pose, twist = found.rows(begins, "<f8", 7), found.rows(begins + 8 * (7 + 36), "<f8", 6)
        self.stamps_ns.append(found.stamps_ns())
        self.log_times_ns.append(found.log_times_ns())
        self.numbers.append(np.concatenate([pose, twist], axis=1))


def read_columns(index: McapIndex, takers: dict[str, Callable[[int, CdrColumns], None]]) -> None:
    """Read some topics of a file, each chunk once.

    Parameters
    ----------
    index : the file.
    takers : what takes the messages of each topic, with the index of their chunk.

    Raises
    ------
    FileFormatError
        a chunk is damaged, or a message is not what its topic says.
    """
    for topic, chunk, found in _parts(index, takers):
        try:
            takers[topic](chunk, found())
        except (ValueError, IndexError) as error:
            place = index.chunks[chunk].begin
            raise index.error(place, f"a chunk whose messages of {topic} are none ({error})", "a whole file") from error


def _parts(index: McapIndex, topics: Iterable[str]) -> Iterator[tuple[str, int, Callable[[], CdrColumns]]]:
    """Topic, chunk, and what gives the messages of that topic in that chunk."""
    edges = np.arange(len(index.chunks) + 1)
    starts = [
        (topic, channel, index.places[channel].offsets, np.searchsorted(index.places[channel].chunks, edges).tolist())
        for topic in topics
        for channel in index.channels_of(topic)
    ]
    for chunk, place in enumerate(index.chunks):
        content: bytes | None = None
        for topic, channel, offsets, edge in starts:
            if edge[chunk] < edge[chunk + 1]:
                # Scans are not compressed; their checksums would take half of the time, and are due when one is read.
                content = content or index.content(chunk, is_checked=bool(place.compression))
                part = offsets[edge[chunk] : edge[chunk + 1]]
                yield topic, chunk, lambda c=content, p=part, n=channel: CdrColumns.of(c, p, n)


def in_order_once(stamps_ns: IntArray) -> tuple[IntArray | slice, int, int]:
    """Rows in order of their stamps, the first of each stamp; how many came late, and how many are left out."""
    if len(stamps_ns) < 2 or int(np.diff(stamps_ns).min()) > 0:
        # All of them, without a copy: a drive of hours has a million.
        return slice(None), 0, 0
    late = int((stamps_ns < np.maximum.accumulate(stamps_ns)).sum())
    order = np.argsort(stamps_ns, kind="stable")
    is_first = np.append(True, np.diff(stamps_ns[order]) > 0)
    return order[is_first], late, int(len(order) - is_first.sum())


def headings(quaternions: FloatArray) -> FloatArray:
    """(N,) headings of quaternions x, y, z, w [rad]; NaN where one is none (all zeros: the sender knows no heading)."""
    x, y, z, w = quaternions.T
    norm = x * x + y * y + z * z + w * w
    found = np.arctan2(2.0 * (w * z + x * y), norm - 2.0 * (y * y + z * z))
    return np.where((norm > 0.25) & (norm < 4.0), found, np.nan)

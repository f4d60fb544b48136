"""ROS bags as recordings: MCAP and sqlite3 of ROS 2, and ROS 1. Which topics are read is said in `channels`."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from commission.errors import FileFormatError
from commission.io.recordings import ros_messages as ros
from commission.io.recordings.channels import NO_OPTIONS, ChannelOptions, Chosen, Role, Topic, choose, left_out
from commission.io.recordings.collector import Collector, MotionKind
from commission.io.recordings.frames import Frames
from commission.io.recordings.ros_source import BagMessage, is_bag, open_bag
from commission.io.recordings.whole import WholeRecording
from commission.site.record_log import RecordLog
from commission.site.recorded_mounting import RecordedMounting
from commission.site.recorded_sweep import RecordedSweep
from commission.site.scanner import ONLY_NAME

SOON_NS = 60_000_000_000
"""Latest first stamp of a simulation whose time began at 0 [ns]."""
_HELD = 64
"""Messages of a topic that wait for one whose stamp is not 0; all further ones have none."""


class RosBag(WholeRecording):
    """A ROS bag; opening it reads its index and chooses its topics."""

    def __init__(self, path: Path, options: ChannelOptions = NO_OPTIONS) -> None:
        """Open a bag; raises FileFormatError, or UsageError where it has several candidates for one role."""
        self.path = path
        self.options = options
        self._bag = open_bag(path)
        found = [each for t in self._bag.topics for each in ros.topic_of(t.name, t.type, t.count)]
        unasked = [topic for topic in found if ros.is_taken_unasked(topic)]
        # Named as odometry, a topic is not the reference as well.
        named = {(word.partition("=")[0].partition(".")[0], word.partition("=")[2]) for word in options.channels}
        asked = [topic for topic in found if topic not in unasked and (topic.role, topic.name) in named]
        self.chosen = choose(path, unasked + asked, options)
        self._far = [topic for topic in found if topic not in unasked]
        if self.chosen.odometry is None and not any(word.startswith(Role.ODOMETRY) for word in options.channels):
            self.chosen = replace(self.chosen, odometry=self._moving_transforms())
        self._check()
        self.scanners = tuple(sorted(self.chosen.scanners.values())) or (ONLY_NAME,)

    @staticmethod
    def recognizes(path: Path) -> bool:
        """Whether a path is a bag, by its content."""
        return is_bag(path)

    def load(self) -> RecordLog:
        """Read everything into columns; raises FileFormatError."""
        odometry = self.chosen.odometry
        collector = Collector(
            self.path,
            self.scanners,
            None if odometry is None else self._motion_kind(odometry),
            self.options.wheels,
        )
        try:
            reading = _Reading(self.chosen, self.scanners, collector, self.options)
            notes = self._read(reading)
            return replace(collector.log(notes), mountings=reading.mountings(), sweeps=reading.sweeps())
        finally:
            collector.close()

    def _moving_transforms(self) -> Topic | None:
        """Topic whose transforms move the vehicle in the frame of its odometry; None where there is none."""
        topics = {topic.name: topic for topic in self._far if topic.type in ros.TF_TYPES}
        for message in self._bag.messages(topics) if topics else ():
            if any(ros.is_odometry(each) for each in message.value.transforms):
                return topics[message.topic]
        return None

    def _motion_kind(self, odometry: Topic) -> MotionKind:
        kind = ros.MOTION_KINDS[odometry.type]
        if kind is MotionKind.WHEEL_ANGLES and self.options.wheels is not None:
            # Other joints may have other programs that tell of them.
            for message in self._bag.messages({odometry.name}):
                has_angles = ros.has_wheel_angles(message.value, self.options.wheels)
                if has_angles is not None:
                    return kind if has_angles else MotionKind.WHEEL_SPEEDS
        return kind

    def _check(self) -> None:
        """Raise FileFormatError where the bag has nothing to read, or turning wheels of unknown size."""
        chosen = self.chosen
        if not chosen.scanners and chosen.odometry is None and chosen.reference is None:
            empty = {topic.name: ", no message" for topic in self._bag.topics if topic.count == 0}
            read = [f"{topic.name} ({topic.type}{empty.get(topic.name, '')})" for topic in self._bag.topics]
            has = ", ".join((*read, *self._bag.unread)[:8]) or "none at all"
            remedy = "sensor_msgs/LaserScan, nav_msgs/Odometry or geometry_msgs/PoseStamped"
            raise FileFormatError(self.path, "", f"has no topic that is read (it has {has})", remedy)
        if chosen.odometry is not None and chosen.odometry.type == "sensor_msgs/msg/JointState":
            if self.options.wheels is None:
                wanted = (
                    "--wheels LEFT,RIGHT,RADIUS,SEPARATION (names of the joints, metres), or --channel odometry=none"
                )
                raise FileFormatError(
                    self.path, chosen.odometry.name, "is the only odometry, of turning wheels", wanted
                )

    def _read(self, reading: _Reading) -> list[str]:
        """Read every message; returns what is to be told."""
        topics = {t.name for t in self._bag.topics if t.type in ros.TF_TYPES}
        topics |= set(self.chosen.scanners)
        topics |= {topic.name for topic in (self.chosen.odometry, self.chosen.reference) if topic is not None}
        types = {topic.name: topic.type for topic in self._bag.topics}
        for message in self._bag.messages(topics):
            try:
                reading.take(message, types[message.topic])
            except (AttributeError, TypeError, ValueError, OverflowError) as error:
                found = f"a message is no {types[message.topic]} ({error})"
                raise FileFormatError(self.path, message.topic, found, "the fields that ROS gives it") from error
        reading.end()
        return [*self._chosen_notes(), *self._bag.notes, *reading.notes()]

    def _chosen_notes(self) -> Iterator[str]:
        """Which topics stand for what."""
        for topic, name in self.chosen.scanners.items():
            yield f"scans{'' if name == ONLY_NAME else f' of {name}'} are those of {topic}"
        for role, topic in ((Role.ODOMETRY, self.chosen.odometry), (Role.REFERENCE, self.chosen.reference)):
            if topic is not None:
                yield f"the {role} is {topic.name} ({topic.type})"
        far = [topic for topic in self._far if topic.type not in ros.TF_TYPES]
        if self.chosen.odometry is None and (could := left_out(far, Role.ODOMETRY)):
            yield f"these are taken for odometry only where they are named, --channel odometry=TOPIC: {could}"


class _Reading:
    """One pass over a bag."""

    def __init__(
        self, chosen: Chosen, scanners: tuple[str, ...], collector: Collector, options: ChannelOptions
    ) -> None:
        self.chosen = chosen
        self.collector = collector
        self.options = options
        self.frames = Frames()
        self._unstamped: Counter[str] = Counter()
        self._all_beyond: Counter[str] = Counter()
        self._beyond: dict[str, tuple[float, float]] = {}
        """Farthest range by its own word, and typical range [m] of the first scan of a topic that is all beyond it."""
        self._scanner_of = {topic: scanners.index(name) for topic, name in chosen.scanners.items()}
        self._frame_of: dict[str, str] = {}
        """Frame of each scanner, by its name."""
        self._base = ""
        self._held: dict[str, list[tuple[BagMessage, str]]] = {}
        """Messages of a topic whose stamp is 0, until one with another stamp tells what it means."""
        self._is_from_zero: dict[str, bool] = {}
        """Of each topic that had such, whether its time begins at 0."""
        self._moved = ""
        """Frame that transforms move, where they are the odometry."""
        self._sweeps: dict[str, float] = {}

    def take(self, message: BagMessage, kind: str) -> None:
        """Hand a message to the collector."""
        if kind in ros.TF_TYPES:
            for each in message.value.transforms:
                self.frames.add(each)
                self._take_transform(message, each)
            return
        if ros.has_zero_stamp(message.value) and message.topic not in self._is_from_zero:
            held = self._held.setdefault(message.topic, [])
            held.append((message, kind))
            if len(held) > _HELD:
                self._let_go(message.topic, is_from_zero=False)
            return
        stamp, is_own = ros.stamp_of(getattr(message.value, "header", None), message.log_time_ns)
        if message.topic in self._held:
            self._let_go(message.topic, is_from_zero=is_own and stamp <= SOON_NS)
        if not is_own and self._is_from_zero.get(message.topic, False):
            stamp, is_own = 0, True
        self._take_stamped(message, kind, stamp, is_own=is_own)

    def end(self) -> None:
        """Take what still waits for a message with a stamp."""
        for topic in tuple(self._held):
            self._let_go(topic, is_from_zero=False)

    def _let_go(self, topic: str, *, is_from_zero: bool) -> None:
        """Take the messages of a topic whose stamp is 0: a time of a simulation, or none."""
        self._is_from_zero[topic] = is_from_zero
        for message, kind in self._held.pop(topic):
            self._take_stamped(message, kind, 0 if is_from_zero else message.log_time_ns, is_own=is_from_zero)

    def _take_stamped(self, message: BagMessage, kind: str, stamp: int, *, is_own: bool) -> None:
        """Hand a message to the collector.

        Parameters
        ----------
        message, kind : decoded, and the name of its type.
        stamp : when it was [ns].
        is_own : whether it says so itself.
        """
        if not is_own:
            self._unstamped[message.topic] += 1
        if message.topic in self._scanner_of:
            self._take_scan(message, kind, stamp)
        odometry, reference = self.chosen.odometry, self.chosen.reference
        if odometry is not None and message.topic == odometry.name:
            self._base = self._base or ros.base_frame(message.value, kind)
            has_angles = self.collector.kind is not MotionKind.WHEEL_SPEEDS
            row = ros.motion_of(message.value, kind, self.options.wheels, has_angles=has_angles)
            if row is None:
                joints = ", ".join(map(str, list(message.value.name)[:8])) or "none"
                why = f"without both of the wheels that --wheels names (its joints: {joints})"
                self.collector.told[f"messages of {message.topic} {why} are left out"] += 1
            else:
                self.collector.add_motion(stamp, row)
        if reference is not None and message.topic == reference.name:
            self.collector.add_reference(stamp, *ros.pose_of(message.value))

    def _take_transform(self, message: BagMessage, stamped: Any) -> None:
        """Take where odometry has the vehicle, where nothing else in the bag says it."""
        odometry = self.chosen.odometry
        if odometry is None or odometry.name != message.topic or not ros.is_odometry(stamped):
            return
        moved = _frame_of(stamped.child_frame_id)
        self._moved = self._base = self._moved or moved
        if moved != self._moved:
            self.collector.told[f"transforms of {moved} in {_frame(stamped.header)} are of another vehicle"] += 1
            return
        stamp, is_own = ros.stamp_of(stamped.header, message.log_time_ns)
        if not is_own:
            self._unstamped[message.topic] += 1
        self.collector.add_motion(stamp, ros.planar_pose_of(stamped.transform))

    def _take_scan(self, message: BagMessage, kind: str, stamp: int) -> None:
        scanner = self._scanner_of[message.topic]
        scan = ros.scan_of(message.value, kind, stamp, scanner)
        if scan is None:
            why = "without beams, or without an angle_min and angle_increment from beam to beam,"
            self.collector.told[f"messages of {message.topic} {why} are left out"] += 1
            return
        if not np.isfinite(scan.ranges).any() and math.isfinite(typical := ros.typical_range(message.value, kind)):
            farthest = float(message.value.range_max)
            self._beyond.setdefault(message.topic, (farthest, typical))
            self._all_beyond[message.topic] += 1
        name = self.collector.scanners[scanner]
        self._frame_of[name] = _frame(message.value.header)
        self._sweeps.setdefault(name, ros.sweep_of(message.value))
        if scan.intensities is None:
            some = 0 < len(message.value.intensities) != len(message.value.ranges)
            what = f"{len(message.value.intensities)} intensities of {len(message.value.ranges)} beams" if some else ""
            what = what or "no intensities"
            self.collector.told[f"scans of {message.topic} have {what}: no reflector can be seen in them"] += 1
        self.collector.add_scan(scan)

    def notes(self) -> Iterator[str]:
        """What is to be told after the last message."""
        for topic, count in self._unstamped.items():
            yield f"{count} messages of {topic} have no stamp; the time of recording stands for it"
        for topic, (farthest, typical) in self._beyond.items():
            yield (
                f"in {self._all_beyond[topic]} scans of {topic} every range is outside of the limits that they state "
                f"themselves (range_max {farthest:g} m, typical range {typical:.4g}): nothing is left of them; "
                "are they in millimetres, or is range_max wrong?"
            )
        for mounting in self.mountings():
            yield f"scanner {mounting.scanner!r} is mounted at {mounting.words}"

    def mountings(self) -> tuple[RecordedMounting, ...]:
        """Mountings of those scanners of which the transforms tell."""
        found = (self.frames.mounting(name, frame, self._base) for name, frame in self._frame_of.items())
        return tuple(each for each in found if each is not None)

    def sweeps(self) -> tuple[RecordedSweep, ...]:
        """How the scanners turn whose messages say it."""
        return tuple(
            RecordedSweep(scanner=name, duration=abs(swept), direction=1 if swept > 0.0 else -1)
            for name, swept in self._sweeps.items()
            if swept
        )


def _frame(header: Any) -> str:
    return _frame_of(header.frame_id)


def _frame_of(name: Any) -> str:
    return str(name).strip("/")

"""Messages of a capture turned into what a recording holds: motion, scans, detections, reference. See `Messages`."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path

from commission.io.protocols.message import OdometryPose, Sent
from commission.io.recordings.captured_messages import Heard, Messages
from commission.io.recordings.collector import Collector, MotionKind
from commission.io.recordings.device_clock import DeviceClock
from commission.io.recordings.pcap import Payload, payloads
from commission.io.recordings.ros_messages import is_measured
from commission.site.records import Detections, Odometry, ReferencePose, Scan
from commission.site.scanner import is_name


class Spoken:
    """What programs said in messages while a capture was made.

    Parameters
    ----------
    path : the capture.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._looking = Messages(Counter())
        self.programs: dict[str, str] = {}
        """Kind of each program by its address."""
        self.motion: MotionKind | None = None
        """How the first odometry says motion; None where none does."""
        self._first: dict[type[Sent], tuple[str, str]] = {}
        """Of odometry and reference the program and topic that said it first: there may be several."""
        self._names: dict[str, set[str]] = {}

    def look(self, payload: Payload) -> None:
        """Learn from a payload which programs and scanners there are."""
        for each in self._looking.take(payload):
            self.programs[each.program] = each.kind
            record = each.message.record
            if isinstance(record, Scan | Detections):
                self._names.setdefault(each.program, set()).add(each.scanner)
            if isinstance(record, Odometry | OdometryPose) and self.motion is None:
                self.motion = MotionKind.POSES if isinstance(record, OdometryPose) else MotionKind.DISPLACEMENTS
                self._first[type(record)] = each.program, each.topic
            elif isinstance(record, ReferencePose) and is_measured(each.topic):
                self._first.setdefault(ReferencePose, (each.program, each.topic))

    def scanners(self) -> dict[str, str]:
        """Kind of what each scanner is told by, by its address: that of the program and its name, where it has one."""
        return {_key(program, name): self.programs[program] for program, names in self._names.items() for name in names}

    def collect(self, collector: Collector, indices: Mapping[str, int]) -> None:
        """Read all messages; raises FileFormatError.

        Parameters
        ----------
        collector : takes what they say.
        indices : of the scanners that are taken, by their addresses.
        """
        if not self.programs:
            return
        clocks = {program: DeviceClock() for program in self.programs}
        for each in self._heard(Counter()):
            # What is not taken may have stamps of long ago.
            if self._takes(each, indices):
                clocks[each.program].learn(each.message.device_ns, each.captured_ns)
        for clock in clocks.values():
            clock.begin()
        for each in self._heard(collector.told):
            if self._takes(each, indices):
                stamp = clocks[each.program].stamp(each.message.device_ns, each.captured_ns)
                _add(collector, each, stamp, indices.get(_key(each.program, each.scanner), 0))
            elif not isinstance(each.message.record, Scan | Detections):
                where = f"{each.topic or type(each.message.record).__name__} at {each.program}"
                collector.told[f"messages ({where}) are left out: another one is taken, or none of its kind"] += 1

    def notes(self) -> Iterator[str]:
        """Which programs there are."""
        return (f"{kind} is spoken at {program}" for program, kind in self.programs.items())

    def _heard(self, told: Counter[str]) -> Iterator[Heard]:
        messages = Messages(told)
        for payload in payloads(self._path):
            yield from messages.take(payload)

    def _takes(self, each: Heard, indices: Mapping[str, int]) -> bool:
        """Whether a message is taken."""
        record = each.message.record
        if isinstance(record, Scan | Detections):
            return _key(each.program, each.scanner) in indices
        return self._first.get(type(record)) == (each.program, each.topic)


def _add(collector: Collector, each: Heard, stamp_ns: int, scanner: int) -> None:
    """Hand one record to the collector."""
    match each.message.record:
        case Scan() as scan:
            collector.add_scan(replace(scan, stamp_ns=stamp_ns, scanner=scanner))
        case Detections() as detections:
            collector.add_detections(stamp_ns, detections.range_bearing, scanner)
        case OdometryPose() as moved:
            collector.add_motion(stamp_ns, moved.pose.tolist())
        case Odometry() as moved:
            collector.add_motion(stamp_ns, moved.displacement.tolist())
        case ReferencePose() as reference:
            collector.add_reference(stamp_ns, *reference.pose.tolist())
        case _:
            pass


def _key(program: str, name: str) -> str:
    return f"{program} {name}" if is_name(name) else program

"""From what a scanner sends to scans, piece by piece as it arrives: fragments joined, frames cut, turns completed.

It opens nothing: a capture and a connection both feed it. What cannot be decoded is counted and left out.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator

from commission.errors import DecodeError
from commission.io.protocols import cola, compact, nav350, safety
from commission.io.protocols.device_time import Counter32, EvenTime
from commission.site.records import Scan

MILLISECOND, MICROSECOND = 1_000_000, 1_000

Timed = tuple[int | None, int, Callable[[int, int], Scan | None]]
"""Time by the device's clock [ns] or None, time of arrival [ns], and what makes the scan from stamp and scanner."""

SEGMENT_LIMIT = 64
"""Segments of a turn; a multiScan sends 12."""
NAV_ANSWER = b"sAN mNPOSGetData "
COLA_ANSWERS = b"sSN ", b"sEA ", b"sRA ", b"sAN "
"""Begins of telegrams that a device sends when it understands; sFA is its refusal."""


class Assembly:
    """Telegrams of one sender."""

    def __init__(self, name: str, told: Counter[str]) -> None:
        self.name = name
        self.told = told
        self.answers = 0
        """Telegrams of a device that understands what it is asked, whether or not they hold a scan."""

    def take(self, data: bytes, arrived_ns: int) -> Iterator[Timed]:
        """Deliver what a payload completes; what cannot be decoded is counted."""
        try:
            yield from self.found(data, arrived_ns)
        except DecodeError as error:
            self.told[f"telegrams of {self.name} cannot be decoded and are left out ({error})"] += 1

    def found(self, data: bytes, arrived_ns: int) -> Iterator[Timed]:
        """Deliver what a payload completes; raises DecodeError."""
        raise NotImplementedError


class ColaAssembly(Assembly):
    """CoLa A and B, the scans of TiM, LMS, LRS, MRS; of several layers the level one."""

    rest = b""

    def __init__(self, name: str, told: Counter[str]) -> None:
        super().__init__(name, told)
        self.counter = Counter32(MICROSECOND)

    def found(self, data: bytes, arrived_ns: int) -> Iterator[Timed]:
        """Deliver what a payload completes; raises DecodeError."""
        frames, self.rest = cola.split_frames(self.rest + data)
        self.answers += sum(frame.startswith(COLA_ANSWERS) for frame in frames)
        for frame in frames:
            if cola.is_scan(frame):
                telegram = cola.decode_lmd(frame)
                begin_ns = self.counter.unwrapped(telegram.begin_us, arrived_ns)
                if telegram.layer:
                    self.told[f"scans of {self.name} are of layers that are not level and are left out"] += 1
                    continue
                yield (
                    begin_ns,
                    arrived_ns,
                    lambda stamp, scanner, found=telegram: cola.scan_of(found, stamp, scanner=scanner),
                )


class NavAssembly(Assembly):
    """Answers of a NAV350."""

    rest = b""

    def __init__(self, name: str, told: Counter[str]) -> None:
        super().__init__(name, told)
        self.counter = Counter32(MILLISECOND)

    def found(self, data: bytes, arrived_ns: int) -> Iterator[Timed]:
        """Deliver what a payload completes; raises DecodeError."""
        frames, self.rest = cola.split_frames(self.rest + data)
        for frame in frames:
            if frame.startswith(NAV_ANSWER):
                result = nav350.decode_nav(frame)
                stamp_ms = result.scan_stamp_ms
                device = None if stamp_ms is None else self.counter.unwrapped(stamp_ms, arrived_ns)
                yield (
                    device,
                    arrived_ns,
                    lambda stamp, scanner, found=result: nav350.scan_of(found, stamp, scanner=scanner),
                )


class SafetyAssembly(Assembly):
    """Instances of a safety scanner, whose clock jitters: times are put in line by the numbers of its scans."""

    def __init__(self, name: str, told: Counter[str]) -> None:
        super().__init__(name, told)
        self.reassembly = safety.Reassembly()
        self.even = EvenTime()

    def found(self, data: bytes, arrived_ns: int) -> Iterator[Timed]:
        """Deliver what a payload completes; raises DecodeError."""
        before = self.reassembly.lost
        instance = self.reassembly.add(safety.decode_fragment(data))
        if self.reassembly.lost > before:
            self.told[f"scans of {self.name} are left out: a fragment was lost"] += 1
        scan = None if instance is None else safety.decode_instance(instance)
        if scan is not None:
            device = None if scan.time_ns is None else self.even.of(scan.scan_number, scan.time_ns)
            yield device, arrived_ns, lambda stamp, scanner: safety.scan_of(scan, stamp, scanner=scanner)


class CompactAssembly(Assembly):
    """Turns of a picoScan or multiScan, put together from their segments."""

    rest = b""
    turn: tuple[compact.CompactModule, ...] = ()
    segments: int | None = None
    """Of the last whole turn: the next one is over when it has as many, and not when another one begins."""

    def found(self, data: bytes, arrived_ns: int) -> Iterator[Timed]:
        """Deliver what a payload completes; raises DecodeError."""
        begin, data = data, self.rest + data
        self.rest = b""
        try:
            size = compact.whole_size(data)
        except DecodeError:
            # A part was lost: begin anew with this datagram, where it is a begin.
            data = begin
            size = compact.whole_size(data) if data.startswith(compact.STX) else 0
        if size is None or (size and len(data) < size):
            self.rest = data
            return
        if not size or not compact.is_scan(data):
            return
        for module in _level(compact.decode_telegram(data[:size]).modules):
            if self.turn and module.frame != self.turn[0].frame:
                yield from self._whole(arrived_ns)
                self.turn = ()
            # A turn that never ends is none.
            self.turn = (*self.turn[-SEGMENT_LIMIT:], module)
            if len(self.turn) == self.segments:
                yield from self._whole(arrived_ns)
                self.turn = ()

    def _whole(self, captured: int) -> Iterator[Timed]:
        turn = tuple(sorted(self.turn, key=lambda module: module.segment))
        if [module.segment for module in turn] != list(range(len(turn))):
            self.told[f"turns of {self.name} without all their segments are left out"] += 1
            self.segments = None
            return
        self.segments = len(turn)
        layer = compact.level_layer(turn[0])
        begin = int(turn[0].start_us[layer]) * MICROSECOND
        yield begin, captured, lambda stamp, scanner: compact.scan_of(turn, layer, stamp, scanner=scanner)


def _level(modules: tuple[compact.CompactModule, ...]) -> tuple[compact.CompactModule, ...]:
    """Return of the modules of one telegram the one with the layer that is nearest to level."""
    if not modules:
        return ()
    return (min(modules, key=lambda module: abs(float(module.elevations[compact.level_layer(module)]))),)

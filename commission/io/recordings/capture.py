"""Captures of scanners' telegrams (pcap, pcapng) as recordings: what a scanner sent, decoded by `io.protocols`.

Each sender is a scanner. A telegram that cannot be decoded is counted and left out.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path

from commission.errors import DecodeError, FileFormatError
from commission.io.protocols import cola, compact, nav350, safety
from commission.io.recordings.channels import NO_OPTIONS, ChannelOptions, Role, Topic, choose
from commission.io.recordings.collector import Collector
from commission.io.recordings.device_clock import DeviceClock
from commission.io.recordings.pcap import Payload, is_capture, payloads
from commission.io.recordings.whole import WholeRecording
from commission.site.record_log import RecordLog
from commission.site.records import Scan
from commission.site.scanner import ONLY_NAME

LOOKED_AT = 5_000
"""Packets by which the senders of a capture are known."""
_MILLISECOND, _MICROSECOND = 1_000_000, 1_000

Timed = tuple[int | None, int, Callable[[int, int], Scan | None]]
"""Time by the device's clock [ns] or None, time of capture [ns], and what makes the scan from stamp and scanner."""


class Capture(WholeRecording):
    """A capture; opening it looks at its first packets for scanners."""

    def __init__(self, path: Path, options: ChannelOptions = NO_OPTIONS) -> None:
        """Open a capture; raises FileFormatError where it holds no telegram that is read."""
        self.path = path
        senders = dict(_senders(path))
        if not senders:
            remedy = "telegrams of SICK CoLa (LMDscandata), NAV350, Compact or safety scanners"
            raise FileFormatError(path, "", "holds no telegram that is read", remedy)
        topics = [Topic(name=f"{name}/scan", type=kind, role=Role.SCAN) for name, kind in senders.items()]
        chosen = choose(path, topics, options) if options.channels else None
        if chosen is not None:
            named = {topic.removesuffix("/scan"): name for topic, name in chosen.scanners.items()}
        elif len(senders) == 1:
            named = {name: ONLY_NAME for name in senders}
        else:
            named = {name: name.replace(".", "-").replace(":", "_") for name in senders}
        self._named = named
        self._kinds = senders
        self.scanners = tuple(sorted(named.values())) or (ONLY_NAME,)

    @staticmethod
    def recognizes(path: Path) -> bool:
        """Whether a path is a capture, by its first bytes."""
        return is_capture(path)

    def load(self) -> RecordLog:
        """Read everything into columns; raises FileFormatError."""
        collector = Collector(self.path, self.scanners, None)
        try:
            clocks = {name: DeviceClock() for name in self._named}
            for name, (device, captured, _) in self._timed(Counter()):
                clocks[name].learn(device, captured)
            for clock in clocks.values():
                clock.begin()
            for name, (device, captured, make) in self._timed(collector.told):
                scan = self._made(make, clocks[name].stamp(device, captured), name, collector)
                if scan is not None:
                    collector.add_scan(scan)
            notes = [f"scanner {scanner!r} is {name}: {self._kinds[name]}" for name, scanner in self._named.items()]
            return collector.log(notes)
        finally:
            collector.close()

    def _made(
        self, make: Callable[[int, int], Scan | None], stamp: int, name: str, collector: Collector
    ) -> Scan | None:
        try:
            return make(stamp, self.scanners.index(self._named[name]))
        except DecodeError as error:
            collector.told[f"telegrams of {name} hold no scan and are left out ({error})"] += 1
            return None

    def _timed(self, told: Counter[str]) -> Iterator[tuple[str, Timed]]:
        """Sender and scan of every telegram, with its times."""
        decoders = {name: _DECODERS[self._kinds[name]](name, told) for name in self._named}
        for payload in payloads(self.path):
            decoder = decoders.get(payload.sender)
            if decoder is not None:
                for found in decoder.take(payload):
                    yield payload.sender, found


def _senders(path: Path) -> Iterator[tuple[str, str]]:
    """Address of each sender of telegrams that are read, and the name of their kind."""
    known: dict[str, str] = {}
    begins: dict[str, bytes] = {}
    for count, payload in enumerate(payloads(path)):
        if count > LOOKED_AT and known:
            return
        if payload.sender in known:
            continue
        if payload.is_stream:
            begin = begins[payload.sender] = (begins.get(payload.sender, b"") + payload.data)[-70_000:]
            kind = "CoLa" if b"sSN LMDscandata " in begin else "NAV350" if _NAV_ANSWER in begin else ""
        elif payload.data.startswith(safety.MAGIC):
            kind = "safety scanner"
        else:
            kind = "Compact" if payload.data.startswith(compact.STX) and compact.is_scan(payload.data) else ""
        if kind:
            known[payload.sender] = kind
            yield payload.sender, kind


_NAV_ANSWER = b"sAN mNPOSGetData "


class _Decoder:
    """Telegrams of one sender."""

    def __init__(self, name: str, told: Counter[str]) -> None:
        self.name = name
        self.told = told

    def take(self, payload: Payload) -> Iterator[Timed]:
        """Deliver what a payload completes; what cannot be decoded is counted."""
        try:
            yield from self.found(payload)
        except DecodeError as error:
            self.told[f"telegrams of {self.name} cannot be decoded and are left out ({error})"] += 1

    def found(self, payload: Payload) -> Iterator[Timed]:
        """Deliver what a payload completes; raises DecodeError."""
        raise NotImplementedError


class _Cola(_Decoder):
    """CoLa A and B, the scans of TiM, LMS, LRS, MRS; of several layers the level one."""

    rest = b""

    def found(self, payload: Payload) -> Iterator[Timed]:
        frames, self.rest = cola.split_frames(self.rest + payload.data)
        for frame in frames:
            if cola.is_scan(frame):
                telegram = cola.decode_lmd(frame)
                if telegram.layer:
                    self.told[f"scans of {self.name} are of layers that are not level and are left out"] += 1
                    continue
                yield (
                    telegram.begin_us * _MICROSECOND,
                    payload.stamp_ns,
                    lambda stamp, scanner, found=telegram: cola.scan_of(found, stamp, scanner=scanner),
                )


class _Nav(_Decoder):
    """Answers of a NAV350."""

    rest = b""

    def found(self, payload: Payload) -> Iterator[Timed]:
        frames, self.rest = cola.split_frames(self.rest + payload.data)
        for frame in frames:
            if frame.startswith(_NAV_ANSWER):
                result = nav350.decode_nav(frame)
                device = None if result.scan_stamp_ms is None else result.scan_stamp_ms * _MILLISECOND
                yield (
                    device,
                    payload.stamp_ns,
                    lambda stamp, scanner, found=result: nav350.scan_of(found, stamp, scanner=scanner),
                )


class _Safety(_Decoder):
    """Instances of a safety scanner, whose own clock jitters: the time of capture stands."""

    def __init__(self, name: str, told: Counter[str]) -> None:
        super().__init__(name, told)
        self.reassembly = safety.Reassembly()

    def found(self, payload: Payload) -> Iterator[Timed]:
        before = self.reassembly.lost
        instance = self.reassembly.add(safety.decode_fragment(payload.data))
        if self.reassembly.lost > before:
            self.told[f"scans of {self.name} are left out: a fragment was lost"] += 1
        scan = None if instance is None else safety.decode_instance(instance)
        if scan is not None:
            yield None, payload.stamp_ns, lambda stamp, scanner: safety.scan_of(scan, stamp, scanner=scanner)


class _Compact(_Decoder):
    """Turns of a picoScan or multiScan, put together from their segments."""

    rest = b""
    turn: tuple[compact.CompactModule, ...] = ()

    def found(self, payload: Payload) -> Iterator[Timed]:
        data = self.rest + payload.data
        self.rest = b""
        try:
            size = compact.whole_size(data)
        except DecodeError:
            # A part was lost: begin anew with this datagram, where it is a begin.
            data = payload.data
            size = compact.whole_size(data) if data.startswith(compact.STX) else 0
        if size is None or (size and len(data) < size):
            self.rest = data
            return
        if not size or not compact.is_scan(data):
            return
        for module in _level(compact.decode_telegram(data[:size]).modules):
            if self.turn and module.frame != self.turn[0].frame:
                yield from self._whole(payload.stamp_ns)
                self.turn = ()
            self.turn = (*self.turn, module)

    def _whole(self, captured: int) -> Iterator[Timed]:
        turn = tuple(sorted(self.turn, key=lambda module: module.segment))
        if [module.segment for module in turn] != list(range(len(turn))):
            self.told[f"turns of {self.name} without all their segments are left out"] += 1
            return
        layer = compact.level_layer(turn[0])
        begin = int(turn[0].start_us[layer]) * _MICROSECOND
        yield begin, captured, lambda stamp, scanner: compact.scan_of(turn, layer, stamp, scanner=scanner)


def _level(modules: tuple[compact.CompactModule, ...]) -> tuple[compact.CompactModule, ...]:
    """Return of the modules of one telegram the one with the layer that is nearest to level."""
    if not modules:
        return ()
    return (min(modules, key=lambda module: abs(float(module.elevations[compact.level_layer(module)]))),)


_DECODERS: dict[str, Callable[[str, Counter[str]], _Decoder]] = {
    "CoLa": _Cola,
    "NAV350": _Nav,
    "safety scanner": _Safety,
    "Compact": _Compact,
}

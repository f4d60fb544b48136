"""Captures of scanners' telegrams (pcap, pcapng) as recordings: what a scanner sent, decoded by `io.protocols`.

Each sender is a scanner. A telegram that cannot be decoded is counted and left out.
"""

from __future__ import annotations

from collections import Counter, OrderedDict, deque
from collections.abc import Callable, Collection, Iterator
from pathlib import Path

from commission.errors import DecodeError, FileFormatError
from commission.io.protocols import assembly, compact, safety
from commission.io.protocols.assembly import Assembly, Timed
from commission.io.recordings.channels import NO_OPTIONS, ChannelOptions, Role, Topic, choose
from commission.io.recordings.collector import Collector
from commission.io.recordings.device_clock import DeviceClock
from commission.io.recordings.pcap import is_capture, payloads
from commission.io.recordings.spoken import Spoken
from commission.io.recordings.whole import WholeRecording
from commission.site.record_log import RecordLog
from commission.site.records import Scan
from commission.site.scanner import ONLY_NAME

_RECENT = 64
"""Scans of a scanner among which one that it sends to a second receiver is found again."""
_FLOWS = 64
"""Connections that are looked through for telegrams at once: a capture of a whole plant has thousands."""


class Capture(WholeRecording):
    """A capture; opening it looks through its packets for scanners: one may be switched on late."""

    def __init__(self, path: Path, options: ChannelOptions = NO_OPTIONS) -> None:
        """Open a capture; raises FileFormatError where it holds no telegram that is read."""
        self.path = path
        told = Counter[str]()
        self._messages = Spoken(path)
        senders = dict(_senders(path, told, self._messages))
        if not senders and not self._messages.programs:
            remedy = "telegrams of SICK CoLa (LMDscandata), NAV350, Compact or safety scanners, JSON or rosbridge"
            why = "; ".join(f"{count} {what}" for what, count in told.items() if count)
            raise FileFormatError(path, "", f"holds no telegram that is read{f' ({why})' if why else ''}", remedy)
        senders |= self._messages.scanners()
        topics = [Topic(name=f"{name}/scan", type=kind, role=Role.SCAN) for name, kind in senders.items()]
        chosen = choose(path, topics, options) if options.channels else None
        if chosen is not None:
            named = {topic.removesuffix("/scan"): name for topic, name in chosen.scanners.items()}
        else:
            named = _names(senders)
        self._named = named
        self._kinds = senders
        self._devices = {name: kind for name, kind in senders.items() if name in named and kind in _DECODERS}
        self.scanners = tuple(sorted(named.values())) or (ONLY_NAME,)

    @staticmethod
    def recognizes(path: Path) -> bool:
        """Whether a path is a capture, by its first bytes."""
        return is_capture(path)

    def load(self) -> RecordLog:
        """Read everything into columns; raises FileFormatError."""
        collector = Collector(self.path, self.scanners, self._messages.motion)
        try:
            clocks = {name: DeviceClock() for name in self._devices}
            for name, (device, captured, _) in self._timed(Counter()):
                clocks[name].learn(device, captured)
            for clock in clocks.values():
                clock.begin()
            for name, (device, captured, make) in self._timed(collector.told):
                scan = self._made(make, clocks[name].stamp(device, captured), name, collector)
                if scan is not None:
                    collector.add_scan(scan)
            indices = {name: self.scanners.index(scanner) for name, scanner in self._named.items()}
            self._messages.collect(collector, indices)
            notes = [f"scanner {scanner!r} is {name}: {self._kinds[name]}" for name, scanner in self._named.items()]
            return collector.log([*notes, *self._messages.notes()])
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
        """Sender and scan of every telegram, with its times; what a scanner sends to several, once."""
        decoders: dict[tuple[str, str], Assembly] = {}
        latest: dict[tuple[str, str], int] = {}
        taken: dict[str, deque[tuple[int, str]]] = {name: deque(maxlen=_RECENT) for name in self._devices}
        for payload in payloads(self.path, told, self._devices.keys()) if self._devices else ():
            name = payload.sender
            # Each connection is a stream of its own: a scanner serves a vehicle and a setup tool at once.
            receiver = payload.receiver if payload.is_stream else ""
            flow = name, receiver
            if flow not in decoders:
                decoders[flow] = _DECODERS[self._devices[name]](name, told)
            for device, captured, make in decoders[flow].take(payload.data, payload.stamp_ns):
                if device is not None and any(device == at and receiver != to for at, to in taken[name]):
                    told[f"telegrams of {name} went to a second receiver, too, and are taken once"] += 1
                    continue
                # A clock that stands says nothing.
                stands = device is not None and device == latest.get(flow)
                if device is not None:
                    latest[flow] = device
                    taken[name].append((device, receiver))
                yield name, (None if stands else device, captured, make)


def _names(senders: Collection[str]) -> dict[str, str]:
    """Name of each scanner: its own where it says one (behind the address), else of its address, or of the only one."""
    own = {sender: sender.partition(" ")[2] for sender in senders}
    if len(set(own.values())) == len(own) and all(own.values()):
        return own
    plain = {sender: sender.replace(".", "-").replace(":", "_").replace(" ", "_") for sender in senders}
    return plain if len(senders) > 1 else {sender: ONLY_NAME for sender in senders}


def _senders(path: Path, told: Counter[str], messages: Spoken) -> Iterator[tuple[str, str]]:
    """Address of each sender of telegrams that are read, and the name of their kind.

    Parameters
    ----------
    path : the capture.
    told : takes what is not read.
    messages : takes what is none of these, and finds messages in it.
    """
    known: dict[str, str] = {}
    begins: OrderedDict[tuple[str, str], bytes] = OrderedDict()
    for payload in payloads(path, told):
        if payload.sender in known:
            continue
        if payload.is_stream:
            flow = payload.sender, payload.receiver
            begin = begins[flow] = (begins.pop(flow, b"") + payload.data)[-70_000:]
            if len(begins) > _FLOWS:
                begins.popitem(last=False)
            kind = "CoLa" if b"sSN LMDscandata " in begin else "NAV350" if assembly.NAV_ANSWER in begin else ""
        elif payload.data.startswith(safety.MAGIC):
            kind = "safety scanner"
        else:
            kind = "Compact" if payload.data.startswith(compact.STX) and compact.is_scan(payload.data) else ""
        if kind:
            known[payload.sender] = kind
            yield payload.sender, kind
        else:
            messages.look(payload)


_DECODERS: dict[str, Callable[[str, Counter[str]], Assembly]] = {
    "CoLa": assembly.ColaAssembly,
    "NAV350": assembly.NavAssembly,
    "safety scanner": assembly.SafetyAssembly,
    "Compact": assembly.CompactAssembly,
}

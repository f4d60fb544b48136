"""Packets of pcap and pcapng captures: UDP datagrams whole, TCP streams in order. It knows no protocol above them.

Formats: draft-ietf-opsawg-pcap and -pcapng. What stands before IP is told by `link_layers`.
"""

from __future__ import annotations

import struct
from collections import Counter, OrderedDict
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import IO

from commission.errors import FileFormatError
from commission.io.reading import cannot_read
from commission.io.recordings.link_layers import network_packet
from commission.site.quantity import STAMP_LIMIT

PCAP_MAGICS = {
    b"\xd4\xc3\xb2\xa1": ("<", 1_000, 0),
    b"\xa1\xb2\xc3\xd4": (">", 1_000, 0),
    b"\x4d\x3c\xb2\xa1": ("<", 1, 0),
    b"\xa1\xb2\x3c\x4d": (">", 1, 0),
    b"\x34\xcd\xb2\xa1": ("<", 1_000, 8),
    b"\xa1\xb2\xcd\x34": (">", 1_000, 8),
}
"""First bytes of a pcap: order of its bytes, nanoseconds of the unit below a second, and bytes that stand before each
packet besides its header (those of routers whose kernel was patched)."""
PCAPNG_MAGIC = b"\x0a\x0d\x0d\x0a"
PACKET_LIMIT = 1_000_000
"""Bytes of a packet or block."""
_OPEN_FRAGMENTS = 64
_WAITING_SEGMENTS = 256
_TCP, _UDP = 6, 17
_PATIENCE_NS = 30_000_000_000
"""Time in which the parts of a datagram arrive (RFC 791: 15 s and more); later its number is another datagram's."""
_AGAIN_NS = 1_000_000_000
"""Time in which a part of a datagram that is whole already is one that was captured twice [ns]."""


_SIMPLE, _ENHANCED, _OBSOLETE = 3, 6, 2
"""Blocks of pcapng that hold a packet."""


@dataclass(frozen=True, slots=True)
class _Interface:
    """What packets of pcapng were captured on."""

    link: int
    """Kind of link."""
    numerator: int
    """Nanoseconds of so many units of stamps as `denominator` says."""
    denominator: int
    """See `numerator`."""
    offset_ns: int
    """What is added to each stamp [ns]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Payload:
    """What was sent: one datagram, or the next bytes of a stream."""

    stamp_ns: int
    """When it was captured; of a datagram in fragments, the first of them [ns]."""
    is_stream: bool
    """TCP, not UDP."""
    sender: str
    """Address and port: `192.168.0.1:2112`."""
    receiver: str
    """The same of where it went."""
    data: bytes
    """The bytes."""


def is_capture(path: Path) -> bool:
    """Whether a file is a capture, by its first bytes."""
    if not path.is_file():
        return False
    with path.open("rb") as file:
        begin = file.read(4)
    return begin == PCAPNG_MAGIC or begin in PCAP_MAGICS


def payloads(path: Path, told: Counter[str] | None = None, senders: Collection[str] | None = None) -> Iterator[Payload]:
    """Deliver what was sent, fragments of IP joined, TCP in the order of its bytes, each byte once.

    Parameters
    ----------
    path : the capture. One that was cut ends where it was cut.
    told : takes what is missing in the capture, and how often.
    senders : addresses whose payloads alone are delivered, and told of; None: all.

    Raises
    ------
    FileFormatError
        it is no capture, or a packet has an impossible length.
    """
    told = Counter() if told is None else told
    hosts = None if senders is None else {sender.rpartition(":")[0] for sender in senders}
    fragments, streams = _Fragments(told, hosts), _Streams(told)
    for captured, link, packet in packets(path, told):
        if abs(captured) >= STAMP_LIMIT:
            told["packets of the capture have a time that cannot be, and are left out"] += 1
            continue
        found = fragments.datagram(captured, network_packet(link, packet, told))
        if found is None:
            continue
        stamp, protocol, source, target, data = found
        if protocol == _UDP and len(data) >= 8:
            ports = struct.unpack_from(">HHH", data)
            sender, receiver = f"{source}:{ports[0]}", f"{target}:{ports[1]}"
            if senders is None or sender in senders:
                content = data[8 : max(8, ports[2])]
                yield Payload(stamp_ns=stamp, is_stream=False, sender=sender, receiver=receiver, data=content)
        elif protocol == _TCP and len(data) >= 20:
            ports = struct.unpack_from(">HH", data)
            flow = f"{source}:{ports[0]}", f"{target}:{ports[1]}"
            if senders is not None and flow[0] not in senders:
                continue
            for sent, part in streams.ordered(flow, stamp, data):
                yield Payload(stamp_ns=sent, is_stream=True, sender=flow[0], receiver=flow[1], data=part)
    fragments.end()
    for flow, sent, part in streams.rest():
        yield Payload(stamp_ns=sent, is_stream=True, sender=flow[0], receiver=flow[1], data=part)


def packets(path: Path, told: Counter[str] | None = None) -> Iterator[tuple[int, int, bytes]]:
    """Deliver stamp [ns], kind of link and bytes of every packet; raises FileFormatError. See `payloads`."""
    told = Counter() if told is None else told
    try:
        with path.open("rb") as file:
            begin = file.read(4)
            file.seek(0)
            if begin == PCAPNG_MAGIC:
                yield from _pcapng(path, file, told)
            elif begin in PCAP_MAGICS:
                yield from _pcap(path, file, PCAP_MAGICS[begin], told)
            else:
                raise FileFormatError(path, "", f"begins with {begin!r}", "a pcap or pcapng capture")
    except OSError as error:
        raise cannot_read(path, error) from error


def _pcap(
    path: Path, file: IO[bytes], kind: tuple[str, int, int], told: Counter[str]
) -> Iterator[tuple[int, int, bytes]]:
    order, unit, more = kind
    header = file.read(24)
    if len(header) < 24:
        _tell_cut(file, 0, told)
        return
    link = struct.unpack_from(f"{order}I", header, 20)[0] & 0xFFFF
    while header := file.read(16 + more):
        begin = file.tell() - len(header)
        if len(header) < 16 + more:
            _tell_cut(file, begin, told)
            return
        seconds, fraction, length, _ = struct.unpack_from(f"{order}IIII", header)
        _check(path, file.tell(), length)
        packet = file.read(length)
        if len(packet) < length:
            _tell_cut(file, begin, told)
            return
        yield seconds * 1_000_000_000 + fraction * unit, link, packet


def _pcapng(path: Path, file: IO[bytes], told: Counter[str]) -> Iterator[tuple[int, int, bytes]]:
    order, interfaces = "<", list[_Interface]()
    while header := file.read(8):
        begin = file.tell() - len(header)
        if header[:4] == PCAPNG_MAGIC:
            mark = file.read(4)
            order = ">" if mark == b"\x1a\x2b\x3c\x4d" else "<"
            interfaces = []
            file.seek(-len(mark), 1)
        if len(header) < 8:
            _tell_cut(file, begin, told)
            return
        kind, length = struct.unpack(f"{order}II", header)
        _check(path, begin, length)
        if length < 12:
            raise FileFormatError(path, f"byte {begin}", f"is a block of {length} bytes", "12 bytes or more")
        body = file.read(length - 8)
        if len(body) < length - 8:
            _tell_cut(file, begin, told)
            return
        if kind == 1 and len(body) >= 12:
            interfaces.append(_interface(order, body))
        else:
            yield from _packet(order, kind, body, interfaces, told)


def _packet(
    order: str, kind: int, body: bytes, interfaces: list[_Interface], told: Counter[str]
) -> Iterator[tuple[int, int, bytes]]:
    """Packet in a block of pcapng; nothing where it holds none."""
    if kind in (_ENHANCED, _OBSOLETE) and len(body) >= 24:
        # The older block has 16 bits for the interface, and 16 for packets that were dropped before.
        number = struct.unpack_from(f"{order}{'I' if kind == _ENHANCED else 'H'}", body)[0]
        high, low, captured = struct.unpack_from(f"{order}III", body, 4)
        if number < len(interfaces) and 20 + captured <= len(body):
            found = interfaces[number]
            stamp = (high << 32 | low) * found.numerator // found.denominator + found.offset_ns
            yield stamp, found.link, body[20 : 20 + captured]
    elif kind == _SIMPLE and interfaces and len(body) >= 8:
        told["packets of the capture have no time"] += 1
        whole = struct.unpack_from(f"{order}I", body)[0]
        yield 0, interfaces[0].link, body[4:-4][:whole]


def _tell_cut(file: IO[bytes], begin: int, told: Counter[str]) -> None:
    """Tell that the file ends inside a packet."""
    told[f"packet is cut at the end of the capture (byte {begin} of {file.tell()}); it is read up to there"] += 1


def _interface(order: str, body: bytes) -> _Interface:
    """Interface as its block describes it."""
    link, place = struct.unpack_from(f"{order}H", body)[0], 8
    numerator, denominator, offset_s = 1_000, 1, 0
    while place + 4 <= len(body) - 4:
        code, size = struct.unpack_from(f"{order}HH", body, place)
        if code == 0:
            break
        if code == 9 and size >= 1 and place + 4 < len(body):
            power = body[place + 4]
            numerator, denominator = 1_000_000_000, (2 if power & 0x80 else 10) ** (power & 0x7F)
        if code == 14 and size == 8 and place + 12 <= len(body):
            offset_s = struct.unpack_from(f"{order}q", body, place + 4)[0]
        place += 4 + size + (-size) % 4
    return _Interface(link, numerator, denominator, offset_s * 1_000_000_000)


def _check(path: Path, offset: int, length: int) -> None:
    if length > PACKET_LIMIT:
        raise FileFormatError(path, f"byte {offset}", f"a packet of {length} bytes", f"{PACKET_LIMIT} at most")


class _Fragments:
    """Joins IPv4 packets that were sent in parts."""

    def __init__(self, told: Counter[str], hosts: Collection[str] | None) -> None:
        self._told = told
        self._hosts = hosts
        self._open: OrderedDict[bytes, tuple[int, dict[int, bytes], list[int]]] = OrderedDict()
        self._whole: OrderedDict[bytes, int] = OrderedDict()
        """When those that were whole last were so [ns]: a mirrored port shows each packet twice."""

    def datagram(self, stamp_ns: int, ip: bytes) -> tuple[int, int, str, str, bytes] | None:
        """Stamp [ns], protocol, sender, receiver and content, once they are whole."""
        if len(ip) < 20:
            return None
        begin = (ip[0] & 15) * 4
        total, number, place = struct.unpack_from(">HHH", ip, 2)
        # A network card that joins segments itself says 0.
        data = ip[begin : total if begin <= total <= len(ip) and total else len(ip)]
        source, target = (".".join(str(byte) for byte in ip[at : at + 4]) for at in (12, 16))
        if self._hosts is not None and source not in self._hosts:
            return None
        if total > len(ip):
            self._told[f"packets of {source} were captured in part only (whole with tcpdump -s 0)"] += 1
        offset, more = (place & 0x1FFF) * 8, bool(place & 0x2000)
        if not offset and not more:
            return stamp_ns, ip[9], source, target, data
        key = ip[9:10] + ip[12:20] + number.to_bytes(2, "big")
        if abs(stamp_ns - self._whole.get(key, -_PATIENCE_NS)) < _AGAIN_NS:
            return None
        if key in self._open and abs(stamp_ns - self._open[key][0]) > _PATIENCE_NS:
            self._lose(key)
        first, parts, size = self._open.setdefault(key, (stamp_ns, {}, []))
        parts[offset] = data
        if not more:
            size[:] = [offset + len(data)]
        while len(self._open) > _OPEN_FRAGMENTS:
            self._lose(next(iter(self._open)))
        if not size or sum(map(len, parts.values())) < size[0]:
            return None
        self._open.pop(key, None)
        self._whole[key] = stamp_ns
        while len(self._whole) > _OPEN_FRAGMENTS:
            self._whole.popitem(last=False)
        joined = b"".join(parts[at] for at in sorted(parts))
        return (first, ip[9], source, target, joined) if len(joined) == size[0] else None

    def end(self) -> None:
        """Tell of those that are not whole when the capture ends."""
        for key in tuple(self._open):
            self._lose(key)

    def _lose(self, key: bytes) -> None:
        del self._open[key]
        source = ".".join(map(str, key[1:5]))
        self._told[f"datagrams of {source} lack a fragment of IP and are left out"] += 1


class _Streams:
    """Puts the segments of TCP streams in order; a segment that is never captured is passed over, and told."""

    def __init__(self, told: Counter[str]) -> None:
        self._told = told
        self._next: dict[tuple[str, str], int] = {}
        self._waiting: dict[tuple[str, str], dict[int, tuple[int, bytes]]] = {}

    def ordered(self, flow: tuple[str, str], stamp_ns: int, segment: bytes) -> Iterator[tuple[int, bytes]]:
        """Deliver the bytes that follow those that were delivered, each with its own time of capture [ns]."""
        number, flags = struct.unpack_from(">I", segment, 4)[0], segment[13]
        data = segment[(segment[12] >> 4) * 4 :]
        if flags & 2:
            for _, sent, part in self.rest(flow):
                yield sent, part
            self._next[flow] = (number + 1) & 0xFFFFFFFF
            return
        if not data:
            return
        expected = self._next.setdefault(flow, number)
        waiting = self._waiting.setdefault(flow, {})
        # Sent again, maybe with more behind it; a begin of long ago is another connection.
        if _ahead(number, expected) + len(data) > 0 and len(data) > len(waiting.get(number, (0, b""))[1]):
            waiting[number] = stamp_ns, data
        if len(waiting) > _WAITING_SEGMENTS:
            self._pass_over(flow)
        yield from self._following(flow)

    def rest(self, only: tuple[str, str] | None = None) -> Iterator[tuple[tuple[str, str], int, bytes]]:
        """Deliver what still waits for a segment that never came: of one flow, or of all (None)."""
        for flow in tuple(self._waiting) if only is None else (only,):
            while self._waiting.get(flow):
                self._pass_over(flow)
                for sent, part in self._following(flow):
                    yield flow, sent, part

    def _pass_over(self, flow: tuple[str, str]) -> None:
        """Go on with the next segment that is there."""
        expected = self._next[flow]
        self._next[flow] = min(self._waiting[flow], key=lambda each: _ahead(each, expected))
        self._told[f"gaps in what {flow[0]} sent: segments of TCP that were not captured"] += 1

    def _following(self, flow: tuple[str, str]) -> Iterator[tuple[int, bytes]]:
        """Deliver what follows without a gap; what was sent twice in other pieces, once."""
        waiting = self._waiting[flow]
        while waiting:
            expected = self._next[flow]
            number = min(waiting, key=lambda each: _ahead(each, expected))
            ahead = _ahead(number, expected)
            if ahead > 0:
                return
            sent, data = waiting.pop(number)
            if data := data[-ahead:]:
                self._next[flow] = (expected + len(data)) & 0xFFFFFFFF
                yield sent, data


def _ahead(number: int, expected: int) -> int:
    """Bytes from an expected number of TCP to another one, modulo 2^32."""
    return (number - expected + 0x80000000) % 0x100000000 - 0x80000000

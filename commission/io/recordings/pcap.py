"""Packets of pcap and pcapng captures: UDP datagrams whole, TCP streams in order. It knows no protocol above them.

Formats: draft-ietf-opsawg-pcap and -pcapng. Ethernet (with VLANs), raw IP, loopback and Linux cooked captures.
"""

from __future__ import annotations

import struct
from collections import OrderedDict
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import IO

from commission.errors import FileFormatError
from commission.io.reading import cannot_read

PCAP_MAGICS = {
    b"\xd4\xc3\xb2\xa1": ("<", 1_000),
    b"\xa1\xb2\xc3\xd4": (">", 1_000),
    b"\x4d\x3c\xb2\xa1": ("<", 1),
    b"\xa1\xb2\x3c\x4d": (">", 1),
}
"""First bytes of a pcap: order of its bytes, nanoseconds of the unit below a second."""
PCAPNG_MAGIC = b"\x0a\x0d\x0d\x0a"
PACKET_LIMIT = 1_000_000
"""Bytes of a packet or block."""
_OPEN_FRAGMENTS = 64
_WAITING_SEGMENTS = 256
_LINK_BYTES = {0: 4, 1: 14, 101: 0, 108: 4, 113: 16, 276: 20}
"""Bytes before IP by the kind of link: loopback, Ethernet, raw, OpenBSD loopback, Linux cooked 1 and 2."""
_TCP, _UDP = 6, 17


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


def payloads(path: Path) -> Iterator[Payload]:
    """Deliver what was sent, fragments of IP joined, TCP in the order of its bytes, each byte once.

    Parameters
    ----------
    path : the capture. One that was cut ends where it was cut.

    Raises
    ------
    FileFormatError
        it is no capture, or a packet has an impossible length.
    """
    fragments, streams = _Fragments(), _Streams()
    for captured, link, packet in packets(path):
        found = fragments.datagram(captured, _network(link, packet))
        if found is None:
            continue
        stamp, protocol, source, target, data = found
        if protocol == _UDP and len(data) >= 8:
            ports = struct.unpack_from(">HHH", data)
            yield Payload(
                stamp_ns=stamp,
                is_stream=False,
                sender=f"{source}:{ports[0]}",
                receiver=f"{target}:{ports[1]}",
                data=data[8 : max(8, ports[2])],
            )
        elif protocol == _TCP and len(data) >= 20:
            ports = struct.unpack_from(">HH", data)
            flow = f"{source}:{ports[0]}", f"{target}:{ports[1]}"
            for part in streams.ordered(flow, data):
                yield Payload(stamp_ns=stamp, is_stream=True, sender=flow[0], receiver=flow[1], data=part)


def packets(path: Path) -> Iterator[tuple[int, int, bytes]]:
    """Stamp [ns], kind of link and bytes of every packet; raises FileFormatError."""
    try:
        with path.open("rb") as file:
            begin = file.read(4)
            file.seek(0)
            if begin == PCAPNG_MAGIC:
                yield from _pcapng(path, file)
            elif begin in PCAP_MAGICS:
                yield from _pcap(path, file, *PCAP_MAGICS[begin])
            else:
                raise FileFormatError(path, "", f"begins with {begin!r}", "a pcap or pcapng capture")
    except OSError as error:
        raise cannot_read(path, error) from error


def _pcap(path: Path, file: IO[bytes], order: str, unit: int) -> Iterator[tuple[int, int, bytes]]:
    header = file.read(24)
    if len(header) < 24:
        return
    link = struct.unpack_from(f"{order}I", header, 20)[0] & 0xFFFF
    while len(header := file.read(16)) == 16:
        seconds, fraction, length, _ = struct.unpack(f"{order}IIII", header)
        _check(path, file.tell(), length)
        packet = file.read(length)
        if len(packet) < length:
            return
        yield seconds * 1_000_000_000 + fraction * unit, link, packet


def _pcapng(path: Path, file: IO[bytes]) -> Iterator[tuple[int, int, bytes]]:
    order, interfaces = "<", list[tuple[int, int, int]]()
    while len(header := file.read(8)) == 8:
        if header[:4] == PCAPNG_MAGIC:
            mark = file.read(4)
            order = ">" if mark == b"\x1a\x2b\x3c\x4d" else "<"
            interfaces = []
            file.seek(-4, 1)
        kind, length = struct.unpack(f"{order}II", header)
        _check(path, file.tell() - 8, length)
        if length < 12:
            raise FileFormatError(path, f"byte {file.tell() - 8}", f"is a block of {length} bytes", "12 bytes or more")
        body = file.read(length - 8)
        if len(body) < length - 8:
            return
        if kind == 1 and len(body) >= 12:
            interfaces.append(_interface(order, body))
        elif kind == 6 and len(body) >= 24:
            number, high, low, captured = struct.unpack_from(f"{order}IIII", body)
            if number < len(interfaces) and 20 + captured <= len(body):
                link, numerator, denominator = interfaces[number]
                stamp = (high << 32 | low) * numerator // denominator
                yield stamp, link, body[20 : 20 + captured]
        elif kind == 3 and interfaces and len(body) >= 8:
            yield 0, interfaces[0][0], body[4:-4]


def _interface(order: str, body: bytes) -> tuple[int, int, int]:
    """Kind of link, and nanoseconds of a unit of its stamps as numerator and denominator."""
    link, place = struct.unpack_from(f"{order}H", body)[0], 8
    numerator, denominator = 1_000, 1
    while place + 4 <= len(body) - 4:
        code, size = struct.unpack_from(f"{order}HH", body, place)
        if code == 0:
            break
        if code == 9 and size >= 1 and place + 4 < len(body):
            power = body[place + 4]
            numerator, denominator = 1_000_000_000, (2 if power & 0x80 else 10) ** (power & 0x7F)
        place += 4 + size + (-size) % 4
    return link, numerator, denominator


def _check(path: Path, offset: int, length: int) -> None:
    if length > PACKET_LIMIT:
        raise FileFormatError(path, f"byte {offset}", f"a packet of {length} bytes", f"{PACKET_LIMIT} at most")


def _network(link: int, packet: bytes) -> bytes:
    """IPv4 packet in a packet of a link; empty where it is another one."""
    begin = _LINK_BYTES.get(link)
    if begin is None:
        return b""
    if link == 1:
        # IEEE 802.1Q: four bytes for each virtual network before the kind of what follows.
        while packet[begin - 2 : begin] in (b"\x81\x00", b"\x88\xa8"):
            begin += 4
        if packet[begin - 2 : begin] != b"\x08\x00":
            return b""
    return packet[begin:] if len(packet) > begin and packet[begin] >> 4 == 4 else b""


class _Fragments:
    """Joins IPv4 packets that were sent in parts."""

    def __init__(self) -> None:
        self._open: OrderedDict[bytes, tuple[int, dict[int, bytes], list[int]]] = OrderedDict()

    def datagram(self, stamp_ns: int, ip: bytes) -> tuple[int, int, str, str, bytes] | None:
        """Stamp [ns], protocol, sender, receiver and content, once they are whole."""
        if len(ip) < 20:
            return None
        begin = (ip[0] & 15) * 4
        total, number, place = struct.unpack_from(">HHH", ip, 2)
        # A network card that joins segments itself says 0.
        data = ip[begin : total if begin <= total <= len(ip) and total else len(ip)]
        source, target = (".".join(str(byte) for byte in ip[at : at + 4]) for at in (12, 16))
        offset, more = (place & 0x1FFF) * 8, bool(place & 0x2000)
        if not offset and not more:
            return stamp_ns, ip[9], source, target, data
        key = ip[9:10] + ip[12:20] + number.to_bytes(2, "big")
        first, parts, size = self._open.setdefault(key, (stamp_ns, {}, []))
        parts[offset] = data
        if not more:
            size[:] = [offset + len(data)]
        while len(self._open) > _OPEN_FRAGMENTS:
            self._open.popitem(last=False)
        if not size or sum(map(len, parts.values())) < size[0]:
            return None
        self._open.pop(key, None)
        joined = b"".join(parts[at] for at in sorted(parts))
        return (first, ip[9], source, target, joined) if len(joined) == size[0] else None


class _Streams:
    """Puts the segments of TCP streams in order; a segment that is never captured is passed over."""

    def __init__(self) -> None:
        self._next: dict[tuple[str, str], int] = {}
        self._waiting: dict[tuple[str, str], dict[int, bytes]] = {}

    def ordered(self, flow: tuple[str, str], segment: bytes) -> Iterator[bytes]:
        """Deliver the bytes that follow those that were delivered."""
        number, flags = struct.unpack_from(">I", segment, 4)[0], segment[13]
        data = segment[(segment[12] >> 4) * 4 :]
        if flags & 2:
            self._next[flow] = (number + 1) & 0xFFFFFFFF
            self._waiting[flow] = {}
            return
        if not data:
            return
        expected = self._next.setdefault(flow, number)
        waiting = self._waiting.setdefault(flow, {})
        ahead = _ahead(number, expected)
        if ahead < 0:
            # Sent again, maybe with more behind it; a begin of long ago is another connection.
            data = data[-ahead:] if -ahead < len(data) else b""
            number = expected
        if data:
            waiting[number] = data
        if len(waiting) > _WAITING_SEGMENTS:
            self._next[flow] = min(waiting, key=lambda each: _ahead(each, expected))
        while (part := waiting.pop(self._next[flow], None)) is not None:
            self._next[flow] = (self._next[flow] + len(part)) & 0xFFFFFFFF
            yield part


def _ahead(number: int, expected: int) -> int:
    """Bytes from an expected number of TCP to another one, modulo 2^32."""
    return (number - expected + 0x80000000) % 0x100000000 - 0x80000000

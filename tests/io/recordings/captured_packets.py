"""Writing captures for tests, by the drafts of their formats."""

from __future__ import annotations

import struct
from collections.abc import Iterable
from pathlib import Path

Packet = tuple[int, bytes]
"""Stamp [ns] and bytes from the Ethernet header on."""
SCANNER, HOST = bytes([192, 168, 0, 1]), bytes([192, 168, 0, 2])


def ip(protocol: int, content: bytes, *, number: int = 1, offset: int = 0, more: bool = False) -> bytes:
    flags = offset // 8 | (0x2000 if more else 0)
    head = struct.pack(">BBHHHBBH4s4s", 0x45, 0, 20 + len(content), number, flags, 64, protocol, 0, SCANNER, HOST)
    return bytes(12) + b"\x08\x00" + head + content


def udp(data: bytes, port: int = 6060) -> bytes:
    return struct.pack(">HHHH", port, 6060, 8 + len(data), 0) + data


def tcp(sequence: int, data: bytes, *, syn: bool = False) -> bytes:
    return struct.pack(">HHIIBBHHH", 2112, 50_000, sequence % 2**32, 0, 5 << 4, 2 if syn else 16, 0, 0, 0) + data


def write_pcap(path: Path, packets: Iterable[Packet], *, order: str = "<", nanoseconds: bool = False) -> Path:
    content = struct.pack(f"{order}IHHIIII", 0xA1B23C4D if nanoseconds else 0xA1B2C3D4, 2, 4, 0, 0, 262_144, 1)
    for stamp, packet in packets:
        fraction = stamp % 10**9 // (1 if nanoseconds else 1000)
        content += struct.pack(f"{order}IIII", stamp // 10**9, fraction, len(packet), len(packet)) + packet
    path.write_bytes(content)
    return path


def write_pcapng(path: Path, packets: Iterable[Packet], *, order: str = "<", digits: int | None = None) -> Path:
    def block(kind: int, body: bytes) -> bytes:
        body += bytes(-len(body) % 4)
        size = struct.pack(f"{order}I", 12 + len(body))
        return struct.pack(f"{order}I", kind) + size + body + size

    unit = 10 ** (9 - (6 if digits is None else digits))
    options = b"" if digits is None else struct.pack(f"{order}HHB3xHH", 9, 1, digits, 0, 0)
    content = block(0x0A0D0D0A, struct.pack(f"{order}IHHq", 0x1A2B3C4D, 1, 0, -1))
    content += block(1, struct.pack(f"{order}HHI", 1, 0, 0) + options)
    for stamp, packet in packets:
        ticks = stamp // unit
        head = struct.pack(f"{order}IIIII", 0, ticks >> 32, ticks & 0xFFFFFFFF, len(packet), len(packet))
        content += block(6, head + packet)
    path.write_bytes(content)
    return path

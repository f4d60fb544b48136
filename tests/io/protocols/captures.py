"""The captured telegrams of real scanners, and how telegrams of other kinds are built by their layout."""

from __future__ import annotations

import json
import struct
from functools import reduce
from operator import xor
from pathlib import Path

import numpy as np


def tcp_stream(file: Path) -> bytes:
    """All bytes of a capture that the vendor's tool wrote as JSON."""
    packets = json.loads(file.read_text())
    payloads = (packet["_source"]["layers"]["tcp"]["tcp.payload"] for packet in packets)
    return b"".join(bytes.fromhex(payload.replace(":", "")) for payload in payloads)


def udp_parts(file: Path) -> list[bytes]:
    """The datagrams of a capture that the vendor's tool wrote as JSON, in the fragments that IP made of them."""
    return [bytes.fromhex(data) for _, data in json.loads(file.read_text())]


def cola_b(content: bytes) -> bytes:
    return b"\x02\x02\x02\x02" + struct.pack(">I", len(content)) + content + bytes([reduce(xor, content, 0)])


def instance(beams: int = 1651, *, said: int | None = None, block: int | None = None, trailing: int = 4) -> bytes:
    """An instance of a nanoScan3 by its layout: 6,812 bytes with 1,651 beams."""
    measured = struct.pack("<I", beams) + b"".join(
        struct.pack("<HBB", 1000 + beam, beam % 256, 1 | (8 if 100 <= beam < 104 else 0) | (2 if beam == 7 else 0))
        for beam in range(beams)
    )
    # Where the blocks lie is free; these places make the instance as long as the measured one.
    state, configuration, measurement = 60, 76, 200
    size = len(measured) if block is None else block
    head = struct.pack("<BBBBIIBBBBII", ord("R"), 1, 0, 0, 11, 12, 0, 0, 0, 0, 77, 88)
    head += struct.pack("<HHI", 19_000, 0, 3_600_000)
    head += struct.pack("<14H", state, 16, configuration, 24, measurement, size, *[0] * 8)
    head += struct.pack("<B15x", 0b100)
    head += struct.pack("<HHHHiiII", 1, beams if said is None else said, 30, 0, -199229440, 699050, 50, 0)
    return head.ljust(measurement, b"\0") + measured + bytes(trailing)


def fragments(whole: bytes, identification: int, size: int = 1436) -> list[bytes]:
    return [
        struct.pack("<4s2sBBIII4x", b"MS3 ", b"MD", 1, 0, len(whole), identification, offset)
        + whole[offset : offset + size]
        for offset in range(0, len(whole), size)
    ]


def nav_answer(beams: int = 1440) -> bytes:
    """An answer of a NAV350 with pose, two reflectors, scan and remission."""
    content = b"sAN mNPOSGetData " + struct.pack(">HBBB", 1, 0, 1, 2)
    content += struct.pack(">HiiIH", 1, -1500, 2500, 90_000, 1) + struct.pack(">BIiBIB", 1, 4711, 3, 3, 0, 2)
    content += struct.pack(">HBH", 1, 0, 2)
    for number, (distance, phi) in enumerate([(5000, 180_000), (2500, 270_000)]):
        content += struct.pack(">H", 0) + struct.pack(">HII", 1, distance, phi)
        content += struct.pack(">HHHBHHIHHHHH", 1, number, 40 + number, 2, 0, 90, 4711, 80, 12, 900, 10, 21)
    content += struct.pack(">H", 1) + b"DIST1" + struct.pack(">ffiHIH", 1.0, 0.0, 0, 250, 4700, beams)
    content += np.arange(beams, dtype=">u4").tobytes()
    content += struct.pack(">H", 1) + b"RSSI1" + struct.pack(">ffiHIH", 1.0, 0.0, 0, 250, 4700, beams)
    return content + np.arange(beams, dtype=">u2").tobytes()

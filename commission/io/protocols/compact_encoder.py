"""Compact telegrams as a virtual picoScan sends them: the inverse of `compact`. It opens no socket."""

from __future__ import annotations

import struct
import zlib

import numpy as np

from commission.io.protocols.cola_encoder import LARGEST, millimetres, strengths
from commission.io.protocols.compact import STX
from commission.site.records import Scan

SEGMENT_BEAMS = 180
"""Beams of a segment, so that a telegram fits into a datagram of 1,472 bytes."""


def encode_turn(scan: Scan, number: int) -> list[bytes]:
    """Return the telegrams of a scan, one for each segment: millimetres, reflector bits, azimuths of 1/5215 rad.

    Parameters
    ----------
    scan : without intensities, reflectors say the most and all else 0.
    number : of the turn.
    """
    beams = len(scan.ranges)
    rows = np.zeros(beams, [("distance", "<u2"), ("rssi", "<u2"), ("properties", "u1"), ("theta", "<u2")])
    azimuths = scan.angle_min + scan.angle_increment * np.arange(beams)
    rows["distance"], rows["rssi"] = millimetres(scan, LARGEST), strengths(scan)[0]
    rows["properties"] = 0 if scan.reflector is None else scan.reflector
    rows["theta"] = np.clip(np.round(azimuths * 5215.0) + 16384, 0, LARGEST)
    parts = np.array_split(np.arange(beams), -(-beams // SEGMENT_BEAMS))
    telegrams: list[bytes] = []
    for segment, part in enumerate(parts):
        begin_us = scan.stamp_ns // 1_000
        module = struct.pack("<QQIIIIQQ", segment, number, 4711, 1, len(part), 1, begin_us, begin_us)
        module += struct.pack("<fff", 0.0, azimuths[part[0]], azimuths[part[-1]])
        module += struct.pack("<fIBBBB", 1.0, 0, 1, 3, 3, 0) + rows[part].tobytes()
        counter = number * len(parts) + segment
        telegram = STX + struct.pack("<IQQII", 1, counter, begin_us, 4, len(module)) + module
        telegrams.append(telegram + struct.pack("<I", zlib.crc32(telegram)))
    return telegrams

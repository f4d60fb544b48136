"""Data output of a virtual SICK safety scanner: the inverse of `safety`. It opens no socket."""

from __future__ import annotations

import math
import struct

import numpy as np

from commission.io.protocols.safety import DAY_MS, MAGIC
from commission.site.records import Scan

PAYLOAD = 1_436
"""Bytes of an instance in one datagram, which with its header has 1,460, as measured on a nanoScan3."""
FARTHEST_MM = 40_000
"""What a beam without an echo says [mm]."""
_DEG = 4_194_304.0
_VALID, _INFINITE, _REFLECTOR = 1, 2, 8
_PLAIN, _BRIGHT = 60, 250
_STATE, _CONFIGURATION, _MEASUREMENT = 60, 76, 100


def encode_instance(scan: Scan, sequence: int, cycle_ms: int = 40) -> bytes:
    """Return the instance of a scan: millimetres, no more exact than the device's.

    Parameters
    ----------
    scan : with reflector flags; without intensities, reflectors are bright and all else is not.
    sequence : number of the data set, modulo 2^32.
    cycle_ms : time from scan to scan [ms].
    """
    beams = len(scan.ranges)
    has_echo = np.isfinite(scan.ranges) & (scan.ranges > 0.0) & (scan.ranges * 1e3 < FARTHEST_MM)
    distances = np.where(has_echo, np.round(np.nan_to_num(scan.ranges, nan=0.0, posinf=0.0) * 1e3), FARTHEST_MM)
    flags = np.zeros(beams, np.bool_) if scan.reflector is None else scan.reflector
    strengths = np.where(flags, _BRIGHT, _PLAIN) if scan.intensities is None else np.clip(scan.intensities, 0, 255)
    rows = np.empty(beams, [("distance", "<u2"), ("strength", "u1"), ("status", "u1")])
    rows["distance"], rows["strength"] = distances, strengths
    rows["status"] = _VALID | np.where(has_echo, 0, _INFINITE) | np.where(flags & has_echo, _REFLECTOR, 0)
    size = 4 + 4 * beams
    head = struct.pack("<BBBBIIB3x", ord("R"), 1, 0, 0, 1, 1, 0)
    days, milliseconds = divmod(scan.stamp_ns // 1_000_000, DAY_MS)
    head += struct.pack("<IIHHI", sequence % 2**32, sequence % 2**32, days % 2**16, 0, milliseconds)
    head += struct.pack("<12H", _STATE, 16, _CONFIGURATION, 24, _MEASUREMENT, size, 0, 0, 0, 0, 0, 0).ljust(28, b"\0")
    state = struct.pack("<16x")
    start = round((math.degrees(scan.angle_min) + 90.0) * _DEG)
    step = round(math.degrees(scan.angle_increment) * _DEG)
    beam_us = round(cycle_ms * 1e3 * abs(scan.angle_increment) / (2.0 * math.pi))
    configuration = struct.pack("<HHHHiiII", 1, beams, cycle_ms, 0, start, step, beam_us, 0)
    return head + state + configuration + struct.pack("<I", beams) + rows.tobytes()


def encode_fragments(instance: bytes, identification: int) -> list[bytes]:
    """Return the datagrams of an instance.

    Parameters
    ----------
    instance : as `encode_instance` makes it.
    identification : number of the instance, modulo 2^32.
    """
    return [
        MAGIC
        + struct.pack("<BBIII4x", 1, 0, len(instance), identification % 2**32, place)
        + instance[place : place + PAYLOAD]
        for place in range(0, len(instance), PAYLOAD)
    ]

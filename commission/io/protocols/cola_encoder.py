"""LMDscandata and mNPOSGetData of a virtual scanner: the inverse of `cola` and `nav350`. It opens no socket."""

from __future__ import annotations

import math
import struct
from functools import reduce
from operator import xor

import numpy as np
from numpy.typing import NDArray

from commission.geometry.arrays import FloatArray
from commission.site.records import Scan

LARGEST = 65_535
_DECIMAL = 10_000
"""Parts of a degree in LMDscandata."""
_MILLI = 1_000
"""Parts of a degree in answers of a NAV350."""


def frame_binary(content: bytes) -> bytes:
    """Return content in the marks of CoLa B."""
    return b"\x02\x02\x02\x02" + struct.pack(">I", len(content)) + content + bytes([reduce(xor, content, 0)])


def frame_text(content: bytes) -> bytes:
    """Return content in the marks of CoLa A."""
    return b"\x02" + content + b"\x03"


def encode_lmd(scan: Scan, count: int) -> bytes:
    """Return a scan as the content of a binary LMDscandata telegram: millimetres, 1/10000 degrees.

    Parameters
    ----------
    scan : without intensities, reflectors say 1 and all else 0.
    count : number of the telegram.
    """
    start, step = _angles(scan, 90.0, _DECIMAL)
    begin_us = scan.stamp_ns // 1_000 % 2**32
    numbers = (1, 1, 4711, 0, count % 2**16, count % 2**16, begin_us, begin_us, 0, 0, 0)
    content = b"sSN LMDscandata " + struct.pack(">HHIHHHIIHHh", *numbers) + struct.pack(">IIHH", 2_500, 1_000, 0, 2)
    raw, scale = strengths(scan)
    for name, factor, values in ((b"DIST1", 1.0, millimetres(scan, LARGEST)), (b"RSSI1", scale, raw)):
        content += name + struct.pack(">ffiHH", factor, 0.0, start, step, len(values)) + values.astype(">u2").tobytes()
    return content + struct.pack(">6H", *[0] * 6)


def encode_lmd_text(scan: Scan, count: int) -> bytes:
    """Return a scan as the content of a CoLa A telegram; see `encode_lmd`."""
    start, step = _angles(scan, 90.0, _DECIMAL)
    begin_us = scan.stamp_ns // 1_000 % 2**32
    words = ["sSN", "LMDscandata", "1", "1", "1267", "0", "0", f"{count % 2**16:X}", f"{count % 2**16:X}"]
    words += [f"{begin_us:X}", f"{begin_us:X}", "0", "0", "0", "0", "0", f"{2_500:X}", f"{1_000:X}", "0", "2"]
    raw, scale = strengths(scan)
    for name, factor, values in (("DIST1", 1.0, millimetres(scan, LARGEST)), ("RSSI1", scale, raw)):
        words += [name, struct.pack(">f", factor).hex().upper(), "00000000", f"{start & 0xFFFFFFFF:X}", f"{step:X}"]
        words += [f"{len(values):X}", *(f"{value:X}" for value in values.tolist())]
    return " ".join([*words, *["0"] * 6]).encode("ascii")


def encode_nav(scan: Scan) -> bytes:
    """Return a scan as the content of an answer to mNPOSGetData: millimetres, 1/1000 degrees, without a pose.

    Parameters
    ----------
    scan : without intensities, reflectors say 1 and all else 0.
    """
    start, step = _angles(scan, 180.0, _MILLI)
    stamp_ms = scan.stamp_ns // 1_000_000 % 2**32
    raw, scale = strengths(scan)
    content = b"sAN mNPOSGetData " + struct.pack(">HBBBHHH", 1, 0, 1, 2, 0, 0, 1)
    far = millimetres(scan, 2**31)
    content += (
        b"DIST1" + struct.pack(">ffiHIH", 1.0, 0.0, start, step, stamp_ms, len(far)) + far.astype(">u4").tobytes()
    )
    content += struct.pack(">H", 1) + b"RSSI1"
    return content + struct.pack(">ffiHIH", scale, 0.0, start, step, stamp_ms, len(raw)) + raw.astype(">u2").tobytes()


def millimetres(scan: Scan, largest: int) -> NDArray[np.int64]:
    """Return (B,) distances of a scan [mm]; 0 where nothing came back, or from beyond what can be said."""
    found = np.round(np.nan_to_num(scan.ranges.astype(np.float64), nan=0.0, posinf=0.0, neginf=0.0) * 1e3)
    return np.where((found > 0.0) & (found <= largest), found, 0.0).astype(np.int64)


def strengths(scan: Scan) -> tuple[NDArray[np.int64], float]:
    """Return (B,) raw strengths of the echoes, and the factor that makes of them those of the scan."""
    flags = np.zeros(len(scan.ranges)) if scan.reflector is None else scan.reflector.astype(np.float64)
    values: FloatArray = flags if scan.intensities is None else np.nan_to_num(scan.intensities.astype(np.float64))
    values = np.maximum(values, 0.0)
    scale = float(np.float32(max(float(values.max(initial=0.0)), 1.0) / LARGEST))
    return np.clip(np.round(values / scale), 0, LARGEST).astype(np.int64), scale


def _angles(scan: Scan, ahead_deg: float, parts: int) -> tuple[int, int]:
    """Return first angle and step in parts of a degree, straight ahead being `ahead_deg`."""
    step = round(math.degrees(scan.angle_increment) * parts)
    if not 0 < step <= LARGEST:
        raise ValueError(f"the step from beam to beam is {scan.angle_increment:g} rad; expected one that CoLa can say")
    return round((math.degrees(scan.angle_min) + ahead_deg) * parts), step

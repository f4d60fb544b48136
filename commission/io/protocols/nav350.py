"""SICK NAV350: the answer to mNPOSGetData and mNLMDGetData in CoLa B, with pose, reflectors and scan.

Layout by the vendor's driver (SICKAG/sick_scan_xd, Apache-2.0); no capture of it is known here.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from commission.errors import DecodeError
from commission.geometry.arrays import FloatArray
from commission.io.protocols.telegram import Telegram
from commission.site.records import Scan

REFLECTOR_LIMIT = 200
"""Reflectors of one answer; a NAV350 tells 40 at most."""
BEAM_LIMIT = 2_880
"""Beams of one answer; a NAV350 has 1,440."""
_POSE, _LANDMARKS = b"sAN mNPOSGetData ", b"sAN mNLMDGetData "
ERRORS = (
    "none",
    "wrong mode of operation",
    "terminated",
    "invalid data",
    "no position",
    "timeout",
    "already active",
    "general error",
)


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class NavResult:
    """What one answer says; angles by the device, whose 0 points to its cable side."""

    error: int
    """Code, 0 where there is none; words in `ERRORS`."""
    pose: FloatArray | None = None
    """(3,) x, y [m] and heading [rad] in the device's layout, or None."""
    pose_stamp_ms: int | None = None
    """Time of the pose by the device's clock [ms]."""
    range_bearing: FloatArray
    """(N, 2) range [m] and angle [rad] of each reflector."""
    global_ids: tuple[int, ...] = ()
    """Number of each reflector in the layout, where it says; 0 or 65535 of unknown ones."""
    ranges: FloatArray | None = None
    """(B,) distance of each beam [m], NaN where nothing came back; None without a scan."""
    start: float = 0.0
    """Angle of the first beam [rad]."""
    step: float = 0.0
    """Angle from beam to beam [rad]."""
    scan_stamp_ms: int | None = None
    """Time of the scan by the device's clock [ms]."""
    remission: FloatArray | None = None
    """(B,) strength of each echo, or None."""


def decode_nav(content: bytes) -> NavResult:
    """Decode the content of a frame that answers a request for pose, reflectors or scan.

    Parameters
    ----------
    content : between the marks of the frame of CoLa B.

    Raises
    ------
    DecodeError
        it is another telegram, ends early, or says more than can be.
    """
    if content.startswith(_POSE):
        t = Telegram(content, len(_POSE), ">")
        _, error, _, _ = t.numbers("HBBB")
        pose, stamp = _pose(t) if t.number("H") else (None, None)
    elif content.startswith(_LANDMARKS):
        t = Telegram(content, len(_LANDMARKS), ">")
        _, error, _, _ = t.numbers("HBBB")
        pose, stamp = None, None
    else:
        raise DecodeError(f"{content[:17]!r} is no answer with pose, reflectors or scan", 0)
    found: list[tuple[float, float]] = []
    numbers: list[int] = []
    if t.left >= 2 and t.number("H"):
        found, numbers = _landmarks(t)
    ranges, (start, step), scan_stamp = _scan(t) if t.left >= 2 else (None, (0.0, 0.0), None)
    remission = _remission(t) if t.left >= 2 and t.number("H") else None
    if remission is not None and ranges is not None and len(remission) != len(ranges):
        raise DecodeError(f"{len(remission)} strengths of {len(ranges)} beams", t.place)
    return NavResult(
        error=error,
        pose=pose,
        pose_stamp_ms=stamp,
        range_bearing=np.array(found, dtype=np.float64).reshape(-1, 2),
        global_ids=tuple(numbers),
        ranges=ranges,
        start=start,
        step=step,
        scan_stamp_ms=scan_stamp,
        remission=remission,
    )


def _pose(t: Telegram) -> tuple[FloatArray, int | None]:
    x, y, phi = t.numbers("iiI")
    stamp = int(t.numbers("BIiBIB")[1]) if t.number("H") else None
    return np.array([x * 1e-3, y * 1e-3, _angle(phi, t)]), stamp


def _landmarks(t: Telegram) -> tuple[list[tuple[float, float]], list[int]]:
    _, count = t.numbers("BH")
    if count > REFLECTOR_LIMIT:
        raise DecodeError(f"{count} reflectors are said; expected {REFLECTOR_LIMIT} at most", t.place)
    found: list[tuple[float, float]] = []
    numbers: list[int] = []
    for _ in range(count):
        polar: tuple[float, float] | None = None
        if t.number("H"):
            x, y = t.numbers("ii")
            polar = math.hypot(x, y) * 1e-3, math.atan2(y, x)
        if t.number("H"):
            distance, phi = t.numbers("II")
            polar = distance * 1e-3, _angle(phi, t)
        number = t.numbers("HHBHHIHHHHH")[1] if t.number("H") else 0
        if polar is not None and polar[0] > 0.0:
            found.append(polar)
            numbers.append(number)
    return found, numbers


def _scan(t: Telegram) -> tuple[FloatArray | None, tuple[float, float], int | None]:
    """Ranges [m], first angle and step [rad], and stamp [ms]."""
    channels = t.number("H")
    if channels > 2:
        raise DecodeError(f"{channels} channels of a scan are said; expected 2 at most", t.place)
    ranges: FloatArray | None = None
    start = step = 0.0
    stamp: int | None = None
    for _ in range(channels):
        name = t.text(5)
        scale, offset, first, apart, when, count = t.numbers("ffiHIH")
        _refuse(count, scale, offset, t)
        raw = t.array("u4", count).astype(np.float64)
        if name == "DIST1":
            ranges = np.where(raw == 0, np.nan, (raw * scale + offset) * 1e-3)
            start, step, stamp = math.radians(first * 1e-3), math.radians(apart * 1e-3), when
    return ranges, (start, step), stamp


def _remission(t: Telegram) -> FloatArray:
    t.text(5)
    scale, offset, _, _, _, count = t.numbers("ffiHIH")
    _refuse(count, scale, offset, t)
    return t.array("u2", count).astype(np.float64) * scale + offset


def _refuse(count: int, scale: float, offset: float, t: Telegram) -> None:
    if count > BEAM_LIMIT or not (math.isfinite(scale) and math.isfinite(offset) and abs(scale) < 1e4):
        raise DecodeError(f"{count} beams of the scale {scale:g} and the offset {offset:g} are said", t.place)


def _angle(phi_mdeg: int, t: Telegram) -> float:
    if phi_mdeg > 360_000:
        raise DecodeError(f"an angle of {phi_mdeg} mdeg is said; expected 360000 at most", t.place)
    return math.radians(phi_mdeg * 1e-3)


def scan_of(result: NavResult, stamp_ns: int, *, scanner: int = 0) -> Scan | None:
    """Return the scan of an answer, x ahead (away from the cable); None where it has none.

    Parameters
    ----------
    result : decoded.
    stamp_ns : of the scan [ns].
    scanner : index into the recording's names.
    """
    if result.ranges is None or not len(result.ranges) or result.step == 0.0:
        return None
    return Scan(
        stamp_ns=stamp_ns,
        ranges=np.where(result.ranges > 0.0, result.ranges, np.nan).astype(np.float32),
        angle_min=result.start - math.pi,
        angle_increment=result.step,
        intensities=None if result.remission is None else result.remission.astype(np.float32),
        scanner=scanner,
    )

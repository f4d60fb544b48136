"""SICK CoLa A and B: frames of a stream, and the telegram LMDscandata of TiM, LMS, LRS and MRS scanners.

Layout checked against captured telegrams of a TiM781S and an MRS1104 (SICKAG/sick_scan_xd, Apache-2.0) and the scans
that the vendor's driver made of the latter.
"""

from __future__ import annotations

import math
import struct
from dataclasses import dataclass
from functools import reduce
from operator import xor

import numpy as np
from numpy.typing import NDArray

from commission.errors import DecodeError
from commission.io.protocols.telegram import Telegram
from commission.site.records import Scan

FRAME_LIMIT = 200_000
"""Bytes of a frame; an MRS1104's scan has 10,123, text is up to three times as long."""
CHANNEL_LIMIT = 16
"""Channels of 16 and of 8 bits each: five echoes with their strengths are ten."""
ENCODER_LIMIT = 8
NOTHING = 0.016
"""Distance [m] up to which a value is no measurement (2, 1, 0 mm and more are seen in captures)."""
_STX = b"\x02\x02\x02\x02"
_NAMES = (b"sSN LMDscandata ", b"sRA LMDscandata ")
_QUARTER_DEG = 90.0


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class ColaChannel:
    """What was measured of each beam: distances, strengths, angles."""

    name: str
    """`DIST1`, `RSSI1`, `ANGL1`."""
    scale: float
    """Factor of the raw numbers."""
    offset: float
    """What is added to them."""
    start: int
    """Angle of the first beam [1/10000 deg]; 90 degrees is straight ahead."""
    step: int
    """Angle from beam to beam [1/10000 deg], rounded."""
    raw: NDArray[np.uint16]
    """(B,) numbers as sent; their product with the scale, plus the offset, is in mm for distances."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class LmdScan:
    """One LMDscandata telegram."""

    serial: int
    """Serial number of the scanner."""
    telegram_count: int
    """Telegrams since the start, modulo 2^16."""
    scan_count: int
    """Scans since the start, modulo 2^16."""
    begin_us: int
    """Time since the start at the first beam [us], modulo 2^32."""
    sent_us: int
    """Time since the start at the transmission [us], modulo 2^32."""
    layer: int
    """Elevation of the layer in the device's own unit, 1/100 deg for MRS1000; 0 of scanners with one layer."""
    frequency: int
    """Scans per second [1/100 Hz]."""
    channels: tuple[ColaChannel, ...]
    """All channels, those of 16 bits first."""

    def channel(self, name: str) -> ColaChannel | None:
        """Return a channel by its name."""
        return next((channel for channel in self.channels if channel.name == name), None)


def split_frames(data: bytes) -> tuple[list[bytes], bytes]:
    """Cut a stream into frames.

    Parameters
    ----------
    data : what has arrived and was not cut yet. Bytes between frames and frames with a wrong checksum are dropped.

    Returns
    -------
    contents, rest : what is between the marks of each frame of CoLa B or A; and what may be the begin of one more.
    """
    found: list[bytes] = []
    place = 0
    while (start := data.find(b"\x02", place)) >= 0:
        if _STX.startswith(data[start : start + 4]) and len(data) - start < 8:
            return found, data[start:]
        if data.startswith(_STX, start):
            length = struct.unpack_from(">I", data, start + 4)[0]
            end = start + 8 + length
            if length > FRAME_LIMIT:
                place = start + 1
            elif end >= len(data):
                return found, data[start:]
            elif reduce(xor, data[start + 8 : end], 0) == data[end]:
                found.append(data[start + 8 : end])
                place = end + 1
            else:
                place = start + 1
        else:
            end = data.find(b"\x03", start)
            text = data[start + 1 : end if end >= 0 else len(data)]
            # Text holds no control bytes: a mark in it is the begin of another frame.
            if not text.isascii() or b"\x02" in text or text[:1] not in (b"", b"s"):
                place = start + 1
            elif end < 0:
                return found, data[start:] if len(text) <= FRAME_LIMIT else b""
            else:
                found.append(text)
                place = end + 1
    return found, b""


def is_scan(content: bytes) -> bool:
    """Whether a frame's content is an LMDscandata telegram."""
    return content.startswith(_NAMES)


def decode_lmd(content: bytes) -> LmdScan:
    """Decode the content of a frame that holds LMDscandata, binary or text.

    Parameters
    ----------
    content : between the marks of the frame.

    Raises
    ------
    DecodeError
        it is another telegram, ends early, or says more than can be.
    """
    if not is_scan(content):
        raise DecodeError(f"{content[:16]!r} is no LMDscandata telegram", 0)
    # In binary the version's first byte, 0, follows; text has a digit there.
    is_text = content[len(_NAMES[0]) : len(_NAMES[0]) + 1].isalnum()
    return _decode_text(content) if is_text else _decode_binary(content)


def _decode_binary(content: bytes) -> LmdScan:
    t = Telegram(content, len(_NAMES[0]), ">")
    _, _, serial, _, telegram_count, scan_count, begin, sent, _, _, layer = t.numbers("HHIHHHIIHHh")
    frequency, _, encoders = t.numbers("IIH")
    if encoders > ENCODER_LIMIT:
        raise DecodeError(f"{encoders} encoders are said; expected {ENCODER_LIMIT} at most", t.place)
    t.skip(6 * encoders)
    channels: list[ColaChannel] = []
    for kind in ("u2", "u1"):
        count = t.number("H")
        if count > CHANNEL_LIMIT:
            raise DecodeError(f"{count} channels are said; expected {CHANNEL_LIMIT} at most", t.place)
        for _ in range(count):
            name = t.text(5)
            scale, offset, start, step, beams = t.numbers("ffiHH")
            raw = t.array(kind, beams).astype(np.uint16)
            channels.append(ColaChannel(name=name, scale=scale, offset=offset, start=start, step=step, raw=raw))
    return LmdScan(
        serial=serial,
        telegram_count=telegram_count,
        scan_count=scan_count,
        begin_us=begin,
        sent_us=sent,
        layer=layer,
        frequency=frequency,
        channels=tuple(channels),
    )


class _Tokens:
    """Words of a CoLa A telegram, in order."""

    def __init__(self, content: bytes) -> None:
        if not content.isascii():
            raise DecodeError("it is no ASCII", 0)
        self.words = content.decode("ascii").split(" ")
        self.index = 2

    def word(self) -> str:
        if self.index >= len(self.words):
            raise DecodeError(f"it ends after {len(self.words)} words", sum(map(len, self.words)))
        self.index += 1
        return self.words[self.index - 1]

    def number(self, bits: int, *, signed: bool = False) -> int:
        """A whole number: hexadecimal as two's complement, or decimal with its sign."""
        word = self.word()
        try:
            value = int(word, 10) if word[:1] in "+-" and word else int(word, 16)
        except ValueError:
            raise DecodeError(f"{word[:16]!r} is no number", self._place()) from None
        if signed and word[:1] not in "+-" and value >= 1 << (bits - 1):
            value -= 1 << bits
        if not -(1 << (bits - 1)) <= value < 1 << bits:
            raise DecodeError(f"{word[:16]!r} has more than {bits} bits", self._place())
        return value

    def real(self) -> float:
        """A number as the eight digits of an IEEE 754 single."""
        return float(struct.unpack(">f", struct.pack(">I", self.number(32) & 0xFFFFFFFF))[0])

    def _place(self) -> int:
        return sum(len(word) + 1 for word in self.words[: self.index - 1])

    def count(self, limit: int, what: str) -> int:
        value = self.number(16)
        if not 0 <= value <= limit:
            raise DecodeError(f"{value} {what} are said; expected {limit} at most", self._place())
        return value


def _decode_text(content: bytes) -> LmdScan:
    t = _Tokens(content)
    _, _, serial = t.number(16), t.number(16), t.number(32)
    _ = t.word(), t.word()
    telegram_count, scan_count, begin, sent = t.number(16), t.number(16), t.number(32), t.number(32)
    _ = t.word(), t.word(), t.word(), t.word()
    layer, frequency, _ = t.number(16, signed=True), t.number(32), t.number(32)
    for _ in range(t.count(ENCODER_LIMIT, "encoders")):
        _ = t.number(32), t.number(16)
    channels: list[ColaChannel] = []
    for bits in (16, 8):
        for _ in range(t.count(CHANNEL_LIMIT, "channels")):
            name, scale, offset = t.word(), t.real(), t.real()
            start, step = t.number(32, signed=True), t.number(16)
            beams = t.count(len(t.words) - t.index, "beams")
            raw = np.array([t.number(bits) for _ in range(beams)], dtype=np.int64)
            if (raw < 0).any():
                raise DecodeError(f"channel {name[:8]!r} has a negative number", 0)
            channels.append(
                ColaChannel(name=name, scale=scale, offset=offset, start=start, step=step, raw=raw.astype(np.uint16))
            )
    return LmdScan(
        serial=serial,
        telegram_count=telegram_count,
        scan_count=scan_count,
        begin_us=begin,
        sent_us=sent,
        layer=layer,
        frequency=frequency,
        channels=tuple(channels),
    )


def scan_of(telegram: LmdScan, stamp_ns: int, *, echo: int = 1, scanner: int = 0) -> Scan:
    """Return the scan of a telegram.

    Parameters
    ----------
    telegram : decoded.
    stamp_ns : of the scan [ns].
    echo : which one of each beam, from 1.
    scanner : index into the recording's names.

    Raises
    ------
    DecodeError
        it has no distances, or they are none (a scale or an angle that cannot be).
    """
    distances = telegram.channel(f"DIST{echo}")
    if distances is None or not len(distances.raw):
        raise DecodeError(f"it has no distances of echo {echo}", 0)
    if not (math.isfinite(distances.scale) and 0.0 < distances.scale < 1e3 and math.isfinite(distances.offset)):
        found = f"distances have the scale {distances.scale:g} and the offset {distances.offset:g}"
        raise DecodeError(f"{found}; expected mm > 0", 0)
    if distances.step == 0 or abs(distances.start) > 7_200_000:
        raise DecodeError(f"beams begin at {distances.start} and are {distances.step} apart [1/10000 deg]", 0)
    ranges = ((distances.raw * distances.scale + distances.offset) * 1e-3).astype(np.float32)
    ranges[~(ranges > NOTHING)] = np.nan
    strengths = telegram.channel(f"RSSI{echo}")
    has_strengths = strengths is not None and len(strengths.raw) == len(ranges) and math.isfinite(strengths.scale)
    return Scan(
        stamp_ns=stamp_ns,
        ranges=ranges,
        angle_min=math.radians(distances.start * 1e-4 - _QUARTER_DEG),
        angle_increment=math.radians(nominal_step_deg(distances.step)),
        intensities=(strengths.raw * strengths.scale + strengths.offset).astype(np.float32)
        if strengths is not None and has_strengths
        else None,
        scanner=scanner,
    )


def nominal_step_deg(step: int) -> float:
    """Angle from beam to beam [deg] that a rounded one stands for: 3333 is a third of a degree, 1667 a sixth.

    Parameters
    ----------
    step : [1/10000 deg]. Taken as it is, that of a TiM781S would be off by 0.027 degrees at the last of 811 beams.
    """
    for parts in range(1, 13):
        whole = round(step * parts / 10_000)
        if whole and abs(10_000 * whole / parts - step) < 1.0:
            return whole / parts
    return step * 1e-4

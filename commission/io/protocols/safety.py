"""UDP data output of SICK safety scanners (microScan3, nanoScan3, outdoorScan3): fragments, instances, scans.

Nothing is ever sent to a scanner: it is listened to. Layout by the vendor's driver (SICKAG/sick_safetyscanners,
Apache-2.0) and sizes that were measured on a nanoScan3 (6,812 bytes in five datagrams, 1,651 beams).
"""

from __future__ import annotations

import math
import struct
from collections import OrderedDict
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from commission.errors import DecodeError
from commission.io.protocols.telegram import Telegram
from commission.site.records import Scan

MAGIC = b"MS3 MD"
HEADER_BYTES = 24
INSTANCE_LIMIT = 65_536
"""Bytes of an instance: offsets of its blocks have 16 bits."""
BEAM_LIMIT = 2_751
"""Beams of a scan, the limit of the vendor's driver."""
OPEN_LIMIT = 8
"""Instances of one scanner that wait for fragments at once; older ones are given up."""
DAY_MS = 86_400_000
_DEG = 1.0 / 4_194_304.0
_INFINITE, _GLARE, _REFLECTOR, _CONTAMINATED, _DIRTY = 2, 4, 8, 16, 32


@dataclass(frozen=True, slots=True, kw_only=True)
class Fragment:
    """One datagram."""

    total: int
    """Bytes of the whole instance."""
    identification: int
    """Number of the instance, modulo 2^32."""
    offset: int
    """Place of the payload in the instance."""
    payload: bytes
    """Its part."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class SafetyScan:
    """What one instance says."""

    channel: int
    """Number of the data output, 0 to 3."""
    sequence: int
    """Data sets sent on this channel, modulo 2^32."""
    scan_number: int
    """Scans since the start; stops in standby."""
    days: int
    """Days since 1972-01-01, or 24-hour spans since power-on where the clock is not set."""
    milliseconds: int
    """Since midnight, or in the current span [ms]."""
    cycle_ms: int
    """Time from scan to scan [ms]."""
    beam_us: int
    """Time from beam to beam [us]."""
    start: int
    """Angle of the first beam [2^-22 deg]; 90 degrees is straight ahead."""
    step: int
    """Angle from beam to beam [2^-22 deg]."""
    distances: NDArray[np.uint16]
    """(B,) distance as sent; times `factor` in mm."""
    factor: int
    """Millimetres of a unit of distance."""
    reflectivity: NDArray[np.uint8]
    """(B,) strength of each echo."""
    status: NDArray[np.uint8]
    """(B,) bits: 0 valid, 1 infinite, 2 glare, 3 reflector, 4 contamination, 5 contamination warning."""
    contamination_warning: bool
    """Whether the scanner warns of a dirty window."""
    contamination_error: bool
    """Whether it has switched off because of it."""

    @property
    def time_ns(self) -> int | None:
        """Time by the scanner's clock [ns], which jitters; None where it says none."""
        return (self.days * DAY_MS + self.milliseconds) * 1_000_000 or None

    @property
    def glare(self) -> NDArray[np.bool_]:
        """(B,) whether a beam was blinded."""
        return (self.status & _GLARE) != 0

    @property
    def contaminated(self) -> NDArray[np.bool_]:
        """(B,) whether the window is dirty there."""
        return (self.status & (_CONTAMINATED | _DIRTY)) != 0


def decode_fragment(datagram: bytes) -> Fragment:
    """Decode one datagram; raises DecodeError where it is none of a safety scanner, or its part cannot be."""
    if not datagram.startswith(MAGIC) or len(datagram) <= HEADER_BYTES:
        raise DecodeError(f"{len(datagram)} bytes that begin with {datagram[:6]!r} are no datagram of data output", 0)
    total, identification, offset = struct.unpack_from("<III", datagram, 8)
    payload = datagram[HEADER_BYTES:]
    if not 0 < total <= INSTANCE_LIMIT or offset + len(payload) > total:
        found = f"{len(payload)} bytes at {offset} of an instance of {total} are said"
        raise DecodeError(f"{found}; expected a part of at most {INSTANCE_LIMIT} bytes", 8)
    return Fragment(total=total, identification=identification, offset=offset, payload=payload)


class Reassembly:
    """Joins the fragments of one scanner; they may come in any order, twice, among those of others, or never."""

    def __init__(self) -> None:
        self._open: OrderedDict[int, tuple[int, dict[int, bytes]]] = OrderedDict()
        self._done: OrderedDict[int, None] = OrderedDict()
        self.lost = 0
        """Instances of which a fragment never came."""

    def add(self, fragment: Fragment) -> bytes | None:
        """Take a fragment; returns the instance that it completes.

        Raises
        ------
        DecodeError
            it contradicts what came before: another total size, or parts that overlap.
        """
        number = fragment.identification
        if number in self._done:
            return None
        total, parts = self._open.setdefault(number, (fragment.total, {}))
        if total != fragment.total:
            del self._open[number]
            raise DecodeError(f"instance {number} has {fragment.total} bytes; expected {total}, as was said", 8)
        if len(parts.get(fragment.offset, b"")) < len(fragment.payload):
            parts[fragment.offset] = fragment.payload
        if sum(map(len, parts.values())) >= total:
            del self._open[number]
            self._finish(number)
            return _joined(number, total, parts)
        while len(self._open) > OPEN_LIMIT:
            given_up, _ = self._open.popitem(last=False)
            self._finish(given_up)
            self.lost += 1
        return None

    def _finish(self, number: int) -> None:
        """Remember that what still comes of an instance is late."""
        self._done[number] = None
        while len(self._done) > 4 * OPEN_LIMIT:
            self._done.popitem(last=False)


def _joined(number: int, total: int, parts: dict[int, bytes]) -> bytes:
    place, found = 0, bytearray()
    for offset in sorted(parts):
        if offset != place:
            raise DecodeError(f"fragments of instance {number} leave a gap or overlap at {place}", place)
        found += parts[offset]
        place += len(parts[offset])
    if place != total:
        raise DecodeError(f"fragments of instance {number} are {place} bytes; expected {total}", place)
    return bytes(found)


def decode_instance(data: bytes) -> SafetyScan | None:
    """Decode a whole instance.

    Parameters
    ----------
    data : its fragments, joined.

    Returns
    -------
    scan : None where it holds no measurement (a channel that sends states only).

    Raises
    ------
    DecodeError
        it ends early, a block is outside of it, or the size of a block contradicts the number of beams.
    """
    t = Telegram(data)
    version, _, _, _, _, _, channel = t.numbers("BBBBIIB")
    if version == 0:
        raise DecodeError("its version is 0: the rest is not valid", 0)
    t.place = 16
    sequence, scan_number, days, _, milliseconds = t.numbers("IIHHI")
    blocks = [t.numbers("HH") for _ in range(4)]
    state, configuration, measurement = blocks[0], blocks[1], blocks[2]
    if measurement == (0, 0) or configuration == (0, 0):
        return None
    flags = _block(data, state, 16, "device status")[0] if state != (0, 0) else 0
    derived = Telegram(_block(data, configuration, 24, "configuration"))
    factor, said, cycle, _, start, step, beam_us = derived.numbers("HHHHiiI")
    measured = Telegram(_block(data, measurement, 4, "measurement"))
    beams = measured.number("I")
    if beams > BEAM_LIMIT or measurement[1] != 4 + 4 * beams or beams != said:
        found = f"a measurement block of {measurement[1]} bytes has {beams} beams, {said} by the configuration"
        raise DecodeError(f"{found}; expected 4 bytes and 4 for each beam", measurement[0])
    if beams and (step == 0 or abs(start) > 720 / _DEG or factor == 0):
        raise DecodeError(f"beams begin at {start}, are {step} apart, and count {factor} mm", configuration[0])
    rows = measured.array("u4", beams)
    return SafetyScan(
        channel=channel,
        sequence=sequence,
        scan_number=scan_number,
        days=days,
        milliseconds=milliseconds,
        cycle_ms=cycle,
        beam_us=beam_us,
        start=start,
        step=step,
        distances=(rows & 0xFFFF).astype(np.uint16),
        factor=factor,
        reflectivity=((rows >> 16) & 0xFF).astype(np.uint8),
        status=(rows >> 24).astype(np.uint8),
        contamination_warning=bool(flags & 4),
        contamination_error=bool(flags & 8),
    )


def _block(data: bytes, place: tuple[int, int], least: int, name: str) -> bytes:
    offset, size = place
    if size < least or offset < 60 or offset + size > len(data):
        found = f"the {name} block has {size} bytes at {offset} of {len(data)}"
        raise DecodeError(f"{found}; expected {least} or more, within the instance", min(offset, len(data)))
    return data[offset : offset + size]


def scan_of(found: SafetyScan, stamp_ns: int, *, scanner: int = 0) -> Scan:
    """Return the scan of an instance: only valid beams with an echo have a range, and only those a reflector.

    Parameters
    ----------
    found : decoded.
    stamp_ns : of the scan [ns].
    scanner : index into the recording's names.
    """
    ranges = (found.distances.astype(np.float64) * found.factor * 1e-3).astype(np.float32)
    valid = ((found.status & 1) != 0) & ((found.status & (_INFINITE | _GLARE | _CONTAMINATED)) == 0)
    ranges[~valid | (found.distances == 0)] = np.nan
    return Scan(
        stamp_ns=stamp_ns,
        ranges=ranges,
        angle_min=math.radians(found.start * _DEG - 90.0),
        angle_increment=math.radians(found.step * _DEG),
        intensities=found.reflectivity.astype(np.float32),
        reflector=valid & ((found.status & _REFLECTOR) != 0),
        scanner=scanner,
    )

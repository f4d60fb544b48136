"""SICK Compact format of picoScan and multiScan over UDP: telegrams of segments with reflector bits.

Layout checked against captured telegrams of both (SICKAG/sick_scan_xd, Apache-2.0).
"""

from __future__ import annotations

import math
import struct
import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from commission.errors import DecodeError
from commission.geometry.arrays import FloatArray
from commission.io.protocols.telegram import Telegram
from commission.site.records import Scan

STX = b"\x02\x02\x02\x02"
TELEGRAM_LIMIT = 1_000_000
LAYER_LIMIT, BEAM_LIMIT, ECHO_LIMIT = 64, 20_000, 8
_SCAN, _IMU = 1, 2
_IMU_BYTES = 64
_HEADER_BYTES = 32
_WITH_DISTANCE, _WITH_RSSI, _WITH_PROPERTIES, _WITH_THETA = 1, 2, 1, 2


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class CompactModule:
    """One segment of a turn."""

    segment: int
    """Number of the segment."""
    frame: int
    """Number of the turn."""
    sender: int
    """Number of the scanner."""
    start_us: NDArray[np.uint64]
    """(L,) time at which each layer's first beam was measured [us]."""
    stop_us: NDArray[np.uint64]
    """(L,) the same of its last beam."""
    elevations: FloatArray
    """(L,) elevation of each layer [rad]."""
    spans: FloatArray
    """(L, 2) azimuth of the first and the last beam of each layer [rad]."""
    ranges: NDArray[np.float32]
    """(L, B, E) distance of each echo [m]; NaN where nothing came back."""
    strengths: NDArray[np.float32] | None
    """(L, B, E) strength of each echo, or None."""
    reflector: NDArray[np.bool_] | None
    """(L, B) whether the scanner says that the beam met a reflector, or None."""
    azimuths: FloatArray | None
    """(L, B) azimuth of each beam [rad], or None."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class CompactTelegram:
    """One telegram of scan data."""

    counter: int
    """Telegrams since the start."""
    sent_us: int
    """Time of transmission [us]."""
    modules: tuple[CompactModule, ...]
    """Its segments."""


def whole_size(begin: bytes) -> int | None:
    """Bytes of a telegram as far as what has arrived of it tells; None until it does.

    Parameters
    ----------
    begin : the first bytes of a telegram, which may exceed a datagram.

    Raises
    ------
    DecodeError
        they are no begin of one.
    """
    if not begin.startswith(STX[: len(begin)]):
        raise DecodeError(f"it begins with {begin[:4]!r}; expected {STX!r}", 0)
    if len(begin) < _HEADER_BYTES:
        return None
    if struct.unpack_from("<I", begin, 4)[0] == _IMU:
        return _IMU_BYTES
    place, size = _HEADER_BYTES, struct.unpack_from("<I", begin, 28)[0]
    while size:
        # The size of the next module stands behind the angles of each, whose number is at its begin.
        if len(begin) < place + 32:
            return None
        layers = struct.unpack_from("<I", begin, place + 20)[0]
        end = place + size
        if layers > LAYER_LIMIT or end > TELEGRAM_LIMIT:
            raise DecodeError(f"a module of {size} bytes with {layers} layers is said", place)
        at = place + 32 + layers * 28 + 4
        if at + 4 > end:
            raise DecodeError(f"a module of {size} bytes with {layers} layers is said", place)
        if len(begin) < at + 4:
            return None
        size = struct.unpack_from("<I", begin, at)[0]
        place = end
    return place + 4


def is_scan(telegram: bytes) -> bool:
    """Whether a whole telegram holds scan data: a multiScan sends those of its inertial unit between them."""
    return telegram[4:8] == _SCAN.to_bytes(4, "little")


def decode_telegram(data: bytes) -> CompactTelegram:
    """Decode one whole telegram.

    Parameters
    ----------
    data : from its first byte to its checksum, fragments joined.

    Raises
    ------
    DecodeError
        the checksum is wrong, it ends early, is no scan, or says more than can be.
    """
    if len(data) < _HEADER_BYTES + 4 or not data.startswith(STX):
        raise DecodeError(f"{len(data)} bytes that begin with {data[:4]!r} are no telegram", 0)
    found, said = zlib.crc32(data[:-4]), struct.unpack_from("<I", data, len(data) - 4)[0]
    if found != said:
        raise DecodeError(f"the checksum is {said:#010x}; expected {found:#010x}", len(data) - 4)
    t = Telegram(data[:-4], 4)
    command, counter, sent, version, size = t.numbers("IQQII")
    if command != _SCAN or version not in (3, 4):
        raise DecodeError(f"command {command} of version {version}; expected scans (1) of version 3 or 4", 4)
    modules: list[CompactModule] = []
    while size:
        end = t.place + size
        module, size = _module(t)
        if t.place != end:
            raise DecodeError(f"a module ends here; expected at byte {end}, as said", t.place)
        modules.append(module)
    if t.left:
        raise DecodeError(f"{t.left} bytes follow the last module", t.place)
    return CompactTelegram(counter=counter, sent_us=sent, modules=tuple(modules))


def _module(t: Telegram) -> tuple[CompactModule, int]:
    """Read a module; returns it and the size of the next one."""
    begin = t.place
    segment, frame, sender, layers, beams, echoes = t.numbers("QQIIII")
    if not (0 < layers <= LAYER_LIMIT and beams <= BEAM_LIMIT and echoes <= ECHO_LIMIT):
        raise DecodeError(f"{layers} layers of {beams} beams with {echoes} echoes are said", begin)
    start, stop = t.array("u8", layers), t.array("u8", layers)
    elevations, first, last = (t.array("f4", layers).astype(np.float64) for _ in range(3))
    scale, following, _, echo_content, beam_content, _ = t.numbers("fIBBBB")
    if not (math.isfinite(scale) and 0.0 < scale < 1e3):
        raise DecodeError(f"the scale of distances is {scale:g}; expected mm > 0", t.place)
    parts = [f"echo{e}{part}" for e in range(echoes) for part in _echo_parts(echo_content)]
    fields = [(name, "<u2") for name in parts]
    fields += [("properties", "u1")] if beam_content & _WITH_PROPERTIES else []
    fields += [("theta", "<u2")] if beam_content & _WITH_THETA else []
    dtype = np.dtype(fields)
    if t.left < dtype.itemsize * layers * beams:
        raise DecodeError(f"{beams} beams of {layers} layers are said, {t.left} bytes are left", t.place)
    rows: Any = np.frombuffer(t.data, dtype, layers * beams, t.place) if dtype.itemsize else np.empty(0)
    t.skip(dtype.itemsize * layers * beams)
    shape = beams, layers

    def column(name: str) -> NDArray[np.uint16]:
        return rows[name].reshape(shape).T

    has = echo_content & _WITH_DISTANCE and echoes
    raw = np.stack([column(f"echo{e}distance") for e in range(echoes)], axis=2) if has else np.zeros((layers, beams, 0))
    ranges = (raw * np.float64(scale) * 1e-3).astype(np.float32)
    ranges[raw == 0] = np.nan
    with_strength = echo_content & _WITH_RSSI and echoes
    strengths = np.stack([column(f"echo{e}rssi") for e in range(echoes)], axis=2) if with_strength else None
    module = CompactModule(
        segment=segment,
        frame=frame,
        sender=sender,
        start_us=start,
        stop_us=stop,
        elevations=elevations,
        spans=np.stack([first, last], axis=1),
        ranges=ranges,
        strengths=None if strengths is None else strengths.astype(np.float32),
        reflector=(column("properties") & 1).astype(np.bool_) if beam_content & _WITH_PROPERTIES else None,
        azimuths=(column("theta").astype(np.float64) - 16384.0) / 5215.0 if beam_content & _WITH_THETA else None,
    )
    return module, following


def _echo_parts(content: int) -> list[str]:
    names = ("distance" if content & _WITH_DISTANCE else "", "rssi" if content & _WITH_RSSI else "")
    return [name for name in names if name]


def level_layer(module: CompactModule) -> int:
    """Index of the layer that a localizer in the plane uses: the one that is nearest to level."""
    return int(np.argmin(np.abs(module.elevations)))


def scan_of(modules: Sequence[CompactModule], layer: int, stamp_ns: int, *, scanner: int = 0) -> Scan:
    """Return one turn as a scan: the segments side by side, the strongest echo of each beam.

    Parameters
    ----------
    modules : segments of one turn, in their order.
    layer : index of the layer.
    stamp_ns : of the scan [ns].
    scanner : index into the recording's names.

    Raises
    ------
    DecodeError
        they have no beams, or beams that are not evenly apart.
    """
    if not modules or any(
        layer >= len(m.elevations) or not m.ranges.shape[1] or not m.ranges.shape[2] for m in modules
    ):
        raise DecodeError("a segment has no beams of the layer", 0)
    azimuths = np.unwrap(np.concatenate([_azimuths(module, layer) for module in modules]))
    step = float(azimuths[-1] - azimuths[0]) / max(len(azimuths) - 1, 1)
    off = np.abs(azimuths - azimuths[0] - step * np.arange(len(azimuths)))
    if not math.isfinite(step) or step == 0.0 or off.max() > max(2.0 * abs(step), 1e-3):
        raise DecodeError("beams are not evenly apart; expected the segments of one turn in their order", 0)
    best = [_strongest(module, layer) for module in modules]
    has_strength = all(module.strengths is not None for module in modules)
    flags = [module.reflector[layer] for module in modules if module.reflector is not None]
    return Scan(
        stamp_ns=stamp_ns,
        ranges=np.concatenate([part[0] for part in best]),
        angle_min=float(azimuths[0]),
        angle_increment=step,
        intensities=np.concatenate([part[1] for part in best]) if has_strength else None,
        reflector=np.concatenate(flags) if len(flags) == len(modules) else None,
        scanner=scanner,
    )


def _azimuths(module: CompactModule, layer: int) -> FloatArray:
    if module.azimuths is not None:
        return module.azimuths[layer]
    first, last = module.spans[layer].tolist()
    return np.linspace(first, last, module.ranges.shape[1])


def _strongest(module: CompactModule, layer: int) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """(B,) range [m] and strength of the strongest echo of each beam, of the first where no strength is said."""
    ranges = module.ranges[layer]
    if module.strengths is None:
        return ranges[:, 0], np.zeros(len(ranges), np.float32)
    strengths = module.strengths[layer]
    best = np.argmax(strengths, axis=1)[:, np.newaxis]
    return np.take_along_axis(ranges, best, axis=1)[:, 0], np.take_along_axis(strengths, best, axis=1)[:, 0]

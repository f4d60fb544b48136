"""Detections without beams: what the detector makes of a reflector in free sight, taken from a library.

It is made once, by the virtual scanner and the detector themselves, of each kind of reflector at many distances and at
all places between two beams. Who sees which reflector from where is not known here.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from commission.compiled import compiled
from commission.geometry.angles import TURN, wrap_scalar
from commission.geometry.arrays import BoolArray, FloatArray, IntArray
from commission.geometry.occupancy import OccupancyGrid
from commission.geometry.raycast import RayCaster
from commission.localization.beam_echo import LARGEST_INCIDENCE, half_width_at
from commission.localization.detection_log import detect_log
from commission.localization.detector import INLIER
from commission.localization.setup import LocalizerSetup
from commission.simulation.scan import beams_of_scanner
from commission.simulation.scan_kernels import BEARING_MARGIN, Hall, Moment, ScannerBeams, cast_scan
from commission.site.record_store import ScanLog
from commission.site.reflectors import Reflector, ReflectorKind
from commission.site.scanner import Scanner

DISTANCES = 96
"""Stretches of distance in the library, each a constant factor (5 % up to 25 m) longer than the one before."""
NEAREST = 0.3
"""Where the first of them begins [m]; nearer than that it counts as there."""
PHASES = 8
"""Parts of the step between two beams."""
SAMPLES = 128
"""Scans of each, at places anywhere in it: a variance at one distance is then known to 4 %, over all to 0.5 %."""
INCIDENCES = 9
"""Angles of incidence of a plate that faces somewhere, evenly from -65 to 65 degrees."""
SEED = 20
"""Seed of the library: it is the same in every study."""

Kind = tuple[float, bool, bool]
"""Radius [m], whether it is a plate, and whether the plate is known to face somewhere."""


class DetectionLibrary(NamedTuple):
    """What was detected of C kinds of reflectors, for kernels."""

    nearest: float
    """Where the first stretch of distance begins [m]."""
    per_log: float
    """Stretches per unit of the natural logarithm of the distance."""
    incidences: IntArray
    """(C,) angles of incidence of each kind: 1 where it does not matter."""
    errors: NDArray[np.float32]
    """(C, I, D, P, S, 2) detected less true range [m] and bearing [rad] of the center; NaN: not detected."""


class Sightings(NamedTuple):
    """Pairs of a scan and a reflector in its free sight, in the order of the scans."""

    distances: FloatArray
    """(n,) from scanner to center [m]; infinity where a nearer reflector hides it."""
    bearings: FloatArray
    """(n,) of the center [rad], as the scanner reports bearings, wrapped."""
    incidences: FloatArray
    """(n,) angle of incidence on a plate [rad], as reported; 0 of what faces nowhere."""
    kinds: IntArray
    """(n,) kind of each."""


def kind_of(reflector: Reflector) -> Kind:
    """What the library tells reflectors apart by."""
    flat = reflector.kind is ReflectorKind.FLAT
    return reflector.reckoned_radius, flat, flat and reflector.heading is not None


def make_library(kinds: tuple[Kind, ...], scanner: Scanner, setup: LocalizerSetup, index: int = 0) -> DetectionLibrary:
    """Scan each kind of reflector in an open field, and detect.

    Parameters
    ----------
    kinds : of reflectors, and of what is taken for one.
    scanner : its beams and their noise.
    setup : the detector.
    index : of the scanner in the setup.

    Returns
    -------
    library : the same for the same arguments.
    """
    # Within the last centimetres of sight fewer and fewer beams come back: that far it counts as a little nearer.
    farthest = max(min(scanner.range[1] - BEARING_MARGIN * scanner.range_sigma, scanner.reflector_range), 2.0 * NEAREST)
    ends = np.geomspace(NEAREST, farthest, DISTANCES + 1)
    angles = [_incidences(kind) for kind in kinds]
    most = max(map(len, angles), default=1)
    errors = np.full((len(kinds), most, DISTANCES, PHASES, SAMPLES, 2), np.nan, dtype=np.float32)
    rng = np.random.default_rng(SEED)
    for c, kind in enumerate(kinds):
        for i, incidence in enumerate(angles[c]):
            for d in range(DISTANCES):
                errors[c, i, d] = _detected(kind, incidence, ends[d : d + 2], _Bench(scanner, setup, index), rng)
    per_log = DISTANCES / math.log(ends[-1] / ends[0])
    return DetectionLibrary(float(ends[0]), per_log, np.array(list(map(len, angles)), dtype=np.int64), errors)


def _incidences(kind: Kind) -> FloatArray:
    return np.linspace(-LARGEST_INCIDENCE, LARGEST_INCIDENCE, INCIDENCES) if kind[2] else np.zeros(1)


@dataclass(frozen=True, slots=True)
class _Bench:
    """What reflectors are looked at with."""

    scanner: Scanner
    setup: LocalizerSetup
    index: int


def _detected(
    kind: Kind, incidence: float, ends: FloatArray, bench: _Bench, rng: np.random.Generator
) -> NDArray[np.float32]:
    """(P, S, 2) errors of range and bearing of one kind in one stretch of distance; NaN where nothing is detected."""
    radius = kind[0]
    beams = beams_of_scanner(replace(bench.scanner, upside_down=False))
    count = 2 * _reach(beams, radius, ends[0]) + 1
    # The middle beam looks along the bearing 0.
    beams = beams._replace(angle_min=-(count // 2) * beams.increment)
    hall = Hall(
        RayCaster(OccupancyGrid(np.zeros((1, 1), np.bool_), 1.0, np.zeros(3))).tables,
        np.zeros((1, 2)),
        np.array([radius]),
        np.array([math.nan if not kind[2] else math.pi + incidence]),
        np.array([kind[1]]),
        np.zeros(1),
    )
    step = beams.increment / PHASES
    true = (np.arange(PHASES)[:, np.newaxis] + rng.random((PHASES, SAMPLES))).ravel() * step
    distances = np.maximum(rng.uniform(ends[0], ends[1], len(true)), 1.01 * radius)
    ranges = np.empty((len(true), count), np.float32)
    flags = np.empty((len(true), count), np.bool_)
    _scan_bench(hall, beams, np.stack((distances, true), 1), rng.standard_normal((len(true), count, 2)), ranges, flags)
    stamps = np.arange(len(true), dtype=np.int64)
    log = ScanLog.even(stamps, ranges, (beams.angle_min, beams.increment), reflector=flags)
    setup = _without_blind_sectors(bench.setup)
    found = detect_log(log, setup, scanner=bench.index)
    passed = np.flatnonzero(found.status == INLIER)
    scans = np.repeat(stamps, np.diff(found.offsets))[passed]
    first = np.unique(scans, return_index=True)[1]
    errors = np.full((len(true), 2), np.nan, dtype=np.float32)
    rows = scans[first]
    errors[rows] = found.range_bearing[passed[first]] - np.stack((distances[rows], true[rows]), 1)
    return errors.reshape(PHASES, SAMPLES, 2)


def _without_blind_sectors(setup: LocalizerSetup) -> LocalizerSetup:
    scanners = tuple(replace(each, blind_sectors_deg=()) for each in setup.scanners)
    return replace(setup, scanners=scanners)


def _reach(beams: ScannerBeams, radius: float, distance: float) -> int:
    """Beams on each side of the middle that can meet a reflector, and a few more that show where it ends."""
    high = math.asin(min(radius / max(distance, 1.01 * radius), 1.0))
    half = half_width_at(distance, beams.half_divergence, beams.half_aperture)
    return min(
        int((high + half + BEARING_MARGIN * beams.bearing_sigma) / beams.increment) + 4, int(1.5 / beams.increment)
    )


@compiled
def _scan_bench(  # noqa: PLR0917 - what stands there, the scanner, and its scans
    hall: Hall,
    beams: ScannerBeams,
    places: FloatArray,
    noise: FloatArray,
    ranges: NDArray[np.float32],
    flags: BoolArray,
) -> None:
    """Scan one reflector at each of some distances and bearings."""
    nobody, shining = np.empty((0, 3)), np.ones(len(hall.radii), np.bool_)
    pose = np.zeros(3)
    for n in range(len(places)):
        # Turned by the bearing, the scanner sees what stands on the axis under it.
        hall.centers[0, 0], pose[2] = places[n, 0], -places[n, 1]
        moment = Moment(pose, math.inf, nobody, noise[n], True, shining)
        cast_scan(hall, beams, moment, ranges[n], flags[n])


def draw_detections(
    library: DetectionLibrary, scanner: Scanner, sightings: Sightings, rng: np.random.Generator
) -> FloatArray:
    """Draw what is detected of each reflector in sight.

    Parameters
    ----------
    library : of the scanner.
    scanner : its bearings.
    sightings : n pairs.
    rng : two numbers for each pair.

    Returns
    -------
    range_bearing : (n, 2) [m, rad] as the scanner reports; NaN where it is not detected.
    """
    out = np.empty((len(sightings.distances), 2))
    _draw(library, scanner.angle_min, scanner.angle_increment, sightings, rng.random((len(out), 2)), out)
    return out


@compiled
def _draw(  # noqa: PLR0917 - library, beams, pairs
    library: DetectionLibrary,
    angle_min: float,
    increment: float,
    sightings: Sightings,
    chance: FloatArray,
    out: FloatArray,
) -> None:
    """Between two angles of incidence one is chosen by chance in proportion: moments are linear in between."""
    _, _, count, phases, samples, _ = library.errors.shape
    for n in range(len(out)):
        distance, kind = sightings.distances[n], sightings.kinds[n]
        if distance == math.inf:
            out[n, 0], out[n, 1] = math.nan, math.nan
            continue
        one, other = chance[n, 0], chance[n, 1]
        d = min(int(math.log(max(distance, library.nearest) / library.nearest) * library.per_log), count - 1)
        i, angles = 0, library.incidences[kind]
        if angles > 1:
            at = (sightings.incidences[n] / LARGEST_INCIDENCE + 1.0) * 0.5 * (angles - 1)
            i = min(max(int(at), 0), angles - 2)
            i += one < at - i
        offset = (sightings.bearings[n] - angle_min) / increment
        phase = min(int((offset - math.floor(offset)) * phases), phases - 1)
        sample = min(int(other * samples), samples - 1)
        out[n, 0] = distance + library.errors[kind, i, d, phase, sample, 0]
        bearing = sightings.bearings[n] + library.errors[kind, i, d, phase, sample, 1]
        out[n, 1] = wrap_scalar(bearing) if abs(bearing) > 0.5 * TURN else bearing

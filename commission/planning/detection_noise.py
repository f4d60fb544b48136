"""What a detection is worth: bias and noise of a reflector's detected center by its distance, found by detecting it.

One reflector stands at a distance, as often at any place between two beams as at any other; it is scanned with the
scanner's own noise and handed to the localizer's own detector. Walls, people and the vehicle's motion are not in it.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from commission.compiled import compiled, compiled_inline
from commission.geometry.arrays import FloatArray, IntArray, read_only
from commission.localization.beam_echo import BeamModel, cylinder_echo, half_width_at, is_flagged, lit_part
from commission.localization.detector import INLIER, detect_clusters
from commission.localization.detector_model import Beams, DetectorModel, ReflectorClass, class_of, detector_model
from commission.site.detection_rates import detection_rate
from commission.site.parameters import DetectorParameters
from commission.site.reflectors import ReflectorMap
from commission.site.scanner import Scanner

CLASS_COLUMNS = 4
"""Fields of a `DetectorModel` that have a row for each class, in the order of a `ReflectorClass`."""
LIKELY = 0.5
"""Probability of detection from which on a reflector counts as visible."""
NEAREST = 0.3
"""Smallest distance that is looked at [m]; nearer ones count as this one."""
DISTANCES = 64
"""Distances that are looked at, evenly in their logarithm."""
SCANS = 1024
"""Scans at each: a sigma is then known to 2 %, and what lies between two distances averages both."""
MARGIN = 5.0
"""Sigmas of bearing noise by which the interval of beams that may meet the reflector is widened."""


class Worth(NamedTuple):
    """What the detections of one reflector at one distance are like."""

    probability: float
    """That it is detected and passes the detector filter while it is in sight [0..1]."""
    range_bias: float
    """Mean error of the range [m]."""
    range_variance: float
    """[m^2]."""
    bearing_variance: float
    """[rad^2]."""
    range_wave: float
    """What of it repeats where the reflector stands alike between two beams: a mean error a cos(psi) of the range, psi
    being a turn from beam to beam and 0 on a beam; its amplitude a [m]. The variances include it, a^2 / 2."""
    bearing_wave: float
    """The same of the bearing, a sin(psi): the cluster's edges jump from beam to beam [rad]."""


class DetectionNoise(NamedTuple):
    """`Worth` by class of reflector and distance, for kernels."""

    columns: FloatArray
    """(C, DISTANCES, 6) rows of `Worth`."""
    per_log: float
    """Rows per e-fold of the distance."""


class DetectionTable(NamedTuple):
    """What was found out about each class of reflectors, for who explains it."""

    distances: FloatArray
    """(DISTANCES,) that were looked at [m]."""
    noise: DetectionNoise
    """What its detections are worth."""
    rates: FloatArray
    """(DISTANCES,) share of scans in which the scanner tells it from other things [0..1]; a factor of its
    probabilities of detection."""
    shown: FloatArray
    """(C, DISTANCES) probability that its beams raise a flag in a scan in which the scanner tells it from other things
    [0..1]."""
    beams: FloatArray
    """(C, DISTANCES) mean width of its widest cluster where there is one [beams]; NaN where there is none."""

    def rejected(self) -> FloatArray:
        """(C, DISTANCES) share of the scans that show it in which nothing passes the detector filter [0..1]."""
        flagged = self.shown * self.rates
        return 1.0 - self.noise.columns[:, :, 0] / np.where(flagged > 0.0, flagged, np.inf) - (flagged == 0.0)

    def likely_between(self, kind: int) -> tuple[float, float]:
        """Nearest and farthest distance between which a class is detected in at least `LIKELY` of all scans [m].

        Of several such stretches the longest; 0 and infinity where it reaches to an end of the table; farthest before
        nearest where there is none.
        """
        probability = self.noise.columns[kind, :, 0]
        edges = np.flatnonzero(np.diff(np.concatenate(([False], probability >= LIKELY, [False])).astype(np.int8)))
        if not len(edges):
            return math.inf, 0.0
        longest = int(np.argmax(np.diff(edges)[::2]))
        first, end = int(edges[2 * longest]), int(edges[2 * longest + 1])
        nearest = 0.0 if first == 0 else self._crossing(probability, first - 1)
        return nearest, math.inf if end == len(probability) else self._crossing(probability, end - 1)

    def _crossing(self, probability: FloatArray, row: int) -> float:
        """Distance between a row and the next at which the probability, interpolated as in `worth`, is `LIKELY` [m]."""
        share = (LIKELY - probability[row]) / (probability[row + 1] - probability[row])
        return float(self.distances[row] * (self.distances[row + 1] / self.distances[row]) ** share)


class _Optics(NamedTuple):
    """What matters of a scanner."""

    increment: float
    beam: BeamModel
    farthest: float


def detection_noise(
    reflectors: ReflectorMap, scanner: Scanner, parameters: DetectorParameters, farthest: float | None = None
) -> DetectionNoise:
    """Find out what detections of the reflectors of a map are worth, out to the scanner's range.

    Parameters
    ----------
    reflectors : their distinct radii and kinds are looked at; a plate is taken to face the scanner.
    scanner : beams and their noise.
    parameters : of the detector: its window rejects, and its rule for the center has a noise of its own.
    farthest : out to where [m]; None: to the scanner's range.
    """
    return detection_table(reflectors, scanner, parameters, farthest).noise


def detection_table(
    reflectors: ReflectorMap, scanner: Scanner, parameters: DetectorParameters, farthest: float | None = None
) -> DetectionTable:
    """Find out how the reflectors of a map are detected, and what their detections are worth.

    Parameters
    ----------
    reflectors, scanner, parameters, farthest : as in `detection_noise`.
    """
    optics = _Optics(
        scanner.angle_increment,
        BeamModel(
            0.5 * math.radians(scanner.beam_width_deg),
            0.5 * scanner.beam_aperture,
            math.radians(scanner.bearing_sigma_deg),
            scanner.range_sigma,
        ),
        farthest or _reach(scanner),
    )
    model = detector_model(reflectors, scanner, parameters)
    columns = model[:CLASS_COLUMNS]
    classes = tuple(zip(*(column.tolist() for column in columns), strict=True))
    table = _experiment(classes, tuple(model[CLASS_COLUMNS:]), optics)
    return _with_rates(table, scanner) if scanner.detection_rates else table


def _with_rates(table: DetectionTable, scanner: Scanner) -> DetectionTable:
    """Table of reflectors that the scanner tells from other things in some of its scans only."""
    rates = detection_rate(scanner.detection_rates, table.distances)
    columns = np.array(table.noise.columns)
    columns[:, :, 0] *= rates
    noise = table.noise._replace(columns=read_only(columns))
    return table._replace(noise=noise, rates=read_only(rates))


def _reach(scanner: Scanner) -> float:
    """Out to where detections are looked at [m]."""
    return max(min(scanner.range[1], scanner.reflector_range), 2.0 * NEAREST)


def classes_of(reflectors: ReflectorMap, scanner: Scanner, parameters: DetectorParameters) -> IntArray:
    """Row of `DetectionNoise.columns` of each reflector.

    Parameters
    ----------
    reflectors, scanner, parameters : as in `detection_noise`.

    Returns
    -------
    rows : (M,) array.
    """
    model = detector_model(reflectors, scanner, parameters)
    columns = model[:CLASS_COLUMNS]
    rows = {each: row for row, each in enumerate(zip(*(column.tolist() for column in columns), strict=True))}
    return np.array([rows[class_of(each)] for each in reflectors.reflectors], dtype=np.int64)


class DetectionQuality(NamedTuple):
    """What detections of each reflector of a map are worth."""

    classes: IntArray
    """(S, M) row of `noise.columns` of each reflector, for each scanner."""
    noise: DetectionNoise
    """By class and distance."""


def detection_quality(
    reflectors: ReflectorMap, scanners: Sequence[Scanner], parameters: DetectorParameters
) -> DetectionQuality:
    """Gather `classes_of` and `detection_noise` of several scanners.

    Parameters
    ----------
    reflectors, parameters : as in `detection_noise`.
    scanners : S of them; all are looked at out to the range of the one that sees farthest.
    """
    farthest = max(map(_reach, scanners))
    noises = [detection_noise(reflectors, scanner, parameters, farthest) for scanner in scanners]
    starts = np.cumsum([0, *(len(noise.columns) for noise in noises)])
    classes = [
        classes_of(reflectors, scanner, parameters) + start for scanner, start in zip(scanners, starts, strict=False)
    ]
    columns = np.concatenate([noise.columns for noise in noises])
    return DetectionQuality(np.stack(classes), DetectionNoise(read_only(columns), noises[0].per_log))


@compiled_inline
def worth(noise: DetectionNoise, kind: int, distance: float) -> Worth:
    """Look up a class of reflectors at a distance.

    Parameters
    ----------
    noise : what was found out, see `detection_noise`.
    kind : row of `noise.columns`.
    distance : of the reflector's center [m].

    Notes
    -----
    (1 - b) row[i] + b row[i + 1] with i + b = per_log ln(distance / NEAREST): linear interpolation, by definition.
    """
    place = noise.per_log * math.log(max(distance, NEAREST) / NEAREST)
    row = min(int(place), noise.columns.shape[1] - 2)
    b = min(place - row, 1.0)
    a = 1.0 - b
    c = noise.columns
    return Worth(
        a * c[kind, row, 0] + b * c[kind, row + 1, 0],
        a * c[kind, row, 1] + b * c[kind, row + 1, 1],
        a * c[kind, row, 2] + b * c[kind, row + 1, 2],
        a * c[kind, row, 3] + b * c[kind, row + 1, 3],
        a * c[kind, row, 4] + b * c[kind, row + 1, 4],
        a * c[kind, row, 5] + b * c[kind, row + 1, 5],
    )


# The same site is predicted again and again while the engineer drags a reflector.
@functools.lru_cache(maxsize=64)
def _experiment(classes: tuple[ReflectorClass, ...], rest: tuple[float, ...], optics: _Optics) -> DetectionTable:
    """Detect each class of reflectors at each distance; `rest` are the other fields of a `DetectorModel`."""
    radii, flat = tuple(each[0] for each in classes), tuple(each[1] for each in classes)
    kinds = (np.float64, np.bool_, np.float64, np.float64)
    model = DetectorModel(
        *(read_only(np.array([each[i] for each in classes], kind)) for i, kind in enumerate(kinds)),  # type: ignore[arg-type]
        *rest,  # type: ignore[arg-type]
    )
    columns = np.zeros((len(radii), DISTANCES, len(Worth._fields)))
    shown, beams = np.zeros((len(radii), DISTANCES)), np.full((len(radii), DISTANCES), np.nan)
    distances = np.geomspace(NEAREST, optics.farthest, DISTANCES)
    for kind, radius in enumerate(radii):
        for row, distance in enumerate(distances.tolist()):
            worth, widths = _judge(max(distance, 2.0 * radius), radius, flat[kind], optics, model, row)
            columns[kind, row], seen = worth, widths > 0
            shown[kind, row] = seen.mean()
            if seen.any():
                beams[kind, row] = widths[seen].mean()
    noise = DetectionNoise(read_only(columns), (DISTANCES - 1) / math.log(optics.farthest / NEAREST))
    return DetectionTable(
        read_only(distances), noise, read_only(np.ones(DISTANCES)), read_only(shown), read_only(beams)
    )


def _judge(  # noqa: PLR0917 - one reflector
    distance: float, radius: float, flat: bool, optics: _Optics, model: DetectorModel, seed: int
) -> tuple[Worth, IntArray]:
    """Scan a reflector often: what the detector makes of it, and the width of its widest cluster in each scan."""
    beam = optics.beam
    half_width = half_width_at(distance, beam.half_divergence, beam.half_aperture)
    span = math.asin(radius / distance) + half_width + MARGIN * beam.bearing_sigma
    reach = int(span / optics.increment) + 2
    rng = np.random.default_rng(seed)
    noise = rng.standard_normal((SCANS, 2 * reach + 1, 2))
    errors, widest = np.empty((SCANS, 2)), np.empty(SCANS, np.int64)
    _detect_often(distance, radius, flat, optics, model, _places(SCANS), noise, errors, widest)
    detected = ~np.isnan(errors[:, 0])
    if detected.sum() < 2:
        return Worth(0.0, 0.0, beam.range_sigma**2, optics.increment**2, 0.0, 0.0), widest
    psi = 2.0 * math.pi * _places(SCANS)[detected]
    ranges, bearings = errors[detected].T
    found = Worth(
        float(detected.mean()),
        float(ranges.mean()),
        float(ranges.var()),
        float(np.square(bearings).mean()),
        float(2.0 * np.mean(ranges * np.cos(psi))),
        float(2.0 * np.mean(bearings * np.sin(psi))),
    )
    return found, widest


def _places(count: int) -> FloatArray:
    """Places evenly between two beams, in steps from a beam [-0.5..0.5]."""
    return (np.arange(count, dtype=np.float64) + 0.5) / count - 0.5


@compiled
def _detect_often(  # noqa: PLR0917 - one reflector
    distance: float,
    radius: float,
    flat: bool,
    optics: _Optics,
    model: DetectorModel,
    places: FloatArray,
    noise: FloatArray,
    errors: FloatArray,
    widest: IntArray,
) -> None:
    """Error of range [m] and bearing [rad] in each of S scans, NaN where nothing passes the detector filter.

    Parameters
    ----------
    places : (S,) bearing of the reflector in each scan [steps between beams], from the middle beam.
    noise : (S, B, 2) standard normal draws for bearing and range of each of B beams; the middle one is straight ahead.
    errors : (S, 2) output.
    widest : (S,) output: width of the widest cluster [beams]; 0 where there is none.
    """
    count = noise.shape[1]
    beams = Beams(count, -(count // 2) * optics.increment, optics.increment, False)
    ranges, flags = np.empty(count, np.float32), np.empty(count, np.bool_)
    range_bearing, widths = np.empty((count, 2)), np.empty(count, np.int64)
    expected, status = np.empty(count), np.empty(count, np.int8)
    half_width = half_width_at(distance, optics.beam.half_divergence, optics.beam.half_aperture)
    high = math.atan(radius / distance) if flat else math.asin(radius / distance)
    for k in range(len(noise)):
        bearing = places[k] * optics.increment
        for i in range(count):
            off = beams.angle_min + i * beams.increment + optics.beam.bearing_sigma * noise[k, i, 0] - bearing
            lower, upper = lit_part(off, half_width, -high, high)
            flags[i] = is_flagged(lower, upper, half_width, 2.0 * high)
            lit = 0.5 * (lower + upper)
            echo = distance / math.cos(lit) if flat else cylinder_echo(distance, radius, lit)
            ranges[i] = echo + optics.beam.range_sigma * noise[k, i, 1] if flags[i] else math.nan
        found = detect_clusters(ranges, flags, beams, model, 0, range_bearing, widths, expected, status)
        errors[k, 0], errors[k, 1], widest[k] = math.nan, math.nan, 0
        for i in range(found):
            widest[k] = max(widest[k], widths[i])
        for i in range(found):
            if status[i] == INLIER:
                errors[k, 0], errors[k, 1] = range_bearing[i, 0] - distance, range_bearing[i, 1] - bearing
                break

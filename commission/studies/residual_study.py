"""Whether residuals are what the localizer takes them for: their size, their likeness in time, and what they go with.

Residuals are innovations: against the belief before each scan. All up to FARTHEST_D2 count, accepted or not.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from commission.geometry.angles import wrap
from commission.geometry.arrays import BoolArray, FloatArray, IntArray, read_only
from commission.progress import Progress, part, silent
from commission.site.floor_map import FloorMap
from commission.site.project import Project
from commission.site.quantity import DEGREES, Shown
from commission.studies.consistency import has_distance
from commission.studies.detection_rates import DetectionRate, detection_rates
from commission.studies.innovations import Innovations, innovations
from commission.studies.inputs import StudyInput
from commission.studies.intensity_peaks import intensity_peaks
from commission.studies.run import RunResult

FARTHEST_D2 = 25.0
"""A detection farther from its reflector is of something else."""
EDGES: FloatArray = read_only(np.arange(0.0, 12.01, 0.5))
"""Bounds of the bins that squared Mahalanobis distances are counted in; what is beyond is counted apart."""
ROUNDS, LEFT_OUT = 10, 5.0
"""Rounds in which noise is estimated, and 1-sigmas beyond which a residual does not count."""
BINS, FEWEST = 10, 50
"""Bins of a relation at most, and residuals in one at least."""
LONGEST_LAG_S, LAGS = 10.0, 16
AROUND_S = 0.25
"""Speed is that of half a second about each scan."""
METRES, METRES_PER_S, DEGREES_PER_S = Shown("m", 1.0), Shown("m/s", 1.0), Shown("°/s", DEGREES.scale)
SENSORS_UNITS = Shown("sensor's units", 1.0)
"""Of an intensity."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class ResidualInput(StudyInput):
    """All that the study reads."""

    run: RunResult
    """The drive, localized and judged."""
    floor_map: FloorMap | None
    """Walls that hide reflectors."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Relation:
    """Residuals by something else, in bins of about as many."""

    name: str
    """What the bins are of."""
    shown: Shown
    """Its unit."""
    places: FloatArray
    """(B,) mean of each bin, SI."""
    counts: IntArray
    """(B,) residuals in each."""
    means: FloatArray
    """(B, 2) mean residual of range [m] and bearing [rad]."""
    spreads: FloatArray
    """(B, 2) their standard deviations."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class BeamRelation:
    """Beams of clusters by distance."""

    places: FloatArray
    """(B,) mean distance of each bin [m]."""
    counts: IntArray
    """(B,) clusters in each."""
    beams: FloatArray
    """(B,) mean number of beams."""
    expected: FloatArray
    """(B,) mean number that was expected."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class ResidualStudy:
    """All that was found."""

    inputs: ResidualInput
    """What it was made of."""
    counts: IntArray
    """(24,) detections by squared Mahalanobis distance, between `EDGES`."""
    beyond: int
    """Those beyond the last edge."""
    mean: float
    """Mean squared Mahalanobis distance; 2 is consistent."""
    factors: FloatArray
    """(2,) multiples of the 1-sigmas of range and bearing that the residuals need; NaN where there are too few."""
    lags: FloatArray
    """(L,) times between two scans [s]."""
    correlations: FloatArray
    """(L, 2) correlation of residuals of one reflector so far apart, of range and bearing."""
    chance: FloatArray
    """(L,) size that a correlation has by chance in 95 % of the cases."""
    relations: tuple[Relation, ...]
    """By range, bearing, speed, turn rate, intensity where scans hold it, and incidence of flat ones."""
    beams: BeamRelation | None
    """None where the sensor itself detects, or nobody knows how many beams a reflector has."""
    rates: tuple[DetectionRate, ...]
    """How often reflectors in sight are seen, by distance."""

    @property
    def total(self) -> int:
        """Detections that are counted."""
        return int(self.counts.sum()) + self.beyond

    @property
    def expected(self) -> FloatArray:
        """(24,) detections between `EDGES` of a consistent filter: chi-square with 2 degrees of freedom."""
        return self.total * (np.exp(-0.5 * EDGES[:-1]) - np.exp(-0.5 * EDGES[1:]))


def residual_study(inputs: ResidualInput, progress: Progress = silent) -> ResidualStudy:
    """Look at the residuals of a run; of several setups on the way, the last one's noise is what they are held against.

    Parameters
    ----------
    inputs : the run.
    progress : told how far it is; may raise to cancel.
    """
    columns = inputs.run.columns
    setup = columns.segments[-1].setup
    progress(0.0, "residuals")
    found = innovations(columns, setup)
    known = has_distance(columns) & np.isfinite(found.residuals[:, 0]) & (columns.d2 < FARTHEST_D2)
    counts, _ = np.histogram(columns.d2[known], EDGES)
    progress(0.3, "residuals in time")
    lags, correlations, chance = _in_time(inputs.run, found, known)
    progress(0.5, "what residuals go with")
    site = Project(reflectors=setup.reflectors, scanners=setup.scanners, floor_map=inputs.floor_map)
    return ResidualStudy(
        inputs=inputs,
        counts=read_only(counts.astype(np.int64)),
        beyond=int(np.count_nonzero(known)) - int(counts.sum()),
        mean=float(columns.d2[known].mean()) if known.any() else math.nan,
        factors=_factors(found, known, np.repeat(np.arange(len(columns)), np.diff(columns.offsets))),
        lags=lags,
        correlations=correlations,
        chance=chance,
        relations=tuple(_relations(inputs.run, found, known)),
        beams=_beams(inputs.run, found, known),
        rates=detection_rates(site, columns, progress=part(progress, 0.6, 1.0)),
    )


def _normalized(found: Innovations, known: BoolArray) -> FloatArray:
    """(m, 2) residuals by the 1-sigma that the filter expects of each."""
    S = found.covariances[known]
    return found.residuals[known] / np.sqrt(np.stack((S[:, 0, 0], S[:, 1, 1]), axis=1))


def _factors(found: Innovations, known: BoolArray, cycle: IntArray) -> FloatArray:
    """(2,) multiples of the noise that the detections of a scan need among themselves, whatever odometry is like.

    Notes
    -----
    The pose is fitted to each scan alone; f^2 is the sum of the squared residuals left over the sum of the redundancies
    r = 1 - w h^T N^-1 h, for ranges and bearings in turn (Förstner 1979, variance components). Scans of one detection
    leave none. What is left beyond `LEFT_OUT` sigmas is of something else.
    """
    counts = np.bincount(cycle[known], minlength=int(cycle.max(initial=0)) + 1)
    rows = np.flatnonzero(known & (counts[cycle] > 1)) if len(cycle) else np.zeros(0, dtype=np.int64)
    if len(rows) < FEWEST:
        return np.full(2, math.nan)
    H, nu, R = found.jacobians[rows], found.residuals[rows], found.noise[rows]
    starts = np.flatnonzero(np.diff(cycle[rows], prepend=-1))
    sizes = np.diff(np.append(starts, len(rows)))
    squares: FloatArray = np.ones(2)
    kept: FloatArray = np.ones(len(rows))
    for turn in range(ROUNDS):
        w: FloatArray = kept[:, np.newaxis] / (squares * R)
        left, taken_up = _fitted_scan_by_scan(H, nu, w, starts, sizes)
        size: FloatArray = (w * left**2).sum(axis=0)
        squares = squares * size / np.maximum((kept[:, np.newaxis] - taken_up).sum(axis=0), 1e-9)
        if turn >= ROUNDS // 2:
            kept = (np.abs(left) < LEFT_OUT * np.sqrt(squares * R)).all(axis=1).astype(np.float64)
    return np.sqrt(squares)


def _fitted_scan_by_scan(
    H: FloatArray, nu: FloatArray, w: FloatArray, starts: IntArray, sizes: IntArray
) -> tuple[FloatArray, FloatArray]:
    """(n, 2) residuals that a pose of each scan's own leaves, and the share w h^T N^-1 h of each that it takes up.

    Parameters
    ----------
    H, nu, w : (n, 2, 3) Jacobians, (n, 2) residuals and (n, 2) weights.
    starts, sizes : first row of each scan, and how many are its.
    """
    N = np.add.reduceat(np.einsum("na,nai,naj->nij", w, H, H), starts) + 1e-9 * np.eye(3)
    b = np.add.reduceat(np.einsum("na,nai,na->ni", w, H, nu), starts)
    inverse = np.repeat(np.linalg.inv(N), sizes, axis=0)
    step = np.repeat(np.linalg.solve(N, b[:, :, np.newaxis])[:, :, 0], sizes, axis=0)
    return nu - np.einsum("nai,ni->na", H, step), w * np.einsum("nai,nij,naj->na", H, inverse, H)


def _in_time(run: RunResult, found: Innovations, known: BoolArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Correlation of the residuals of one reflector by the time between them, and its size by chance."""
    columns, cycles = run.columns, len(run.columns)
    period = float(np.median(np.diff(run.times))) if cycles > 1 else 0.0
    most = min(int(LONGEST_LAG_S / period), cycles // 4) if period > 0.0 else 0
    if most < 1 or np.count_nonzero(known) < FEWEST:
        return np.zeros(0), np.zeros((0, 2)), np.zeros(0)
    steps = np.unique(np.round(np.geomspace(1, most, LAGS)).astype(np.int64))
    z = _normalized(found, known)
    z = z - z.mean(axis=0)
    cycle = np.repeat(np.arange(cycles), np.diff(columns.offsets))[known]
    key = columns.reflector[known] * (cycles + most) + cycle
    order = np.argsort(key, kind="stable")
    key, z = key[order], z[order]
    variance = np.maximum((z**2).mean(axis=0), 1e-30)
    rhos, chance = np.full((len(steps), 2), math.nan), np.full(len(steps), math.nan)
    for row, step in enumerate(steps.tolist()):
        at = np.minimum(np.searchsorted(key, key + step), len(key) - 1)
        here = np.flatnonzero(key[at] == key + step)
        if len(here):
            rhos[row] = (z[here] * z[at[here]]).mean(axis=0) / variance
            chance[row] = 1.96 / math.sqrt(len(here))
    return np.asarray(steps * period, dtype=np.float64), rhos, chance


def _relations(run: RunResult, found: Innovations, known: BoolArray) -> list[Relation]:
    """Residuals by what they might go with."""
    columns, log = run.columns, run.inputs.log
    cycle = np.repeat(np.arange(len(columns)), np.diff(columns.offsets))[known]
    measured, residuals = columns.range_bearing[known], found.residuals[known]
    amounts = [("range", METRES, measured[:, 0]), ("bearing", DEGREES, measured[:, 1])]
    if len(log.odometry_stamps_ns) > 1:
        seconds = (log.odometry_stamps_ns - log.first_ns) * 1e-9
        for name, shown, each in (
            ("speed", METRES_PER_S, log.displacements[:, 0]),
            ("turn rate", DEGREES_PER_S, log.displacements[:, 2]),
        ):
            way = np.cumsum(each)
            before, after = (np.interp(run.times + side, seconds, way) for side in (-AROUND_S, AROUND_S))
            amounts.append((name, shown, ((after - before) / (2.0 * AROUND_S))[cycle]))
    setup = columns.segments[-1].setup
    peaks = intensity_peaks(log, columns.detected, setup)[known]
    reflectors = setup.reflectors
    flat = reflectors.is_flat[columns.reflector[known]] if len(reflectors) else np.zeros(len(cycle), dtype=np.bool_)
    relations = [_relation(name, shown, amount, residuals) for name, shown, amount in amounts]
    bright = np.isfinite(peaks)
    if bright.any():
        relations.append(_relation("intensity", SENSORS_UNITS, peaks[bright], residuals[bright]))
    if flat.any():
        mountings = np.array([each.mounting[2] for each in setup.scanners])[columns.detected.scanners[cycle]]
        ray = columns.means[cycle, 2] + mountings + measured[:, 1] + math.pi
        incidence = np.abs(wrap(ray - reflectors.headings[columns.reflector[known]]))
        relations.append(_relation("incidence", DEGREES, incidence[flat], residuals[flat]))
    return [each for each in relations if len(each.counts) > 1]


def _bins(amount: FloatArray) -> IntArray:
    """Bin of each value: about as many in each, none twice."""
    count = max(1, min(BINS, len(amount) // FEWEST))
    edges = np.unique(np.quantile(amount, np.linspace(0.0, 1.0, count + 1)[1:-1])) if len(amount) else np.zeros(0)
    return np.searchsorted(edges, amount, side="right")


def _means(bins: IntArray, values: FloatArray) -> FloatArray:
    """Mean of the values of each bin."""
    return np.bincount(bins, values) / np.bincount(bins)


def _relation(name: str, shown: Shown, amount: FloatArray, residuals: FloatArray) -> Relation:
    _, bins = np.unique(_bins(amount), return_inverse=True)
    means = np.stack([_means(bins, residuals[:, axis]) for axis in (0, 1)], axis=1)
    squares = np.stack([_means(bins, (residuals[:, axis] - means[bins, axis]) ** 2) for axis in (0, 1)], axis=1)
    return Relation(
        name=name,
        shown=shown,
        places=_means(bins, amount),
        counts=np.bincount(bins),
        means=means,
        spreads=np.sqrt(squares),
    )


def _beams(run: RunResult, found: Innovations, known: BoolArray) -> BeamRelation | None:
    """Beams of clusters against what is expected there."""
    detected = run.columns.detected
    rows = known & (detected.beams > 0) & np.isfinite(detected.expected)
    if np.count_nonzero(rows) < FEWEST:
        return None
    distances = found.distances[rows]
    _, bins = np.unique(_bins(distances), return_inverse=True)
    return BeamRelation(
        places=_means(bins, distances),
        counts=np.bincount(bins),
        beams=_means(bins, detected.beams[rows].astype(np.float64)),
        expected=_means(bins, detected.expected[rows]),
    )

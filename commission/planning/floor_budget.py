"""What the error of a fix comes from over the floor: noise, map, mounting, range bias and clock, of one scan.

The figures of `coverage` are those of noise (and of the survey, where a reflector has a sigma). Constants move every
fix at a place alike, whatever else is averaged: here they are added, by their own response.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from commission.geometry.arrays import BoolArray, FloatArray, read_only
from commission.localization.cross_covariance import survey_variance
from commission.planning.coverage import Coverage
from commission.planning.dilution import FixOptions, Heading, Measurement
from commission.planning.error_budget import CONTRIBUTIONS
from commission.planning.vehicle_visibility import VehicleVisibility
from commission.planning.visibility import faces, unpack
from commission.progress import Progress, silent
from commission.site.reflectors import ReflectorMap
from commission.site.scanner import Scanner
from commission.site.uncertainty import Uncertainty

PAIRS_AT_ONCE = 400_000
"""Points times reflectors that are looked at together: some tens of megabytes."""
SINGULAR = 1e-12
"""Determinant of the information, scaled to ones on its diagonal, below which there is no fix."""
NOISE, MAP, MOUNTING, RANGE, CLOCK = range(5)


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class FloorBudget:
    """Error of a fix at N points, and what it comes from. Read-only."""

    sigma: FloatArray
    """(N,) 1-sigma of the position along its longest axis [m]; infinite where there is no fix."""
    shares: FloatArray
    """(N, 5) share of each of `CONTRIBUTIONS` in the square of that [0..1]; zeros where there is no fix."""

    @property
    def largest(self) -> tuple[str, ...]:
        """(N,) what contributes most at each point; empty where there is no fix."""
        most = self.shares.argmax(axis=1)
        has_fix = np.isfinite(self.sigma)
        return tuple(CONTRIBUTIONS[part] if there else "" for part, there in zip(most, has_fix, strict=True))


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class BudgetSite:
    """What the budget reads besides a coverage."""

    visible: VehicleVisibility
    """Reflectors, in the order of the coverage's bits, scanners and walls."""
    uncertainty: Uncertainty
    """How well constants are known."""
    speed: float
    """Of the vehicle [m/s]: a clock that is late counts by the way driven meanwhile."""

    @property
    def reflectors(self) -> ReflectorMap:
        """The reflectors."""
        return self.visible.reflectors

    @property
    def scanners(self) -> tuple[Scanner, ...]:
        """The laser scanners."""
        return tuple(self.visible.scanners)


@dataclass(frozen=True, slots=True, eq=False)
class _Stance:
    """A heading of the vehicle, and how each scanner looks about the point then."""

    heading: float | None
    """Of the vehicle [rad], map frame; None where it is all round."""
    views: tuple[int, ...]
    """View of each scanner in the coverage's sight."""
    levers: FloatArray
    """(S, 2) each scanner from the point whose position is asked for [m], map axes."""
    headings: FloatArray
    """(S,) of each scanner [rad], map frame."""


def floor_budget(found: Coverage, site: BudgetSite, progress: Progress = silent) -> FloorBudget:
    """Add the constants to the figures of a coverage.

    Parameters
    ----------
    found : what is seen from each point, and under which conditions.
    site : reflectors, scanners, and how well what is constant is known.
    progress : told how far it is; may raise to cancel.

    Returns
    -------
    budget : of the heading that the coverage is of: the given one, or of several the worst or best at each point.

    Notes
    -----
    With the information I of all detections and weights w, P = I^-1: noise and survey P (sum w^2 var h h^T) P, and of a
    constant c with the response J of a detection, P (sum w h J) of its 1-sigma. A scanner that is displaced sees what
    a displaced vehicle would. All round, the vehicle is taken to drive in the worst direction.
    """
    stances = tuple(_stances(found.options, site.scanners))
    points = found.lattice.points()
    sigma, shares = np.full(len(points), math.inf), np.zeros((len(points), len(CONTRIBUTIONS)))
    step = max(1, PAIRS_AT_ONCE // max(1, len(site.reflectors)))
    for first in range(0, len(points), step):
        rows = slice(first, first + step)
        progress(first / len(points), "error with constants")
        none_yet = np.ones(len(points[rows]), dtype=np.bool_)
        for stance in stances:
            one, its = _along_longest(*_parts(found, site, stance, rows))
            stands = _stands(site, stance, points[rows])
            worse = one > sigma[rows] if found.options.heading is Heading.WORST else one < sigma[rows]
            takes = stands & (none_yet | worse)
            sigma[rows][takes], shares[rows][takes] = one[takes], its[takes]
            none_yet &= ~stands
    return FloorBudget(sigma=read_only(sigma), shares=read_only(shares))


def _stances(options: FixOptions, scanners: Sequence[Scanner]) -> Iterator[_Stance]:
    """Headings that are looked at; the views of a coverage are heading by heading, scanner by scanner."""
    count = len(scanners)
    mounted = np.array([scanner.mounting for scanner in scanners])
    if options.heading is Heading.ALL_ROUND:
        yield _Stance(None, tuple(range(count)), np.zeros((count, 2)), np.zeros(count))
        return
    headings = [options.given_heading]
    if options.heading is not Heading.GIVEN:
        headings = [2.0 * math.pi * each / options.headings for each in range(options.headings)]
    for number, heading in enumerate(headings):
        c, s = math.cos(heading), math.sin(heading)
        levers = mounted[:, :2] @ np.array([[c, s], [-s, c]])
        # Of one scanner the point is its own place unless a heading is given.
        if count == 1 and options.heading is not Heading.GIVEN:
            levers = np.zeros((1, 2))
        views = (0,) if count == 1 else tuple(count * number + each for each in range(count))
        yield _Stance(heading, views, levers, heading + mounted[:, 2])


def _parts(found: Coverage, site: BudgetSite, stance: _Stance, rows: slice) -> tuple[FloatArray, BoolArray]:
    """(n, 5, 2, 2) what each source contributes to the position [m^2], and (n,) whether there is a fix."""
    options, known = found.options, site.uncertainty
    places = found.lattice.points()[rows]
    count = len(places)
    has_prior = options.measurement is Measurement.RANGE_BEARING_PRIOR
    prior = np.zeros((3, 3))
    if has_prior:
        prior = np.diag([options.prior_position_sigma**-2] * 2 + [options.prior_heading_sigma**-2])
    information, noise, survey = (np.tile(start, (count, 1, 1)) for start in (prior, prior, np.zeros((3, 3))))
    biases: list[FloatArray] = []
    displaced: list[FloatArray] = []
    turned: list[FloatArray] = []
    taken = np.zeros((count, len(site.reflectors)), dtype=np.bool_)
    for scanner in range(len(stance.views)):
        sees = _sees(found, site, stance, scanner, (rows, places + stance.levers[scanner]))
        if stance.heading is None:
            # All round each reflector counts once, whichever scanner sees it.
            sees &= ~taken
        taken |= sees
        one = _sums(site, options, sees, places, (site.scanners[scanner], stance.levers[scanner]))
        information += one.information
        noise += one.noise
        survey += one.survey
        biases.append(one.range_gradient)
        displaced.append(one.information[:, :, :2])
        turned.append(one.bearing_gradient)
    fewest = 0 if has_prior else 3 if options.measurement is Measurement.BEARING_ONLY and len(stance.views) == 1 else 2
    covariance, regular = _inverse(information, taken.sum(axis=1) >= fewest)

    def position(matrix: FloatArray) -> FloatArray:
        return (covariance @ matrix @ covariance)[:, :2, :2]

    def response(columns: FloatArray) -> FloatArray:
        moved = (covariance @ columns)[:, :2]
        return moved @ moved.transpose(0, 2, 1)

    parts = np.zeros((count, len(CONTRIBUTIONS), 2, 2))
    parts[:, NOISE], parts[:, MAP] = position(noise), position(survey)
    direction = None if stance.heading is None else np.array([math.cos(stance.heading), math.sin(stance.heading)])
    for bias, shift, turn in zip(biases, displaced, turned, strict=True):
        parts[:, RANGE] += known.range_bias**2 * response(bias[:, :, np.newaxis])
        parts[:, MOUNTING] += known.mounting_position**2 * response(shift)
        parts[:, MOUNTING] += known.mounting_heading**2 * response(turn[:, :, np.newaxis])
        driven = shift if direction is None else (shift @ direction)[:, :, np.newaxis]
        parts[:, CLOCK] += (known.clock * site.speed) ** 2 * response(driven)
    return parts, regular


def _stands(site: BudgetSite, stance: _Stance, points: FloatArray) -> BoolArray:
    """(n,) whether the vehicle can stand at points (n, 2) so: of several scanners none is in a wall."""
    stands = np.ones(len(points), dtype=np.bool_)
    for lever in stance.levers if len(stance.levers) > 1 else ():
        stands &= np.logical_not(site.visible.caster.grid.is_occupied(points + lever))
    return stands


def _sees(found: Coverage, site: BudgetSite, stance: _Stance, scanner: int, at: tuple[slice, FloatArray]) -> BoolArray:
    """(n, M) which reflectors a scanner sees from its places; all around where the heading is."""
    rows, places = at
    seen = unpack(found.sight[stance.views[scanner], rows], len(site.reflectors))
    if stance.heading is None:
        return seen
    delta = site.reflectors.centers[np.newaxis] - places[:, np.newaxis]
    bearings = np.arctan2(delta[..., 1], delta[..., 0]) - stance.headings[scanner]
    return seen & faces(site.scanners[scanner], bearings)


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class _Sums:
    """What the detections of one scanner add up to at n points."""

    information: FloatArray
    """(n, 3, 3) sum of w h h^T."""
    noise: FloatArray
    """(n, 3, 3) sum of w^2 var h h^T of the noise."""
    survey: FloatArray
    """(n, 3, 3) the same of the survey."""
    range_gradient: FloatArray
    """(n, 3) sum of w h of the ranges."""
    bearing_gradient: FloatArray
    """(n, 3) sum of w h of the bearings."""


def _sums(
    site: BudgetSite, options: FixOptions, sees: BoolArray, points: FloatArray, mounted: tuple[Scanner, FloatArray]
) -> _Sums:
    """Add up the detections by one scanner, given with its lever (2,), about points (n, 2)."""
    scanner, lever = mounted
    delta = site.reflectors.centers[np.newaxis] - (points + lever)[:, np.newaxis]
    squared = np.maximum((delta**2).sum(axis=2), 1e-18)
    r = np.sqrt(squared)
    ux, uy = delta[..., 0] / r, delta[..., 1] / r
    bx, by = uy / r, -ux / r
    h_range = np.stack((-ux, -uy, ux * lever[1] - uy * lever[0]), axis=-1)
    h_bearing = np.stack((bx, by, -1.0 - bx * lever[1] + by * lever[0]), axis=-1)
    own = np.array([survey_variance(each, site.uncertainty) for each in site.reflectors.reflectors])
    range_noise, bearing_noise = (
        sigma**2 for sigma in scanner.detection_sigmas(options.range_sigma, options.bearing_sigma)
    )
    range_survey, bearing_survey = np.broadcast_to(own, r.shape), own / squared
    has_ranges = options.measurement is not Measurement.BEARING_ONLY
    w_range = (sees / (range_noise + range_survey)) if has_ranges else np.zeros(r.shape)
    w_bearing = sees / (bearing_noise + bearing_survey)

    def outer(of_range: FloatArray, of_bearing: FloatArray) -> FloatArray:
        return np.einsum("nm,nmi,nmj->nij", of_range, h_range, h_range) + np.einsum(
            "nm,nmi,nmj->nij", of_bearing, h_bearing, h_bearing
        )

    return _Sums(
        information=outer(w_range, w_bearing),
        noise=outer(w_range**2 * range_noise, w_bearing**2 * bearing_noise),
        survey=outer(w_range**2 * range_survey, w_bearing**2 * bearing_survey),
        range_gradient=np.einsum("nm,nmi->ni", w_range, h_range),
        bearing_gradient=np.einsum("nm,nmi->ni", w_bearing, h_bearing),
    )


def _inverse(information: FloatArray, enough: BoolArray) -> tuple[FloatArray, BoolArray]:
    """(n, 3, 3) inverse, zeros where there is none; and (n,) whether there is one."""
    diagonal = np.diagonal(information, axis1=1, axis2=2)
    scale = np.sqrt(np.where(diagonal > 0.0, diagonal, 1.0))
    scaled = information / (scale[:, :, np.newaxis] * scale[:, np.newaxis, :])
    regular = enough & (diagonal > 0.0).all(axis=1) & (np.linalg.det(scaled) > SINGULAR)
    inverse = np.zeros_like(information)
    inverse[regular] = np.linalg.inv(scaled[regular])
    return inverse / (scale[:, :, np.newaxis] * scale[:, np.newaxis, :]), regular


def _along_longest(parts: FloatArray, regular: BoolArray) -> tuple[FloatArray, FloatArray]:
    """(n,) 1-sigma along the longest axis of all parts together, and (n, 5) their shares in its square."""
    total = parts.sum(axis=1)
    angle = 0.5 * np.arctan2(2.0 * total[:, 0, 1], total[:, 0, 0] - total[:, 1, 1])
    direction = np.stack((np.cos(angle), np.sin(angle)), axis=1)
    along = np.einsum("ni,npij,nj->np", direction, parts, direction)
    variance = along.sum(axis=1)
    sigma = np.where(regular, np.sqrt(np.maximum(variance, 0.0)), math.inf)
    shares = np.where(regular[:, np.newaxis], along / np.maximum(variance, 1e-300)[:, np.newaxis], 0.0)
    return sigma, shares

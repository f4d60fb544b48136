"""How well a fix can be from one scan: Fisher information of a pose from visible reflectors, covariance, dilution.

Nothing is filtered or simulated here: the covariance is the Cramér-Rao bound of a single measurement of all visible
reflectors. A singular geometry is a result, infinite in every figure. The figures of a vehicle are in `vehicle_fixes`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Any, NamedTuple

import numpy as np

from commission.geometry.arrays import FloatArray
from commission.geometry.se2 import compose
from commission.planning import dilution_kernels
from commission.planning.dilution_kernels import FixModel
from commission.planning.visibility import field_of_view
from commission.site.checks import above, between
from commission.site.parameters import ObservationParameters, OdometryParameters
from commission.site.reflectors import ReflectorMap
from commission.site.scanner import Scanner

DEFAULT_HEADINGS = 16


class Measurement(StrEnum):
    """What one scan measures of each reflector."""

    RANGE_BEARING = "range-bearing"
    BEARING_ONLY = "bearing-only"
    """Triangulation, as a rotating goniometer does (Alenyà et al. 2005); it needs three reflectors."""
    RANGE_BEARING_PRIOR = "range-bearing-prior"
    """Ranges and bearings together with the pose expected from odometry."""


class Heading(StrEnum):
    """Which headings of the vehicle a figure speaks of."""

    BY_SCANNER = "by-scanner"
    """The worst where no scanner sees all around, otherwise all round."""
    GIVEN = "given"
    WORST = "worst"
    """The worst over evenly spaced headings, of each figure on its own."""
    BEST = "best"
    ALL_ROUND = "all-round"
    """As if the scanner saw a full turn. Of several scanners, as if they stood at the point and shared the turn: each
    reflector counts once."""

    def seen_by(self, scanners: Sequence[Scanner]) -> Heading:
        """Return what `by-scanner` means for some scanners; the others mean what they say."""
        if self is not Heading.BY_SCANNER:
            return self
        turns = any(each.is_full_turn and not each.blind_sectors_deg for each in scanners)
        return Heading.ALL_ROUND if turns else Heading.WORST


@dataclass(frozen=True, slots=True, kw_only=True)
class FixOptions:
    """Measurement model of a fix, and the headings it is asked for."""

    measurement: Measurement = Measurement.RANGE_BEARING
    """`range-bearing`, `bearing-only` (triangulation) or `range-bearing-prior` (with odometry)."""
    range_sigma: float = 0.02
    """1-sigma noise of a reflector's range [m], by a scanner that has none of its own."""
    bearing_sigma: float = 0.004
    """1-sigma noise of a reflector's bearing [rad], by a scanner that has none of its own."""
    prior_position_sigma: float = 0.05
    """1-sigma of the position expected from odometry, each axis [m]; read by `range-bearing-prior` only."""
    prior_heading_sigma: float = math.radians(1.0)
    """1-sigma of the heading expected from odometry [rad]; read by `range-bearing-prior` only."""
    heading: Heading = Heading.ALL_ROUND
    """`given`, `worst`, `best` or `all-round`."""
    given_heading: float = 0.0
    """Heading of the vehicle where `heading` is `given` [rad], map frame."""
    headings: int = DEFAULT_HEADINGS
    """Evenly spaced headings that `worst` and `best` look at."""
    blocked_per_m: float = 0.0
    """Probability per metre of ray that a person blocks it [1/m]."""

    def __post_init__(self) -> None:
        if self.heading is Heading.BY_SCANNER:
            raise ValueError("fix.heading is by-scanner; expected what it means for the scanners of the vehicle")
        above(self.range_sigma, 0.0, "fix.range_sigma", "m")
        above(self.bearing_sigma, 0.0, "fix.bearing_sigma", "rad")
        above(self.prior_position_sigma, 0.0, "fix.prior_position_sigma", "m")
        above(self.prior_heading_sigma, 0.0, "fix.prior_heading_sigma", "rad")
        if not math.isfinite(self.given_heading):
            raise ValueError(f"fix.given_heading is {self.given_heading}; expected finite radians")
        between(self.headings, (1, 360), "fix.headings")
        between(self.blocked_per_m, (0.0, 1.0), "fix.blocked_per_m", "per metre")


class Fixes(NamedTuple):
    """Figures of a fix at N points; infinite where the geometry is singular."""

    visible: dilution_kernels.Counts
    """(N,) number of visible reflectors."""
    position_sigma: FloatArray
    """(N,) 1-sigma along the longest axis of the position's ellipse [m]."""
    heading_sigma: FloatArray
    """(N,) 1-sigma of the heading [rad]."""
    position_dop: FloatArray
    """(N,) sqrt(var_x + var_y) over the first scanner's noise: of the range [1], of the bearing [m/rad] for
    `bearing-only`."""
    heading_dop: FloatArray
    """(N,) sigma of the heading over the noise of the first scanner's bearing [1]."""
    expected_visible: FloatArray
    """(N,) expected number of visible reflectors among people."""
    two_or_more: FloatArray
    """(N,) probability of seeing at least two reflectors among people [0..1]."""
    three_or_more: FloatArray
    """(N,) probability of seeing at least three reflectors among people [0..1]."""


def odometry_prior(parameters: OdometryParameters, distance: float, speed: float) -> tuple[float, float]:
    """1-sigma of position and heading [m, rad] after driving straight from a perfect pose, for `prior_*_sigma`.

    Parameters
    ----------
    parameters : growth of odometry's uncertainty.
    distance : driven since then [m].
    speed : of the vehicle [m/s], greater than 0.
    """
    above(distance, 0.0, "distance on odometry", "m")
    above(speed, 0.0, "speed", "m/s")
    seconds = distance / speed
    forward = parameters.forward_per_sqrt_m**2 * distance + parameters.forward_per_sqrt_s**2 * seconds
    heading = parameters.heading_per_sqrt_m**2 * distance + parameters.heading_per_sqrt_s**2 * seconds
    # A heading that walks at random along the way moves the end sideways by a third of its variance times distance^2.
    lateral = parameters.lateral_per_sqrt_m**2 * distance + heading * distance**2 / 3.0
    return math.sqrt(max(forward, lateral)), math.sqrt(heading)


def fix_options(observation: ObservationParameters, **changes: Any) -> FixOptions:
    """Options with the noise that the localizer assumes."""
    return replace(FixOptions(range_sigma=observation.range_sigma, bearing_sigma=observation.bearing_sigma), **changes)


def fix_model(scanner: Scanner, options: FixOptions) -> FixModel:
    """Options as plain numbers for the kernels."""
    headings = np.zeros(1)
    lever: FloatArray = np.zeros(2)
    combine = dilution_kernels.SINGLE
    first, width = (-math.pi, 2.0 * math.pi) if options.heading is Heading.ALL_ROUND else field_of_view(scanner)
    mounted = float(scanner.mounting[2])
    if options.heading is Heading.GIVEN:
        headings = np.array([options.given_heading + mounted])
        lever = compose([0.0, 0.0, options.given_heading], scanner.mounting)[:2]
    elif options.heading in (Heading.WORST, Heading.BEST):
        headings = np.arange(options.headings, dtype=np.float64) * (2.0 * math.pi / options.headings) + mounted
        combine = dilution_kernels.WORST if options.heading is Heading.WORST else dilution_kernels.BEST
    blind = np.empty((0, 2)) if options.heading is Heading.ALL_ROUND else scanner.blind_sectors
    triangulates = options.measurement is Measurement.BEARING_ONLY
    has_prior = options.measurement is Measurement.RANGE_BEARING_PRIOR
    range_sigma, bearing_sigma = scanner.detection_sigmas(options.range_sigma, options.bearing_sigma)
    return FixModel(
        range_variance=math.inf if triangulates else range_sigma**2,
        bearing_variance=bearing_sigma**2,
        prior_position=options.prior_position_sigma**-2 if has_prior else 0.0,
        prior_heading=options.prior_heading_sigma**-2 if has_prior else 0.0,
        # Two bearings leave a circle of positions, one range and bearing leaves another.
        fewest=0 if has_prior else 3 if triangulates else 2,
        position_noise=bearing_sigma if triangulates else range_sigma,
        lever_x=float(lever[0]),
        lever_y=float(lever[1]),
        headings=headings,
        first=first,
        width=width,
        blind=blind,
        combine=combine,
        free_per_m=1.0 - options.blocked_per_m,
    )


def survey_sigmas(reflectors: ReflectorMap) -> FloatArray:
    """1-sigma uncertainty of each reflector's place: (M,) array [m]."""
    return np.array([reflector.own_sigma for reflector in reflectors.reflectors], dtype=np.float64)


def as_fixes(counts: dilution_kernels.Counts, figures: FloatArray) -> Fixes:
    """Arrays that a kernel filled, by name; no copy is made."""
    return Fixes(counts, *(figures[:, i] for i in range(dilution_kernels.FIGURES)))

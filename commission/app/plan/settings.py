"""What the step Plan is asked for: one frozen value in the page's state. Nothing is computed here."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum
from typing import TypeAlias

from commission.planning.dependence import Failure
from commission.planning.dilution import Heading, Measurement
from commission.site.checks import above, between

Place: TypeAlias = tuple[float, float]
"""A place on the floor [m, m], map frame."""

PlanValue: TypeAlias = bool | int | float | str | None


class Figure(StrEnum):
    """What a heatmap shows; the names are those of `planning.dilution.Fixes`."""

    NONE = ""
    VISIBLE = "visible"
    POSITION_SIGMA = "position_sigma"
    HEADING_SIGMA = "heading_sigma"
    POSITION_DOP = "position_dop"
    HEADING_DOP = "heading_dop"
    EXPECTED_VISIBLE = "expected_visible"
    TWO_OR_MORE = "two_or_more"
    THREE_OR_MORE = "three_or_more"


@dataclass(frozen=True, slots=True)
class PlanSettings:
    """What is wanted of the step Plan; whatever is not wanted is not computed."""

    figure: Figure = Figure.NONE
    """What the heatmap shows; none: there is no heatmap."""
    opacity: float = 0.8
    """Opacity of the heatmap [0..1]."""
    heading: Heading = Heading.ALL_ROUND
    """Heading of the vehicle at each spot."""
    given_heading: float = 0.0
    """Heading of the vehicle where it is given [rad], map frame."""
    measurement: Measurement = Measurement.RANGE_BEARING
    """What one scan measures of each reflector."""
    on_odometry: float = 1.0
    """Way driven on odometry before the fix [m]; read with odometry as a prior only."""
    blocked_per_m: float = 0.0
    """Probability per metre of ray that a person stands in it [1/m]."""
    min_beams: int = 1
    """Beams that a reflector must get for certain to count as visible [beams]."""
    probe: Place | None = None
    """Where the floor was clicked last [m]; its values are read out."""
    spots: tuple[Place, ...] = ()
    """Where ellipses of a fix were asked for [m]."""
    ellipse_grid: bool = False
    """Whether ellipses are drawn on a coarse grid, too."""
    ellipse_factor: float = 100.0
    """Factor at which ellipses of a fix are drawn [1..10000]."""
    route: str = ""
    """Route whose prediction is shown; empty: none."""
    failure: Failure = Failure.BLOCKED
    """What happens to each reflector in turn."""
    ranking: int = 0
    """Number of times a ranking by what depends on each reflector was asked for; 0: it is not wanted."""
    fallen: tuple[str, ...] = ()
    """Ids of reflectors that have failed already when the others are ranked, in the order of failing."""
    failed: str = ""
    """Id of the reflector whose failure is shown on the floor; empty: none."""

    cold_start: int = 0
    """Number of times ambiguous places were asked for; 0: they are not wanted."""
    tolerance: float = 0.1
    """Distance up to which a reflector counts as standing where a look-alike of it does [m]."""
    pair: int = -1
    """Which pair of look-alikes is shown, counted in the order of the list; -1: none."""

    def __post_init__(self) -> None:
        above(self.tolerance, 0.0, "tolerance", "m")
        between(self.ellipse_factor, (1.0, 1e4), "magnification of ellipses")
        between(self.opacity, (0.0, 1.0), "opacity")
        between(self.blocked_per_m, (0.0, 1.0), "blocked", "per metre")
        above(self.on_odometry, 0.0, "way on odometry", "m")
        between(self.min_beams, (1, 20), "beams at least")
        if not math.isfinite(self.given_heading):
            raise ValueError(f"heading is {self.given_heading}; expected finite radians")

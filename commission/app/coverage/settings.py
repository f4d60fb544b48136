"""What is asked of the heatmap: one frozen value in the page's state. Nothing is computed here."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum
from typing import TypeAlias

from commission.app.base.conditions import Conditions
from commission.app.base.floor_picture import FloorPicture
from commission.app.base.state import AppState
from commission.planning.dilution import Heading, Measurement
from commission.site.checks import above, between
from commission.studies.coverage import CoverageOptions

Place: TypeAlias = tuple[float, float]
"""A place on the floor [m, m], map frame."""
NAME = "coverage"
"""Of the feature."""


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


@dataclass(frozen=True, slots=True, kw_only=True)
class CoverageSettings:
    """What is wanted of the heatmap; while it shows no figure, nothing is computed."""

    figure: Figure = Figure.NONE
    """What it shows; none: there is no heatmap."""
    heading: Heading = Heading.ALL_ROUND
    """Heading of the vehicle at each spot."""
    given_heading: float = 0.0
    """Heading of the vehicle where it is given [rad], map frame."""
    measurement: Measurement = Measurement.RANGE_BEARING
    """What one scan measures of each reflector."""
    on_odometry: float = 1.0
    """Way driven on odometry before the fix [m]; read with odometry as a prior only."""
    probe: Place | None = None
    """Where the floor was clicked last [m]; its values are read out."""
    spots: tuple[Place, ...] = ()
    """Where ellipses of a fix were asked for [m]."""
    ellipse_grid: bool = False
    """Whether ellipses are drawn on a coarse grid, too."""
    ellipse_factor: float = 100.0
    """Factor at which ellipses of a fix are drawn [1..10000]."""

    def __post_init__(self) -> None:
        between(self.ellipse_factor, (1.0, 1e4), "magnification of ellipses")
        above(self.on_odometry, 0.0, "way on odometry", "m")
        if not math.isfinite(self.given_heading):
            raise ValueError(f"heading is {self.given_heading}; expected finite radians")

    def options(self, conditions: Conditions) -> CoverageOptions:
        """What the study is asked for, as fine as the page shows it."""
        return CoverageOptions(
            measurement=self.measurement,
            heading=self.heading,
            given_heading=self.given_heading,
            on_odometry=self.on_odometry,
            blocked_per_m=conditions.blocked_per_m,
            visibility=conditions.visibility,
        )


def shown_figure(state: AppState) -> Figure:
    """Return what the heatmap shows: nothing while another feature has the floor."""
    is_ours = state.part(FloorPicture).owner == NAME
    return state.part(CoverageSettings).figure if is_ours else Figure.NONE

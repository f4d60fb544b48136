"""What is asked of the heatmap: one frozen value in the page's state. Nothing is computed here."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import Annotated, TypeAlias

from commission.app.base.conditions import Conditions
from commission.app.base.floor_picture import FloorPicture
from commission.app.base.state import AppState
from commission.planning.dilution import Heading, Measurement
from commission.site.checks import check_fields
from commission.site.quantity import DEGREES, POSITIVE, Bounds, Choice, Quantity, Switch
from commission.studies.coverage import CoverageOptions

Place: TypeAlias = tuple[float, float]
"""A place on the floor [m, m], map frame."""
NAME = "coverage"
"""Of the feature."""


class Figure(StrEnum):
    """What a heatmap shows; the names are those of `planning.dilution.Fixes` where nothing else is said."""

    NONE = ""
    VISIBLE = "visible"
    POSITION_SIGMA = "position_sigma"
    HEADING_SIGMA = "heading_sigma"
    TOTAL_SIGMA = "total_sigma"
    """With constants; no figure of a fix, but of its budget."""
    CONTOUR_POSITION = "contour_position"
    """By the contours of the floor map; of no fix, either."""
    CONTOUR_HEADING = "contour_heading"
    """The same of the heading."""
    TAG_POSITION = "tag_position"
    """By tags; of no fix, either."""
    TAG_HEADING = "tag_heading"
    """The same of the heading."""
    REELS = "reels"
    """Temporary landmarks; of no fix, either."""
    POSITION_DOP = "position_dop"
    HEADING_DOP = "heading_dop"
    EXPECTED_VISIBLE = "expected_visible"
    TWO_OR_MORE = "two_or_more"
    THREE_OR_MORE = "three_or_more"


BY_CONTOURS = frozenset({Figure.CONTOUR_POSITION, Figure.CONTOUR_HEADING})
"""Figures that no reflector has a part in."""
BY_TAGS = frozenset({Figure.TAG_POSITION, Figure.TAG_HEADING})
"""Likewise."""
COUNTED = frozenset({Figure.VISIBLE, Figure.REELS})
"""Whole numbers of what is in sight."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CoverageSettings:
    """What is wanted of the heatmap; while it shows no figure, nothing is computed."""

    figure: Annotated[Figure, Choice("Show")] = Figure.NONE
    """What the floor is colored by; off: there is no heatmap."""
    heading: Annotated[Heading, Choice("Heading")] = Heading.BY_SCANNER
    """Heading of the vehicle. By scanner: the worst where no scanner sees all around, otherwise all round."""
    given_heading: Annotated[
        float, Quantity(label="Given", unit="rad", shown=DEGREES, step=1.0, entry=(-360.0, 360.0))
    ] = 0.0
    """Direction in which the vehicle looks, map frame; 0 is along x, counterclockwise."""
    measurement: Annotated[Measurement, Choice("Measured")] = Measurement.RANGE_BEARING
    """What one scan measures: ranges and bearings, bearings only, or both together with odometry."""
    on_odometry: Annotated[
        float, Quantity(label="Odometry", unit="m", bounds=POSITIVE, step=0.1, entry=(0.1, 100.0))
    ] = 1.0
    """Way driven on odometry since a pose that was known exactly."""
    probe: Place | None = None
    """Where the floor was clicked last [m]; its values are read out."""
    spots: tuple[Place, ...] = ()
    """Where ellipses of a fix were asked for [m]."""
    ellipse_grid: Annotated[bool, Switch("On a grid")] = False
    """Whether ellipses are drawn all over the floor, too."""
    ellipse_factor: Annotated[float, Quantity(label="Drawn", bounds=Bounds.between(1.0, 1e4))] = 100.0
    """Factor at which ellipses of a fix are drawn; true to scale is 1x."""

    def __post_init__(self) -> None:
        check_fields(self, "heatmap: ")

    def options(self, conditions: Conditions) -> CoverageOptions:
        """What the study is asked for, as fine as the page shows it."""
        return CoverageOptions(
            measurement=self.measurement,
            heading=self.heading,
            given_heading=self.given_heading,
            on_odometry=self.on_odometry,
            blocked_per_m=conditions.blocked_per_m,
            visibility=conditions.visibility,
            with_constants=self.figure is Figure.TOTAL_SIGMA,
            with_contours=self.figure in BY_CONTOURS,
            with_tags=self.figure in BY_TAGS,
            with_temporary=self.figure is Figure.REELS,
        )


def shown_figure(state: AppState) -> Figure:
    """Return what the heatmap shows: nothing while another feature has the floor."""
    is_ours = state.part(FloorPicture).owner == NAME
    return state.part(CoverageSettings).figure if is_ours else Figure.NONE

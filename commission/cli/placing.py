"""The command `place`: a suggested layout of reflectors, written as a project of its own."""

from __future__ import annotations

import dataclasses
import math
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from tyro.conf import Positional, UseAppendAction, arg

from commission.errors import UsageError

if TYPE_CHECKING:
    from commission.planning.candidates import AllowedHeights
    from commission.planning.demands import Spot, Unmet
    from commission.planning.placement import Placement, PlacementOptions

STATIONS = "stations"
STARTS = "starts"
SPOT_FORM = f"{STATIONS}, {STARTS}, X,Y or X,Y,HEADING (metres, degrees)"
HEIGHTS_FORM = "LOW,HIGH or LOW,HIGH,X1,Y1,X2,Y2 (metres)"


@dataclass(frozen=True, kw_only=True)
class Place:
    """Suggest few reflectors on walls and pillars, so that the routes are driven within limits; writes a project."""

    project: Positional[Path]
    """Folder of the project (holds project.yaml)."""
    out: Annotated[Path, arg(metavar="PROJECT2")]
    """Folder for the project with the suggested reflectors; made when it does not exist."""
    route: Annotated[UseAppendAction[tuple[str, ...]], arg(metavar="NAME")] = ()
    """Route that counts. None: all."""
    extend: bool = True
    """Whether the project's reflectors stay; with --no-extend the layout starts empty, with the locked ones alone."""
    visible: int = 2
    """Reflectors that must be visible everywhere on the routes."""
    survive_failure: bool = True
    """Whether everything must hold as well with any single reflector blocked."""
    position_limit: float | None = None
    """Largest 2-sigma of x and y on the routes [m]. None: the supervisor's."""
    heading_limit: float | None = None
    """Largest 2-sigma of the heading on the routes [deg]. None: the supervisor's."""
    min_spacing: float = 0.5
    """Smallest distance between two reflectors [m]."""
    unambiguous: Annotated[UseAppendAction[tuple[str, ...]], arg(metavar="stations|starts|X,Y|X,Y,HEADING")] = ()
    """Where a vehicle that is switched on must see which place it is: at the stations, at the starts of the routes, or
    at a spot [m, m, deg]; a spot without a heading counts with all."""
    blocked_per_m: float = 0.0
    """Probability per metre of ray that a person blocks it [1/m]."""
    spacing: float = 1.0
    """Distance between places along the walls that are considered [m]."""
    radius: float = 0.04
    """Radius of the reflectors [m]."""
    height: float = 0.2
    """Height of the scanner's beams above the floor, and of the middle of the reflectors where it is allowed [m]."""
    length: float = 0.2
    """Length of the reflectors: one whose middle is not at the height of the beams must still be met by them [m]."""
    heights: Annotated[UseAppendAction[tuple[str, ...]], arg(metavar="LOW,HIGH[,X1,Y1,X2,Y2]")] = ()
    """Heights that are allowed for the middle of a reflector, everywhere or in a rectangle, map frame [m]."""
    clearance: float = 0.3
    """Distance left between a reflector and the vehicle on its routes [m]."""
    keep_out: Annotated[UseAppendAction[tuple[str, ...]], arg(metavar="X1,Y1,X2,Y2")] = ()
    """Rectangle without reflectors, by two opposite corners, map frame [m]."""
    seed: int = 1
    """Seed of the search: the same seed gives the same layout."""

    def run(self) -> None:
        """Search, write, and tell what was found."""
        from commission.io.project_file import load_project, save_project
        from commission.planning.placement import place

        if self.out.resolve() == self.project.resolve():
            raise UsageError(f"--out is the project itself, {self.out}; expected another folder")
        try:
            options = self._options()
        except ValueError as error:
            raise UsageError(str(error)) from None
        project = load_project(self.project)
        if not project.routes:
            raise UsageError("the project has no route; expected one to place reflectors for")
        found = place(project, self.route or None, options)
        save_project(dataclasses.replace(project, reflectors=found.reflectors), self.out)
        sys.stdout.write("\n".join([*_report(found), f"Written to   {self.out}"]) + "\n")

    def _options(self) -> PlacementOptions:
        """Options of the search; raises ValueError for a number out of range."""
        from commission.planning.candidates import CandidateOptions
        from commission.planning.demands import Demands
        from commission.planning.placement import PlacementOptions
        from commission.planning.route_prediction import PredictionOptions

        spots = [text for text in self.unambiguous if text not in {STATIONS, STARTS}]
        demands = Demands(
            self.visible,
            self.survive_failure,
            self.position_limit,
            None if self.heading_limit is None else math.radians(self.heading_limit),
            self.min_spacing,
            unambiguous_stations=STATIONS in self.unambiguous,
            unambiguous_starts=STARTS in self.unambiguous,
            unambiguous_spots=tuple(_spot(text) for text in spots),
        )
        candidates = CandidateOptions(
            spacing=self.spacing,
            radius=self.radius,
            height=self.height,
            clearance=self.clearance,
            keep_out=tuple(_rectangle(text) for text in self.keep_out),
            length=self.length,
            allowed_heights=tuple(_heights(text) for text in self.heights),
        )
        prediction = PredictionOptions(blocked_per_m=self.blocked_per_m)
        return PlacementOptions(demands, candidates, prediction, extend=self.extend, seed=self.seed)


def _numbers(text: str, option: str, counts: tuple[int, ...], form: str) -> list[float]:
    """Read numbers between commas; raises UsageError that shows the text and the form expected."""
    try:
        numbers = [float(word) for word in text.split(",")]
    except ValueError:
        numbers = []
    if len(numbers) not in counts:
        raise UsageError(f"{option} is {text!r}; expected {form}")
    return numbers


def _rectangle(text: str) -> tuple[float, float, float, float]:
    """Read `X1,Y1,X2,Y2`."""
    x_a, y_a, x_b, y_b = _numbers(text, "--keep-out", (4,), "X1,Y1,X2,Y2 (metres)")
    return x_a, y_a, x_b, y_b


def _spot(text: str) -> Spot:
    """Read `X,Y` or `X,Y,HEADING`."""
    x, y, *heading = _numbers(text, "--unambiguous", (2, 3), SPOT_FORM)
    return (x, y, math.radians(heading[0])) if heading else (x, y)


def _heights(text: str) -> AllowedHeights:
    """Read `LOW,HIGH` or `LOW,HIGH,X1,Y1,X2,Y2`; raises ValueError for heights out of order."""
    from commission.planning.candidates import AllowedHeights

    low, high, *corners = _numbers(text, "--heights", (2, 6), HEIGHTS_FORM)
    if not corners:
        return AllowedHeights(low, high)
    x_a, y_a, x_b, y_b = corners
    return AllowedHeights(low, high, (x_a, y_a, x_b, y_b))


def _report(found: Placement) -> list[str]:
    """Lines for a person."""
    lines = [
        f"Reflectors   {found.added} suggested among {len(found.candidates)} places, "
        f"{len(found.reflectors) - found.added} kept; fewer than {found.at_least} new ones cannot be enough",
    ]
    return lines + [f"Not met      {_told(unmet)}" for unmet in found.unmet]


def _told(unmet: Unmet) -> str:
    """Say which demand does not hold, and where."""
    if unmet.reason == "ambiguous":
        nearest = f" (nearest: metre {unmet.metres[0]} of route {unmet.route!r})" if unmet.metres else ""
        return f"{unmet.place}: another pose sees the same, or fewer than two reflectors are visible{nearest}"
    what = "too few visible" if unmet.reason == "visible" else "uncertainty over its limit"
    return f"route {unmet.route!r}: {what} on {len(unmet.metres)} m, from {unmet.metres[0]} m"

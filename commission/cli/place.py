"""The command `place`: a suggested layout of reflectors, written as a project of its own."""

from __future__ import annotations

import dataclasses
import math
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from tyro.conf import Positional, UseAppendAction, arg

from commission.errors import UsageError
from commission.site.quantity import counted_text

if TYPE_CHECKING:
    from commission.planning.placement import Placement, PlacementOptions
    from commission.planning.unmet import Unmet
    from commission.site.layout_brief import AllowedHeights, CandidateOptions, Demands, Spot
    from commission.site.project import Project

STATIONS = "stations"
STARTS = "starts"
SPOT_FORM = f"{STATIONS}, {STARTS}, X,Y or X,Y,HEADING (metres, degrees)"
HEIGHTS_FORM = "LOW,HIGH or LOW,HIGH,X1,Y1,X2,Y2 (metres)"
NOT_MET = {
    "visible": "too few visible",
    "uncertainty": "uncertainty over its limit",
    "pairs": "two pairs in sight with nearly the same distance",
    "spread": "places along the walls far from any reflector",
}


@dataclass(frozen=True, kw_only=True)
class Place:
    """Suggest few reflectors on walls and pillars, so that the routes are driven within limits; writes a project.

    Ctrl+C ends the search with the best layout so far, where there is one.

    What is not given here is as the project asks for it.
    """

    project: Positional[Path]
    """Folder of the project (holds project.yaml)."""
    out: Annotated[Path, arg(metavar="PROJECT2")]
    """Folder for the project with the suggested reflectors; made when it does not exist."""
    route: Annotated[UseAppendAction[tuple[str, ...]], arg(metavar="NAME")] = ()
    """Route that counts. None: those that count in the project."""
    extend: bool = True
    """Whether the project's reflectors stay; with --no-extend the layout starts empty, with the locked ones alone."""
    preset: Annotated[str | None, arg(metavar="NAME")] = None
    """What the maker of a scanner asks of every layout, in place of what the project says. NAV350: at least 3 visible
    after any single one has failed. None: what the project asks for."""
    visible: int | None = None
    """Reflectors that must be visible everywhere on the routes. None: as in the project (2 unless changed)."""
    survive_failure: bool = True
    """Whether everything must hold as well with any single reflector blocked; with --no-survive-failure it need not,
    whatever the project says."""
    position_limit: float | None = None
    """Largest 2-sigma of x and y on the routes [m]. None: the project's, or else the supervisor's."""
    heading_limit: float | None = None
    """Largest 2-sigma of the heading on the routes [deg]. None: the project's, or else the supervisor's."""
    leeway: float | None = None
    """Where reflectors at all places together hardly keep a limit, or do not: how much more than what they give is good
    enough, as a share: 0.1 is 10 %; 0 takes nearly all of them. None: as in the project (0.1 unless changed)."""
    min_spacing: float | None = None
    """Smallest distance between two reflectors [m]. None: as in the project (0.5 unless changed)."""
    pairs_differ: float | None = None
    """By how much the distances of any two pairs of reflectors in sight at once must differ [m], so that a start search
    tells them apart: 0.3 is usual, 0: they need not. None: as in the project (0 unless changed)."""
    wall_reach: float | None = None
    """How far any place along the walls that is seen from a route may be from the nearest reflector [m], so that they
    spread along the walls; 0: any distance. None: as in the project (0 unless changed)."""
    unambiguous: Annotated[UseAppendAction[tuple[str, ...]], arg(metavar="stations|starts|X,Y|X,Y,HEADING")] = ()
    """Where a vehicle that is switched on must see which place it is: at the stations, at the starts of the routes, or
    at a spot [m, m, deg]; a spot without a heading counts with all. Beside those of the project."""
    blocked_per_m: float = 0.0
    """Probability per metre of ray that a person blocks it [1/m]."""
    spacing: float | None = None
    """Distance between places along the walls that are considered [m]. None: as in the project (1 unless changed)."""
    radius: float | None = None
    """Radius of the reflectors [m]. None: as in the project (0.04 unless changed)."""
    height: float | None = None
    """Height of the scanner's beams above the floor, and of the middle of the reflectors where it is allowed [m].
    None: as in the project (0.2 unless changed)."""
    length: float | None = None
    """Length of the reflectors: one whose middle is not at the height of the beams must still be met by them [m].
    None: as in the project (0.2 unless changed)."""
    heights: Annotated[UseAppendAction[tuple[str, ...]], arg(metavar="LOW,HIGH[,X1,Y1,X2,Y2]")] = ()
    """Heights that are allowed for the middle of a reflector, everywhere or in a rectangle, map frame [m]. Beside
    those of the project."""
    clearance: float | None = None
    """Distance left between a reflector and the vehicle on its routes [m].
    None: as in the project (0.3 unless changed)."""
    keep_out: Annotated[UseAppendAction[tuple[str, ...]], arg(metavar="X1,Y1,X2,Y2")] = ()
    """Rectangle without reflectors, by two opposite corners, map frame [m]. Beside those of the project."""
    seed: int = 1
    """Seed of the search: the same seed gives the same layout."""
    force: bool = False
    """Whether a project that is in PROJECT2 already is replaced."""

    def run(self) -> None:
        """Search, write, and tell what was found."""
        from commission.io.project_copy import refuse_to_replace, save_copy
        from commission.io.project_file import load_project
        from commission.planning.layout_figures import compared
        from commission.studies.placement import PlacementInput, placement

        if self.out.resolve() == self.project.resolve():
            raise UsageError(f"--out is the project itself, {self.out}; expected another folder")
        refuse_to_replace(self.out, force=self.force)
        project = load_project(self.project)
        try:
            options = self._options(project)
        except ValueError as error:
            raise UsageError(str(error)) from None
        result = placement(PlacementInput.of(project, options, self.route or None))
        found = result.placement
        kept = save_copy(dataclasses.replace(project, reflectors=found.reflectors), self.out, force=self.force)
        zones = [f"Zones        {result.zones_told}"] if result.zones_told else []
        notes = [] if kept is None else [f"Note         unsaved edits of the project that was there are kept in {kept}"]
        changes = [f"{name[:20]:<20} {change}" for name, change in compared(result.before, result.after)]
        sys.stdout.write(
            "\n".join([*_report(found), *zones, "Before and after", *changes, *notes, f"Written to   {self.out}"])
            + "\n"
        )

    def _options(self, project: Project) -> PlacementOptions:
        """Options of the search; raises ValueError for a number out of range."""
        from commission.planning.placement import PlacementOptions
        from commission.planning.route_prediction import PredictionOptions

        return PlacementOptions(
            demands=self._demands(project.layout.demands),
            candidates=self._candidates(project.layout.candidates),
            prediction=PredictionOptions(blocked_per_m=self.blocked_per_m),
            extend=self.extend,
            seed=self.seed,
        )

    def _demands(self, given: Demands) -> Demands:
        """Those of the project, with what the command line says; raises ValueError for an unknown preset."""
        given = given if self.preset is None else given.preset(self.preset.upper())
        spots = [text for text in self.unambiguous if text not in {STATIONS, STARTS}]
        return dataclasses.replace(
            given,
            survive_failure=self.survive_failure and given.survive_failure,
            unambiguous_stations=STATIONS in self.unambiguous or given.unambiguous_stations,
            unambiguous_starts=STARTS in self.unambiguous or given.unambiguous_starts,
            unambiguous_spots=(*given.unambiguous_spots, *map(_spot, spots)),
            **_said(
                visible=self.visible,
                position_limit=self.position_limit,
                heading_limit=None if self.heading_limit is None else math.radians(self.heading_limit),
                leeway=self.leeway,
                spacing=self.min_spacing,
                pairs_differ=self.pairs_differ,
                wall_reach=self.wall_reach,
            ),
        )

    def _candidates(self, given: CandidateOptions) -> CandidateOptions:
        """Those of the project, with what the command line says."""
        return dataclasses.replace(
            given,
            keep_out=(*given.keep_out, *map(_rectangle, self.keep_out)),
            allowed_heights=(*given.allowed_heights, *map(_heights, self.heights)),
            **_said(
                spacing=self.spacing,
                radius=self.radius,
                height=self.height,
                clearance=self.clearance,
                length=self.length,
            ),
        )


def _said(**options: float | None) -> dict[str, Any]:
    """Options that the command line gives."""
    return {name: value for name, value in options.items() if value is not None}


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
    from commission.site.layout_brief import AllowedHeights

    low, high, *corners = _numbers(text, "--heights", (2, 6), HEIGHTS_FORM)
    if not corners:
        return AllowedHeights(low, high)
    x_a, y_a, x_b, y_b = corners
    return AllowedHeights(low, high, (x_a, y_a, x_b, y_b))


def _report(found: Placement) -> list[str]:
    """Lines for a person."""
    # Where no layout from these places meets the demands, there is no number that is enough.
    bound = f"; fewer than {found.at_least} new ones cannot be enough" if found.at_least else ""
    kept = len(found.reflectors) - found.added
    lines = [
        f"Reflectors   {found.added} suggested among {counted_text(len(found.candidates), 'place')}, {kept} kept{bound}"
    ]
    if found.was_ended:
        lines.append("Ended        before its time, with the best layout so far: fewer reflectors might do")
    return lines + [f"Not met      {_told(unmet)}" for unmet in found.unmet]


def _told(unmet: Unmet) -> str:
    """Say which demand does not hold, and where."""
    if unmet.reason == "ambiguous":
        nearest = f" (nearest: metre {unmet.metres[0]} of route {unmet.route!r})" if unmet.metres else ""
        return f"{unmet.place}: another pose sees the same, or fewer than two reflectors are visible{nearest}"
    what = NOT_MET[unmet.reason]
    stretches = ", ".join(f"{first} to {last}" for first, last in unmet.stretches())
    where = f"route {unmet.route!r}: {what} on {len(unmet.metres)} m ({stretches} m)"
    return where if unmet.beyond is None else f"{where}: {unmet.beyond.told()}"

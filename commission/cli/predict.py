"""The command `predict`: how well the vehicle will localize along a route, before it has driven it."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from tyro.conf import Positional, arg

from commission.errors import UsageError
from commission.site.quantity import MILLIMETRES, PLAIN_DEGREES

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from commission.planning.dependence import Dependence
    from commission.planning.error_budget import PredictedErrors
    from commission.planning.route_prediction import PredictionOptions, RoutePrediction
    from commission.planning.station_accuracy import StationAccuracy
    from commission.site.project import Project
    from commission.site.reflectors import ReflectorMap
    from commission.studies.drives import PlannedDrives
    from commission.studies.kinds_prediction import KindsPrediction

BY_TWO_SIGMA = (
    "by 2-sigma: the project's supervisor holds the protection level, which is larger, and may stop elsewhere"
)
MOST_NEEDED = 5
"""Reflectors that the report names; the file has all."""


@dataclass(frozen=True, kw_only=True)
class Predict:
    """Predict what the localizer will say of itself along a route, and its error, with what each source contributes.

    Writes prediction.csv and summary.json; where walls, tags or bearings alone correct the pose as well, kinds.csv.
    """

    project: Positional[Path]
    """Folder of the project (holds project.yaml)."""
    out: Annotated[Path, arg(metavar="DIR")]
    """Folder for the results; made when it does not exist."""
    route: Annotated[str | None, arg(metavar="NAME")] = None
    """Route to drive. None: the project's first."""
    blocked_per_m: float = 0.0
    """Probability per metre of ray that a person blocks it [1/m]."""
    what_if: Annotated[Literal["blocked", "dirty", "moved"] | None, arg(metavar="{blocked,dirty,moved}")] = None
    """Let each reflector in turn fail so (moved: by 5 cm), and write dependents.csv, what depends on most first."""
    failures: int = 0
    """Block this many reflectors, each time the one on which most depends then, and write failures.csv [reflectors]."""
    every_route: bool = False
    """Whether --what-if and --failures ask about all routes of the project; the prediction is that of one."""
    force: bool = False
    """Whether files in DIR that this command did not write are overwritten; its own earlier results always are."""

    def run(self) -> None:
        """Predict, write, and tell in a few lines what is to be expected."""
        if not 0.0 <= self.blocked_per_m <= 1.0:
            raise UsageError(f"--blocked-per-m is {self.blocked_per_m:g}; expected 0 to 1 per metre")
        if self.failures < 0:
            raise UsageError(f"--failures is {self.failures}; expected 0 or more reflectors")

        from commission.io.overwriting import result_folder
        from commission.io.prediction_files import FILES, write_kinds, write_prediction
        from commission.io.project_file import load_project
        from commission.studies.kinds_prediction import KindsInput, kinds_beside_ranges, kinds_prediction
        from commission.studies.prediction import PredictionInput, prediction

        out = result_folder(self.out, "predict", FILES, force=self.force, sources=(self.project,))
        project = load_project(self.project)
        if self.route is None and not project.routes:
            raise UsageError("the project has no route; expected one to predict along")
        name = project.routes[0].name if self.route is None else self.route
        found = prediction(PredictionInput.of(project, name, self._options()))
        lines = [*_report(name, found.prediction, found.errors), *_at_stations(found.stations)]
        lines += _in_zones(found.planned.way_without_reflectors)
        driven = kinds_prediction(KindsInput.of(project, name)) if kinds_beside_ranges(project) else None
        lines += _by_every_kind(driven)
        with out.writing() as folder:
            lines += self._what_if(project, found.drives, folder)
            write_prediction(folder, name, found.prediction, found.errors, found.stations)
            if driven is not None:
                write_kinds(folder, driven)
        sys.stdout.write("\n".join([*lines, f"Written to   {self.out}"]) + "\n")

    def _options(self) -> PredictionOptions:
        from commission.planning.route_prediction import PredictionOptions

        return PredictionOptions(blocked_per_m=self.blocked_per_m)

    def _what_if(self, project: Project, known: PlannedDrives, folder: Path) -> list[str]:
        """Let reflectors fail as the options ask for, write what that does, and tell it."""
        from commission.io.prediction_files import write_dependents, write_failures
        from commission.planning.dependence import Failure
        from commission.studies.drives import DrivesInput
        from commission.studies.failures import FailuresInput, failures, worst_failures

        drives, lines = known.inputs, list[str]()
        if self.every_route:
            drives = DrivesInput.of(project, None, self._options())
        if self.what_if is not None:
            result = failures(FailuresInput(drives=drives, failure=Failure(self.what_if)), known=known)
            known = result.drives
            write_dependents(folder, result.ranking, project.reflectors)
            lines += _most_needed(result.ranking, project.reflectors)
        if self.failures:
            worst = worst_failures(drives, self.failures, known=known).ranking
            write_failures(folder, worst, project.reflectors)
            lines += _one_after_the_other(worst, project.reflectors)
        return lines


def _report(name: str, prediction: RoutePrediction, errors: PredictedErrors) -> list[str]:
    """Lines for a person; millimetres and degrees as is the habit."""
    from commission.site.parameters import HELD_LEVEL

    x, y, heading = prediction.two_sigma.max(axis=0)
    error_x, error_y, error_heading = errors.two_sigma.max(axis=0)
    limits = prediction.limits
    stops, starts = (
        ", ".join(f"{metre:.1f} m" for metre in metres) for metres in (prediction.trips(), prediction.recoveries())
    )
    return [
        f"Route        {name!r}, {prediction.drive.length:.1f} m in "
        f"{prediction.drive.stamps_ns[-1] * 1e-9:.1f} s, {len(prediction.drive)} scans",
        f"2-sigma      position {MILLIMETRES.text(prediction.position_two_sigma.max(), '.1f')} "
        f"(limit {MILLIMETRES.number(limits.position_limit)}), x {MILLIMETRES.text(x, '.1f')}, "
        f"y {MILLIMETRES.text(y, '.1f')}, heading {PLAIN_DEGREES.text(heading, '.2f')} "
        f"(limit {PLAIN_DEGREES.number(limits.heading_limit, '.2f')}) at most",
        f"Error        2-sigma position {MILLIMETRES.text(errors.position_two_sigma.max(), '.1f')}, "
        f"x {MILLIMETRES.text(error_x, '.1f')}, y {MILLIMETRES.text(error_y, '.1f')}, "
        f"heading {PLAIN_DEGREES.text(error_heading, '.2f')} at most",
        f"Budget       2-sigma of the position by each alone: {budget_told(errors.part_two_sigma.max(axis=0))}",
        f"Reflectors   {prediction.seen.min()} seen at least, {prediction.seen.mean():.1f} on average; "
        f"at most {prediction.on_odometry.max():.1f} m on odometry alone",
        f"Supervisor   stops at: {stops or 'none'}{f'; drives on at: {starts}' if starts else ''}; "
        f"metres over a limit: {len(prediction.failing_metres())}",
        *([f"             {BY_TWO_SIGMA}"] if prediction.limits.held == HELD_LEVEL else []),
    ]


def _at_stations(stations: Sequence[StationAccuracy]) -> list[str]:
    """Line about the stations on the route, if there are any."""
    if not stations:
        return []
    missed = [
        f"{each.station} {MILLIMETRES.text(each.expected, '.1f')} (allowed {MILLIMETRES.number(each.required)}; "
        f"{budget_told(each.parts)})"
        for each in stations
        if not each.is_met
    ]
    verdict = f"too uncertain at {', '.join(missed)}" if missed else "each is reached as accurately as it requires"
    return [f"Stations     {len(stations)} on the route; {verdict}"]


def _in_zones(way: float) -> list[str]:
    """Line about the way on which zones leave reflectors out, if there is any."""
    told = "predicted there by odometry alone; contours and tags are reckoned with by every kind alone"
    return [f"Zones        reflectors correct nothing on {way:.1f} m of the way: {told}"] if way > 0.0 else []


def _by_every_kind(driven: KindsPrediction | None) -> list[str]:
    """Lines about what the filter says by every kind, where there is one beside ranges and bearings of reflectors."""
    if driven is None:
        return []
    limits, stops = driven.inputs.parameters.supervisor, int((driven.stops > 0.0).sum())
    return [
        f"Every kind   by {', '.join(driven.kinds)}: 2-sigma position {MILLIMETRES.text(driven.position.max(), '.1f')} "
        f"(limit {MILLIMETRES.number(limits.position_limit)}), heading "
        f"{PLAIN_DEGREES.text(driven.heading.max(), '.2f')} at most; stops on {stops} of {len(driven.metre)} m "
        "(driven three times in a virtual hall; the lines above go by ranges and bearings alone)"
    ]


def budget_told(parts: Iterable[float]) -> str:
    """Name what each source of error contributes; millimetres as is the habit."""
    from commission.planning.error_budget import CONTRIBUTIONS

    named = zip(CONTRIBUTIONS, parts, strict=True)
    return ", ".join(f"{name} {MILLIMETRES.number(part, '.1f')}" for name, part in named) + " mm"


def _most_needed(ranked: Sequence[Dependence], reflectors: ReflectorMap) -> list[str]:
    """Line that names the reflectors on which metres depend."""
    needed = [
        f"{reflectors.reflectors[each.reflector].id} ({each.failing_metres} m)"
        for each in ranked[:MOST_NEEDED]
        if each.failing_metres
    ]
    return [f"What if      metres that fail with one reflector: {', '.join(needed) or 'none'}"]


def _one_after_the_other(worst: Sequence[Dependence], reflectors: ReflectorMap) -> list[str]:
    """Line that names the reflectors blocked, and the metres that fail with all of them."""
    names = ", then ".join(
        f"{reflectors.reflectors[each.reflector].id} (+{each.failing_metres} m)" for each in worst[:MOST_NEEDED]
    )
    more = f" and {len(worst) - MOST_NEEDED} more" if len(worst) > MOST_NEEDED else ""
    metres = sum(each.failing_metres for each in worst)
    return [f"Failures     {metres} m fail with all {len(worst)} blocked: {names or 'no reflector is seen'}{more}"]

"""The command `coverage`: visibility and dilution over the floor into a folder."""

from __future__ import annotations

import math
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from tyro.conf import Positional, arg

from commission.errors import UsageError
from commission.site.quantity import MILLIMETRES, PERCENT, PLAIN_DEGREES, Shown, counted_text

if TYPE_CHECKING:
    from collections.abc import Callable

    from commission.planning.dilution import FixOptions
    from commission.studies.coverage import CoverageOptions


@dataclass(frozen=True, kw_only=True)
class CoverageCommand:
    """Compute what the scanner sees over the floor; writes coverage.npz, .csv, .png and summary.json."""

    project: Positional[Path]
    """Folder of the project (holds project.yaml)."""
    out: Annotated[Path, arg(metavar="DIR")]
    """Folder for the results; made when it does not exist."""
    spacing: float = 0.25
    """Distance between neighboring points of the floor [m]."""
    heading: Literal["by-scanner", "all-round", "worst", "best"] | float = "by-scanner"
    """Heading of the vehicle [deg]; or the worst or best of 16; or all-round, as if the scanner saw a full turn; or
    by-scanner: the worst where no scanner sees all around, otherwise all-round. Points are positions of base for a
    heading, of the scanner otherwise."""
    measurement: Literal["range-bearing", "bearing-only", "range-bearing-prior"] = "range-bearing"
    """What is measured of a reflector; bearing-only is triangulation, prior adds what odometry says."""
    odometry: float = 1.0
    """Distance driven on odometry since the last fix [m]; read with range-bearing-prior only."""
    blocked_per_m: float = 0.0
    """Probability per metre of ray that a person blocks it [1/m]."""
    min_beams: int = 1
    """Beams that a reflector must get for certain to count as visible [beams]."""
    max_incidence: float = 60.0
    """Largest angle between a flat reflector's normal and the ray [deg]."""
    ellipses: float | None = None
    """Distance between the points whose 1-sigma ellipses are written to ellipses.csv [m]. None: no ellipses."""
    budget: bool = False
    """Whether it is also told what constants (survey, mounting, range bias, clock: `uncertainty` of the project) add to
    the error of a fix, and what most of it comes from. Of many headings that takes as many times longer."""
    contours: bool = False
    """Whether it is also told what the contours of the floor map tell a single scan, as `parameters.contour` matches
    them: where no reflector is needed."""
    tags: bool = False
    """Whether it is also told what one frame of the camera tells by tags. Of a heading, points are positions of base;
    else of the camera."""
    temporary: bool = False
    """Whether it is also told how many reels of the project's disturbances, those that stand there when a drive begins,
    a scanner that looks all round would see as temporary landmarks: where odometry does not drift."""
    force: bool = False
    """Whether files in DIR that this command did not write are overwritten; its own earlier results always are."""

    def run(self) -> None:
        """Compute, write, and tell in a few lines what was found."""
        from commission.io.coverage_files import FILES, write_coverage, write_ellipses
        from commission.io.overwriting import result_folder
        from commission.io.project_file import load_project
        from commission.studies.coverage import CoverageInput, coverage, ellipses_of, summary

        if self.ellipses is not None and not 0.0 < self.ellipses < math.inf:
            raise UsageError(f"--ellipses is {self.ellipses}; expected metres greater than 0")
        out = result_folder(self.out, "coverage", FILES, force=self.force, sources=(self.project,))
        project = load_project(self.project)
        if self.contours and project.floor_map is None:
            raise UsageError(f"{self.project} has no floor map; --contours expects one")
        if self.tags and not project.tags:
            raise UsageError(f"{self.project} has no tags; --tags expects some under tags: in project.yaml")
        if self.temporary and not project.disturbances.reels:
            raise UsageError(
                f"{self.project} has no reels; --temporary expects some under disturbances: in project.yaml"
            )
        try:
            result = coverage(CoverageInput.of(project, self._options()))
        except ValueError as error:
            raise UsageError(str(error)) from None
        entries = summary(result, project.parameters.supervisor)
        ellipses = None if self.ellipses is None else ellipses_of(result, self.ellipses)
        with out.writing() as folder:
            write_coverage(folder, result, entries)
            if ellipses is not None:
                write_ellipses(folder, ellipses)
        sys.stdout.write("\n".join([*_report(entries, result.coverage.options), f"Written to   {self.out}"]) + "\n")

    def _options(self) -> CoverageOptions:
        """What is asked of every point; raises ValueError for a number out of range."""
        from commission.planning.dilution import Heading, Measurement
        from commission.planning.visibility import VisibilityOptions
        from commission.studies.coverage import CoverageOptions

        return CoverageOptions(
            measurement=Measurement(self.measurement),
            heading=Heading(self.heading) if isinstance(self.heading, str) else Heading.GIVEN,
            given_heading=0.0 if isinstance(self.heading, str) else math.radians(self.heading),
            on_odometry=self.odometry,
            blocked_per_m=self.blocked_per_m,
            visibility=VisibilityOptions(self.min_beams, self.max_incidence),
            spacing=self.spacing,
            with_constants=self.budget,
            with_contours=self.contours,
            with_tags=self.tags,
            with_temporary=self.temporary,
        )


def _heading(options: FixOptions) -> str:
    """Say for which headings of the vehicle the figures hold."""
    from commission.planning.dilution import Heading

    names = {
        Heading.WORST: f"worst of {options.headings}",
        Heading.BEST: f"best of {options.headings}",
        Heading.GIVEN: PLAIN_DEGREES.text(options.given_heading, ".1f"),
    }
    return names.get(options.heading, "all round, as if the scanner saw a full turn")


def _report(entries: dict[str, int | float | None], options: FixOptions) -> list[str]:
    """Lines for a person; millimetres and degrees as is the habit."""

    def share(key: str) -> str:
        value = entries[key]
        return "unknown" if value is None else PERCENT.text(value, ".1f")

    def figure(key: str, unit: Shown, form: str) -> str:
        value = entries[key]
        return "none" if value is None else unit.text(value, form)

    return [
        f"Floor        {entries['area_m2']:.0f} m2 in {entries['points']} points; "
        f"{counted_text(int(entries['reflectors'] or 0), 'reflector')}",
        f"Heading      {_heading(options)}",
        f"Visible      1 or more on {share('share_1_visible')}, 2 on {share('share_2_visible')}, "
        f"3 on {share('share_3_visible')}",
        f"One fix      possible on {share('share_with_fix')}; two sigma within the supervisor's limits on "
        f"{share('share_within_limits')}",
        f"1-sigma      position {figure('position_sigma_median_m', MILLIMETRES, '.1f')} median, "
        f"{figure('position_sigma_p95_m', MILLIMETRES, '.1f')} at 95 % of the floor; heading "
        f"{figure('heading_sigma_median_rad', PLAIN_DEGREES, '.2f')} and "
        f"{figure('heading_sigma_p95_rad', PLAIN_DEGREES, '.2f')}",
        *_contours(entries, share, figure),
        *_tags(entries, share, figure),
        *_reels(entries, share),
        *_budget(entries, share, figure),
    ]


def _contours(
    entries: dict[str, int | float | None], share: Callable[[str], str], figure: Callable[[str, Shown, str], str]
) -> list[str]:
    """Line about what contours tell, where that was asked for."""
    if "contour_share_whole_pose" not in entries:
        return []
    within, either = share("contour_share_within_limits"), share("share_within_limits_by_either")
    return [
        f"Contours     tell the whole pose on {share('contour_share_whole_pose')}, 1-sigma "
        f"{figure('contour_position_sigma_median_m', MILLIMETRES, '.1f')} median; two sigma within the limits on "
        f"{within}, by reflectors or contours on {either}"
    ]


def _tags(
    entries: dict[str, int | float | None], share: Callable[[str], str], figure: Callable[[str, Shown, str], str]
) -> list[str]:
    """Line about what tags tell, where that was asked for."""
    if "tag_share_seen" not in entries:
        return []
    return [
        f"Tags         one is in sight on {share('tag_share_seen')}, at some heading on "
        f"{share('tag_share_seen_at_some_heading')}, 1-sigma "
        f"{figure('tag_position_sigma_median_m', MILLIMETRES, '.1f')} median; two sigma within the limits on "
        f"{share('tag_share_within_limits')}, by reflectors or tags on "
        f"{share('share_within_limits_by_reflectors_or_tags')}"
    ]


def _reels(entries: dict[str, int | float | None], share: Callable[[str], str]) -> list[str]:
    """Line about temporary landmarks, where that was asked for."""
    if "reel_share_seen" not in entries:
        return []
    key = "reel_share_two_seen_without_fix"
    more = "" if entries[key] is None else f"; where reflectors give no fix, two on {share(key)}"
    return [
        f"Temporary    a reel is in sight on {share('reel_share_seen')}, two on {share('reel_share_two_seen')}{more}"
    ]


def _budget(
    entries: dict[str, int | float | None], share: Callable[[str], str], figure: Callable[[str, Shown, str], str]
) -> list[str]:
    """Line about the error with all constants, where that was asked for."""
    from commission.planning.error_budget import CONTRIBUTIONS

    if "total_sigma_median_m" not in entries:
        return []
    return [
        f"Budget       1-sigma with constants: position {figure('total_sigma_median_m', MILLIMETRES, '.1f')} median, "
        f"{figure('total_sigma_p95_m', MILLIMETRES, '.1f')} at 95 %; most of it comes from "
        + ", ".join(f"{part} on {share(f'share_{part}_largest')}" for part in CONTRIBUTIONS),
    ]

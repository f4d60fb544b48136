"""The command `ambiguity`: where a vehicle may take one place, or one reflector, for another."""

from __future__ import annotations

import math
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from tyro.conf import Positional, UseAppendAction, arg

from commission.errors import UsageError
from commission.site.quantity import PERCENT, PLAIN_DEGREES, counted_text

if TYPE_CHECKING:
    from commission.site.reflectors import ReflectorMap
    from commission.studies.ambiguity import AmbiguityResult, RouteRisks

NAMED = 3
"""Pairs that the report names; the files have all."""


@dataclass(frozen=True, kw_only=True)
class Ambiguity:
    """Find where reflectors without names mislead: at a cold start anywhere on the floor, and along the routes.

    Writes ambiguity.npz, .csv, .png, ambiguous_pairs.csv, neighbors.csv and summary.json.
    """

    project: Positional[Path]
    """Folder of the project (holds project.yaml)."""
    out: Annotated[Path, arg(metavar="DIR")]
    """Folder for the results; made when it does not exist."""
    route: Annotated[UseAppendAction[tuple[str, ...]], arg(metavar="NAME")] = ()
    """Route to look for misleading neighbors along. None: all."""
    spacing: float = 0.5
    """Distance between neighboring points of the floor [m]."""
    tolerance: float = 0.1
    """Largest distance at which a reflector still counts as where the constellation wants it [m]."""
    separation: float = 0.5
    """Distance from which two poses are different places [m]."""
    turn: float = 15.0
    """Difference of heading from which two poses at one place are different [deg]."""
    headings: int = 8
    """Evenly spaced headings that are tried at each point; a scanner that sees all around needs one."""
    force: bool = False
    """Whether files in DIR that this command did not write are overwritten; its own earlier results always are."""

    def run(self) -> None:
        """Compute, write, and tell in a few lines what was found."""
        from commission.io.ambiguity_files import FILES, write_ambiguity
        from commission.io.overwriting import result_folder
        from commission.io.project_file import load_project
        from commission.planning.ambiguity import AmbiguityOptions
        from commission.studies.ambiguity import AmbiguityInput, SiteAmbiguity, ambiguity, misleading_neighbors, summary
        from commission.studies.drives import DrivesInput

        out = result_folder(self.out, "ambiguity", FILES, force=self.force, sources=(self.project,))
        project = load_project(self.project)
        drives = DrivesInput.of(project, self.route or None)
        try:
            options = AmbiguityOptions(self.tolerance, self.separation, math.radians(self.turn), self.headings)
            floor = ambiguity(AmbiguityInput.of(project, options, spacing=self.spacing))
        except ValueError as error:
            raise UsageError(str(error)) from None
        found = SiteAmbiguity(floor, misleading_neighbors(drives))
        with out.writing() as folder:
            write_ambiguity(folder, found, project.reflectors, summary(found))
        lines = [*_cold_start(found.floor, project.reflectors), *_tracking(found.routes, project.reflectors)]
        sys.stdout.write("\n".join([*lines, f"Written to   {self.out}"]) + "\n")


def _cold_start(found: AmbiguityResult, reflectors: ReflectorMap) -> list[str]:
    """Lines about the floor, and the pairs that most poses confuse."""
    on, area = found.drivable, found.lattice.spacing**2
    share = found.ambiguous.sum() / max(on.sum(), 1)
    rival, few = found.has_twin.sum() * area, (found.visible[on] < 2).sum() * area
    lines = [
        f"Cold start   {found.ambiguous.sum() * area:.1f} of {on.sum() * area:.1f} m2 ambiguous in some heading "
        f"({PERCENT.text(share, '.1f')}): {rival:.1f} m2 look like another place, "
        f"{few:.1f} m2 see fewer than two reflectors",
    ]
    for pair in found.cold.pairs[:NAMED]:
        names, images = (
            ", ".join(reflectors.reflectors[index].id for index in group) for group in (pair.constellation, pair.image)
        )
        here, there = (_pose(pose) for pose in (pair.example, pair.partner))
        lines.append(f"Alike        {names} as {images}: {counted_text(pair.poses, 'pose')}, e.g. {here} for {there}")
    more = len(found.cold.pairs) - NAMED
    return [*lines, f"             and {counted_text(more, 'more pair')}"] if more > 0 else lines


def _pose(pose: tuple[float, float, float]) -> str:
    x, y, heading = pose
    return f"{x:.2f}, {y:.2f} m, {PLAIN_DEGREES.text(heading)}"


def _tracking(routes: tuple[RouteRisks, ...], reflectors: ReflectorMap) -> list[str]:
    """A line per route about the neighbors that mislead on it."""
    from commission.studies.ambiguity import metres_at_risk

    lines: list[str] = []
    for each in routes:
        if not each.risks:
            lines.append(f"Tracking     route {each.route!r}: no neighbor to be mistaken for")
            continue
        worst = each.risks[0]
        names = [reflectors.reflectors[index].id for index in (worst.reflector, worst.neighbor)]
        lines.append(
            f"Tracking     route {each.route!r}: neighbors to be mistaken for on {len(metres_at_risk(each.risks))} m; "
            f"worst {names[0]} for {names[1]}, {PERCENT.text(worst.worst, '.1f')} of detections"
        )
    return lines

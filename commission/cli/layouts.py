"""The command `layouts`: two layouts of reflectors on one site, beside each other."""

from __future__ import annotations

import math
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from tyro.conf import Positional, arg

from commission.cli.terminal import shown_progress
from commission.errors import UsageError
from commission.site.quantity import MILLIMETRES, PERCENT

if TYPE_CHECKING:
    from commission.studies.layouts import FloorDifference, LayoutResult

LEAST = 1e-4
"""Difference of a 1-sigma that counts as one [m]."""


@dataclass(frozen=True, kw_only=True)
class Layouts:
    """Compare two layouts of reflectors on one site: along routes, at stations, with failures, and over the floor.

    Each figure is told as `first -> other`; nothing is written.
    """

    project: Positional[Path]
    """Folder of the project (holds project.yaml): the site, and the first layout."""
    other: Annotated[Positional[Path], arg(metavar="OTHER")]
    """The other layout: a table of reflectors (CSV), or the folder of a project, of which only the reflectors count."""
    blocked_per_m: float = 0.0
    """Probability per metre of ray that a person blocks it [1/m]."""

    def run(self) -> None:
        """Compare, and tell what was found."""
        from commission.io.project_file import load_project
        from commission.io.reflector_tables import read_reflectors
        from commission.planning.layout_figures import compared
        from commission.planning.route_prediction import PredictionOptions
        from commission.progress import part
        from commission.studies.layouts import FloorFigure, LayoutInput, floor_difference, layout

        project = load_project(self.project)
        reflectors = load_project(self.other).reflectors if self.other.is_dir() else read_reflectors(self.other)
        try:
            options = PredictionOptions(blocked_per_m=self.blocked_per_m)
        except ValueError as error:
            raise UsageError(str(error)) from None
        first = layout(LayoutInput.of(project, None, options), part(shown_progress, 0.0, 0.5))
        other = layout(LayoutInput.of(project, reflectors, options), part(shown_progress, 0.5, 1.0))
        lines = [f"{name[:20]:<20} {change}" for name, change in compared(first.figures, other.figures)]
        difference = None
        if project.floor_map is not None:
            difference = floor_difference(other, first, FloorFigure.POSITION_SIGMA)
        sys.stdout.write("\n".join([*lines, *_of_floor(first, other, difference)]) + "\n")


def _of_floor(first: LayoutResult, other: LayoutResult, difference: FloorDifference | None) -> list[str]:
    """Lines of the whole floor; none without a floor map."""
    if difference is None:
        return ["Floor                no floor map: the reflectors themselves say how far it reaches"]
    from commission.studies.coverage import summary

    lines = [f"{'Ambiguous start':<20} {first.ambiguous_area:.1f} -> {other.ambiguous_area:.1f} m2 of the floor"]
    one, two = (summary(each.floor, each.inputs.parameters.supervisor) for each in (first, other))
    for name, key, shown in (
        ("With a fix", "share_with_fix", PERCENT),
        ("Within the limits", "share_within_limits", PERCENT),
        ("Position, median", "position_sigma_median_m", MILLIMETRES),
    ):
        numbers = [math.nan if (value := each[key]) is None else float(value) for each in (one, two)]
        texts = ["none" if math.isnan(number) else shown.text(number, ".1f") for number in numbers]
        lines.append(f"{name:<20} {' -> '.join(texts)}")
    floor = max(1, int(first.floor.drivable.sum()))
    better = int((difference.gains > LEAST).sum() + difference.gained.sum()) / floor
    worse = int((difference.gains < -LEAST).sum() + difference.lost.sum()) / floor
    lines.append(
        f"{'A fix is':<20} better on {PERCENT.text(better, '.1f')} of the floor, worse on {PERCENT.text(worse, '.1f')}"
    )
    return lines

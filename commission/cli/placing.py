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
    from commission.planning.placement import Placement, PlacementOptions


@dataclass(frozen=True, kw_only=True)
class Place:
    """Suggest reflectors on the walls so that the routes are driven within limits; writes a project with them."""

    project: Positional[Path]
    """Folder of the project (holds project.yaml)."""
    out: Annotated[Path, arg(metavar="PROJECT2")]
    """Folder for the project with the suggested reflectors; made when it does not exist."""
    route: Annotated[UseAppendAction[tuple[str, ...]], arg(metavar="NAME")] = ()
    """Route that counts. None: all."""
    extend: bool = True
    """Whether the project's reflectors stay; with --no-extend the layout starts empty."""
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
    spacing: float = 1.0
    """Distance between places along the walls that are considered [m]."""
    radius: float = 0.04
    """Radius of the reflectors [m]."""
    height: float = 0.2
    """Height of the middle of the reflectors above the floor [m]."""
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
        from commission.planning.placement import Demands, PlacementOptions

        heading = None if self.heading_limit is None else math.radians(self.heading_limit)
        return PlacementOptions(
            Demands(self.visible, self.survive_failure, self.position_limit, heading, self.min_spacing),
            CandidateOptions(
                spacing=self.spacing,
                radius=self.radius,
                height=self.height,
                keep_out=tuple(_rectangle(text) for text in self.keep_out),
            ),
            extend=self.extend,
            seed=self.seed,
        )


def _rectangle(text: str) -> tuple[float, float, float, float]:
    """Read `X1,Y1,X2,Y2`; raises UsageError that shows the text and the form expected."""
    words = text.split(",")
    try:
        x_a, y_a, x_b, y_b = (float(word) for word in words)
    except ValueError:
        raise UsageError(f"--keep-out is {text!r}; expected X1,Y1,X2,Y2 (metres)") from None
    return x_a, y_a, x_b, y_b


def _report(found: Placement) -> list[str]:
    """Lines for a person."""
    lines = [
        f"Reflectors   {found.added} suggested among {len(found.candidates)} places, "
        f"{len(found.reflectors) - found.added} kept; fewer than {found.at_least} new ones cannot be enough",
    ]
    for unmet in found.unmet:
        what = "too few visible" if unmet.reason == "visible" else "uncertainty over its limit"
        lines.append(f"Not met      route {unmet.route!r}: {what} on {len(unmet.metres)} m, from {unmet.metres[0]} m")
    return lines

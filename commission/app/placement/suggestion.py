"""Suggested reflectors: what is wished for, the job that looks for them, and what was found. All frozen values."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from commission.errors import UsageError
from commission.geometry.arrays import FloatArray
from commission.planning import true_error
from commission.planning.nominal_drive import nominal_drive
from commission.planning.placement import Placement, PlacementOptions, Unmet, place
from commission.progress import Progress
from commission.site.layout_brief import LayoutBrief
from commission.site.project import Project
from commission.site.reflectors import ReflectorMap

SMALLEST_AREA = 0.05
"""Side below which a rectangle on the floor was a click and not an area [m]."""


@dataclass(frozen=True, slots=True)
class LayoutWish:
    """Whether a suggested layout is wanted, and from what it starts; what it must achieve is part of the project."""

    extend: bool = True
    """Whether the present reflectors stay; if not, only the locked ones do."""
    wanted: bool = False
    """Whether a layout is looked for, or shown."""
    asked: int = 0
    """Number of times a layout was asked for: asking again is told apart from having asked."""


def with_option(brief: LayoutBrief, name: str, value: object) -> LayoutBrief:
    """Return what is asked of a layout with one option changed.

    Parameters
    ----------
    brief : what is asked.
    name : `group.name` of one of its demands or candidates.
    value : new value, SI and radians.

    Raises
    ------
    UsageError
        there is no such option.
    ValueError
        the value is out of range.
    """
    group, _, inner = name.rpartition(".")
    holder: Any = getattr(brief, group, None)
    if holder is None or not hasattr(holder, inner):
        raise UsageError(f"a suggested layout has no option {name!r}")
    changed: Any = replace(holder, **{inner: value})
    return replace(brief, **{group: changed})


@dataclass(frozen=True, slots=True, eq=False)
class UnmetStretch:
    """Metres in a row where a demand does not hold."""

    route: str
    """Name of the route."""
    reason: str
    """As in `planning.placement.Unmet`."""
    first: int
    """First metre of the way."""
    last: int
    """Metre at which the stretch ends."""
    points: FloatArray
    """(N, 2) the way there [m], map frame."""

    @property
    def place(self) -> tuple[float, float]:
        """Where the stretch begins [m]."""
        return float(self.points[0, 0]), float(self.points[0, 1])


@dataclass(frozen=True, slots=True, eq=False)
class Suggestion:
    """A suggested layout, and what it was made from."""

    wish: LayoutWish
    """What was wished for."""
    site: Project
    """The site as it was."""
    placement: Placement
    """What was found."""
    unmet: tuple[UnmetStretch, ...]
    """Where it does not do."""

    @property
    def added(self) -> FloatArray:
        """(N, 2) places of the new reflectors [m]."""
        return self.placement.reflectors.centers[len(self.placement.reflectors) - self.placement.added :]

    @property
    def removed(self) -> FloatArray:
        """(M, 2) places of the reflectors that would go [m]: all that are not locked, where the layout starts empty."""
        if self.wish.extend:
            return np.empty((0, 2))
        return np.array([(r.x, r.y) for r in self.site.reflectors.reflectors if not r.locked]).reshape(-1, 2)

    def is_of(self, project: Project) -> bool:
        """Whether the site is still the one that the layout was made for."""
        parts = ("reflectors", "floor_map", "routes", "vehicle", "scanner", "parameters", "stations")
        return all(getattr(project, part) is getattr(self.site, part) for part in parts)


def suggest(project: Project, wish: LayoutWish, progress: Progress) -> Suggestion:
    """Look for few reflectors that meet the demands.

    Locked reflectors stay even where the layout starts empty.

    Raises
    ------
    UsageError
        no route counts, or there is no wall to put a reflector on.
    """
    brief = project.layout
    routes = brief.counted(project.routes)
    if not routes:
        raise UsageError("no route counts for the suggested layout; expected one or more")
    if project.floor_map is None:
        raise UsageError("the project has no floor map, so no wall to put reflectors on; expected one")
    site = project
    if not wish.extend:
        site = replace(project, reflectors=ReflectorMap(tuple(r for r in project.reflectors.reflectors if r.locked)))
    progress(0.0, "compiling")
    true_error.warm_up()
    found = place(site, routes, PlacementOptions(demands=brief.demands, candidates=brief.candidates), progress)
    return Suggestion(wish, project, found, tuple(_stretches(project, found.unmet)))


def _stretches(project: Project, unmet: tuple[Unmet, ...]) -> list[UnmetStretch]:
    """Metres where demands do not hold, those in a row together, in the order of their routes."""
    found: list[UnmetStretch] = []
    for each in unmet:
        drive = nominal_drive(project.route(each.route), project.vehicle, project.scanner)
        metres = np.array(each.metres)
        for part in np.split(metres, np.flatnonzero(np.diff(metres) > 1) + 1):
            first, last = int(part[0]), int(part[-1]) + 1
            on_it = (drive.metres >= first) & (drive.metres < last)
            found.append(UnmetStretch(each.route, each.reason, first, last, drive.poses[on_it, :2]))
    return found

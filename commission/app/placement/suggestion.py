"""Suggested reflectors: what is wished for, the job that looks for them, and what was found. All frozen values."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

from commission.errors import UsageError
from commission.geometry.arrays import FloatArray
from commission.planning.placement import Placement, PlacementOptions
from commission.progress import Progress
from commission.site.layout_brief import LayoutBrief
from commission.site.project import Project
from commission.studies.placement import PlacementInput, PlacementResult, UnmetStretch, placement

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
class Suggestion:
    """A suggested layout, and what it was made from."""

    wish: LayoutWish
    """What was wished for."""
    site: Project
    """The site as it was."""
    result: PlacementResult
    """What was found."""

    @property
    def placement(self) -> Placement:
        """The suggested layout."""
        return self.result.placement

    @property
    def unmet(self) -> tuple[UnmetStretch, ...]:
        """Where it does not do."""
        return self.result.unmet

    @property
    def added(self) -> FloatArray:
        """(N, 2) places of the new reflectors [m]."""
        return self.result.added

    @property
    def removed(self) -> FloatArray:
        """(M, 2) places of the reflectors that would go [m]."""
        return self.result.removed

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
    options = PlacementOptions(demands=brief.demands, candidates=brief.candidates, extend=wish.extend)
    inputs = PlacementInput.of(project, options)
    if project.floor_map is None:
        raise UsageError("the project has no floor map, so no wall to put reflectors on; expected one")
    return Suggestion(wish, project, placement(inputs, progress))

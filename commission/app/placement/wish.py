"""Whether a suggested layout is wanted: one frozen value in the page's state. What it must achieve is the project's."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from commission.errors import UsageError
from commission.planning.placement import PlacementOptions
from commission.site.project import Project
from commission.site.quantity import Switch
from commission.studies.placement import PlacementInput

SMALLEST_AREA = 0.05
"""Side below which a rectangle on the floor was a click and not an area [m]."""


@dataclass(frozen=True, slots=True)
class LayoutWish:
    """Whether a suggested layout is wanted, and from what it starts."""

    extend: Annotated[bool, Switch("Keep present")] = True
    """Whether the reflectors that are there stay; if not, only the locked ones do."""
    inputs: PlacementInput | None = None
    """The site as it was when a layout was asked for, and what was asked; none: no layout is looked for or shown."""
    asked: int = 0
    """Number of times a layout was asked for: asking again is told apart from having asked."""
    enough: int = 0
    """The number of the search that is to end with the best layout found so far."""


def placement_input(project: Project, *, extend: bool) -> PlacementInput:
    """Return what a suggested layout depends on.

    Parameters
    ----------
    project : the site, and what it asks of a layout.
    extend : whether the present reflectors stay; locked ones do anyway.

    Raises
    ------
    UsageError
        no route counts, or there is no wall to put a reflector on.
    """
    brief = project.layout
    options = PlacementOptions(demands=brief.demands, candidates=brief.candidates, extend=extend)
    inputs = PlacementInput.of(project, options)
    if project.floor_map is None:
        raise UsageError("the project has no floor map, so no wall to put reflectors on; expected one")
    return inputs

"""A suggested layout, as panels and layers draw it; unasked, none."""

from __future__ import annotations

from dataclasses import dataclass

from commission.app.placement.wish import LayoutWish
from commission.planning.placement import PlacementOptions
from commission.site.project import Project
from commission.studies.inputs import is_same
from commission.studies.placement import PlacementInput, PlacementResult

SITE = ("reflectors", "floor_map", "scanners", "vehicle", "parameters", "stations")
"""Parts of the input that are the site's, besides its routes."""


@dataclass(frozen=True, slots=True, eq=False)
class LayoutView:
    """A suggested layout."""

    suggestion: PlacementResult
    """What was found."""
    outdated: bool
    """Whether the site has changed since."""
    wished_otherwise: bool
    """Whether something else is wished for by now."""


def layout_view(suggestion: PlacementResult, project: Project, wish: LayoutWish) -> LayoutView:
    """Hold a suggestion against the site and the wishes of now.

    Parameters
    ----------
    suggestion : what was found.
    project : the site as it is now, and what it asks of a layout.
    wish : from what a layout would start now.
    """
    inputs, brief = suggestion.inputs, project.layout
    options = PlacementOptions(demands=brief.demands, candidates=brief.candidates, extend=wish.extend)
    counted = tuple(route.name for route in inputs.routes)
    return LayoutView(
        suggestion,
        outdated=not _is_of(inputs, project),
        wished_otherwise=not is_same(inputs.options, options) or counted != brief.counted(project.routes),
    )


def _is_of(inputs: PlacementInput, project: Project) -> bool:
    """Whether the site is still the one that the layout was made for, with the routes that counted."""
    routes = {route.name: route for route in project.routes}
    return all(is_same(getattr(project, part), getattr(inputs, part)) for part in SITE) and all(
        is_same(routes.get(route.name), route) for route in inputs.routes
    )

"""What is wrong with the site and how its selected routes drive, as panels and layers draw it: frozen, newest wins."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from commission.app.base.view import PageView
from commission.planning.route_profile import RouteProfile
from commission.studies.problems import Problem
from commission.studies.violations import Violation


@dataclass(frozen=True, slots=True, eq=False)
class InspectionView:
    """Of the newest project that was checked."""

    problems: tuple[Problem, ...] = ()
    """What is wrong with the site, errors first."""
    violations: tuple[Violation, ...] = ()
    """Where routes ask too much of the vehicle; the same value as long as nothing changes."""
    profiles: Mapping[str, RouteProfile] = field(default_factory=dict[str, RouteProfile])
    """How the routes drive that some browser has selected, by name."""


NOTHING = InspectionView()


def inspection_of(view: PageView) -> InspectionView:
    """Return what was found; nothing before the first check."""
    return view.part(InspectionView) or NOTHING

"""What each result of the step Plan depends on: parts of the project and settings, as keys that are compared."""

from __future__ import annotations

from commission.app.plan.settings import PlanSettings
from commission.app.plan.upkeep import Key
from commission.site.project import Project
from commission.site.reflectors import ReflectorMap

MOST_MOVED = 12
"""Reflectors that are moved one by one; the floor is computed anew when more have changed."""


def floor_key(project: Project, plan: PlanSettings) -> Key:
    """Return what a heatmap depends on, its reflectors first."""
    return (
        project.reflectors,
        project.floor_map,
        project.scanner,
        project.parameters.observation,
        project.parameters.odometry,
        plan.heading.value,
        plan.given_heading,
        plan.measurement.value,
        plan.on_odometry,
        plan.blocked_per_m,
        plan.min_beams,
    )


def site_key(project: Project, plan: PlanSettings) -> Key:
    """Return what predictions depend on besides the route."""
    return (
        project.reflectors,
        project.floor_map,
        project.scanner,
        project.vehicle,
        project.parameters,
        project.routes,
        project.stations,
        plan.blocked_per_m,
        plan.min_beams,
    )


def route_key(project: Project, plan: PlanSettings) -> Key:
    """Return what a prediction depends on, the route last."""
    return (*site_key(project, plan), plan.route)


def ranking_key(project: Project, plan: PlanSettings) -> Key:
    """Return what a ranking depends on, and last which request it answers."""
    return (*site_key(project, plan), plan.failure.value, plan.ranking)


def cold_start_key(project: Project, plan: PlanSettings) -> Key:
    """Return what ambiguous places depend on."""
    return (project.reflectors, project.floor_map, project.scanner, plan.min_beams, plan.tolerance)


def changed_reflectors(before: ReflectorMap, after: ReflectorMap) -> list[int] | None:
    """Return the indices of the reflectors that changed; none when there are other ones, or too many."""
    if len(before) != len(after):
        return None
    pairs = zip(before.reflectors, after.reflectors, strict=True)
    changed = [index for index, (old, new) in enumerate(pairs) if old != new]
    return changed if len(changed) <= MOST_MOVED else None

"""What each step of commissioning lacks, read off the project alone. No widget."""

from __future__ import annotations

from dataclasses import dataclass

from commission.site.project import Project

FEWEST_REFLECTORS = 2
"""Fewest reflectors from which a pose follows."""


@dataclass(frozen=True, slots=True)
class Task:
    """One thing on the way from an empty project to a driving vehicle."""

    title: str
    """What to do, as its button says."""
    note: str
    """How far it is, or why it cannot be done yet."""
    done: bool
    """Whether it is done."""
    way: str = ""
    """Where on the page it is done, for the script `guide.js`; empty: it cannot be done yet."""


def _has_enough(project: Project) -> bool:
    """Whether a pose follows from what is there."""
    return len(project.reflectors) >= FEWEST_REFLECTORS or bool(_instead_of_reflectors(project))


def _instead_of_reflectors(project: Project) -> str:
    """Return what a pose follows from without reflectors; empty: nothing."""
    if project.parameters.contour.seen_of(project.floor_map) is not None:
        return "contours of the floor map"
    return "tags" if project.tags and project.parameters.tag.enabled else ""


def tasks(project: Project, *, drives: bool) -> tuple[Task, ...]:
    """Return what there is to do, in order.

    Parameters
    ----------
    project : as edited now.
    drives : whether a run is on the page.
    """
    count, routes = len(project.reflectors), len(project.routes)
    others, enough = _instead_of_reflectors(project), _has_enough(project)
    by_hand = f"by clicks on the floor, {FEWEST_REFLECTORS} or more; or import a table"
    lacks = () if enough else ("reflectors",)
    lacks += () if routes else ("a route",)
    return (
        Task(
            "Load a floor map",
            "" if project.floor_map is not None else "ROS map, image, CAD or 3D; or go on in an open field",
            project.floor_map is not None,
            "tab:Site open:Floor_map",
        ),
        Task(
            "Place reflectors",
            f"{count} placed" if count else f"none needed: {others} tell the pose" if others else by_hand,
            enough,
            "tab:Selection press:Place",
        ),
        Task(
            "Draw a route",
            f"{routes} drawn" if routes else "by clicks on the floor, Enter ends it",
            routes > 0,
            "tab:Selection press:Route",
        ),
        Task(
            "Drive",
            f"first: {' and '.join(lacks)}" if lacks else "a virtual vehicle, on the first route",
            drives,
            "" if lacks else "tab:Run press:Drive",
        ),
    )


def lacking(project: Project, *, drives: bool) -> dict[str, str]:
    """Return of each step on the left what it lacks, in words; empty: nothing.

    Parameters
    ----------
    project : as edited now.
    drives : whether a run is on the page.
    """
    count = len(project.reflectors)
    no_map = () if project.floor_map is not None else ("a floor map",)
    few = () if _has_enough(project) else (f"reflectors ({count} of at least {FEWEST_REFLECTORS})",)
    no_route = () if project.routes else ("a route",)
    still = () if drives else ("a run",)
    of_each = {
        "Site": no_map + few + no_route,
        "Plan": few + no_route,
        "Run": few + no_route + still,
        "Tune": few + no_route + still,
    }
    return {step: ", ".join(parts) for step, parts in of_each.items()}

"""What the owner thread publishes and what layers and panels draw: one frozen value, newest wins. No viser in here."""

from __future__ import annotations

from dataclasses import dataclass, field

from commission.app.base.jobs import Job
from commission.app.base.parts import Part, Parts
from commission.app.base.state import AppState
from commission.geometry.arrays import FloatArray


@dataclass(frozen=True, slots=True)
class Followed:
    """The place that a camera goes with where it follows; whoever has something that moves puts it into the view."""

    place: tuple[float, float]
    """Where it is [m], map frame."""


@dataclass(frozen=True, slots=True, eq=False)
class LivedPath:
    """Where something has been so far, and how well that was known: for whoever lays it beside what was expected."""

    poses: FloatArray
    """(K, 3) `T_map_base` [m, m, rad]."""
    two_sigma: FloatArray
    """(K, 3) 2-sigma of x [m], y [m] and heading [rad]."""
    position_two_sigma: FloatArray
    """(K,) 2-sigma of the position that the supervisor holds against its limit [m]."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class PageView:
    """Everything that panels and layers draw from."""

    state: AppState
    """The page's own state."""
    jobs: tuple[Job, ...] = ()
    """Background work under way."""
    waiting: tuple[Job, ...] = ()
    """Background work that has not begun."""
    parts: Parts = field(default_factory=dict[type, object])
    """What services have found, one value of each type."""
    floor_is_colored: bool = False
    """Whether a layer colors the floor, so that thin marks need a casing."""

    def part(self, kind: type[Part]) -> Part | None:
        """Return what a service has found; none where there is nothing yet."""
        part = self.parts.get(kind)
        return part if isinstance(part, kind) else None


def view_of(state: AppState, *parts: object, jobs: tuple[Job, ...] = (), waiting: tuple[Job, ...] = ()) -> PageView:
    """Return a view with these parts, each found by its type.

    Parameters
    ----------
    state : the page's own.
    parts : what services have found.
    jobs, waiting : background work under way, and what has not begun.
    """
    return PageView(state=state, jobs=jobs, waiting=waiting, parts={type(part): part for part in parts})

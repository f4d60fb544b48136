"""What a change of routes and stations adds, changes and removes: the preview of an import. No files here."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Generic, Protocol, TypeVar

import numpy as np

from commission.site.fields import in_file
from commission.site.routes import Route, Segment
from commission.site.stations import Station

SAMPLES = 64
"""Points of a curve that are compared: a spline of a few control points hides nothing between them."""


class _Named(Protocol):
    @property
    def name(self) -> str: ...


T = TypeVar("T", bound=_Named)


@dataclass(frozen=True, slots=True)
class Change(Generic[T]):
    """One thing that is there before and after, and differs."""

    before: T
    """As it is now."""
    after: T
    """As it would be."""


@dataclass(frozen=True, slots=True)
class NamedDiff(Generic[T]):
    """Difference between two lists of things that are told apart by their names."""

    added: tuple[T, ...] = ()
    """Those that are only in the later list."""
    changed: tuple[Change[T], ...] = ()
    """Those that are in both and differ."""
    removed: tuple[T, ...] = ()
    """Those that are only in the earlier list."""
    unchanged: int = 0
    """Number of those that are the same in both."""

    def __bool__(self) -> bool:
        """Whether there is any difference."""
        return bool(self.added or self.changed or self.removed)


def difference(before: tuple[T, ...], after: tuple[T, ...]) -> NamedDiff[T]:
    """Compare two lists of routes or of stations, by name.

    Returns
    -------
    difference : added and changed in the order of `after`, removed in the order of `before`.
    """
    old = {value.name: value for value in before}
    new = {value.name for value in after}
    # Compared as files have them: what was exported and comes back is no change.
    changed = tuple(Change(old[v.name], v) for v in after if v.name in old and in_file(old[v.name]) != in_file(v))
    return NamedDiff(
        added=tuple(value for value in after if value.name not in old),
        changed=changed,
        removed=tuple(value for value in before if value.name not in new),
        unchanged=sum(value.name in old for value in after) - len(changed),
    )


def merged(before: tuple[T, ...], diff: NamedDiff[T], *, remove: bool) -> tuple[T, ...]:
    """Apply a difference to the list from which it starts, keeping its order; what is added comes last.

    Parameters
    ----------
    before : the earlier list of `diff`.
    diff : what to add, change and remove.
    remove : whether those that are absent from the later list go, or stay.
    """
    gone = {value.name for value in diff.removed} if remove else set[str]()
    changes = {change.before.name: change.after for change in diff.changed}
    kept = tuple(changes.get(value.name, value) for value in before if value.name not in gone)
    return (*kept, *diff.added)


def with_required_accuracy(before: tuple[Station, ...], after: tuple[Station, ...]) -> tuple[Station, ...]:
    """Return the later stations with the required accuracy of earlier ones of their names: no format carries it."""
    accuracy = {station.name: station.required_accuracy for station in before}
    return tuple(replace(s, required_accuracy=accuracy.get(s.name, s.required_accuracy)) for s in after)


def length_of(route: Route) -> float:
    """Return the length of a route [m]."""
    return sum(segment.spline().length for segment in route.segments)


def course_shift(before: Segment, after: Segment) -> float:
    """Return the largest distance between places at equal shares of the lengths of two curves [m]."""
    old, new = before.spline(), after.spline()
    if old == new:
        return 0.0
    shares = np.linspace(0.0, 1.0, SAMPLES)
    gaps = old.point(old.u_at(old.length * shares)) - new.point(new.u_at(new.length * shares))
    return float(np.max(np.hypot(gaps[:, 0], gaps[:, 1])))

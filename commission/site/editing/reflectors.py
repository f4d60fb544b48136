"""Edits of the reflector map: add, move, turn, mirror, repeat, set, lock, delete.

A locked reflector stays as it is and where it is; `locked_among` tells the engineer which ones did. Every function
returns a new map with the order kept and what is new at its end; an id that the map does not have is a UsageError.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from commission.errors import UsageError
from commission.geometry.angles import wrap_scalar
from commission.geometry.arrays import FloatArray
from commission.site.editing.names import fresh_names
from commission.site.fields import with_field
from commission.site.reflectors import Reflector, ReflectorKind, ReflectorMap

MOST_COPIES = 10_000
"""Reflectors that one edit may add; more is a slip of the finger."""


@dataclass(frozen=True, slots=True)
class Added:
    """A map to which reflectors were added."""

    reflectors: ReflectorMap
    """All reflectors."""
    ids: tuple[str, ...]
    """Ids of the new ones, in order: what to select now."""


@dataclass(frozen=True, slots=True)
class Axis:
    """A straight line on the floor."""

    x: float
    """A point of it, x in the map frame [m]."""
    y: float
    """A point of it, y in the map frame [m]."""
    angle: float
    """Its direction, map frame [rad]."""

    @staticmethod
    def through(first: ArrayLike, second: ArrayLike) -> Axis:
        """Line through two points (2,) [m]; raises ValueError when they coincide."""
        (x0, y0), (x1, y1) = np.asarray(first, dtype=np.float64), np.asarray(second, dtype=np.float64)
        if math.hypot(x1 - x0, y1 - y0) == 0.0:
            raise ValueError("the two points of the axis coincide; expected two different points")
        return Axis(float(x0), float(y0), math.atan2(y1 - y0, x1 - x0))


def add(reflectors: ReflectorMap, points: ArrayLike, like: Reflector) -> Added:
    """Place reflectors.

    Parameters
    ----------
    reflectors : those there are.
    points : (N, 2) array [m], map frame: centers of the new ones.
    like : kind, radius, heading and the rest of each new one; ids continue the numbering of its id.
    """
    xy = np.asarray(points, dtype=np.float64).reshape(-1, 2)
    return _append(reflectors, [replace(like, x=float(x), y=float(y), locked=False) for x, y in xy], like.id)


def delete(reflectors: ReflectorMap, ids: Collection[str]) -> ReflectorMap:
    """Remove the selected reflectors that are not locked."""
    chosen = _known(reflectors, ids)
    return ReflectorMap(tuple(r for r in reflectors.reflectors if r.id not in chosen or r.locked))


def move(reflectors: ReflectorMap, ids: Collection[str], offset: tuple[float, float]) -> ReflectorMap:
    """Shift the selection.

    Parameters
    ----------
    reflectors : those there are.
    ids : the selection.
    offset : [m, m], map frame.
    """
    dx, dy = offset
    return _change(reflectors, ids, lambda r: replace(r, x=r.x + dx, y=r.y + dy))


def place(reflectors: ReflectorMap, positions: Mapping[str, tuple[float, float]]) -> ReflectorMap:
    """Put reflectors, by their ids, at new centers [m, m], map frame."""
    return _change(reflectors, positions, lambda r: replace(r, x=positions[r.id][0], y=positions[r.id][1]))


def turn(reflectors: ReflectorMap, ids: Collection[str], pivot: tuple[float, float], angle: float) -> ReflectorMap:
    """Turn the selection, flat plates' headings included, around a point.

    Parameters
    ----------
    reflectors : those there are.
    ids : the selection.
    pivot : what it turns around [m, m], map frame.
    angle : counterclockwise [rad].
    """
    c, s = math.cos(angle), math.sin(angle)

    def turned(r: Reflector) -> Reflector:
        dx, dy = r.x - pivot[0], r.y - pivot[1]
        turned_to = replace(r, x=pivot[0] + c * dx - s * dy, y=pivot[1] + s * dx + c * dy)
        return _facing(turned_to, None if r.heading is None else r.heading + angle)

    return _change(reflectors, ids, turned)


def mirror(reflectors: ReflectorMap, ids: Collection[str], axis: Axis) -> ReflectorMap:
    """Mirror the selection about an axis, flat plates' headings included; twice gives back what was.

    Parameters
    ----------
    reflectors : those there are.
    ids : the selection.
    axis : a line on the floor.
    """
    return _change(reflectors, ids, lambda r: _mirrored(r, axis))


def duplicate(reflectors: ReflectorMap, ids: Collection[str], offset: tuple[float, float]) -> Added:
    """Copy the selection, locked ones too, shifted; the copies have fresh ids and are not locked.

    Parameters
    ----------
    reflectors : those there are.
    ids : the selection.
    offset : of the copies [m, m], map frame.
    """
    return repeat(reflectors, ids, offset, 1)


def duplicate_mirrored(reflectors: ReflectorMap, ids: Collection[str], axis: Axis) -> Added:
    """Copy the selection, locked ones too, to the other side of an axis.

    Parameters
    ----------
    reflectors : those there are.
    ids : the selection.
    axis : a line on the floor.
    """
    originals = _selected(reflectors, ids)
    return _append_copies(reflectors, [(r, _mirrored(r, axis)) for r in originals])


def repeat(reflectors: ReflectorMap, ids: Collection[str], step: tuple[float, float], count: int) -> Added:
    """Copy the selection several times, each copy a step from the one before: an array along a line.

    Parameters
    ----------
    reflectors : those there are.
    ids : the selection.
    step : from each copy to the next [m, m], map frame.
    count : copies of each, 0 or more.

    Raises
    ------
    UsageError
        a negative count, or more than MOST_COPIES copies in total.
    """
    originals = _selected(reflectors, ids)
    if count < 0 or count * len(originals) > MOST_COPIES:
        raise UsageError(f"{count} x {len(originals)} copies; expected 0 to {MOST_COPIES}")
    dx, dy = step
    copies = [(r, replace(r, x=r.x + k * dx, y=r.y + k * dy)) for k in range(1, count + 1) for r in originals]
    return _append_copies(reflectors, copies)


def row(start: tuple[float, float], end: tuple[float, float], spacing: float) -> FloatArray:
    """Points on a line from start to end, both included when the length is a multiple of the spacing.

    Parameters
    ----------
    start, end : [m, m], map frame.
    spacing : distance between neighbors [m].

    Returns
    -------
    points : (N, 2) array [m] for `add`; the start alone when the line has no length.
    """
    length = math.hypot(end[0] - start[0], end[1] - start[1])
    if not spacing > 0.0 or length / spacing > MOST_COPIES:
        raise UsageError(
            f"spacing is {spacing:g} m on {length:g} m; expected more than 0 m, at most {MOST_COPIES} points"
        )
    # A length of 3 x 0.1 m must not lose its last point to rounding.
    along = np.arange(math.floor(length / spacing + 1e-9) + 1) * spacing
    share = (along / length if length > 0.0 else along)[:, np.newaxis]
    return np.asarray(start) + share * (np.asarray(end, dtype=np.float64) - np.asarray(start))


def set_value(reflectors: ReflectorMap, ids: Collection[str], name: str, value: object) -> ReflectorMap:
    """Set one field of the selection, as typed into a table.

    Parameters
    ----------
    reflectors : those there are.
    ids : the selection; exactly one when `id` is set.
    name : of a field of `Reflector`; `set_locked` is for `locked`.
    value : its new content, SI and radians.

    Raises
    ------
    UsageError
        a field does not exist.
    ProjectError
        the new id is in use.
    ValueError
        a value is out of its range.
    """
    if name == "locked":
        raise UsageError("reflectors are locked together with those that are locked already; expected another field")
    if name == "id" and len(ids) != 1:
        raise UsageError(f"{len(ids)} reflectors would be called {value!r}; expected one to be renamed")
    return _change(reflectors, ids, lambda r: with_field(r, name, value, "field of a reflector"))


def set_locked(reflectors: ReflectorMap, ids: Collection[str], locked: bool) -> ReflectorMap:
    """Lock or unlock the selection.

    Parameters
    ----------
    reflectors : those there are.
    ids : the selection.
    locked : whether edits leave them alone.
    """
    chosen = _known(reflectors, ids)
    return ReflectorMap(tuple(replace(r, locked=locked) if r.id in chosen else r for r in reflectors.reflectors))


def locked_among(reflectors: ReflectorMap, ids: Collection[str]) -> tuple[str, ...]:
    """Ids of the selection that an edit leaves alone because they are locked."""
    return tuple(r.id for r in _selected(reflectors, ids) if r.locked)


def _mirrored(reflector: Reflector, axis: Axis) -> Reflector:
    """Mirror image; its id and the rest are kept."""
    c, s = math.cos(2.0 * axis.angle), math.sin(2.0 * axis.angle)
    dx, dy = reflector.x - axis.x, reflector.y - axis.y
    image = replace(reflector, x=axis.x + c * dx + s * dy, y=axis.y + s * dx - c * dy)
    return _facing(image, None if reflector.heading is None else 2.0 * axis.angle - reflector.heading)


def _facing(reflector: Reflector, heading: float | None) -> Reflector:
    """Turn a flat plate of known direction; a cylinder keeps its value, so that its row of the table stays short."""
    if heading is None or reflector.kind is not ReflectorKind.FLAT:
        return reflector
    return replace(reflector, heading=wrap_scalar(heading))


def _known(reflectors: ReflectorMap, ids: Collection[str]) -> frozenset[str]:
    """The selection as a set, or a UsageError that names what is not in the map."""
    chosen = frozenset(ids)
    unknown = chosen - {r.id for r in reflectors.reflectors}
    if unknown:
        raise UsageError(f"no reflector is called {min(unknown)!r}; expected an id of the reflector map")
    return chosen


def _selected(reflectors: ReflectorMap, ids: Collection[str]) -> list[Reflector]:
    """The selected reflectors in the order of the map."""
    chosen = _known(reflectors, ids)
    return [r for r in reflectors.reflectors if r.id in chosen]


def _change(reflectors: ReflectorMap, ids: Collection[str], change: Callable[[Reflector], Reflector]) -> ReflectorMap:
    """Replace each selected reflector that is not locked."""
    chosen = _known(reflectors, ids)
    return ReflectorMap(tuple(change(r) if r.id in chosen and not r.locked else r for r in reflectors.reflectors))


def _append(reflectors: ReflectorMap, new: list[Reflector], like: str) -> Added:
    """Give fresh ids to new reflectors and add them."""
    if len(new) > MOST_COPIES:
        raise UsageError(f"{len(new)} reflectors at once; expected at most {MOST_COPIES}")
    ids = fresh_names((r.id for r in reflectors.reflectors), len(new), like)
    named = (replace(r, id=name) for r, name in zip(new, ids, strict=True))
    return Added(ReflectorMap((*reflectors.reflectors, *named)), ids)


def _append_copies(reflectors: ReflectorMap, copies: list[tuple[Reflector, Reflector]]) -> Added:
    """Add copies, each numbered on from the id of its original; they are not locked."""
    taken = {r.id for r in reflectors.reflectors}
    stems: dict[str, list[int]] = {}
    for index, (original, _) in enumerate(copies):
        stems.setdefault(original.id.rstrip("0123456789"), []).append(index)
    ids = [""] * len(copies)
    for indices in stems.values():
        for index, name in zip(indices, fresh_names(taken, len(indices), copies[indices[0]][0].id), strict=True):
            ids[index] = name
            taken.add(name)
    new = (replace(copy, id=name, locked=False) for (_, copy), name in zip(copies, ids, strict=True))
    return Added(ReflectorMap((*reflectors.reflectors, *new)), tuple(ids))

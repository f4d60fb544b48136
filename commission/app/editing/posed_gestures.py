"""What a click or a drag hits of marks that have a place and look somewhere: stations and tags. Pure."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Protocol

import numpy as np

from commission.app.base.extent import extent_of
from commission.app.editing.editor import Grab, Point
from commission.site.project import Project

TIP_MARKS = 9.0
"""Distance from a mark to the tip that turns it, in sizes of a mark."""


class Posed(Protocol):
    """Something with a place and a heading."""

    @property
    def x(self) -> float:
        """Of its place [m], map frame."""
        ...

    @property
    def y(self) -> float:
        """Of its place [m], map frame."""
        ...

    @property
    def heading(self) -> float:
        """Where it looks, map frame [rad]."""
        ...


def nearest_posed(items: Sequence[Posed], place: Point, reach: float) -> int | None:
    """Return which one is nearest to a place; none when none is within reach.

    Parameters
    ----------
    items : stations or tags.
    place : point [m], map frame.
    reach : largest distance [m].
    """
    if not items:
        return None
    gaps = [math.dist(place, (item.x, item.y)) for item in items]
    nearest = int(np.argmin(gaps))
    return nearest if gaps[nearest] <= reach else None


def heading_tip(project: Project, item: Posed) -> Point:
    """Return the place by which a station or a tag is turned [m]."""
    reach = TIP_MARKS * extent_of(project).mark_size()
    return item.x + reach * math.cos(item.heading), item.y + reach * math.sin(item.heading)


def grabbed_of(project: Project, item: Posed | None, start: Point, reach: float) -> Grab | None:
    """Return what a drag takes hold of at what is selected: the mark or its tip; none when neither.

    Parameters
    ----------
    project : its extent says how far away the tip is.
    item : what is selected; None: nothing.
    start : where the drag begins [m], map frame.
    reach : how far a click reaches [m].
    """
    if item is None:
        return None
    if math.dist(start, heading_tip(project, item)) <= reach:
        return Grab.HEADING
    return Grab.POSED if math.dist(start, (item.x, item.y)) <= reach else None


def turned_to(item: Posed, place: Point) -> float:
    """Return the heading with which it looks at a place [rad]."""
    return math.atan2(place[1] - item.y, place[0] - item.x)

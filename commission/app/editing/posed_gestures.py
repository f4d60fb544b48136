"""What a click or a drag hits of marks that have a place and look somewhere: stations and tags. Pure."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from commission.app.base.extent import extent_of
from commission.app.editing.editor import Editor, Grab, Point, PosedKey
from commission.app.editing.posed_kinds import KINDS, PosedMark, mark_of
from commission.site.project import Project

TIP_MARKS = 9.0
"""Distance from a mark to the tip that turns it, in sizes of a mark."""


def nearest_posed(items: Sequence[PosedMark], place: Point, reach: float) -> int | None:
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


def heading_tip(project: Project, item: PosedMark) -> Point:
    """Return the place by which a station or a tag is turned [m]."""
    reach = TIP_MARKS * extent_of(project).mark_size()
    return item.x + reach * math.cos(item.heading), item.y + reach * math.sin(item.heading)


def grabbed_of(project: Project, item: PosedMark | None, start: Point, reach: float) -> Grab | None:
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


def turned_to(item: PosedMark, place: Point) -> float:
    """Return the heading with which it looks at a place [rad]."""
    return math.atan2(place[1] - item.y, place[0] - item.x)


def posed_at(project: Project, place: Point, reach: float) -> PosedKey | None:
    """Return the station, or else the tag, that is nearest to a place; None where none is within reach.

    Parameters
    ----------
    project : has them.
    place : point [m], map frame.
    reach : largest distance [m].
    """
    for kind, posed in KINDS.items():
        marks = posed.all_of(project)
        nearest = nearest_posed(marks, place, reach)
        if nearest is not None:
            return PosedKey(kind, posed.named.key_of(marks[nearest]))
    return None


def moved_posed(project: Project, editor: Editor) -> PosedMark | None:
    """Return the selected station or tag as the drag under way would leave it: a route attracts a station."""
    mark, drag = mark_of(project, editor.posed), editor.drag
    if editor.posed is None or mark is None or drag is None:
        return mark
    if drag.grab is Grab.HEADING:
        return replace(mark, heading=turned_to(mark, drag.now))
    if drag.grab is not Grab.POSED:
        return mark
    dropped = replace(mark, x=drag.now[0], y=drag.now[1])
    attracted: PosedMark = KINDS[editor.posed.kind].moved(project, dropped, editor.reach)
    return attracted

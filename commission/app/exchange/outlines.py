"""Where an import would put things: places and lines that its browser draws on the floor before anything changes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from commission.app.editing.route_gestures import curve
from commission.app.exchange.pending import Pending
from commission.geometry.arrays import FloatArray
from commission.site.project import Project

MOST = 2000
"""Reflectors, and routes, that are drawn: more would only be a blot."""


@dataclass(frozen=True, slots=True, eq=False)
class Outlines:
    """What is drawn of an import."""

    centers: FloatArray
    """(N, 2) places of reflectors that are added or moved, and of stations that are added [m], map frame."""
    lines: tuple[FloatArray, ...]
    """(M, 2) points [m] each: from the place of a moved reflector to its new one, and along new courses of routes."""


NOTHING = Outlines(np.empty((0, 2)), ())


def outlines_of(project: Project, pending: Pending | None) -> Outlines:
    """Return what is drawn of an import that waits; nothing when there is none."""
    if pending is None:
        return NOTHING
    found = pending.preview(project)
    places: list[tuple[float, float]] = []
    lines: list[FloatArray] = []
    if found.reflectors is not None:
        moved = [change for change in found.reflectors.changed if change.moved > 0.0][:MOST]
        places += [(r.x, r.y) for r in (*found.reflectors.added[:MOST], *(change.after for change in moved))]
        lines += [np.array([(c.before.x, c.before.y), (c.after.x, c.after.y)]) for c in moved]
    if found.routes is not None:
        courses = (*found.routes.added, *(change.after for change in found.routes.changed))
        lines += [curve(segment) for route in courses[:MOST] for segment in route.segments]
    if found.stations is not None:
        places += [(station.x, station.y) for station in found.stations.added[:MOST]]
    return Outlines(np.array(places, dtype=np.float64).reshape(-1, 2), tuple(lines))

"""Reflectors that a vehicle should see from somewhere and does not: what speaks against a hypothesis of its pose."""

from __future__ import annotations

import math
from typing import NamedTuple

from commission.compiled import compiled, compiled_inline
from commission.geometry.arrays import FloatArray, IntArray
from commission.geometry.ray_kernels import RayTables, is_line_free
from commission.localization.beam_ends import HIDDEN, THROUGH, Ends, what_beams_say
from commission.localization.wall_evidence import NO_BEAMS

SEEN = 0.8
"""Probability that a reflector in free sight is detected again and again: people stand before some, some are down."""
THROUGH_SEEN = 0.95
"""The same where beams went through its place: nobody stands before it. It may have been taken away."""
BEHIND_SEEN = 0.5
"""The same where beams end before it and the map has no wall there: somebody is there, or the pose is wrong."""


@compiled_inline
def is_taken(entry: int, taken: IntArray, count: int) -> bool:
    """Whether one of the first things is that reflector already.

    Parameters
    ----------
    entry : row of `ReflectorIndex.places`.
    taken : (C,) such a row for each thing; -1: none.
    count : things that are asked.

    Notes
    -----
    No formula: it looks through a list.
    """
    found = False
    for i in range(count):
        found = found or taken[i] == entry
    return found


class Sights(NamedTuple):
    """Views from which reflectors should have been seen, and what is known of what hides them; for kernels."""

    views: FloatArray
    """(V, 5) scanners in the frame of odometry [m, m, rad], index of the scanner, weight of the view."""
    ends: Ends
    """(V, BINS) where the beams of each view end, see `beam_ends`."""
    eyes: FloatArray
    """(E, 5) scanner, first bearing and width of a stretch of its field of view [rad], smallest and largest range
    of a reflector [m]."""
    walls: RayTables
    """Of the floor map."""
    walled: bool
    """Whether there is one."""
    facings: FloatArray
    """(N,) direction that a flat reflector faces [rad]; NaN: seen from all sides."""
    beams: FloatArray = NO_BEAMS
    """(B, 4) whose ends are compared with the walls, see `wall_beams`; none without a floor map."""


@compiled
def log_missed(  # noqa: PLR0917 - a pose, number by number
    x: float, y: float, t: float, taken: IntArray, sights: Sights, places: FloatArray, least: float
) -> float:
    """Log of the probability that the reflectors which no thing is were not seen from anywhere; not below `least` much.

    Parameters
    ----------
    x, y, t : frame of odometry in the map [m, m, rad].
    taken : (C,) row of `places` that each thing is; -1: none.
    sights : views, and what hides reflectors from them.
    places : the map, see `ReflectorIndex`.
    least : it is not summed up further where it is below that already.

    Notes
    -----
    sum over reflectors of sum(w log P) / max(1, sum w) over the views that should see it, w their weights, P by what
    walls and beams say of it: a mean, by definition.
    """
    c, s = math.cos(t), math.sin(t)
    views = sights.views
    total, farthest = 0.0, 0.0
    for e in range(len(sights.eyes)):
        farthest = max(farthest, sights.eyes[e, 4] ** 2)
    for entry in range(len(places)):
        if total < least:
            break
        if is_taken(entry, taken, len(taken)):
            continue
        share, logs = 0.0, 0.0
        for v in range(len(views)):
            vx, vy = x + c * views[v, 0] - s * views[v, 1], y + s * views[v, 0] + c * views[v, 1]
            dx, dy, log_unseen = places[entry, 0] - vx, places[entry, 1] - vy, 0.0
            # Most are out of range: no function is called for them, which counts references of every array.
            if dx * dx + dy * dy <= farthest:
                log_unseen = _log_unseen(v, vx, vy, t + views[v, 2], entry, sights, places)
            if log_unseen < 0.0:
                share += views[v, 4]
                logs += views[v, 4] * log_unseen
        total += logs / max(share, 1.0)
    return total


@compiled_inline
def _log_unseen(  # noqa: PLR0917 - a view, number by number
    view: int, vx: float, vy: float, heading: float, entry: int, sights: Sights, places: FloatArray
) -> float:
    """Log of the probability that a scanner at (vx, vy) does not see a reflector; 0 where it cannot.

    Notes
    -----
    log(1 - P): P = SEEN, THROUGH_SEEN where the beams went through its place, BEHIND_SEEN where they end before it
    although no wall of the map is there; by definition.
    """
    dx, dy = places[entry, 0] - vx, places[entry, 1] - vy
    square = dx * dx + dy * dy
    facing = sights.facings[entry]
    if not math.isnan(facing) and -dx * math.cos(facing) - dy * math.sin(facing) < 0.3 * math.sqrt(square):
        return 0.0
    if not _is_in_view(dx, dy, square, heading, int(sights.views[view, 3]), sights.eyes):
        return 0.0
    distance = math.sqrt(square)
    said = what_beams_say(view, distance, math.atan2(dy, dx) - heading, sights.ends)
    if said == HIDDEN and not sights.walled:
        return 0.0
    if sights.walled and said != THROUGH:
        # Up to just before the reflector: it may stand at a wall.
        part = max(distance - 0.3, 0.0) / distance
        if not is_line_free(sights.walls, vx, vy, vx + part * dx, vy + part * dy):
            return 0.0
    seen = THROUGH_SEEN if said == THROUGH else BEHIND_SEEN if said == HIDDEN else SEEN
    return math.log(1.0 - seen)


@compiled_inline
def _is_in_view(dx: float, dy: float, square: float, heading: float, scanner: int, eyes: FloatArray) -> bool:  # noqa: PLR0917
    """Whether a scanner of some heading looks where a reflector is that lies (dx, dy) from it.

    Notes
    -----
    Range and bearing between their limits, by definition.
    """
    seen = False
    for e in range(len(eyes)):
        if int(eyes[e, 0]) != scanner or square > eyes[e, 4] ** 2 or square < eyes[e, 3] ** 2:
            continue
        bearing = math.atan2(dy, dx) - heading - eyes[e, 1]
        bearing -= 2.0 * math.pi * math.floor(bearing / (2.0 * math.pi))
        seen = seen or bearing <= eyes[e, 2]
    return seen

"""Scans of the way that a vehicle has gone since it is looked for: what they saw, in the frame of odometry, one by one.

`sightings` joins what is seen to things; where too little is seen at once for that, the scans themselves are kept.
"""

from __future__ import annotations

import math

import numpy as np

from commission.compiled import compiled, compiled_inline
from commission.geometry.angles import wrap_scalar
from commission.geometry.arrays import FloatArray, read_only
from commission.localization.observation import observation_at
from commission.localization.sightings import INFLATION, noise_on_floor
from commission.localization.start import MOST_SCORED
from commission.localization.trail_fit import INDEPENDENT_M, INDEPENDENT_RAD, Trail

MOST_SEEN = 300
"""Detections that are kept at most, the newest: a minute of a camera, some seconds of a scanner that sees ten."""
LONGEST_WAY = 150.0
"""Nor is what was seen longer ago than on so much of the way, see `way_between`: 15 m straight on."""
SPREAD = 0.5
"""Variance of the place of a thing, both axes together, from which on it suggests no pose [m^2]."""
ONE_PLACE = 0.4
"""Things nearer than that [m] in the frame of odometry suggest the same."""


def no_trail() -> Trail:
    """Return a trail without scans."""
    return Trail(read_only(np.empty((0, 8))), read_only(np.empty((0, 2))))


@compiled
def way_between(before: FloatArray, after: FloatArray) -> float:
    """How much new a scan tells: one for each `INDEPENDENT_M` driven and each `INDEPENDENT_RAD` turned.

    Parameters
    ----------
    before, after : (8,) rows of `Trail.scans`.

    Notes
    -----
    way = distance / `INDEPENDENT_M` + |turn| / `INDEPENDENT_RAD`, by definition.
    """
    driven = math.hypot(after[1] - before[1], after[2] - before[2])
    return driven / INDEPENDENT_M + abs(wrap_scalar(after[3] - before[3])) / INDEPENDENT_RAD


def lengthened(trail: Trail, scan: FloatArray, detections: FloatArray) -> Trail:
    """Append a scan, and drop the oldest ones where there are too many.

    Parameters
    ----------
    trail : before.
    scan : (8,) row of `Trail.scans`; the last number is not read.
    detections : (n, 2) range [m] and bearing [rad], those that may be reflectors.
    """
    if len(detections) == 0:
        return trail
    scans, seen = trail.scans, np.concatenate((trail.seen, detections))
    newest = scan.copy()
    newest[7] = len(seen)
    scans = np.concatenate((scans, newest[np.newaxis]))
    first = _first_kept(scans)
    begin = int(scans[first - 1, 7]) if first else 0
    scans = scans[first:].copy()
    scans[:, 7] -= begin
    return Trail(read_only(scans), read_only(seen[begin:].copy()))


@compiled
def _first_kept(scans: FloatArray) -> int:
    """Oldest scan of the newest ones that are kept.

    Notes
    -----
    No formula: it goes back from the newest one, as far as `MOST_SEEN` and `LONGEST_WAY` allow.
    """
    first, to_come = len(scans) - 1, 0.0
    while first > 0:
        to_come += way_between(scans[first - 1], scans[first])
        if not (scans[first - 1, 7] > scans[-1, 7] - MOST_SEEN and to_come < LONGEST_WAY):
            break
        first -= 1
    return first


def newest_things(trail: Trail, models: FloatArray) -> FloatArray:
    """(C, 5) x, y [m] and covariance [m^2] of what was seen last, as of now; two of one place at most.

    Parameters
    ----------
    trail : see `Trail`.
    models : (S, 6) see `observation_rows`.
    """
    things = np.empty((MOST_SCORED, 5))
    return read_only(things[: _newest(trail, models, things)])


@compiled
def _newest(trail: Trail, models: FloatArray, things: FloatArray) -> int:
    """Write the things of `newest_things`; return their number.

    Notes
    -----
    P = P_detection + drift of odometry since then at its distance: as in `sightings`.
    """
    now, count = trail.scans[-1], 0
    for k in range(len(trail.scans) - 1, -1, -1):
        scan = trail.scans[k]
        model = observation_at(models, int(scan[6]))
        theta = scan[3]
        c, s = math.cos(theta), math.sin(theta)
        x, y = scan[1] + c * model.mount_x - s * model.mount_y, scan[2] + s * model.mount_x + c * model.mount_y
        for i in range(int(trail.scans[k - 1, 7]) if k else 0, int(scan[7])):
            measured, direction = trail.seen[i, 0] - model.range_bias, theta + model.mount_theta + trail.seen[i, 1]
            px, py = x + measured * math.cos(direction), y + measured * math.sin(direction)
            across = INFLATION * model.bearing_variance * measured * measured
            xx, xy, yy = noise_on_floor(INFLATION * model.range_variance, across, direction)
            away2 = (px - now[1]) ** 2 + (py - now[2]) ** 2
            drifted = now[4] - scan[4] + (now[5] - scan[5]) * away2 + 1e-4
            if xx + yy + 2.0 * drifted >= SPREAD or _near(things, count, px, py) >= 2:
                continue
            things[count, 0], things[count, 1] = px, py
            things[count, 2], things[count, 3], things[count, 4] = xx + drifted, xy, yy + drifted
            count += 1
            if count == len(things):
                return count
        if now[4] - scan[4] > SPREAD:
            break
    return count


@compiled_inline
def _near(things: FloatArray, count: int, x: float, y: float) -> int:
    """How many of the first things lie nearer than `ONE_PLACE` to a place.

    Notes
    -----
    No formula: it counts.
    """
    near = 0
    for i in range(count):
        if math.hypot(x - things[i, 0], y - things[i, 1]) < ONE_PLACE:
            near += 1
    return near

"""Scans of the way that a vehicle has gone since it is looked for: what they saw, in the frame of odometry, one by one.

`sightings` joins what is seen to things; where too little is seen at once for that, the scans themselves are kept.
"""

from __future__ import annotations

import itertools
import math

import numpy as np

from commission.geometry.arrays import FloatArray, read_only
from commission.localization.observation import ObservationModel
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


def way_between(before: FloatArray, after: FloatArray) -> float:
    """How much new a scan tells: one for each `INDEPENDENT_M` driven and each `INDEPENDENT_RAD` turned.

    Parameters
    ----------
    before, after : (8,) rows of `Trail.scans`.
    """
    driven = math.hypot(after[1] - before[1], after[2] - before[2])
    return driven / INDEPENDENT_M + abs(math.remainder(after[3] - before[3], 2.0 * math.pi)) / INDEPENDENT_RAD


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
    ways = [way_between(a, b) for a, b in itertools.pairwise(scans)]
    to_come = np.concatenate((np.cumsum(ways[::-1])[::-1], (0.0,)))
    kept = (scans[:, 7] > len(seen) - MOST_SEEN) & (to_come < LONGEST_WAY)
    first = int(np.argmax(kept))
    begin = int(scans[first - 1, 7]) if first else 0
    scans = scans[first:].copy()
    scans[:, 7] -= begin
    return Trail(read_only(scans), read_only(seen[begin:].copy()))


def newest_things(trail: Trail, models: FloatArray) -> FloatArray:
    """(C, 5) x, y [m] and covariance [m^2] of what was seen last, as of now; two of one place at most.

    Parameters
    ----------
    trail : see `Trail`.
    models : (S, 6) see `observation_rows`.
    """
    things: list[tuple[float, ...]] = []
    now = trail.scans[-1]
    for k in range(len(trail.scans) - 1, -1, -1):
        scan, model = trail.scans[k], ObservationModel(*models[int(trail.scans[k, 6])].tolist())
        x, y, theta = scan[1:4].tolist()
        c, s = math.cos(theta), math.sin(theta)
        x, y = x + c * model.mount_x - s * model.mount_y, y + s * model.mount_x + c * model.mount_y
        for distance, bearing in trail.seen[int(trail.scans[k - 1, 7]) if k else 0 : int(scan[7])].tolist():
            measured, direction = distance - model.range_bias, theta + model.mount_theta + bearing
            px, py = x + measured * math.cos(direction), y + measured * math.sin(direction)
            across = INFLATION * model.bearing_variance * measured * measured
            xx, xy, yy = noise_on_floor(INFLATION * model.range_variance, across, direction)
            away2 = (px - now[1]) ** 2 + (py - now[2]) ** 2
            drifted = float(now[4] - scan[4] + (now[5] - scan[5]) * away2) + 1e-4
            near = sum(math.hypot(px - each[0], py - each[1]) < ONE_PLACE for each in things)
            if near < 2 and xx + yy + 2.0 * drifted < SPREAD:
                things.append((px, py, xx + drifted, xy, yy + drifted))
                if len(things) == MOST_SCORED:
                    return read_only(np.array(things))
        if now[4] - scan[4] > SPREAD:
            break
    return read_only(np.array(things, dtype=np.float64).reshape(-1, 5))

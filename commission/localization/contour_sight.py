"""Whether a scan could have been taken from where the vehicle believes to be: no beam goes through a wall.

People and things that the map lacks end beams early and say nothing of the pose. A beam that is longer than the way to
the next wall of the map says that the vehicle is elsewhere, or the wall.
"""

from __future__ import annotations

import math

from commission.compiled import compiled
from commission.geometry.arrays import FloatArray
from commission.localization.contour_match import GridPose
from commission.localization.contour_tables import ContourTables, read_distance

MOST_BEAMS = 90
"""Beams that are looked along, evenly over the scan."""
BEHIND_M = 0.5
"""A beam that ends this far behind a wall has gone through it [m]: less may be the error of an honest pose."""
LEAST_STEP = 0.5
"""Way that is gone on at least [cells]."""


@compiled
def share_through_walls(pose: GridPose, points: FloatArray, x: float, y: float, tables: ContourTables) -> float:
    """Share of the beams that would have gone through a wall of the map [0..1].

    Parameters
    ----------
    pose : of base [cells, rad].
    points : (n, 2) points of the scan [cells], base frame; one at least.
    x, y : the scanner in base [cells].
    tables : of the map.

    Notes
    -----
    s <- s + d(p + s u) along each beam from the scanner p towards u, d the distance from the nearest contour, until
    d <= 0 (sphere tracing, Hart 1996): through a wall where that is `BEHIND_M` before the point. What lies outside of
    the table is no wall.
    """
    c, s = math.cos(pose.theta), math.sin(pose.theta)
    u, v = pose.u + c * x - s * y, pose.v + s * x + c * y
    every, looked, through = max(len(points) // MOST_BEAMS, 1), 0, 0
    for i in range(0, len(points), every):
        ahead, aside = points[i, 0] - x, points[i, 1] - y
        way = math.hypot(ahead, aside)
        looked += 1
        if way * tables.resolution <= BEHIND_M:
            continue
        along_u, along_v = (c * ahead - s * aside) / way, (s * ahead + c * aside) / way
        gone, last = 0.0, way - BEHIND_M / tables.resolution
        while gone < last:
            distance = read_distance(tables.distances, u + gone * along_u, v + gone * along_v).distance
            if math.isnan(distance):
                break
            if distance <= 0.0:
                through += 1
                break
            gone += max(distance / tables.resolution, LEAST_STEP)
    return through / looked

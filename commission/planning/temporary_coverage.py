"""How many reels a scanner would see as temporary landmarks from every point of the floor.

They tell nothing of the map: where some are in sight, odometry does not drift. What stands there comes and goes; it is
the reels that the project says stand there when a virtual drive begins.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from commission.geometry.arrays import BoolArray, FloatArray, IntArray, read_only
from commission.planning.coverage import Lattice
from commission.progress import Progress, silent
from commission.site.disturbances import Reel
from commission.site.floor_map import FloorMap
from commission.site.parameters import TemporaryParameters
from commission.site.scanner import Scanner
from commission.site.walls import walls_of

POINTS_AT_ONCE = 4096
"""Points between two words of progress."""


def reels_in_sight(  # noqa: PLR0917 - the site, and what is asked
    reels: Sequence[Reel],
    rule: TemporaryParameters,
    scanners: Sequence[Scanner],
    floor: FloorMap | None,
    lattice: Lattice,
    progress: Progress = silent,
) -> IntArray:
    """(N,) reels that one of the lasers, at a point and looking all round, sees well enough to be a landmark.

    Parameters
    ----------
    reels : of the project; those that appear later are not there.
    rule : what a reel has to show.
    scanners : of the vehicle; those that measure bearings alone see none.
    floor : walls that hide reels, where there is a map.
    lattice : the points [m], map frame.
    progress : told how far it is; may raise to cancel.
    """
    there = [reel for reel in reels if reel.appears == 0.0 and rule.least_radius <= reel.radius <= rule.largest_radius]
    centers = np.array([(reel.x, reel.y) for reel in there]).reshape(-1, 2)
    radii = np.array([reel.radius for reel in there])
    lasers = [scanner for scanner in scanners if not scanner.is_goniometer]
    points, walls = lattice.points(), walls_of(floor)
    found = np.zeros(len(points), dtype=np.int64)
    for first in range(0, len(points), POINTS_AT_ONCE):
        progress(first / len(points), "reels over the floor")
        here = points[first : first + POINTS_AT_ONCE]
        away = centers[np.newaxis] - here[:, np.newaxis]
        distances = np.hypot(away[..., 0], away[..., 1])
        seen = np.zeros(distances.shape, dtype=np.bool_)
        for laser in lasers:
            seen |= _shows_enough(distances, radii, rule, laser)
        seen &= ~_behind_another(away, distances, radii)
        n, t = np.nonzero(seen)
        surface = (1.0 - radii[t] / distances[n, t])[:, np.newaxis]
        seen[n, t] = walls.line_of_sight(here[n], here[n] + surface * away[n, t])
        found[first : first + POINTS_AT_ONCE] = seen.sum(axis=1)
    return read_only(found)


def _shows_enough(distances: FloatArray, radii: FloatArray, rule: TemporaryParameters, laser: Scanner) -> BoolArray:
    """(N, T) whether enough beams meet a reel over enough of its arc.

    Parameters
    ----------
    distances : (N, T) from the scanner to the center of each reel [m].
    radii : (T,) of the reels [m].
    rule : what it has to show.
    laser : its range and the angle between its beams.

    Notes
    -----
    From a distance d a circle of radius r spans 2 asin(r / d), and 2 acos(r / d) of its own arc is in sight.
    """
    ratio = np.divide(radii, distances, out=np.ones_like(distances), where=distances > radii)
    beams = 2.0 * np.arcsin(ratio) / laser.angle_increment
    arc = 2.0 * np.arccos(ratio)
    nearest, farthest = laser.range
    is_near = (distances - radii >= nearest) & (distances - radii <= farthest) & (distances <= rule.reach)
    return is_near & (beams >= rule.fewest_points) & (arc >= rule.least_arc) & (arc <= rule.largest_arc)


def _behind_another(away: FloatArray, distances: FloatArray, radii: FloatArray) -> BoolArray:
    """(N, T) whether the line to a reel's center meets another reel first.

    Parameters
    ----------
    away : (N, T, 2) from each point to each center [m].
    distances : (N, T) their lengths [m].
    radii : (T,) of the reels [m].
    """
    hidden = np.zeros(distances.shape, dtype=np.bool_)
    for other, radius in enumerate(radii.tolist()):
        to = away[:, other : other + 1]
        along = (to * away).sum(axis=-1) / np.maximum(distances, 1e-9)
        aside = np.abs(to[..., 0] * away[..., 1] - to[..., 1] * away[..., 0]) / np.maximum(distances, 1e-9)
        blocks = (aside < radius) & (along > 0.0) & (along < distances - radii)
        blocks[:, other] = False
        hidden |= blocks
    return hidden

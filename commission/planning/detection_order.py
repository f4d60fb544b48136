"""The order in which a prediction takes in the reflectors of a scan: by geometry, not that of their file."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from commission.geometry.arrays import FloatArray, IntArray
from commission.geometry.se2 import compose
from commission.planning.visibility import VisibleReflectors
from commission.site.scanner import Scanner


def farthest_first(
    visible: VisibleReflectors, centers: FloatArray, poses: FloatArray, turns: tuple[Sequence[Scanner], IntArray]
) -> VisibleReflectors:
    """Sort the reflectors that each pose sees by their distance from the scanner, the farthest first.

    Parameters
    ----------
    visible : reflectors seen from each of N poses.
    centers : (M, 2) of all reflectors [m], map frame.
    poses : (N, 3) array `T_map_base` [m, m, rad].
    turns : the scanners, and (N,) which of them looks from each pose.

    Notes
    -----
    A detection that may be missing is mixed by its probability, one after the other. A corrected covariance is concave
    in the one before, so that every order gives at least the mean over all sets of detections (Jensen): by up to 12 %
    at an assumed start, which no order does best for both position and heading, and within 1.5 % while driving. The
    farthest first is nearest to drawn drives in the position.
    """
    scanners, scanner_of = turns
    scan = np.repeat(np.arange(len(poses)), visible.counts())
    mounted = compose(poses, np.array([each.mounting for each in scanners])[scanner_of])
    delta = centers[visible.indices] - mounted[scan, :2]
    distance, direction = np.hypot(delta[:, 0], delta[:, 1]), np.arctan2(delta[:, 1], delta[:, 0])
    # Where two are equally far the direction decides; in the map, since it has no seam at a heading of the vehicle.
    order = np.lexsort((direction, -np.round(distance, 9), scan))
    return VisibleReflectors(visible.offsets, visible.indices[order])

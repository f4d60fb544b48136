"""Reflectors that a pose explains in every single scan, and yet contradicts: what is seen of them lies beside them.

The gate lets pass what noise alone may do once. Noise averages out over the way, a wrong pose does not; nor does a
wrong place in the map, so that of two poses the one that contradicts fewer reflectors is to be believed.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from commission.localization.pose_gaussian import PoseGaussian
from commission.localization.search_map import SearchMap
from commission.localization.trail_fit import GATE, MET, Trail, follow

FEWEST = 1.0
"""Detections, counted by how new each is, from which on the mean of a reflector says something."""


class Contradiction(NamedTuple):
    """What reflectors of the map say of a pose that has met them along a trail."""

    met: int
    """How many of them have been met often enough to tell."""
    contradicted: int
    """How many of those are not where the pose says."""
    misfit: float
    """Variance, each axis, of how far they lie beside their places, beyond what noise explains [m^2]."""


def contradiction(pose: PoseGaussian, trail: Trail, around: SearchMap) -> Contradiction:
    """Lead a pose back along a trail, and compare the mean of what it met with the map.

    Parameters
    ----------
    pose : of base at the newest scan, map frame.
    trail : see `Trail`; at least one scan.
    around : the map.

    Notes
    -----
    m^T (R / n + survey)^-1 m > `GATE`, where m is the mean of n detections less the place of their reflector and R the
    mean of their noise: innovations of a filter that is right are white (Kailath 1968). What moves the pose by less
    than a part of the supervisor's limit is no contradiction.
    """
    met = np.zeros((len(around.reflectors.places), MET))
    longest = max(float(trail.seen[:, 0].max()), 1.0)
    follow(
        pose,
        False,
        trail,
        around.models,
        around.eyes,
        longest,
        around.crowd,
        around.reflectors,
        met,
    )
    survey = around.reflectors.places[met[:, 0] >= FEWEST, 2]
    met = met[met[:, 0] >= FEWEST]
    if not len(met):
        return Contradiction(0, 0, 0.0)
    weight = met[:, 0]
    x, y = met[:, 1] / weight, met[:, 2] / weight
    # The mean of n detections has the n-th part of their mean noise.
    xx, xy, yy = (met[:, k] / weight**2 for k in (3, 4, 5))
    misfit = max(0.5 * float(np.mean(x * x + y * y - xx - yy)), 0.0)
    xx, yy = xx + survey, yy + survey
    d2 = (yy * x * x - 2.0 * xy * x * y + xx * y * y) / (xx * yy - xy * xy)
    beside = (d2 > GATE) & (np.hypot(x, y) > around.harmless)
    return Contradiction(len(met), int(beside.sum()), misfit)

"""Headings of a reference in degrees, told from radians by the way from pose to pose. Arrays in, arrays out.

It is a matter of the reference alone: no estimate is asked.
"""

from __future__ import annotations

import math

import numpy as np

from commission.geometry.angles import wrap
from commission.geometry.arrays import FloatArray, read_only

_AGREES = 0.3
"""Twice the angle between heading and way [rad]: at most this where they agree."""


def are_degrees(poses: FloatArray) -> bool:
    """Whether headings are in degrees: they then agree with the way that is driven, and as radians do not.

    Parameters
    ----------
    poses : (R, 3) array [m, m, rad as it is said], map frame; NaN where unknown. Radians that were never wrapped are
        large, too, so that size alone tells nothing.
    """
    known = poses[np.isfinite(poses).all(axis=1)]
    if len(known) < 2 or np.abs(known[:, 2]).max() <= math.pi + 0.1:
        return False
    steps = np.diff(known[:, :2], axis=0)
    length = np.hypot(steps[:, 0], steps[:, 1])
    moving = length > max(0.25 * float(np.quantile(length, 0.9)), 1e-4)
    if not moving.any():
        return False
    course = np.arctan2(steps[moving, 1], steps[moving, 0])
    as_radians, as_degrees = (
        float(np.median(np.abs(wrap(2.0 * (course - theta)))))  # twice the angle: forward and reverse are alike
        for theta in (known[:-1, 2][moving], np.radians(known[:-1, 2][moving]))
    )
    return as_degrees < _AGREES < as_radians


def in_radians(poses: FloatArray) -> FloatArray:
    """Return reference poses whose headings are radians: (R, 3) array [m, m, rad], the same where they were."""
    return read_only(poses * (1.0, 1.0, math.pi / 180.0)) if are_degrees(poses) else poses

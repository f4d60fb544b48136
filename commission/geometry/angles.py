"""Angles in radians under one convention: wrapped to [-pi, pi).

Differences of angles are taken here and nowhere else; degrees are not known here.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from commission.compiled import compiled
from commission.geometry.arrays import BoolArray, FloatArray

TURN = 2.0 * math.pi


def wrap(angle: ArrayLike) -> FloatArray:
    """Wrap angles to [-pi, pi); one that is inside already is returned to the last bit.

    Parameters
    ----------
    angle : (...) array [rad]; must be finite.

    Returns
    -------
    wrapped : (...) array [rad].
    """
    given = np.asarray(angle, dtype=np.float64)
    inside = (given >= -math.pi) & (given < math.pi)
    if inside.all():
        return given.copy()
    wrapped = given - TURN * np.floor((given + math.pi) / TURN)
    # Rounding can push the result just outside; both ends of the interval are the same angle.
    wrapped = np.where((wrapped < -math.pi) | (wrapped >= math.pi), -math.pi, wrapped)
    return np.where(inside, given, wrapped)


def difference(angle: ArrayLike, reference: ArrayLike) -> FloatArray:
    """Shortest signed turn from `reference` to `angle`.

    Parameters
    ----------
    angle, reference : (...) arrays [rad] that broadcast against each other; must be finite.

    Returns
    -------
    turn : (...) array [rad] in [-pi, pi).
    """
    return wrap(np.subtract(angle, reference))


def within(angles: ArrayLike, sectors: FloatArray) -> BoolArray:
    """Whether angles lie in any of some sectors.

    Parameters
    ----------
    angles : (...) array [rad], of any turn.
    sectors : (B, 2) first angle and width of each, counter-clockwise [rad]; of none, no angle does.

    Returns
    -------
    inside : (...) array.
    """
    offset = np.asarray(angles, dtype=np.float64)[..., np.newaxis] - sectors[:, 0]
    inside: BoolArray = np.any(offset - TURN * np.floor(offset / TURN) <= sectors[:, 1], axis=-1)
    return inside


@compiled
def wrap_scalar(angle: float) -> float:
    """Wrap one angle [rad] to [-pi, pi): the same arithmetic as `wrap`, for kernels.

    Notes
    -----
    a - 2 pi floor((a + pi) / 2 pi), by definition.
    """
    if -math.pi <= angle < math.pi:
        return angle
    wrapped = angle - TURN * math.floor((angle + math.pi) / TURN)
    if wrapped < -math.pi or wrapped >= math.pi:
        return -math.pi
    return wrapped


def warm_up() -> None:
    """Compile the kernel of this module."""
    wrap_scalar(4.0)

"""Directions of the plane as unit vectors, for kernels: turned and compared without arctangent, sine and cosine.

Angles in radians are `angles`, rigid motions `se2`.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from commission.compiled import compiled_inline

SMALL_TURN = 0.01
"""Turns up to this are made by series [rad]."""
SERIES_TURN = 50.0
"""Sines and cosines of angles up to this are made by series [rad]."""
QUARTER_TURN_HIGH = float.fromhex("0x1.921fb544p0")
"""First 33 bits of pi / 2: a few quarters of them are exact."""
QUARTER_TURN_LOW = float.fromhex("0x1.0b4611a626331p-34")
"""The rest of pi / 2."""
S3, S5, S7, S9, S11, S13, S15 = (1.0 / math.factorial(n) for n in range(3, 17, 2))
C4, C6, C8, C10, C12, C14, C16 = (1.0 / math.factorial(n) for n in range(4, 18, 2))


class UnitVector(NamedTuple):
    """A direction as a unit vector: its cosine and sine."""

    cos: float
    sin: float


@compiled_inline
def direction_of(angle: float) -> UnitVector:
    """Unit vector of an angle [rad].

    Notes
    -----
    (cos(angle), sin(angle)), by definition. Of angles up to a few turns by Taylor series about the nearest quarter
    turn, up to the first term below half a last bit: laid into the kernel, where a call of the library would empty all
    registers. Quarter turns are taken off in two parts, so that nothing is lost (Cody and Waite 1980, chapter 8).
    """
    if not -SERIES_TURN < angle < SERIES_TURN:
        return UnitVector(math.cos(angle), math.sin(angle))
    quarters = math.floor(angle * (2.0 / math.pi) + 0.5)
    a = (angle - quarters * QUARTER_TURN_HIGH) - quarters * QUARTER_TURN_LOW
    a2 = a * a
    a4 = a2 * a2
    a8 = a4 * a4
    s = (1.0 - a2 * S3) + a4 * (S5 - a2 * S7) + a8 * ((S9 - a2 * S11) + a4 * (S13 - a2 * S15))
    s = a * s
    c = (C4 - a2 * C6) + a4 * (C8 - a2 * C10) + a8 * ((C12 - a2 * C14) + a4 * C16)
    c = (1.0 - 0.5 * a2) + a4 * c
    quadrant = quarters & 3
    if quadrant & 1:
        c, s = -s, c
    return UnitVector(-c, -s) if quadrant & 2 else UnitVector(c, s)


@compiled_inline
def turned_by(direction: UnitVector, angle: float) -> UnitVector:
    """Unit vector turned by an angle, which is mostly small [rad].

    Notes
    -----
    R(angle) direction, by definition; up to `SMALL_TURN` the series of both, whose first terms left out are
    angle^7 / 5040 and angle^8 / 40320.
    """
    if -SMALL_TURN < angle < SMALL_TURN:
        a2 = angle * angle
        c = 1.0 - a2 * (0.5 - a2 * (1.0 / 24.0 - a2 * (1.0 / 720.0)))
        s = angle * (1.0 - a2 * (1.0 / 6.0 - a2 * (1.0 / 120.0)))
    else:
        c, s = math.cos(angle), math.sin(angle)
    return composed(direction, UnitVector(c, s))


@compiled_inline
def turn_to(ux: float, uy: float, direction: UnitVector) -> float:
    """Angle from a unit vector to a direction, mostly a small one [rad].

    Parameters
    ----------
    ux, uy : what is turned from; shorter than 1 where there is nothing to be told.
    direction : what is turned to.

    Notes
    -----
    atan2(u x d, u . d), by definition; near 0 the series of the arcsine, whose first term left out is
    (10395 / 599040) s^13.
    """
    s = ux * direction.sin - uy * direction.cos
    c = ux * direction.cos + uy * direction.sin
    if c > 0.998 and -0.05 < s < 0.05:
        s2 = s * s
        rest = 15.0 / 336.0 + s2 * (105.0 / 3456.0 + s2 * (945.0 / 42240.0))
        return s + s * s2 * (1.0 / 6.0 + s2 * (3.0 / 40.0 + s2 * rest))
    return math.atan2(s, c)


@compiled_inline
def composed(first: UnitVector, second: UnitVector) -> UnitVector:
    """Unit vector of the sum of two angles.

    Notes
    -----
    cos(a + b) = cos a cos b - sin a sin b, sin(a + b) = sin a cos b + cos a sin b, by definition.
    """
    return UnitVector(
        first.cos * second.cos - first.sin * second.sin,
        first.sin * second.cos + first.cos * second.sin,
    )

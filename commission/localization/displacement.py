"""What rejected detections say together: by how much the pose would have to be moved for all of them to fit.

Of one alone a wrong heading explains much, the farther it is; of several, one and the same error has to explain all.
"""

from __future__ import annotations

from typing import NamedTuple

from commission.compiled import compiled_inline

FEWEST_PAIRS = 2.0
"""Of one detection no heading can be told."""
ALLOWED = 2.0
"""Squares of the shares of what is harmless, of the position and of the heading together: an error may have both."""
COHERENT = 9.0
"""Mean square of what is left of a degree of freedom, over the noise, up to which one displacement explains all."""


class Pairs(NamedTuple):
    """Rejected detections, each with the reflector nearest to it, as weighted sums.

    q is from base to the detection, e from the detection to the reflector [m], both in the map's axes.
    """

    number: float
    w: float
    """Of the weights, 1 over the variance of a place [1/m^2]."""
    wx: float
    wy: float
    """Of w q."""
    wqq: float
    """Of w |q|^2."""
    ex: float
    ey: float
    """Of w e."""
    turn: float
    """Of w (q x e)."""
    ee: float
    """Of w |e|^2."""


NO_PAIRS = Pairs(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


@compiled_inline
def with_pair(  # noqa: PLR0917 - a pair, number by number
    pairs: Pairs, qx: float, qy: float, ex: float, ey: float, variance: float
) -> Pairs:
    """Add a detection and its nearest reflector.

    Parameters
    ----------
    pairs : those so far.
    qx, qy : from base to the detection [m], map axes.
    ex, ey : from the detection to the reflector [m], map axes.
    variance : of e, each axis [m^2].

    Notes
    -----
    No formula: it adds.
    """
    w = 1.0 / variance
    return Pairs(
        pairs.number + 1.0,
        pairs.w + w,
        pairs.wx + w * qx,
        pairs.wy + w * qy,
        pairs.wqq + w * (qx * qx + qy * qy),
        pairs.ex + w * ex,
        pairs.ey + w * ey,
        pairs.turn + w * (qx * ey - qy * ex),
        pairs.ee + w * (ex * ex + ey * ey),
    )


@compiled_inline
def tell_of_a_displacement(pairs: Pairs, harmless: float, harmless_turn: float) -> bool:
    """Whether one displacement of the pose explains all pairs, and none that is harmless does.

    Parameters
    ----------
    pairs : rejected detections with their nearest reflectors.
    harmless, harmless_turn : error of the pose that is harmless [m, rad].

    Notes
    -----
    min over d, t of sum w |e - d - t R q|^2 + |d|^2 / harmless^2 + t^2 / harmless_turn^2, R the turn by 90 degrees:
    least squares with a prior, linear in a small t, derived from its normal equations. Explained where the first part
    is at most 9 (2 n - 3), by the noise; harmless where the others are at most 2, each being 1 at most, by definition.
    """
    if pairs.number < FEWEST_PAIRS or not (harmless > 0.0 and harmless_turn > 0.0):
        return False
    of_place, of_turn = 1.0 / (harmless * harmless), 1.0 / (harmless_turn * harmless_turn)
    whole = pairs.w + of_place
    turn = pairs.turn + (pairs.wy * pairs.ex - pairs.wx * pairs.ey) / whole
    turn /= pairs.wqq + of_turn - (pairs.wx * pairs.wx + pairs.wy * pairs.wy) / whole
    dx, dy = (pairs.ex + pairs.wy * turn) / whole, (pairs.ey - pairs.wx * turn) / whole
    square = dx * dx + dy * dy
    left = pairs.ee - 2.0 * (dx * pairs.ex + dy * pairs.ey + turn * pairs.turn)
    left += pairs.w * square + pairs.wqq * turn * turn + 2.0 * turn * (dy * pairs.wx - dx * pairs.wy)
    if left > COHERENT * (2.0 * pairs.number - 3.0):
        return False
    return of_place * square + of_turn * turn * turn > ALLOWED

"""Colors of what the supervisor compares with its limits, as a share of them, on routes and in charts."""

from __future__ import annotations

import numpy as np

from commission.app.base import theme
from commission.app.base.ramp import colors
from commission.app.base.theme import Color
from commission.geometry.arrays import FloatArray, IntArray

BOUNDS = (0.05, 0.1, 0.2, 0.35, 0.5, 0.7, 1.0)
"""Where one color ends and the next begins; above the last the supervisor stops the vehicle."""


def palette() -> tuple[Color, ...]:
    """Color of each class; the last one is not of the ramp, since the limit is no gradual thing."""
    # Without the darkest two, which would not be seen on a dark floor.
    ramp = ((int(red), int(green), int(blue)) for red, green, blue in colors(len(BOUNDS) + 2)[2:])
    return (*ramp, theme.OVER_LIMIT)


def limit_classes(limit_shares: FloatArray) -> IntArray:
    """(N,) index into the palette of each of N shares of the limit [1]."""
    return np.digitize(limit_shares, BOUNDS)

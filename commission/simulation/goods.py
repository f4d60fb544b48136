"""Goods of a virtual hall: paper reels that appear, vanish and are carried, as the circles that a scanner meets.

Whatever stands on the floor when is said beforehand (`site.disturbances.Reel`): nothing is drawn at random here.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from commission.geometry.arrays import FloatArray
from commission.site.disturbances import Reel


def reels_at(reels: Sequence[Reel], seconds: float) -> FloatArray:
    """(K, 3) x, y and radius of the reels that stand somewhere at a time [m], map frame.

    Parameters
    ----------
    reels : of the hall.
    seconds : after the start of the drive [s].
    """
    there = [each for each in reels if each.appears <= seconds and not 0.0 < each.vanishes <= seconds]
    return np.array([(*_place(each, seconds), each.radius) for each in there], dtype=np.float64).reshape(-1, 3)


def _place(reel: Reel, seconds: float) -> tuple[float, float]:
    """Center of a reel at a time: it is carried straight to where it stays."""
    if not 0.0 < reel.carried < seconds:
        return reel.x, reel.y
    way = math.hypot(reel.to_x - reel.x, reel.to_y - reel.y)
    share = 1.0 if way == 0.0 else min(reel.speed * (seconds - reel.carried) / way, 1.0)
    return reel.x + share * (reel.to_x - reel.x), reel.y + share * (reel.to_y - reel.y)

"""How often a scanner tells a reflector in free sight from other things, by its distance: a table of the scanner.

Not what the detector makes of the beams afterwards: its window is reckoned with elsewhere.
"""

from __future__ import annotations

import itertools
import math
from typing import TypeAlias

import numpy as np

from commission.geometry.arrays import FloatArray

DetectionRates: TypeAlias = tuple[tuple[float, float], ...]
"""Distances [m], ascending, each with the share of scans there [0..1]; none: in all scans."""


def check_detection_rates(rates: DetectionRates, name: str) -> None:
    """Refuse a table whose distances do not ascend or whose shares are none.

    Parameters
    ----------
    rates : the table.
    name : what the message calls it.

    Raises
    ------
    ValueError
        says what was found and what is expected.
    """
    for distance, share in rates:
        found = f"{name} holds [{distance:g}, {share:g}]"
        if not (math.isfinite(distance) and distance >= 0.0):
            raise ValueError(f"{found}; expected a distance of 0 m or more, then a share")
        if not 0.0 <= share <= 1.0:
            raise ValueError(f"{found}; expected a distance [m], then a share of 0 to 1")
    for (near, share), (far, other) in itertools.pairwise(rates):
        if not near < far:
            found = f"{name} holds [{near:g}, {share:g}] before [{far:g}, {other:g}]"
            raise ValueError(f"{found}; expected distances that ascend")


def detection_rate(rates: DetectionRates, distances: FloatArray) -> FloatArray:
    """(...) share of scans in which reflectors at some distances are told from other things [0..1].

    Parameters
    ----------
    rates : the table; without any entry it is all scans.
    distances : (...) from scanner to center [m].

    Notes
    -----
    Linear between two entries; before the first one as there, and after the last one as there: by definition.
    """
    if not rates:
        return np.ones(np.shape(distances))
    known, shares = np.array(rates).T
    return np.interp(distances, known, shares)

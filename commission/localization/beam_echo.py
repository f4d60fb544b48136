"""What one beam of finite width sees of a reflector: which part of it is lit, and the range that comes back from there.

The virtual scanner makes its echoes by it, the detector fits circles by it. No noise, no walls and no scans in here.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from commission.compiled import compiled_inline

LIT_SHARE = 0.2
"""Share of a beam (or, if narrower, of the object) that must meet for a flag: less returns too weak an echo."""


class BeamModel(NamedTuple):
    """Width and noise of a scanner's beams, for kernels."""

    half_width: float
    """Half of a beam's divergence [rad]."""
    bearing_sigma: float
    """1-sigma noise of a beam's bearing [rad]."""
    range_sigma: float
    """1-sigma noise of a beam's range [m]."""


@compiled_inline
def lit_part(bearing: float, half_width: float, low: float, high: float) -> tuple[float, float]:
    """Bearings of the two ends of the part of an object that a beam meets, lower first; crossed where it misses.

    Parameters
    ----------
    bearing : of the beam's middle, relative to the object's center [rad].
    half_width : half of the beam's divergence [rad].
    low, high : the object's two edges, relative to its center [rad].

    Notes
    -----
    [max(b - w, low), min(b + w, high)]: intersection of two intervals, by definition.
    """
    return max(bearing - half_width, low), min(bearing + half_width, high)


@compiled_inline
def is_flagged(lower: float, upper: float, half_width: float, size: float) -> bool:
    """Whether enough of a beam meets an object, so that the scanner calls it a reflector.

    Parameters
    ----------
    lower, upper : bearings of the two ends of the lit part [rad], see `lit_part`.
    half_width : half of the beam's divergence [rad].
    size : angle that the object takes up [rad].

    Notes
    -----
    upper - lower >= LIT_SHARE min(2 half_width, size), by definition.
    """
    return upper - lower >= LIT_SHARE * min(2.0 * half_width, size)


@compiled_inline
def cylinder_echo(distance: float, radius: float, bearing: float) -> float:
    """Range to the surface of a cylinder along a ray [m].

    Parameters
    ----------
    distance, radius : of its center, and of it [m].
    bearing : of the ray, relative to the center [rad]; beyond the silhouette it counts as meeting the edge.

    Notes
    -----
    r = d cos(b) - sqrt(R^2 - d^2 sin^2(b)), the nearer root of |r u - c| = R: the law of cosines, by definition.
    """
    across = distance * math.sin(bearing)
    return distance * math.cos(bearing) - math.sqrt(max(radius * radius - across * across, 0.0))

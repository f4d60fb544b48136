"""What one beam of finite width sees of a reflector: which part of it is lit, and the range that comes back from there.

The virtual scanner makes its echoes by it, the detector fits circles by it. No noise, no walls and no scans in here.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from commission.compiled import compiled_inline

LIT_SHARE = 0.2
"""Share of a beam (or, if narrower, of the object) that must meet for a flag: less returns too weak an echo."""
LARGEST_INCIDENCE = math.radians(65.0)
"""Angle of incidence beyond which a flat reflector returns no more than a wall does [rad]."""


class BeamModel(NamedTuple):
    """Width and noise of a scanner's beams, for kernels."""

    half_divergence: float
    """Half of a beam's divergence [rad]."""
    half_aperture: float
    """Half of a beam's width where it leaves the scanner [m]."""
    bearing_sigma: float
    """1-sigma noise of a beam's bearing [rad]."""
    range_sigma: float
    """1-sigma noise of a beam's range [m]."""


@compiled_inline
def half_width_at(distance: float, half_divergence: float, half_aperture: float) -> float:
    """Half of the angle that a beam takes up at a distance, seen from the scanner [rad].

    Parameters
    ----------
    distance : from the scanner [m], more than 0.
    half_divergence : half of the beam's divergence [rad].
    half_aperture : half of its width where it leaves the scanner [m].

    Notes
    -----
    w = D / 2 + atan(a / (2 d)): a beam is a + D d wide, by definition (NAV350: 20 mm and 5 mrad).
    """
    if half_aperture == 0.0:
        return half_divergence
    return half_divergence + math.atan(half_aperture / distance)


@compiled_inline
def flagged_span(high: float, half_width: float, share: float) -> float:
    """Angle within which the middles of the beams lie that an object flags [rad].

    Parameters
    ----------
    high : half of the angle that the object takes up [rad].
    half_width : half of the beam's width there [rad].
    share : of the beam (or, if narrower, of the object) that must meet: 0 where a touch is enough, 0.5 where the
        middle must.

    Notes
    -----
    2 (high + w - share min(2 w, 2 high)): the bearings at which `is_flagged` holds, derived. With no width this is the
    2 asin(radius / distance) of Sobreira et al. 2016, equation 3; with a share of 0.5 the larger of the two angles.
    """
    return 2.0 * (high + half_width - 2.0 * share * min(half_width, high))


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

"""How well a hypothesis of where the vehicle is fits all that was seen: least squares, and the evidence for it.

It judges one pose after the other, each by itself; where poses come from is `start`'s, which one is believed and when
`relocalization`'s.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from commission.compiled import compiled, compiled_inline
from commission.geometry.angles import wrap_scalar
from commission.geometry.arrays import FloatArray, IntArray
from commission.localization.missed import SEEN, Sights, is_taken, log_missed
from commission.localization.reflector_index import ReflectorIndex, nearest_entry
from commission.localization.wall_evidence import MOST_FOR, log_walls

GATE = 11.8
"""Squared distance up to which a thing is a reflector: 99.7 % of chi-square with 2 degrees of freedom."""
NEGLIGIBLE = 40.0
"""A hypothesis whose log of the evidence is that far below another one's is not judged to the end."""
FIT_STEPS = 4
"""Steps of Gauss and Newton; the first associates widely, the last decides."""
ROW = 13
"""Numbers of a hypothesis: x, y, heading of the frame of odometry in the map, its covariance (xx, xy, xt, yy, yt, tt),
log of the evidence, things that fit a reflector, in how many scans in a row it was the only one left, and which part of
the evidence counts among places alone."""


class Prior(NamedTuple):
    """What is known before anything is seen: the floor evenly, half of the belief around a pose where one is known."""

    log_even: float
    """Log of the density of a pose anywhere [1 / (m^2 rad)]."""
    known: bool
    """Whether there is a last good pose."""
    x: float
    y: float
    theta: float
    position_variance: float
    heading_variance: float


@compiled_inline
def _inverse3(  # noqa: PLR0917 - a matrix, number by number
    a: float, b: float, c: float, d: float, e: float, f: float
) -> tuple[float, float, float, float, float, float, float]:
    """Inverse (upper triangle) and determinant of [[a, b, c], [b, d, e], [c, e, f]].

    Notes
    -----
    Cofactors over determinant, by definition.
    """
    xx, xy, xt = d * f - e * e, c * e - b * f, b * e - c * d
    det = a * xx + b * xy + c * xt
    scale = 1.0 / det
    return (
        xx * scale,
        xy * scale,
        xt * scale,
        (a * f - c * c) * scale,
        (b * c - a * e) * scale,
        (a * d - b * b) * scale,
        det,
    )


@compiled
def judge(  # noqa: PLR0917 - things, views and the map, array by array
    poses: FloatArray,
    things: FloatArray,
    base_x: float,
    base_y: float,
    clutter: float,
    prior: Prior,
    sights: Sights,
    index: ReflectorIndex,
    judged: FloatArray,
) -> None:
    """Fit each pose to all things by least squares, and weigh the evidence for it.

    Parameters
    ----------
    poses : (H, 3) frame of odometry in the map [m, m, rad].
    things : (C, 5) x, y [m] and covariance xx, xy, yy [m^2] in the frame of odometry.
    base_x, base_y : where the vehicle is now in that frame [m]: poses are fitted about that place.
    clutter : density of things that are no reflectors [1 / m^2].
    prior : density of poses.
    sights : views from which reflectors should have been seen, and what hides them.
    index : the map.
    judged : (H, ROW) out; the covariance is of the vehicle's pose.

    Notes
    -----
    log evidence = sum of log(SEEN N(d; S) / clutter) over things that fit, + `log_missed` of the reflectors that
    should be seen and fit no thing, + `log_walls`, + log((2 pi)^(3/2) det(P)^(1/2) prior): Laplace's approximation of
    the probability of the things, over that of the same number of things at random places; derived. The covariance is
    P times sum d^T S^-1 d / (2 n - 3) of the n things that fit, where that is more than one: what scatters more than
    stated is known less (Birge 1932); the evidence is not changed by it.
    """
    taken = np.empty(len(things), dtype=np.int64)
    most = -math.inf
    for h in range(len(poses)):
        x, y, t = poses[h, 0], poses[h, 1], poses[h, 2]
        fit = _fit_step(x, y, t, things, base_x, base_y, clutter, 4.0, index, taken)
        for step in range(1, FIT_STEPS):
            if fit.fits < 2:
                break
            x, y, t = _moved(x, y, t, fit, base_x, base_y)
            widen = 4.0 if step < 2 else 1.0
            fit = _fit_step(x, y, t, things, base_x, base_y, clutter, widen, index, taken)
        judged[h, 0], judged[h, 1], judged[h, 2] = x, y, wrap_scalar(t)
        judged[h, 9], judged[h, 10], judged[h, 11], judged[h, 12] = -math.inf, fit.fits, 0.0, 0.0
        xx, xy, xt, yy, yt, tt, det = _inverse3(fit.xx, fit.xy, fit.xt, fit.yy, fit.yt, fit.tt)
        if fit.fits < 2 or not det > 0.0:
            continue
        misfit = max(fit.misfit / (2.0 * fit.fits - 3.0), 1.0)
        judged[h, 3], judged[h, 4], judged[h, 5] = misfit * xx, misfit * xy, misfit * xt
        judged[h, 6], judged[h, 7], judged[h, 8] = misfit * yy, misfit * yt, misfit * tt
        c, s = math.cos(t), math.sin(t)
        before = density(prior, x + c * base_x - s * base_y, y + s * base_x + c * base_y, t)
        evidence = fit.evidence + 1.5 * math.log(2.0 * math.pi) - 0.5 * math.log(det) + math.log(before)
        walls = log_walls(x, y, t, sights.beams, sights.walls)
        evidence += walls
        judged[h, 12] = max(walls - MOST_FOR, 0.0)
        judged[h, 9] = evidence + log_missed(x, y, t, taken, sights, index.places, most - NEGLIGIBLE - evidence)
        most = max(most, judged[h, 9])


class Fit(NamedTuple):
    """Things that fit a pose, and the normal equations of its correction about the vehicle's place."""

    fits: int
    evidence: float
    misfit: float
    """Sum of the squared distances of the things that fit."""
    xx: float
    xy: float
    xt: float
    yy: float
    yt: float
    tt: float
    gx: float
    gy: float
    gt: float


@compiled_inline
def _moved(x: float, y: float, t: float, fit: Fit, base_x: float, base_y: float) -> tuple[float, float, float]:  # noqa: PLR0917
    """Pose of the frame after a step: the vehicle's place moves, and about it the frame turns.

    Notes
    -----
    delta = (J^T W J)^-1 J^T W d: Gauss and Newton.
    """
    xx, xy, xt, yy, yt, tt, _ = _inverse3(fit.xx, fit.xy, fit.xt, fit.yy, fit.yt, fit.tt)
    c, s = math.cos(t), math.sin(t)
    at_x = x + c * base_x - s * base_y + xx * fit.gx + xy * fit.gy + xt * fit.gt
    at_y = y + s * base_x + c * base_y + xy * fit.gx + yy * fit.gy + yt * fit.gt
    t += xt * fit.gx + yt * fit.gy + tt * fit.gt
    c, s = math.cos(t), math.sin(t)
    return at_x - (c * base_x - s * base_y), at_y - (s * base_x + c * base_y), t


@compiled
def _fit_step(  # noqa: PLR0917 - things and the map, array by array
    x: float,
    y: float,
    t: float,
    things: FloatArray,
    base_x: float,
    base_y: float,
    clutter: float,
    widen: float,
    index: ReflectorIndex,
    taken: IntArray,
) -> Fit:
    """Associate all things at a pose, and sum up what they say of it; a gate `widen` times as large takes any."""
    c, s = math.cos(t), math.sin(t)
    a, b, e, f, g, k = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    gx, gy, gt = 0.0, 0.0, 0.0
    fits, evidence, misfit = 0, 0.0, 0.0
    for i in range(len(things)):
        taken[i] = -1
        px, py = c * things[i, 0] - s * things[i, 1], s * things[i, 0] + c * things[i, 1]
        sxx = c * c * things[i, 2] - 2.0 * c * s * things[i, 3] + s * s * things[i, 4]
        sxy = c * s * (things[i, 2] - things[i, 4]) + (c * c - s * s) * things[i, 3]
        syy = s * s * things[i, 2] + 2.0 * c * s * things[i, 3] + c * c * things[i, 4]
        reach = math.sqrt(widen * GATE * (max(sxx, syy) + abs(sxy) + index.cells.largest_variance))
        best, _ = nearest_entry(x + px, y + py, min(reach, 1.5), index)
        # Two things are not one reflector: the one that was seen more often comes first.
        if best < 0 or is_taken(best, taken, i):
            continue
        place = index.places[best]
        sxx += place[2]
        syy += place[2]
        area = sxx * syy - sxy * sxy
        dx, dy = place[0] - x - px, place[1] - y - py
        d2 = (syy * dx * dx - 2.0 * sxy * dx * dy + sxx * dy * dy) / area
        gain = math.log(SEEN / (clutter * 2.0 * math.pi * math.sqrt(area))) - 0.5 * d2
        if d2 > widen * GATE or (widen == 1.0 and gain <= 0.0):
            continue
        taken[i] = best
        fits += 1
        evidence += gain
        misfit += d2
        # W = S^-1, J = [[1, 0, -(py - by)], [0, 1, px - bx]] about the vehicle.
        wxx, wxy, wyy = syy / area, -sxy / area, sxx / area
        jx, jy = (s * base_x + c * base_y) - py, px - (c * base_x - s * base_y)
        tx, ty = wxx * jx + wxy * jy, wxy * jx + wyy * jy
        a, b, e = a + wxx, b + wxy, e + tx
        f, g, k = f + wyy, g + ty, k + jx * tx + jy * ty
        gx, gy, gt = gx + wxx * dx + wxy * dy, gy + wxy * dx + wyy * dy, gt + tx * dx + ty * dy
    return Fit(fits, evidence, misfit, a, b, e, f, g, k, gx, gy, gt)


@compiled_inline
def density(prior: Prior, x: float, y: float, t: float) -> float:
    """Density of a pose of the vehicle before anything is seen [1 / (m^2 rad)]; half of it even, half around a pose.

    Parameters
    ----------
    prior : what is known.
    x, y, t : pose of base [m, m, rad], map frame.

    Notes
    -----
    p = 0.5 U + 0.5 N, a mixture; derived.
    """
    dense = math.exp(prior.log_even)
    if prior.known:
        away2 = ((x - prior.x) ** 2 + (y - prior.y) ** 2) / prior.position_variance
        away2 += wrap_scalar(t - prior.theta) ** 2 / prior.heading_variance
        norm = (2.0 * math.pi) ** 1.5 * prior.position_variance * math.sqrt(prior.heading_variance)
        dense = 0.5 * dense + 0.5 * math.exp(-0.5 * away2) / norm
    return dense

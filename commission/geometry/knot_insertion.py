"""Inserting knots: more control points for the same curve, so that a part of it can be bent or driven differently."""

from __future__ import annotations

import numpy as np

from commission.geometry.arrays import FloatArray
from commission.geometry.splines import Spline

SAME_KNOT = 1e-9
"""Parameters this close, as a share of the domain, are one knot: two would leave a piece without a length."""


def multiplicity(spline: Spline, u: float) -> int:
    """How often a parameter occurs among the knots."""
    first, last = spline.domain
    return int((np.abs(spline.knots - u) <= SAME_KNOT * (last - first)).sum())


def insert_knot(spline: Spline, u: float, times: int = 1) -> Spline:
    """Insert a knot; the curve stays the same, as a curve and in its parameter.

    Parameters
    ----------
    spline : the curve.
    u : parameter inside the domain. One that is (nearly) a knot counts as that knot.
    times : how often; less when the knot then occurs `degree` times, which is the most.

    Returns
    -------
    finer : with one control point more for each knot inserted.

    Notes
    -----
    Boehm 1980; Piegl, Tiller, "The NURBS Book", 1997, equation 5.15, in homogeneous coordinates.
    """
    first, last = spline.domain
    if not first < u < last:
        raise ValueError(f"parameter is {u:g}; expected inside {first:g} to {last:g}")
    nearest = float(spline.knots[np.argmin(np.abs(spline.knots - u))])
    u = nearest if abs(nearest - u) <= SAME_KNOT * (last - first) else u
    if not first < u < last:
        return spline
    for _ in range(min(times, spline.degree - multiplicity(spline, u))):
        spline = _with_one_more(spline, u)
    return spline


def split(spline: Spline, u: float) -> tuple[Spline, Spline]:
    """Cut a curve in two at a parameter inside its domain: together they are the same curve.

    Each part keeps its piece of the parameter's domain. Raises ValueError when `u` is (nearly) an end of the domain.
    """
    p = spline.degree
    cut = insert_knot(spline, u, p)
    inside = np.flatnonzero(np.abs(cut.knots - u) <= SAME_KNOT * (cut.domain[1] - cut.domain[0]))
    if len(inside) != p:
        raise ValueError(f"parameter {u:g} is an end of the curve; expected one inside")
    k = int(inside[0])
    at = cut.knots[k]
    before = Spline(p, cut.control_points[:k], np.append(cut.knots[: k + p], at), cut.weights[:k])
    after = Spline(p, cut.control_points[k - 1 :], np.insert(cut.knots[k:], 0, at), cut.weights[k - 1 :])
    return before, after


def _with_one_more(spline: Spline, u: float) -> Spline:
    p, knots, weights = spline.degree, spline.knots, spline.weights
    span = int(np.searchsorted(knots, u, side="right")) - 1
    homogeneous = np.column_stack((spline.control_points * weights[:, np.newaxis], weights))
    moved: list[FloatArray] = []
    for i in range(span - p + 1, span - int((knots == u).sum()) + 1):
        share = (u - knots[i]) / (knots[i + p] - knots[i])
        moved.append(share * homogeneous[i] + (1.0 - share) * homogeneous[i - 1])
    kept = span - p + 1
    rest = homogeneous[kept + len(moved) - 1 :]
    finer = np.vstack((homogeneous[:kept], *moved, rest))
    return Spline(p, finer[:, :2] / finer[:, 2:], np.insert(knots, span + 1, u), finer[:, 2])

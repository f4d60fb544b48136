"""Compiled evaluation of rational B-splines by de Boor's algorithm, for `splines` and for kernels that follow a path.

Nothing is checked here: knots, degree and control points come from a `Spline`, whose constructor has checked them.
"""

from __future__ import annotations

import numpy as np

from commission.compiled import compiled, compiled_inline
from commission.geometry.arrays import FloatArray

# Newton doubles the digits per step; the limit only stops a guess that is trapped at a cusp.
MAX_CLOSEST_STEPS = 60
MAX_BACKTRACKS = 30


@compiled
def span_at(knots: FloatArray, degree: int, u: float) -> int:
    """Span of the knots that a parameter lies in; the last span also holds the end of the domain.

    Parameters
    ----------
    knots : (N + degree + 1,) array, not decreasing.
    degree : of the curve.
    u : parameter within the domain.

    Notes
    -----
    k with knots[k] <= u < knots[k + 1], by bisection: The NURBS Book, algorithm A2.1.
    """
    low, high = degree, len(knots) - degree - 1
    while high - low > 1:
        middle = (low + high) // 2
        if u < knots[middle]:
            high = middle
        else:
            low = middle
    return low


@compiled
def evaluate(
    knots: FloatArray, controls: FloatArray, degree: int, u: float
) -> tuple[float, float, float, float, float, float]:
    """Point and its first and second derivative by the parameter.

    Parameters
    ----------
    knots : (N + degree + 1,) array.
    controls : (3, N, 3) array: control points (w x, w y, w) of the curve and of its first two derivatives.
    degree : of the curve.
    u : parameter; outside the domain it counts as the nearer end.

    Returns
    -------
    x, y [m], dx, dy [m per unit of u], ddx, ddy [m per unit of u squared].

    Notes
    -----
    C = A / w, C' = (A' - w' C) / w, C'' = (A'' - 2 w' C' - w'' C) / w: Piegl, Tiller, "The NURBS Book", 1997, equation
    4.8 (rational derivatives), with equation 3.8 (control points of derivatives).
    """
    u = min(max(u, knots[degree]), knots[len(knots) - degree - 1])
    span = span_at(knots, degree, u)
    homogeneous = np.zeros((3, 3))
    _blossom(knots, controls, degree, span, u, min(degree, 2), np.empty((degree + 1, 3)), homogeneous)
    w, dw, ddw = homogeneous[0, 2], homogeneous[1, 2], homogeneous[2, 2]
    x, y = homogeneous[0, 0] / w, homogeneous[0, 1] / w
    dx, dy = (homogeneous[1, 0] - dw * x) / w, (homogeneous[1, 1] - dw * y) / w
    ddx = (homogeneous[2, 0] - 2.0 * dw * dx - ddw * x) / w
    ddy = (homogeneous[2, 1] - 2.0 * dw * dy - ddw * y) / w
    return x, y, dx, dy, ddx, ddy


@compiled_inline
def _blossom(  # noqa: PLR0917 - two tables, where to look, and where to write
    knots: FloatArray,
    controls: FloatArray,
    degree: int,
    span: int,
    u: float,
    orders: int,
    window: FloatArray,
    homogeneous: FloatArray,
) -> None:
    """Write the homogeneous curve and its derivatives up to an order; `window` is room for degree + 1 points.

    Notes
    -----
    d_j = (1 - a) d_(j-1) + a d_j, level by level: de Boor's algorithm.
    """
    for order in range(orders + 1):
        p = degree - order
        # Loops and not slices, here and below: slice assignment took five times as long to compile.
        for j in range(p + 1):
            for axis in range(3):
                window[j, axis] = controls[order, span - degree + j, axis]
        for level in range(1, p + 1):
            for j in range(p, level - 1, -1):
                left = knots[span - p + j]
                share = (u - left) / (knots[span + 1 + j - level] - left)
                for axis in range(3):
                    window[j, axis] = (1.0 - share) * window[j - 1, axis] + share * window[j, axis]
        for axis in range(3):
            homogeneous[order, axis] = window[p, axis]


@compiled
def evaluate_many(knots: FloatArray, controls: FloatArray, degree: int, parameters: FloatArray) -> FloatArray:
    """Rows [x, y, dx, dy, ddx, ddy] of `evaluate` at each of M parameters: (M, 6) array.

    Parameters
    ----------
    knots, controls, degree : as in `evaluate`.
    parameters : (M,) array.
    """
    rows = np.empty((len(parameters), 6))
    for i in range(len(parameters)):
        x, y, dx, dy, ddx, ddy = evaluate(knots, controls, degree, parameters[i])
        rows[i, 0], rows[i, 1], rows[i, 2], rows[i, 3], rows[i, 4], rows[i, 5] = x, y, dx, dy, ddx, ddy
    return rows


@compiled
def tangents_many(knots: FloatArray, controls: FloatArray, degree: int, parameters: FloatArray) -> FloatArray:
    """Rows [dx, dy] of `evaluate` at each of M parameters: (M, 2) array.

    Parameters
    ----------
    knots, controls, degree : as in `evaluate`.
    parameters : (M,) array.

    Notes
    -----
    C' = (A' - w' C) / w: The NURBS Book, equation 4.8. Lengths need no more, and of them there are many.
    """
    rows, window, homogeneous = np.empty((len(parameters), 2)), np.empty((degree + 1, 3)), np.zeros((3, 3))
    for i in range(len(parameters)):
        u = min(max(parameters[i], knots[degree]), knots[len(knots) - degree - 1])
        _blossom(knots, controls, degree, span_at(knots, degree, u), u, 1, window, homogeneous)
        w, dw = homogeneous[0, 2], homogeneous[1, 2]
        x, y = homogeneous[0, 0] / w, homogeneous[0, 1] / w
        rows[i, 0], rows[i, 1] = (homogeneous[1, 0] - dw * x) / w, (homogeneous[1, 1] - dw * y) / w
    return rows


@compiled
def closest_parameter(  # noqa: PLR0917 - three tables and three numbers, as kernels pass them
    knots: FloatArray, controls: FloatArray, degree: int, x: float, y: float, guess: float
) -> float:
    """Parameter of the local minimum of the distance to a point that is reached downhill from a guess.

    Parameters
    ----------
    knots, controls, degree : as in `evaluate`.
    x, y : the point [m].
    guess : parameter to begin at.

    Notes
    -----
    Newton on (C(u) - p) . C'(u) = 0 (The NURBS Book, equation 6.3) with steps that never go uphill.
    """
    first, last = knots[degree], knots[len(knots) - degree - 1]
    u = min(max(guess, first), last)
    cx, cy, dx, dy, ddx, ddy = evaluate(knots, controls, degree, u)
    for _ in range(MAX_CLOSEST_STEPS):
        squared = (cx - x) ** 2 + (cy - y) ** 2
        slope = (cx - x) * dx + (cy - y) * dy
        speed2 = dx * dx + dy * dy
        bend = speed2 + (cx - x) * ddx + (cy - y) * ddy
        # Where the second derivative does not point to a minimum, Gauss-Newton's positive part of it still does.
        step = -slope / (bend if bend > 1e-3 * speed2 else speed2) if speed2 > 0.0 else 0.0
        trial, moved = u, False
        for _ in range(MAX_BACKTRACKS):
            trial = min(max(u + step, first), last)
            if trial == u:
                break
            cx, cy, dx, dy, ddx, ddy = evaluate(knots, controls, degree, trial)
            trial_squared = (cx - x) ** 2 + (cy - y) ** 2
            trial_slope = (cx - x) * dx + (cy - y) * dy
            # Close to the minimum the distance no longer tells two parameters apart; its slope still does.
            flat = trial_squared <= squared * (1.0 + 1e-12) and abs(trial_slope) < 0.5 * abs(slope)
            if trial_squared < squared or flat:
                moved = True
                break
            step *= 0.5
        if not moved:
            break
        u = trial
    return u


def warm_up() -> None:
    """Compile the kernels of this module for the read-only arrays that a `Spline` holds."""
    knots, controls, parameters = np.array([0.0, 0.0, 1.0, 1.0]), np.ones((3, 2, 3)), np.array([0.5])
    knots.setflags(write=False)
    controls.setflags(write=False)
    evaluate_many(knots, controls, 1, parameters)
    tangents_many(knots, controls, 1, parameters)
    evaluate(knots, controls, 1, 0.5)
    closest_parameter(knots, controls, 1, 0.0, 0.0, 0.5)

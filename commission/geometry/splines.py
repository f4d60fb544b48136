"""Plane curves: B-splines and NURBS with tangent, curvature and arc length, and Catmull-Rom curves through points.

A curve is a frozen value; which way a vehicle drives along it is not its business.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from commission.geometry import spline_kernels
from commission.geometry.arrays import FloatArray, equal_fields, frozen
from commission.geometry.se2 import transform_points

GAUSS_NODES, GAUSS_WEIGHTS = (
    frozen(table, (8,), "Gauss-Legendre rule") for table in np.polynomial.legendre.leggauss(8)
)
# Length error accepted on one piece of the table, as a share of the control polygon; a table has tens of pieces.
PIECE_TOLERANCE = 1e-11
# A cusp halves its piece down to 2^-24 of a knot span, where what remains is shorter than the tolerance.
MAX_HALVINGS = 24
# Bisection alone reaches the last bit in 53 halvings.
MAX_INVERSION_STEPS = 60
# Share of the whole that lies between two knots at least, if they are not equal: derivatives are divided by it.
NARROWEST_GAP = 1e-12


@dataclass(frozen=True, slots=True, eq=False, init=False)
class Spline:
    """A clamped B-spline, rational where weights differ (NURBS); parameter u over [knots[0], knots[-1]].

    A parameter outside the domain counts as the nearer end. Arc length is accurate to 1e-9 of the whole length.
    """

    degree: int
    """Degree of the polynomial pieces: 1 is a polyline, 3 the usual choice."""
    control_points: FloatArray
    """(N, 2) [m]: the curve starts at the first and ends at the last; N is at least degree + 1."""
    knots: FloatArray
    """(N + degree + 1,) nondecreasing, the ends repeated; none given: uniform over [0, 1]."""
    weights: FloatArray
    """(N,) positive; none given: all 1."""
    controls: FloatArray = field(init=False, repr=False, compare=False)
    """(3, N, 3) homogeneous control points of the curve and its first two derivatives, for `spline_kernels`."""
    breaks: FloatArray = field(init=False, repr=False, compare=False)
    """(M,) parameters at which the arc length is tabulated."""
    break_lengths: FloatArray = field(init=False, repr=False, compare=False)
    """(M,) [m] arc length from the start to each of `breaks`."""

    def __init__(
        self,
        degree: int,
        control_points: ArrayLike,
        knots: ArrayLike | None = None,
        weights: ArrayLike | None = None,
    ) -> None:
        points = frozen(np.ascontiguousarray(control_points), (None, 2), "control_points")
        n = len(points)
        if degree < 1:
            raise ValueError(f"degree is {degree}; expected at least 1")
        if n < degree + 1:
            raise ValueError(f"{n} control points; expected at least {degree + 1} for degree {degree}")
        if not (points != points[0]).any():
            raise ValueError(f"all {n} control points coincide; expected a curve with a length")
        object.__setattr__(self, "degree", degree)
        object.__setattr__(self, "control_points", points)
        given = clamped_uniform_knots(degree, n) if knots is None else knots
        object.__setattr__(self, "knots", _checked_knots(given, degree, n))
        object.__setattr__(self, "weights", _checked_weights(np.ones(n) if weights is None else weights, n))
        controls = _derivative_controls(degree, self.knots, self.weights, points)
        object.__setattr__(self, "controls", frozen(controls, (3, n, 3), "controls"))
        breaks, lengths = self._length_table()
        object.__setattr__(self, "breaks", frozen(breaks, (None,), "breaks"))
        object.__setattr__(self, "break_lengths", frozen(lengths, (None,), "break_lengths"))

    def __eq__(self, other: object) -> bool:
        """Equal when degree, control points, knots and weights are."""
        return equal_fields(self, other)

    @property
    def domain(self) -> tuple[float, float]:
        """First and last parameter."""
        return float(self.knots[0]), float(self.knots[-1])

    @property
    def length(self) -> float:
        """Arc length of the whole curve [m]."""
        return float(self.break_lengths[-1])

    def point(self, u: ArrayLike) -> FloatArray:
        """Points at parameters u (...): (..., 2) array [m]."""
        return self._rows(u)[..., 0:2]

    def derivatives(self, u: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """First and second derivative by u at parameters (...): two (..., 2) arrays [m]; from the right at a knot."""
        rows = self._rows(u)
        return rows[..., 2:4], rows[..., 4:6]

    def heading(self, u: ArrayLike) -> FloatArray:
        """Direction of the tangent at parameters (...): (...) array [rad] in [-pi, pi]; nan where the speed is zero."""
        rows = self._rows(u)
        dx, dy = rows[..., 2], rows[..., 3]
        return np.where(np.hypot(dx, dy) > 0.0, np.arctan2(dy, dx), np.nan)

    def curvature(self, u: ArrayLike) -> FloatArray:
        """Curvature at parameters (...): (...) array [1/m], positive to the left; nan where the speed is zero."""
        rows = self._rows(u)
        dx, dy, ddx, ddy = rows[..., 2], rows[..., 3], rows[..., 4], rows[..., 5]
        speed = np.hypot(dx, dy)
        safe = np.where(speed > 0.0, speed, np.nan)
        # Divided in three steps: the cube of a slow speed would underflow.
        return (dx / safe * ddy - dy / safe * ddx) / safe / safe

    def s_at(self, u: ArrayLike) -> FloatArray:
        """Arc length from the start to parameters u (...): (...) array [m]."""
        given = np.clip(np.asarray(u, dtype=np.float64), *self.domain)
        piece = np.clip(np.searchsorted(self.breaks, given, side="right") - 1, 0, len(self.breaks) - 2)
        return self.break_lengths[piece] + self._arc(self.breaks[piece], given)

    def u_at(self, s: ArrayLike) -> FloatArray:
        """Parameters at arc lengths s (...) [m]: the inverse of `s_at`; outside [0, length] the nearer end."""
        target = np.clip(np.asarray(s, dtype=np.float64), 0.0, self.length)
        piece = np.clip(np.searchsorted(self.break_lengths, target, side="right") - 1, 0, len(self.breaks) - 2)
        start, low, high = self.breaks[piece], self.breaks[piece], self.breaks[piece + 1]
        wanted = target - self.break_lengths[piece]
        available = self.break_lengths[piece + 1] - self.break_lengths[piece]
        u = low + (high - low) * np.divide(wanted, available, out=np.zeros_like(wanted), where=available > 0.0)
        for _ in range(MAX_INVERSION_STEPS):
            excess = self._arc(start, u) - wanted
            low, high = np.where(excess < 0.0, u, low), np.where(excess > 0.0, u, high)
            speed = self._speed(u)
            newton = u - np.divide(excess, speed, out=np.full_like(excess, np.inf), where=speed > 0.0)
            following = np.where((newton >= low) & (newton <= high), newton, 0.5 * (low + high))
            following = np.where(excess == 0.0, u, following)
            settled = np.abs(following - u) <= 1e-15 * (self.knots[-1] - self.knots[0])
            u = following
            if settled.all():
                break
        return u

    def closest(self, point: ArrayLike, guess: float) -> float:
        """Parameter at which the curve comes closest to a point, near a guess.

        Parameters
        ----------
        point : (2,) array [m].
        guess : parameter from which the distance is followed downhill; the previous answer, for a moving vehicle.

        Returns
        -------
        u : a local minimum of the distance, or an end of the domain.
        """
        x, y = np.asarray(point, dtype=np.float64)
        return spline_kernels.closest_parameter(
            self.knots, self.controls, self.degree, float(x), float(y), float(guess)
        )

    def transformed(self, T_a_b: ArrayLike) -> Spline:
        """The same curve in frame a, this one being given in b."""
        return Spline(self.degree, transform_points(T_a_b, self.control_points), self.knots, self.weights)

    def _rows(self, u: ArrayLike) -> FloatArray:
        """Evaluate at parameters (...): (..., 6) array."""
        given = np.asarray(u, dtype=np.float64)
        flat = np.ascontiguousarray(given).reshape(-1)
        rows = spline_kernels.evaluate_many(self.knots, self.controls, self.degree, flat)
        return rows.reshape((*given.shape, 6))

    def _speed(self, u: FloatArray) -> FloatArray:
        flat = np.ascontiguousarray(u).reshape(-1)
        rows = spline_kernels.tangents_many(self.knots, self.controls, self.degree, flat)
        return np.hypot(rows[:, 0], rows[:, 1]).reshape(u.shape)

    def _arc(self, start: FloatArray, end: FloatArray) -> FloatArray:
        """Arc length between parameters inside one piece of the table, by Gauss-Legendre quadrature."""
        half = 0.5 * (end - start)
        middle = 0.5 * (start + end)
        speeds = self._speed(middle[..., np.newaxis] + half[..., np.newaxis] * GAUSS_NODES)
        return half * (speeds @ GAUSS_WEIGHTS)

    def _length_table(self) -> tuple[FloatArray, FloatArray]:
        """Halve the knot spans until quadrature over a piece and over its halves agree; return pieces and lengths."""
        polygon = np.linalg.norm(np.diff(self.control_points, axis=0), axis=1).sum()
        edges = np.unique(self.knots)
        for _ in range(MAX_HALVINGS):
            middle = 0.5 * (edges[:-1] + edges[1:])
            halves = self._arc(edges[:-1], middle) + self._arc(middle, edges[1:])
            rough = np.abs(halves - self._arc(edges[:-1], edges[1:])) > PIECE_TOLERANCE * polygon
            if not rough.any():
                break
            edges = np.sort(np.concatenate((edges, middle[rough])))
        return edges, np.concatenate(([0.0], np.cumsum(self._arc(edges[:-1], edges[1:]))))


def clamped_uniform_knots(degree: int, n: int) -> FloatArray:
    """Knots over [0, 1], equally spaced inside and repeated degree + 1 times at the ends, for n control points."""
    inner = np.linspace(0.0, 1.0, n - degree + 1)
    return np.concatenate((np.zeros(degree), inner, np.ones(degree)))


def catmull_rom(points: ArrayLike) -> Spline:
    """Smooth curve through the given points, as a cubic B-spline in Bezier form (inner knots of multiplicity 3).

    Parameters
    ----------
    points : (N, 2) array [m], N at least 2, no two neighbors equal.

    Returns
    -------
    spline : cubic over [0, 1] with continuous tangent; point i lies at `knots[3 * i + 1]`.

    Notes
    -----
    Centripetal parametrization: the only one without cusps and self-intersections inside a piece (Yuksel, Schaefer,
    Keyser, "Parameterization and applications of Catmull-Rom curves", 2011). The ends leave along the chord.
    """
    given = frozen(points, (None, 2), "points")
    if len(given) < 2:
        raise ValueError(f"{len(given)} points; expected at least 2")
    chords = np.diff(given, axis=0)
    steps = np.sqrt(np.linalg.norm(chords, axis=1))
    if not steps.all():
        i = int(np.argmin(steps))
        raise ValueError(f"points {i} and {i + 1} are equal; expected distinct neighbors")
    velocities = chords / steps[:, np.newaxis]
    before = np.concatenate((velocities[:1], velocities))
    after = np.concatenate((velocities, velocities[-1:]))
    step_before = np.concatenate((steps[:1], steps))[:, np.newaxis]
    step_after = np.concatenate((steps, steps[-1:]))[:, np.newaxis]
    tangents = (before * step_after + after * step_before) / (step_before + step_after)
    third = steps[:, np.newaxis] / 3.0
    pieces = np.stack((given[:-1], given[:-1] + tangents[:-1] * third, given[1:] - tangents[1:] * third), axis=1)
    times = np.concatenate(([0.0], np.cumsum(steps))) / steps.sum()
    times[-1] = 1.0
    knots = np.concatenate(([0.0], np.repeat(times, 3), [1.0]))
    return Spline(3, np.concatenate((pieces.reshape(-1, 2), given[-1:])), knots)


def _checked_knots(values: ArrayLike, degree: int, n: int) -> FloatArray:
    """Knots as a read-only array, or a ValueError that says which rule they break."""
    knots = frozen(values, (None,), "knots")
    if len(knots) != n + degree + 1:
        raise ValueError(f"{len(knots)} knots; expected {n + degree + 1} ({n} control points + degree {degree} + 1)")
    falls = np.flatnonzero(np.diff(knots) < 0.0)
    if falls.size:
        i = int(falls[0])
        raise ValueError(f"knots[{i + 1}] is {knots[i + 1]:g} after {knots[i]:g}; expected nondecreasing knots")
    for name, end in (("first", knots[: degree + 1]), ("last", knots[-degree - 1 :])):
        if (end != end[0]).any():
            raise ValueError(f"the {name} {degree + 1} knots are {end.tolist()}; expected equal ones (clamped end)")
    inner, counts = np.unique(knots[degree + 1 : -degree - 1], return_counts=True)
    if knots[0] == knots[-1] or (inner == knots[0]).any() or (inner == knots[-1]).any():
        raise ValueError(f"an end knot occurs more than {degree + 1} times; expected exactly {degree + 1}")
    if (counts > degree).any():
        i = int(np.argmax(counts))
        raise ValueError(f"inner knot {inner[i]:g} occurs {counts[i]} times; expected at most {degree} (the degree)")
    gaps = np.diff(knots)
    narrow = np.flatnonzero((gaps > 0.0) & (gaps < NARROWEST_GAP * (knots[-1] - knots[0])))
    if narrow.size:
        i = int(narrow[0])
        text = f"knots[{i + 1}] lies {gaps[i]:g} after knots[{i}], of {knots[-1] - knots[0]:g} in all"
        raise ValueError(f"{text}; expected equal knots, or at least {NARROWEST_GAP:g} of all between them")
    return knots


def _checked_weights(values: ArrayLike, n: int) -> FloatArray:
    """Weights as a read-only array, or a ValueError that says which one is not positive."""
    weights = frozen(values, (n,), "weights")
    if (weights <= 0.0).any():
        i = int(np.argmin(weights))
        raise ValueError(f"weights[{i}] is {weights[i]:g}; expected a number > 0")
    return weights


def _derivative_controls(degree: int, knots: FloatArray, weights: FloatArray, points: FloatArray) -> FloatArray:
    """Homogeneous control points of the curve and its first two derivatives (The NURBS Book, equation 3.8)."""
    n = len(points)
    controls = np.zeros((3, n, 3))
    controls[0] = np.column_stack((points * weights[:, np.newaxis], weights))
    for order in range(1, min(degree, 2) + 1):
        p = degree - order + 1
        count = n - order
        gaps = (knots[degree + 1 : degree + 1 + count] - knots[order : order + count])[:, np.newaxis]
        differences = p * np.diff(controls[order - 1, : count + 1], axis=0)
        # A knot of multiplicity p + 1 leaves an empty basis function, whose control point never counts.
        np.divide(differences, gaps, out=controls[order, :count], where=gaps > 0.0)
    return controls

"""What speaks for and against each point that a map was fitted by: its residual, how large it may be, and the others.

It judges a fit (`plant_fit`) and changes nothing.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from commission.errors import UsageError
from commission.geometry import se2
from commission.geometry.arrays import FloatArray
from commission.site.editing.plant_fit import PlantFit, PlantPair, fit_points

UNKNOWNS = 3
"""Numbers that a fit finds: x, y and heading."""
FEWEST_FOR_WORST = 4
"""Points of which it can be told which one is wrong."""
STEPS = 1e-6
"""What the fit itself is calculated to [m]: no figure is told finer."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PointCheck:
    """One point of a fit."""

    pair: PlantPair
    """Which one."""
    residual: tuple[float, float]
    """Where the plant has it less where the moved map has it [m, m], plant axes."""
    sigma: float
    """1-sigma of that residual, each axis, by how much all points scatter [m]; NaN without redundancy."""
    left_out: float
    """By how much the fit of all others misses it [m]; NaN where they make no fit."""
    left_out_sigma: float
    """1-sigma of that, each axis, by how much the others scatter among themselves [m]; NaN without redundancy."""

    @property
    def off(self) -> float:
        """By how much it is missed [m]."""
        return math.hypot(*self.residual)

    @property
    def strength(self) -> float:
        """How many times its 1-sigma the point is off from the fit of all others; 0 where those say nothing."""
        if math.isnan(self.left_out) or math.isnan(self.left_out_sigma):
            return 0.0
        return self.left_out / max(self.left_out_sigma, STEPS)


def scatter(fit: PlantFit) -> float:
    """Return the 1-sigma of a point, each axis, that the residuals of a fit speak for [m]; NaN without redundancy.

    Notes
    -----
    s^2 = sum of squared residuals / (2 N - 3), unbiased for white noise of one size.
    """
    redundant = 2 * len(fit.pairs) - UNKNOWNS
    return math.sqrt(float(np.sum(fit.residuals**2)) / redundant) if redundant > 0 else math.nan


def check_points(fit: PlantFit) -> tuple[PointCheck, ...]:
    """Judge each point of a fit: its residual with 1-sigma, and what the others say of it, in the order of the points.

    Notes
    -----
    Residuals of a least-squares fit have the covariance s^2 (I - H); H_i = I / N + n n^T / sum |q|^2 is the leverage of
    the i-th point, q its place from the middle of all and n that turned by a quarter. What a point is off by from the
    fit of the others has s_i^2 (I - H_i)^-1 with their scatter s_i (Cook and Weisberg 1982, Residuals and Influence in
    Regression, chapter 2). Both are told as the root of the mean of the two axes.
    """
    places = np.array([each.at for each in fit.pairs], dtype=np.float64)
    q = se2.transform_points(np.array([0.0, 0.0, float(fit.T_plant_map[2])]), places - places.mean(axis=0))
    spread, s = float(np.sum(q**2)), scatter(fit)
    found: list[PointCheck] = []
    for index, (pair, residual) in enumerate(zip(fit.pairs, fit.residuals.tolist(), strict=True)):
        free = _freedom(q[index], len(fit.pairs), spread)
        left_out, sigma = _left_out(fit, index, free)
        found.append(
            PointCheck(
                pair=pair,
                residual=(residual[0], residual[1]),
                sigma=s * math.sqrt(max(float(np.mean(free)), 0.0)),
                left_out=left_out,
                left_out_sigma=sigma,
            )
        )
    return tuple(found)


def worst_of(checks: tuple[PointCheck, ...]) -> PointCheck | None:
    """Return the point that the others contradict most, in units of what they let expect.

    None of fewer than four points: where one of three is wrong, each of them contradicts the other two.
    """
    if len(checks) < FEWEST_FOR_WORST:
        return None
    worst = max(checks, key=lambda each: each.strength, default=None)
    return worst if worst is not None and worst.strength > 0.0 else None


def _freedom(q: FloatArray, count: int, spread: float) -> FloatArray:
    """(2,) eigenvalues of I - H_i: along the way to the middle, and across it."""
    along = 1.0 - 1.0 / count
    return np.array([along, along - float(q @ q) / spread])


def _left_out(fit: PlantFit, index: int, free: FloatArray) -> tuple[float, float]:
    """By how much the fit of the others misses a point, and the 1-sigma of that [m]; NaN where there is none."""
    others = [each for number, each in enumerate(fit.pairs) if number != index]
    try:
        without = fit_points(others, check=False)
    except UsageError:
        return math.nan, math.nan
    pair = fit.pairs[index]
    off = np.subtract(pair.plant, se2.transform_points(without.T_plant_map, np.array(pair.at)))
    known = float(free.min()) > STEPS
    sigma = scatter(without) * math.sqrt(float(np.mean(1.0 / free))) if known else math.nan
    return float(np.hypot(*off)), sigma

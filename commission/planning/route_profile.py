"""How a route drives: curvature, heading and speed over its metres, with the ramps of the planned drive.

The same legs that simulation follows and prediction walks along, thinned for the eye.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass

import numpy as np

from commission.geometry.angles import wrap_scalar
from commission.geometry.arrays import FloatArray, frozen
from commission.planning.route_check import smallest_radius
from commission.site.path import CREEP, Leg, MotionLimits, legs_of
from commission.site.routes import Route
from commission.site.vehicle import Vehicle

MOST_ROWS = 600
"""About as many rows as a plot has pixels."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class RouteProfile:
    """A route over its metres. All arrays are read-only."""

    metres: FloatArray
    """(K,) way from the start of the route [m], rising; a stop on the way is two rows at one metre."""
    curvatures: FloatArray
    """(K,) curvature of the way [1/m], positive to the left of the way; the largest of each row's stretch."""
    headings: FloatArray
    """(K,) heading of the vehicle [rad], counted on over a half turn; a jump is a turn on the spot."""
    speeds: FloatArray
    """(K,) speed that is planned there [m/s], with its ramps; the lowest of each row's stretch."""
    largest_curvature: float
    """The most that the vehicle can drive [1/m]; infinite when it turns on the spot."""
    seconds: float
    """Time that the way takes, without the rests at its stops [s]."""
    stops: int
    """Stops on the way: cusps and kinks."""

    @property
    def length(self) -> float:
        """Length of the route [m]."""
        return float(self.metres[-1])


def route_profile(route: Route, vehicle: Vehicle, limits: MotionLimits | None = None) -> RouteProfile:
    """Look along a route as it will be driven.

    Parameters
    ----------
    route : the route.
    vehicle : the steering of a tricycle limits its speed where the curvature changes.
    limits : what the drives can do; the defaults when None.
    """
    legs = legs_of(route, vehicle, limits or MotionLimits())
    starts = np.concatenate(([0.0], np.cumsum([leg.length for leg in legs])))
    step = max(1, -(-sum(len(leg.points) for leg in legs) // MOST_ROWS))
    rows = [_rows(leg, float(start), step) for leg, start in zip(legs, starts[:-1], strict=True)]
    for before, after in itertools.pairwise(rows):
        turn = wrap_scalar(float(after[0, 2] - before[-1, 2]))
        after[:, 2] += before[-1, 2] + turn - after[0, 2]
    columns = np.concatenate(rows).T
    metres, curvatures, headings, speeds = (frozen(column, (None,), "profile") for column in columns)
    radius = smallest_radius(vehicle)
    return RouteProfile(
        metres=metres,
        curvatures=curvatures,
        headings=headings,
        speeds=speeds,
        largest_curvature=1.0 / radius if radius > 0.0 else math.inf,
        seconds=sum(_seconds(leg) for leg in legs),
        stops=len(legs) - 1,
    )


def _rows(leg: Leg, start: float, step: int) -> FloatArray:
    """(K, 4) metre, curvature, heading and speed of each `step` samples, and of the last sample."""
    firsts = np.arange(0, len(leg.points), step)
    high = np.maximum.reduceat(leg.curvatures, firsts)
    low = np.minimum.reduceat(leg.curvatures, firsts)
    facing = math.pi if leg.reverse else 0.0
    headings = np.unwrap(leg.travel_headings)
    headings += wrap_scalar(float(headings[0]) + facing) - headings[0]
    at = np.append(firsts, len(leg.points) - 1)
    return np.column_stack(
        (
            start + leg.step * at,
            np.append(np.where(high >= -low, high, low), leg.curvatures[-1]),
            headings[at],
            np.append(np.minimum.reduceat(leg.speeds, firsts), leg.speeds[-1]),
        )
    ).astype(np.float64, copy=False)


def _seconds(leg: Leg) -> float:
    """Time of one leg [s]; its speeds change linearly in their squares."""
    speeds = np.maximum(leg.speeds, CREEP)
    return float((2.0 * leg.step / (speeds[1:] + speeds[:-1])).sum())

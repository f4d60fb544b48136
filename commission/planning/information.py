"""What each reflector adds to the information about a pose: bounds that are linear in the choice of reflectors.

The filter's information after a scan is a concave function of which reflectors stand: its tangent at any layout lies
above it everywhere. So "the tangent reaches what the limit asks for" is necessary for every layout that keeps the
limit, whatever layout the tangent was taken at. That makes limits of the uncertainty rows of a covering problem.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from commission.compiled import compiled, compiled_inline
from commission.geometry.arrays import FloatArray, IntArray, read_only
from commission.localization.observation import expect, observation_at, scanner_offset
from commission.planning.detection_noise import DetectionNoise, worth
from commission.planning.route_prediction import PlannedRoute, RoutePrediction, predict_route, smallest_route

FORGOTTEN = 1e-8
"""Share of the weight that a scan has, below which earlier ones say nothing any more."""


@dataclass(frozen=True, slots=True, eq=False)
class Tangent:
    """Upper bound of the information about one axis of the pose after one scan, for any choice of reflectors."""

    gains: FloatArray
    """(M,) what each reflector adds where it stands, in multiples of the information at the layout of the tangent."""
    rest: float
    """What there is without any: of the start, and what odometry keeps."""
    variance: float
    """Of that axis at the layout of the tangent [m^2 or rad^2]."""

    def need(self, variance: float) -> float:
        """Return the sum of gains without which the variance cannot be as small as a given one.

        Notes
        -----
        w^T L w >= 2 w^T e - v for w = P e: since v >= e^T L^-1 e = max over w of 2 w^T e - w^T L w. Derived.
        """
        return 2.0 - variance / self.variance - self.rest


def tangent_at(planned: PlannedRoute, prediction: RoutePrediction, scan: int, axis: int) -> Tangent:
    """Return the bound for an axis after a scan, as a tangent at a layout.

    Parameters
    ----------
    planned : the route with all reflectors that may stand.
    prediction : along the route with those of the layout.
    scan : of the drive.
    axis : 0 for x, 1 for y, 2 for the heading.

    Notes
    -----
    L' <= G L G^T + P'^-1 Q P'^-1 with G = P'^-1 F P, P' = F P F^T + Q, tangent of (F L^-1 F^T + Q)^-1 at P; and
    L' <= L + p H^T R^-1 H for a detection of probability p, since the inverse is convex. Derived; followed backwards
    from w = P e, so that a tangent costs as much as a look at the scans before it. Constants that are considered count
    as known: no filter that has to allow for them does better.
    """
    model = planned.model()
    gains = np.zeros(len(planned.reflectors))
    variance = float(prediction.covariances[scan, axis, axis])
    rest = _followed_back(
        scan,
        axis,
        planned.drive.poses,
        planned.drive.scanners,
        planned.visible.offsets,
        planned.visible.indices,
        _places(planned),
        model.observations,
        model.noise,
        model.kinds,
        (model.inside_gate, model.free_per_m),
        prediction.prior_covariances,
        prediction.covariances,
        gains,
    )
    return Tangent(gains / variance, rest / variance, variance)


def _places(planned: PlannedRoute) -> FloatArray:
    """(M, 3) x, y [m], map frame; variance that is noise to the filter: none where it considers the survey [m^2]."""
    places = planned.places[:, :3].copy()
    if planned.parameters.filter.consider:
        places[:, 2] = 0.0
    return read_only(places)


@compiled
def _followed_back(  # noqa: PLR0917 - the columns of a drive
    scan: int,
    axis: int,
    poses: FloatArray,
    scanners: IntArray,
    offsets: IntArray,
    indices: IntArray,
    places: FloatArray,
    observations: FloatArray,
    noise: DetectionNoise,
    kinds: IntArray,
    chances: tuple[float, float],
    priors: FloatArray,
    posteriors: FloatArray,
    gains: FloatArray,
) -> float:
    """Add up w^T H^T R^-1 H w per reflector, and return the rest."""
    inside_gate, free_per_m = chances
    w = posteriors[scan, :, axis].copy()
    whole, rest, k = posteriors[scan, axis, axis], 0.0, scan
    while True:
        observation = observation_at(observations, int(scanners[k]))
        x, y, theta = poses[k, 0], poses[k, 1], poses[k, 2]
        offset_x, offset_y = scanner_offset(theta, observation)
        for n in range(offsets[k], offsets[k + 1]):
            m = indices[n]
            e = expect(x, y, theta, offset_x, offset_y, places[m, 0], places[m, 1], observation.mount_theta)
            across = e.bearing_x * e.bearing_x + e.bearing_y * e.bearing_y
            by_range = e.range_x * w[0] + e.range_y * w[1] + e.range_theta * w[2]
            by_bearing = e.bearing_x * w[0] + e.bearing_y * w[1] + e.bearing_theta * w[2]
            detected = worth(noise, int(kinds[scanners[k], m]), e.range).probability
            chance = detected * inside_gate * free_per_m**e.range
            gains[m] += chance * by_range * by_range / (observation.range_variance + places[m, 2])
            bearing_variance = observation.bearing_variance + places[m, 2] * across
            gains[m] += chance * by_bearing * by_bearing / bearing_variance
        u = np.linalg.solve(priors[k], w)
        if k == 0:
            return rest + u @ w
        turned = _turned_back(u, poses[k, 0] - poses[k - 1, 0], poses[k, 1] - poses[k - 1, 1])
        before = posteriors[k - 1] @ turned
        # u^T Q u, with Q = P' - F P F^T.
        rest += u @ w - turned @ before
        w, k = before, k - 1
        left = turned @ before
        if left < FORGOTTEN * whole:
            return rest + left


@compiled_inline
def _turned_back(u: FloatArray, dx: float, dy: float) -> FloatArray:
    """F^T u for a motion by (dx, dy) in the map: F = [[1, 0, -dy], [0, 1, dx], [0, 0, 1]]."""
    return np.array([u[0], u[1], u[2] - dy * u[0] + dx * u[1]])


def warm_up() -> None:
    """Compile the kernel of this module."""
    planned = smallest_route()
    tangent_at(planned, predict_route(planned), len(planned.drive) - 1, 0)

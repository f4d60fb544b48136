"""What the scanner should see of a reflector: h of equation 2, its Jacobian, and the uncertainty of both.

Ranges and bearings are those of reflector centers in the scanner frame. No association and no correction in here.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from commission.compiled import compiled, compiled_inline
from commission.geometry import se2
from commission.geometry.angles import wrap, wrap_scalar
from commission.geometry.arrays import FloatArray, IntArray, read_only
from commission.geometry.directions import UnitVector, direction_of
from commission.localization.estimate import Belief
from commission.site.parameters import ObservationParameters
from commission.site.scanner import Scanner

SMALLEST_RANGE = 1e-3
"""Ranges are not linearized below this [m]: a reflector's center is never nearer than its radius."""


class ObservationModel(NamedTuple):
    """Scanner mounting and R of equation 2, for kernels."""

    mount_x: float
    mount_y: float
    mount_theta: float
    range_variance: float
    bearing_variance: float
    range_bias: float


class Expected(NamedTuple):
    """Expected observation and the two rows of its Jacobian with respect to x, y, theta of base in map."""

    range: float
    bearing: float
    range_x: float
    range_y: float
    range_theta: float
    bearing_x: float
    bearing_y: float
    bearing_theta: float


def observation_model(scanner: Scanner, parameters: ObservationParameters) -> ObservationModel:
    """Return the scalars that the kernels need; the noise is the scanner's own where it has one."""
    x, y, theta = (float(value) for value in scanner.mounting)
    range_sigma, bearing_sigma = scanner.detection_sigmas(parameters.range_sigma, parameters.bearing_sigma)
    return ObservationModel(x, y, theta, range_sigma**2, bearing_sigma**2, float(parameters.range_bias))


def observation_rows(models: Sequence[ObservationModel]) -> FloatArray:
    """(S, 6) the models of several scanners, for kernels; see `observation_at`."""
    return read_only(np.array(models, dtype=np.float64).reshape(-1, 6))


@compiled_inline
def observation_at(rows: FloatArray, scanner: int) -> ObservationModel:
    """Model of one scanner out of `observation_rows`."""
    return ObservationModel(
        rows[scanner, 0],
        rows[scanner, 1],
        rows[scanner, 2],
        rows[scanner, 3],
        rows[scanner, 4],
        rows[scanner, 5],
    )


@compiled_inline
def scanner_offset(theta: float, model: ObservationModel) -> tuple[float, float]:
    """Scanner's place seen from base, map axes [m].

    Notes
    -----
    R(theta) m with m the mounting, by definition.
    """
    return offset_facing(direction_of(theta), model)


@compiled_inline
def offset_facing(facing: UnitVector, model: ObservationModel) -> tuple[float, float]:
    """`scanner_offset` of a heading that is given as a direction.

    Notes
    -----
    offset = R m, with m the mounting, by definition.
    """
    c, s = facing
    return c * model.mount_x - s * model.mount_y, s * model.mount_x + c * model.mount_y


@compiled_inline
def expect(  # noqa: PLR0917 - a pose and a point, number by number
    x: float, y: float, theta: float, offset_x: float, offset_y: float, target_x: float, target_y: float, mount: float
) -> Expected:
    """Range and bearing of a point seen by the scanner, with the Jacobian.

    Parameters
    ----------
    x, y, theta : pose of base in map [m, m, rad].
    offset_x, offset_y : `scanner_offset` of it [m].
    target_x, target_y : point [m], map frame.
    mount : heading of the scanner in the base frame [rad].

    Notes
    -----
    h = (|d|, atan2(d_y, d_x) - theta - mount), d = target - scanner: Sobreira et al. 2016, equation 2; H its derivative
    (Algorithm 1, line 7).
    """
    dx, dy = target_x - (x + offset_x), target_y - (y + offset_y)
    return expect_at(dx, dy, wrap_scalar(math.atan2(dy, dx) - theta - mount), offset_x, offset_y)


@compiled_inline
def expect_at(dx: float, dy: float, bearing: float, offset_x: float, offset_y: float) -> Expected:
    """Expected observation of a point that lies somewhere from the scanner: for whoever has no use for its bearing.

    Parameters
    ----------
    dx, dy : point, seen from the scanner, map axes [m].
    bearing : of it, handed through [rad].
    offset_x, offset_y : `scanner_offset` [m].

    Notes
    -----
    No formula: that of `expect`.
    """
    square = dx * dx + dy * dy
    distance = math.sqrt(square)
    # 1 / distance, without waiting for the root before it divides.
    inverse = max(distance, SMALLEST_RANGE) * (1.0 / max(square, SMALLEST_RANGE * SMALLEST_RANGE))
    ux, uy = dx * inverse, dy * inverse
    # The scanner moves by (-offset_y, offset_x) per radian.
    return Expected(
        distance,
        bearing,
        -ux,
        -uy,
        ux * offset_y - uy * offset_x,
        uy * inverse,
        -ux * inverse,
        -(uy * offset_y + ux * offset_x) * inverse - 1.0,
    )


def range_bearing(T_map_base: ArrayLike, mounting: ArrayLike, points_map: ArrayLike) -> FloatArray:
    """Expected range and bearing of points in the scanner frame (equation 2 without its noise).

    Parameters
    ----------
    T_map_base : (3,) array [m, m, rad].
    mounting : (3,) `T_base_scanner` [m, m, rad].
    points_map : (N, 2) array [m], map frame.

    Returns
    -------
    range_bearing : (N, 2) array [m, rad], bearings in [-pi, pi).
    """
    sx, sy, heading = se2.compose(T_map_base, mounting)
    delta = np.asarray(points_map, dtype=np.float64).reshape(-1, 2) - (sx, sy)
    bearing = wrap(np.arctan2(delta[:, 1], delta[:, 0]) - heading)
    return np.stack((np.hypot(delta[:, 0], delta[:, 1]), bearing), axis=1)


def residuals(T_map_scanner: FloatArray, places: FloatArray, measured: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Measured ranges and bearings minus those expected (equation 2 without its noise), each from a pose of its own.

    Parameters
    ----------
    T_map_scanner : (n, 3) pose of the scanner at each detection [m, m, rad].
    places : (n, 2) where what was detected stands [m], map frame.
    measured : (n, 2) range [m], without the bias that is known of it, and bearing [rad], scanner frame.

    Returns
    -------
    residuals : (n, 2) of range [m] and bearing [rad], bearings in [-pi, pi).
    distances : (n,) expected ranges [m].
    """
    rays = places - T_map_scanner[:, :2]
    distances = np.hypot(rays[:, 0], rays[:, 1])
    turns = wrap(measured[:, 1] - np.arctan2(rays[:, 1], rays[:, 0]) + T_map_scanner[:, 2])
    return np.stack((measured[:, 0] - distances, turns), axis=1), distances


def jacobians(T_map_base: ArrayLike, mounting: ArrayLike, points_map: ArrayLike) -> FloatArray:
    """Jacobian of `range_bearing` with respect to `T_map_base`.

    Parameters
    ----------
    T_map_base, mounting, points_map : as in `range_bearing`.

    Returns
    -------
    H : (N, 2, 3) array: rows range, bearing; columns x, y, theta. Finite for a point at the scanner itself.
    """
    pose = np.asarray(T_map_base, dtype=np.float64)
    scanner = se2.compose(pose, mounting)[:2]
    ox, oy = scanner - pose[:2]
    delta = np.asarray(points_map, dtype=np.float64).reshape(-1, 2) - scanner
    inverse = 1.0 / np.maximum(np.hypot(delta[:, 0], delta[:, 1]), SMALLEST_RANGE)
    ux, uy = delta[:, 0] * inverse, delta[:, 1] * inverse
    along = np.stack((-ux, -uy, ux * oy - uy * ox), axis=1)
    across = np.stack((uy * inverse, -ux * inverse, -(uy * oy + ux * ox) * inverse - 1.0), axis=1)
    return np.stack((along, across), axis=1)


def innovation_covariances(
    belief: Belief, model: ObservationModel, centers: ArrayLike, sigmas: ArrayLike = 0.0
) -> FloatArray:
    """Covariance of each reflector's expected observation (S of Algorithm 1, line 8).

    Parameters
    ----------
    belief : pose of base before the scan.
    model : scanner mounting and R.
    centers : (N, 2) reflector centers [m], map frame.
    sigmas : (N,) or one: 1-sigma uncertainty of the surveyed centers, each axis [m].

    Returns
    -------
    S : (N, 2, 2) array of range [m] and bearing [rad].
    """
    mounting = (model.mount_x, model.mount_y, model.mount_theta)
    H = jacobians(belief.mean, mounting, centers)
    distance = np.maximum(range_bearing(belief.mean, mounting, centers)[:, 0], SMALLEST_RANGE)
    surveyed = np.square(np.broadcast_to(np.asarray(sigmas, dtype=np.float64), distance.shape))
    S = H @ belief.covariance @ np.swapaxes(H, 1, 2)
    S[:, 0, 0] += model.range_variance + surveyed
    S[:, 1, 1] += model.bearing_variance + surveyed / np.square(distance)
    return S


def validation_ellipses(
    belief: Belief, model: ObservationModel, centers: ArrayLike, sigmas: ArrayLike = 0.0
) -> FloatArray:
    """Uncertainty of each expected observation laid on the floor around its reflector (blue in the paper's Fig. 12).

    Parameters
    ----------
    belief, model, centers, sigmas : as in `innovation_covariances`.

    Returns
    -------
    covariances : (N, 2, 2) array [m^2], map axes. A detection lies inside the gate when it falls inside the ellipse of
        `sqrt(gate)` sigmas around the reflector, up to the curvature of polar coordinates.
    """
    return laid_on_the_floor(belief, model, centers, innovation_covariances(belief, model, centers, sigmas))


def laid_on_the_floor(belief: Belief, model: ObservationModel, centers: ArrayLike, S: FloatArray) -> FloatArray:
    """Covariances of expected observations laid on the floor around their reflectors.

    Parameters
    ----------
    belief : pose of base.
    model : mounting of the scanner.
    centers : (N, 2) reflector centers [m], map frame.
    S : (N, 2, 2) of range [m] and bearing [rad].

    Returns
    -------
    covariances : (N, 2, 2) array [m^2], map axes.
    """
    scanner = se2.compose(belief.mean, (model.mount_x, model.mount_y, model.mount_theta))[:2]
    delta = np.asarray(centers, dtype=np.float64).reshape(-1, 2) - scanner
    distance = np.maximum(np.hypot(delta[:, 0], delta[:, 1]), SMALLEST_RANGE)
    ux, uy = delta[:, 0] / distance, delta[:, 1] / distance
    # Columns: a metre of range, a radian of bearing.
    spread = np.stack((np.stack((ux, -delta[:, 1]), axis=1), np.stack((uy, delta[:, 0]), axis=1)), axis=1)
    return spread @ S @ np.swapaxes(spread, 1, 2)


def project_detections(
    means: FloatArray, offsets: IntArray, detections: FloatArray, models: FloatArray, *, scanners: IntArray
) -> FloatArray:
    """Detections of many scans seen from the poses of base.

    Parameters
    ----------
    means : (K, 3) poses of base in map [m, m, rad].
    offsets : (K + 1,) rows of `detections` that belong to each.
    detections : (n, 2) range [m] and bearing [rad], scanner frame, as measured; the range bias is taken off.
    models : (S, 6) `observation_rows` of the scanners: mounting and range bias.
    scanners : (K,) scanner of each scan.

    Returns
    -------
    points_map : (n, 2) array [m], map frame.
    """
    points = np.empty((len(detections), 2))
    _project(
        read_only(means), read_only(offsets), read_only(detections), read_only(models), read_only(scanners), points
    )
    return points


@compiled
def _project(  # noqa: PLR0917 - the columns of the log
    means: FloatArray,
    offsets: IntArray,
    detections: FloatArray,
    models: FloatArray,
    scanners: IntArray,
    points: FloatArray,
) -> None:
    """`project_detections` into `points`."""
    for k in range(len(means)):
        model = observation_at(models, scanners[k])
        x, y, theta = means[k, 0], means[k, 1], means[k, 2]
        offset_x, offset_y = scanner_offset(theta, model)
        for i in range(offsets[k], offsets[k + 1]):
            distance = detections[i, 0] - model.range_bias
            direction = theta + model.mount_theta + detections[i, 1]
            points[i, 0] = x + offset_x + distance * math.cos(direction)
            points[i, 1] = y + offset_y + distance * math.sin(direction)

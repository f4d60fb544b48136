"""What each reflector has in the information about a pose, constants considered: a model of the filter at one scan.

Odometry ties the last scans together to one fix, in which older ones count less. Of a reflector that is seen again and
again its survey remains, of all reflectors together mounting, range bias and clock: what more of the same would add is
little, and what stands across from it is much. Not a bound, as `information` is: a guide for a search that judges by
predictions.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from commission.compiled import compiled, compiled_inline
from commission.geometry.arrays import BoolArray, FloatArray, IntArray
from commission.localization.consider import PER_REFLECTOR, PER_SCANNER, ConsiderModel, scanner_jacobian
from commission.localization.observation import direction_of, expect, observation_at, scanner_offset
from commission.localization.setup import consider_model
from commission.planning.detection_noise import DetectionNoise, worth
from commission.planning.prediction_kernels import step_to, twist_of
from commission.planning.route_prediction import PlannedRoute, RoutePrediction, predict_route, smallest_route

FORGOTTEN = 1e-3
"""Share of the weight that a scan has, below which earlier ones are left out."""
POSE = 3
OWN = POSE + PER_REFLECTOR
"""Rows of a Gram matrix before those of the scanners: the pose, and the place of the reflector."""


@dataclass(frozen=True, slots=True, eq=False)
class FixShares:
    """What of the information about one axis of the pose each reflector would have beside those of a layout."""

    gains: FloatArray
    """(M,) of each reflector, in multiples of the information at the layout; those of the layout and `rest` are 1."""
    rest: float
    """Of scans before, and of what is known of the constants."""


def fix_shares(planned: PlannedRoute, prediction: RoutePrediction, scan: int, axis: int, taken: BoolArray) -> FixShares:
    """Return what each reflector has in the information about an axis after a scan.

    Parameters
    ----------
    planned : the route with all M reflectors that may stand.
    prediction : along the route with those of the layout.
    scan : of the drive.
    axis : 0 for x, 1 for y, 2 for the heading.
    taken : (M,) the layout.

    Notes
    -----
    L = sum p s B^T R^-1 B + diag(0, P_p^-1) of the pose and the constants, with B = (H F^-1, J) and the weight s of
    each scan; z = L^-1 e / (e^T L^-1 e) has z^T L z = 1 / (e^T L^-1 e), so that z^T L' z is above that of any other
    layout. A reflector's place is its own matter and taken out of its part of L. The weight is that of w^T P^-1 w from
    w_k-1 = P F^T P'^-1 w_k: what the filter itself keeps of a scan. Derived.
    """
    size = OWN + PER_SCANNER * len(planned.scanners)
    grams, before = np.zeros((len(planned.reflectors), size, size)), np.zeros((POSE, POSE))
    model = planned.model()
    _gather(
        (scan, axis),
        planned.drive.stamps_ns,
        planned.drive.poses,
        planned.drive.scanners,
        planned.visible.offsets,
        planned.visible.indices,
        planned.places,
        model.observations,
        model.noise,
        model.kinds,
        (model.inside_gate, model.free_per_m),
        _sigmas(consider_model(planned.uncertainty)),
        prediction.prior_covariances,
        prediction.covariances,
        grams,
        before,
    )
    left = _without_places(grams)
    known = np.eye(left.shape[1])
    known[:POSE, :POSE] = before
    direction = np.linalg.solve(left[taken].sum(axis=0) + known, np.eye(len(known))[axis])
    # In multiples of the information, which is 1 over the axis' own part of the direction.
    direction /= np.sqrt(direction[axis])
    gains = np.maximum(np.einsum("i,mij,j->m", direction, left, direction), 0.0)
    return FixShares(gains, float(direction @ known @ direction))


def _sigmas(constants: ConsiderModel) -> FloatArray:
    """(5,) 1-sigma of the constants of a scanner."""
    mount = (constants.mount_position, constants.mount_position, constants.mount_heading)
    return np.sqrt(np.array([*mount, constants.range_bias, constants.clock]))


def _without_places(grams: FloatArray) -> FloatArray:
    """(M, n, n) information about the pose and the constants of scanners, when no reflector's place is known better."""
    others, place = np.r_[0:POSE, OWN : grams.shape[1]], np.arange(POSE, OWN)
    across = grams[:, others[:, np.newaxis], place]
    own = grams[:, place[:, np.newaxis], place] + np.eye(len(place))
    return grams[:, others[:, np.newaxis], others] - across @ np.linalg.solve(own, across.transpose(0, 2, 1))


@compiled
def _gather(  # noqa: PLR0917 - the columns of a drive
    at: tuple[int, int],
    stamps_ns: IntArray,
    poses: FloatArray,
    scanners: IntArray,
    offsets: IntArray,
    indices: IntArray,
    places: FloatArray,
    observations: FloatArray,
    noise: DetectionNoise,
    kinds: IntArray,
    chances: tuple[float, float],
    sigmas: FloatArray,
    priors: FloatArray,
    posteriors: FloatArray,
    grams: FloatArray,
    before: FloatArray,
) -> None:
    """Add up p s B^T R^-1 B per reflector, constants in multiples of their sigma, and what earlier scans leave."""
    (k, axis), (inside_gate, free_per_m) = at, chances
    by_range, by_bearing = np.empty(OWN + PER_SCANNER), np.empty(OWN + PER_SCANNER)
    last_x, last_y, share = poses[k, 0], poses[k, 1], 1.0
    w = posteriors[k, :, axis].copy()
    whole = w[axis]
    while True:
        observation = observation_at(observations, int(scanners[k]))
        x, y, theta = poses[k, 0], poses[k, 1], poses[k, 2]
        offset_x, offset_y = scanner_offset(theta, observation)
        facing, twist = direction_of(theta), twist_of(step_to(poses, stamps_ns, k))
        first = PER_SCANNER * int(scanners[k])
        for n in range(offsets[k], offsets[k + 1]):
            m = indices[n]
            e = expect(x, y, theta, offset_x, offset_y, places[m, 0], places[m, 1], observation.mount_theta)
            j = scanner_jacobian(facing, e, twist[0], twist[1], twist[2])
            surveyed = np.sqrt(places[m, 3])
            in_range = (j.mount_xr, j.mount_yr, 0.0, 1.0, j.clock_r)
            in_bearing = (j.mount_xb, j.mount_yb, -1.0, 0.0, j.clock_b)
            _fill(by_range, e.range_x, e.range_y, e.range_theta, (x - last_x, y - last_y), surveyed, in_range, sigmas)
            _fill(
                by_bearing,
                e.bearing_x,
                e.bearing_y,
                e.bearing_theta,
                (x - last_x, y - last_y),
                surveyed,
                in_bearing,
                sigmas,
            )
            detected = worth(noise, int(kinds[scanners[k], m]), e.range).probability
            chance = share * detected * inside_gate * free_per_m**e.range
            in_both = (chance / observation.range_variance, chance / observation.bearing_variance)
            _add(grams[m], by_range, by_bearing, in_both, first)
        inverse = np.linalg.inv(priors[k])
        u = inverse @ w
        if k > 0:
            dx, dy = poses[k, 0] - poses[k - 1, 0], poses[k, 1] - poses[k - 1, 1]
            turned = np.array([u[0], u[1], u[2] - dy * u[0] + dx * u[1]])
            w, k = posteriors[k - 1] @ turned, k - 1
            left = (turned @ w) / whole
        else:
            left = 0.0
        if left < FORGOTTEN:
            for i in range(POSE):
                for i2 in range(POSE):
                    before[i, i2] = share * inverse[i, i2]
            back = np.eye(POSE)
            back[0, 2], back[1, 2] = last_y - y, x - last_x
            before[:] = back.T @ before @ back
            return
        share = left


@compiled_inline
def _fill(  # noqa: PLR0917 - a row of an observation, number by number
    row: FloatArray,
    in_x: float,
    in_y: float,
    in_theta: float,
    back: tuple[float, float],
    surveyed: float,
    j: tuple[float, float, float, float, float],
    sigmas: FloatArray,
) -> None:
    """Write (H F^-1, J), with F of a motion from `back` of the fix [m] to it."""
    row[0], row[1], row[2] = in_x, in_y, in_theta - in_x * back[1] + in_y * back[0]
    row[3], row[4] = -surveyed * in_x, -surveyed * in_y
    for column in range(PER_SCANNER):
        row[OWN + column] = sigmas[column] * j[column]


@compiled
def _add(gram: FloatArray, by_range: FloatArray, by_bearing: FloatArray, each: tuple[float, float], first: int) -> None:
    """Add a detection of a scanner whose constants stand from `first` on after those that are the reflector's own."""
    for a in range(OWN + PER_SCANNER):
        i = a if a < OWN else first + a
        for b in range(a + 1):
            j = b if b < OWN else first + b
            more = each[0] * by_range[a] * by_range[b] + each[1] * by_bearing[a] * by_bearing[b]
            gram[i, j] += more
            if i != j:
                gram[j, i] += more


def warm_up() -> None:
    """Compile the kernel of this module."""
    planned = smallest_route()
    everything = np.ones(len(planned.reflectors), np.bool_)
    fix_shares(planned, predict_route(planned), len(planned.drive) - 1, 0, everything)

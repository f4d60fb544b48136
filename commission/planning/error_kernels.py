"""Compiled recursion of the error along a planned drive; its kinds are told in `error_budget`."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from commission.compiled import compiled, compiled_inline
from commission.geometry.arrays import FloatArray, IntArray
from commission.geometry.directions import direction_of
from commission.geometry.se2 import compose_scalars, inverse_scalars
from commission.localization.consider import (
    BLOCKS,
    PER_REFLECTOR,
    PER_SCANNER,
    Considering,
    ConsiderModel,
    ScannerJacobian,
    considering_at,
    innovation_given,
    scanner_jacobian,
)
from commission.localization.consider_columns import begin, room_for
from commission.localization.consider_correction import correct_given
from commission.localization.kalman import Gain, Innovation, corrected_covariance, gain, innovation
from commission.localization.observation import Expected, ObservationModel, expect, observation_at, scanner_offset
from commission.localization.odometry import OdometryNoise, predict
from commission.localization.pose_gaussian import PoseGaussian
from commission.planning.detection_noise import DetectionNoise, Worth, worth
from commission.planning.prediction_kernels import (
    count_of,
    mix,
    mixed,
    put_all_back,
    remember,
    same_size,
    step_to,
    take_out_all,
    twist_of,
)

FORGOTTEN = 1e-16
"""Squared response below which a reflector is no longer followed [m^2, rad^2]."""


class ErrorModel(NamedTuple):
    """What the recursion reads besides the drive."""

    odometry: OdometryNoise
    observations: FloatArray
    """(S, 6) what the filter believes of the detections of each scanner: `observation_rows`."""
    noise: DetectionNoise
    """What they are truly worth."""
    gate_d2: float
    """Largest squared Mahalanobis distance of an inlier; infinite without the filter."""
    inside_gate: float
    """Probability of that, by the filter's own belief."""
    free_per_m: float
    """Probability per metre of ray that nobody is in the way."""
    beams: FloatArray
    """(S, 2) of each scanner: bearing of the first beam and step between beams [rad]."""
    consider: ConsiderModel
    """Variances of the constants of a scanner."""


NOISE, MAP, MOUNTING, RANGE, CLOCK_PART = range(5)
"""What contributes to an error: what is new in every scan or repeats with the beams; survey; mounting; range; clock."""
PARTS = 5


class _Passing(NamedTuple):
    """What the association filter does to true detections."""

    probability: float
    """That one passes."""
    smaller: float
    """Factor of the innovation's covariance of those that pass."""
    larger: float
    """The same of those that do not."""


@compiled
def propagate_errors(  # noqa: PLR0917 - the columns of a drive
    stamps_ns: IntArray,
    poses: FloatArray,
    offsets: IntArray,
    indices: IntArray,
    places: FloatArray,
    kinds: IntArray,
    scanners: IntArray,
    priors: FloatArray,
    start_sigmas: FloatArray,
    cross: FloatArray | None,
    blocks: IntArray,
    model: ErrorModel,
    squares: FloatArray,
    inliers: FloatArray,
    parts: FloatArray,
) -> None:
    """Second moments of the error after each scan.

    Parameters
    ----------
    stamps_ns, poses : the K scans of a drive.
    offsets, indices : visible reflectors of each scan.
    places : (M, 4) x, y, and variance of the surveyed place of each reflector, as the filter has it and as it is.
    kinds : (S, M) row of `model.noise` of each reflector for each scanner.
    scanners : (K,) scanner of each scan.
    priors : (K, 3, 3) what the filter believes before the detections of each scan.
    start_sigmas : (3,) of the start pose.
    cross, blocks : as in `predict_covariances`.
    model : what the filter believes of its detections, and what they are truly worth.
    squares : (K, 3, 3) output.
    inliers : (K,) output: expected number of inliers of each scan.
    parts : (K, 5, 3, 3) output: what each of `PARTS` contributes; they add up to `squares`.

    Notes
    -----
    E[e e^T] = P + b b^T + sum of R V R^T over reflectors and scanners: white errors P, mean error b, and the response R
    of the pose to errors that stay (waves, places, mounting, range, clock), of variance V. Derived: e = (I - K H) F e
    before + K (error of the detection), with the gain K that the filter believes in.
    """
    # Per reflector, what one unit of its error moves the pose by: two quarters of its wave, two axes of its place.
    # Every scanner has waves of its own; the place of a reflector stands with the waves of the first.
    rows = kinds.size
    responses = np.zeros((rows, 3, 4))
    followed, is_followed, count = np.empty(rows, np.int64), np.zeros(rows, np.bool_), 0
    askew = np.zeros((len(model.observations), 3, PER_SCANNER))
    bias = np.zeros(3)
    x, y, theta = poses[0, 0], poses[0, 1], poses[0, 2]
    sx, sy, st = start_sigmas[0], start_sigmas[1], start_sigmas[2]
    error = PoseGaussian(x, y, theta, sx * sx, 0.0, 0.0, sy * sy, 0.0, st * st)
    for k in range(len(stamps_ns)):
        x, y, theta = poses[k, 0], poses[k, 1], poses[k, 2]
        step, pivot = step_to(poses, stamps_ns, k), (x, y)
        if k > 0:
            pivot = (poses[k - 1, 0], poses[k - 1, 1])
            error = _moved(error, x, y, theta, step[3], model.odometry)
            _turn(responses, followed[:count], bias, askew, x - pivot[0], y - pivot[1])
        belief, scanner, first, last = _at(x, y, theta, priors[k]), scanners[k], offsets[k], offsets[k + 1]
        observation, inliers[k] = observation_at(model.observations, scanner), 0.0
        offset_x, offset_y = scanner_offset(theta, observation)
        twist, reflectors = twist_of(step), count_of(cross, model.observations)
        given = considering_at(room_for(cross, last - first), belief, pivot, twist, model.consider)
        begin(given, reflectors, scanner)
        take_out_all(given, blocks, indices, first, last)
        kept = same_size(given)
        for i in range(first, last):
            m, at = indices[i], BLOCKS + PER_REFLECTOR * (i - first)
            mount = observation.mount_theta
            e = expect(x, y, theta, offset_x, offset_y, places[m, 0], places[m, 1], mount)
            true = worth(model.noise, int(kinds[scanner, m]), e.range)
            says = innovation_given(belief, e, e.range, e.bearing, places[m, 2], observation, given, at)
            passing = _passing(belief, e, says, true, places[m, 2], observation, model.gate_d2, given, at)
            seen = true.probability * model.free_per_m**e.range
            error = _after(error, e, gain(says), true, passing, seen, observation)
            row = scanner * len(places) + m
            for each in (row, m):
                if not is_followed[each]:
                    followed[count], is_followed[each] = each, True
                    count += 1
            share = seen * passing.probability
            inliers[k] += share
            _respond(responses, followed[:count], bias, askew, e, gain(says), share)
            _disturb(responses, row, m, bias, e, gain(says), share, true, model.beams[scanner])
            j = scanner_jacobian(direction_of(theta), e, twist[0], twist[1], twist[2])
            _disturb_all(askew[scanner], j, gain(says), share)
            remember(given, kept)
            probability = seen * model.inside_gate
            corrected = correct_given(
                belief, e.range, e.bearing, places[m, 0], places[m, 1], places[m, 2], observation, given, at
            )
            belief = mixed(belief, corrected, probability)
            mix(given, kept, probability)
        put_all_back(given, blocks, indices, first, last, reflectors, scanner)
        count = _forget(responses, followed, is_followed, count)
        _gather(error, responses, followed[:count], places, bias, squares[k], parts[k])
        _gather_scanners(askew, model.consider, squares[k], parts[k])


@compiled_inline
def _moved(  # noqa: PLR0917 - a pose, number by number
    error: PoseGaussian, x: float, y: float, theta: float, seconds: float, noise: OdometryNoise
) -> PoseGaussian:
    """Error after the motion to a pose."""
    back_x, back_y, back_theta = inverse_scalars(error.x, error.y, error.theta)
    dx, dy, dtheta = compose_scalars(back_x, back_y, back_theta, x, y, theta)
    moved = predict(error, dx, dy, dtheta, seconds, noise)
    return PoseGaussian(x, y, theta, moved.xx, moved.xy, moved.xt, moved.yy, moved.yt, moved.tt)


@compiled_inline
def _at(x: float, y: float, theta: float, c: FloatArray) -> PoseGaussian:
    """Belief of a covariance (3, 3) at a pose."""
    return PoseGaussian(x, y, theta, c[0, 0], c[0, 1], c[0, 2], c[1, 1], c[1, 2], c[2, 2])


@compiled_inline
def _passing(  # noqa: PLR0917 - a detection, number by number
    belief: PoseGaussian,
    e: Expected,
    says: Innovation,
    true: Worth,
    surveyed: float,
    o: ObservationModel,
    gate_d2: float,
    given: Considering | None,
    at: int,
) -> _Passing:
    """What the gate g does when the filter says S of innovations whose covariance is T.

    For T = l S, with u = g / 2l: 1 - exp(-u) pass, with the covariance T (1 - u exp(-u) / (1 - exp(-u))). l is half the
    trace of S^-1 T. T has the true noise, but the pose's covariance is the filter's: with the true one, the few drives
    that are rejected would widen it until all drives seemed to be.
    """
    actual = ObservationModel(o.mount_x, o.mount_y, o.mount_theta, true.range_variance, true.bearing_variance, 0.0)
    is_so = innovation_given(belief, e, e.range, e.bearing, surveyed, actual, given, at)
    across = is_so.w - says.w
    trace = is_so.s_rr / says.s_rr + (is_so.schur + across * across * is_so.s_rr) / says.schur
    u = gate_d2 / trace
    outside = math.exp(-u)
    # Without a gate, or far inside it, nothing is rejected.
    if outside < 1e-12:
        return _Passing(1.0, 1.0, 1.0)
    smaller = 1.0 - u * outside / (1.0 - outside)
    # All of them together have the factor 1.
    return _Passing(1.0 - outside, smaller, (1.0 - (1.0 - outside) * smaller) / outside)


@compiled_inline
def _after(  # noqa: PLR0917 - a detection, number by number
    error: PoseGaussian,
    e: Expected,
    k: Gain,
    true: Worth,
    passing: _Passing,
    seen: float,
    observation: ObservationModel,
) -> PoseGaussian:
    """Covariance of what is new in every scan, after a detection that may be missing or rejected.

    Given the innovation v, the error before is L v and a rest of covariance P - L T L^T, with L the gain of a filter
    that knew P and T. So afterwards it is (L - K) v or, when rejected, L v, besides that same rest.
    """
    o = observation
    range_noise = max(true.range_variance - 0.5 * true.range_wave * true.range_wave, 1e-12)
    bearing_noise = max(true.bearing_variance - 0.5 * true.bearing_wave * true.bearing_wave, 1e-12)
    white = ObservationModel(o.mount_x, o.mount_y, o.mount_theta, range_noise, bearing_noise, 0.0)
    is_so = innovation(error, e, e.range, 0.0, 0.0, white)
    rest = _corrected(error, e, gain(is_so), is_so)
    taken = mixed(rest, _corrected(error, e, k, is_so), passing.smaller)
    rejected = mixed(rest, error, passing.larger)
    return mixed(error, mixed(rejected, taken, passing.probability), seen)


@compiled_inline
def _corrected(error: PoseGaussian, e: Expected, k: Gain, is_so: Innovation) -> PoseGaussian:
    """Error after a correction by a gain."""
    xx, xy, xt, yy, yt, tt = corrected_covariance(error, e, k, is_so.range_noise, is_so.bearing_noise)
    return PoseGaussian(error.x, error.y, error.theta, xx, xy, xt, yy, yt, tt)


@compiled
def _turn(  # noqa: PLR0917 - all kinds of error
    responses: FloatArray, followed: IntArray, bias: FloatArray, askew: FloatArray, mx: float, my: float
) -> None:
    """A motion by (mx, my) [m] turns an error of the heading into one of the position."""
    for scanner in range(len(askew)):
        for column in range(PER_SCANNER):
            askew[scanner, 0, column] -= my * askew[scanner, 2, column]
            askew[scanner, 1, column] += mx * askew[scanner, 2, column]
    bias[0] -= my * bias[2]
    bias[1] += mx * bias[2]
    for m in followed:
        for column in range(4):
            responses[m, 0, column] -= my * responses[m, 2, column]
            responses[m, 1, column] += mx * responses[m, 2, column]


@compiled
def _respond(  # noqa: PLR0917 - a detection, number by number
    responses: FloatArray,
    followed: IntArray,
    bias: FloatArray,
    askew: FloatArray,
    e: Expected,
    k: Gain,
    share: float,
) -> None:
    """A correction takes a share of every error back: B -= share K H B."""
    for scanner in range(len(askew)):
        b = askew[scanner]
        for c in range(PER_SCANNER):
            b[0, c], b[1, c], b[2, c] = _less(b[0, c], b[1, c], b[2, c], e, k, share)
    bias[0], bias[1], bias[2] = _less(bias[0], bias[1], bias[2], e, k, share)
    for m in followed:
        b = responses[m]
        for c in range(4):
            b[0, c], b[1, c], b[2, c] = _less(b[0, c], b[1, c], b[2, c], e, k, share)


@compiled_inline
def _less(  # noqa: PLR0917 - an error, number by number
    x: float, y: float, theta: float, e: Expected, k: Gain, share: float
) -> tuple[float, float, float]:
    """An error of the pose after a correction that knows nothing else."""
    r = share * (e.range_x * x + e.range_y * y + e.range_theta * theta)
    b = share * (e.bearing_x * x + e.bearing_y * y + e.bearing_theta * theta)
    return x - k.xr * r - k.xb * b, y - k.yr * r - k.yb * b, theta - k.tr * r - k.tb * b


@compiled
def _disturb(  # noqa: PLR0917 - a detection, number by number
    responses: FloatArray,
    row: int,
    place: int,
    bias: FloatArray,
    e: Expected,
    k: Gain,
    share: float,
    true: Worth,
    beams: FloatArray,
) -> None:
    """Add what a detection brings in: its mean error, its wave, and one metre of survey error along each axis."""
    psi = 2.0 * math.pi * (e.bearing - beams[0]) / beams[1]
    c, s = math.cos(psi), math.sin(psi)
    # A wave of unknown phase is a cosine and a sine of independent amplitudes, each with half of the square.
    in_range = (math.sqrt(0.5) * true.range_wave * c, -math.sqrt(0.5) * true.range_wave * s, -e.range_x, -e.range_y)
    in_bearing = (
        math.sqrt(0.5) * true.bearing_wave * s,
        math.sqrt(0.5) * true.bearing_wave * c,
        -e.bearing_x,
        -e.bearing_y,
    )
    for column in range(4):
        r, b = share * in_range[column], share * in_bearing[column]
        m = row if column < 2 else place
        responses[m, 0, column] += k.xr * r + k.xb * b
        responses[m, 1, column] += k.yr * r + k.yb * b
        responses[m, 2, column] += k.tr * r + k.tb * b
    bias[0] += k.xr * share * true.range_bias
    bias[1] += k.yr * share * true.range_bias
    bias[2] += k.tr * share * true.range_bias


@compiled_inline
def _disturb_all(b: FloatArray, j: ScannerJacobian, k: Gain, share: float) -> None:
    """Add what one unit of each constant of a scanner brings in with a detection: B += share K J."""
    in_range = (j.mount_xr, j.mount_yr, 0.0, 1.0, j.clock_r)
    in_bearing = (j.mount_xb, j.mount_yb, -1.0, 0.0, j.clock_b)
    for column in range(PER_SCANNER):
        r, across = share * in_range[column], share * in_bearing[column]
        b[0, column] += k.xr * r + k.xb * across
        b[1, column] += k.yr * r + k.yb * across
        b[2, column] += k.tr * r + k.tb * across


@compiled
def _forget(responses: FloatArray, followed: IntArray, is_followed: np.ndarray, count: int) -> int:
    """Follow no longer what has faded; return how many are left."""
    left = 0
    for i in range(count):
        m = followed[i]
        if np.abs(responses[m]).max() ** 2 < FORGOTTEN:
            responses[m] = 0.0
            is_followed[m] = False
        else:
            followed[left] = m
            left += 1
    return left


@compiled
def _gather(  # noqa: PLR0917 - all kinds of error
    error: PoseGaussian,
    responses: FloatArray,
    followed: IntArray,
    places: FloatArray,
    bias: FloatArray,
    square: FloatArray,
    part: FloatArray,
) -> None:
    """Add up what is not the scanner's into a (3, 3) second moment, and into each of its (5, 3, 3) parts."""
    square[0, 0], square[0, 1], square[0, 2] = error.xx, error.xy, error.xt
    square[1, 0], square[1, 1], square[1, 2] = error.xy, error.yy, error.yt
    square[2, 0], square[2, 1], square[2, 2] = error.xt, error.yt, error.tt
    part[:] = 0.0
    for i in range(3):
        for j in range(3):
            square[i, j] += bias[i] * bias[j]
            for m in followed:
                b = responses[m]
                square[i, j] += b[i, 0] * b[j, 0] + b[i, 1] * b[j, 1]
                surveyed = places[m % len(places), 3] * (b[i, 2] * b[j, 2] + b[i, 3] * b[j, 3])
                square[i, j] += surveyed
                part[MAP, i, j] += surveyed
            part[NOISE, i, j] = square[i, j] - part[MAP, i, j]


@compiled
def _gather_scanners(askew: FloatArray, variances: ConsiderModel, square: FloatArray, part: FloatArray) -> None:
    """Add what the constants of the scanners contribute."""
    p = variances
    each = (p.mount_position, p.mount_position, p.mount_heading, p.range_bias, p.clock)
    kinds = (MOUNTING, MOUNTING, MOUNTING, RANGE, CLOCK_PART)
    for scanner in range(len(askew)):
        b = askew[scanner]
        for column in range(PER_SCANNER):
            for i in range(3):
                for j in range(3):
                    more = each[column] * b[i, column] * b[j, column]
                    square[i, j] += more
                    part[kinds[column], i, j] += more

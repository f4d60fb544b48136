"""Compiled covariance recursion along a planned drive: the localizer's own *predict*, *correct* and supervisor."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from commission.compiled import compiled, compiled_inline
from commission.geometry.angles import wrap_scalar
from commission.geometry.arrays import FloatArray, IntArray
from commission.geometry.se2 import compose_scalars, inverse_scalars, log_scalars
from commission.localization.consider import (
    BLOCKS,
    PER_REFLECTOR,
    PER_SCANNER,
    Considering,
    ConsiderModel,
    considering_at,
    innovation_given,
)
from commission.localization.consider_columns import begin, put_back, put_block, room_for, take_out
from commission.localization.consider_correction import correct_given
from commission.localization.kalman import Innovation, squared_distance
from commission.localization.observation import ObservationModel, expect, observation_at, scanner_offset
from commission.localization.odometry import OdometryNoise, predict
from commission.localization.pose_gaussian import PoseGaussian
from commission.localization.supervisor import SupervisorLimits, supervise
from commission.planning.detection_noise import LIKELY, DetectionNoise, worth


class PredictionModel(NamedTuple):
    """What the recursion reads besides the drive."""

    odometry: OdometryNoise
    observations: FloatArray
    """(S, 6) `observation_rows` of the scanners."""
    limits: SupervisorLimits
    gate_d2: float
    """Squared Mahalanobis distance from which an expected innovation is rejected; infinite without the filter."""
    inside_gate: float
    """Probability that a detection of a visible reflector passes the association filter."""
    free_per_m: float
    """Probability per metre of ray that nobody is in the way."""
    noise: DetectionNoise
    """Probability that a visible reflector passes the detector filter, by class and distance."""
    kinds: IntArray
    """(S, M) row of `noise` of each reflector for each scanner."""
    consider: ConsiderModel
    """Variances of the constants of a scanner."""


class PredictionColumns(NamedTuple):
    """Where the recursion writes, a row per scan."""

    prior_covariances: FloatArray
    means: FloatArray
    covariances: FloatArray
    modes: NDArray[np.int8]
    seen: IntArray
    on_odometry: FloatArray
    innovations: FloatArray
    """(N, 3) covariance S of the innovation of every visible reflector: S_rr, w = S_rb / S_rr, S_bb - w S_rb."""


@compiled
def predict_covariances(  # noqa: PLR0917 - the columns of a drive
    stamps_ns: IntArray,
    poses: FloatArray,
    metres: FloatArray,
    scanners: IntArray,
    offsets: IntArray,
    indices: IntArray,
    places: FloatArray,
    shifts: FloatArray,
    reach: FloatArray,
    belief: PoseGaussian,
    cross: FloatArray | None,
    blocks: IntArray,
    model: PredictionModel,
    columns: PredictionColumns,
) -> None:
    """Run the filter over exact odometry and exact detections.

    Parameters
    ----------
    stamps_ns, poses, metres, scanners : the K scans of a drive.
    offsets, indices : visible reflectors of each scan.
    places : (M, 4) x, y and variance of each reflector as the filter has it.
    shifts : (M, 2) what the reflectors have moved since [m].
    reach : (M,) distance up to which each is seen [m]; negative: never.
    belief : at the first scan, before its detections.
    cross : (3, 2 B + 5 S) zeros, for the covariance with the considered constants; None: none is considered.
    blocks : (M,) which two columns of it a reflector has that is seen at all.
    model : what the filter reads besides the drive.
    columns : outputs.

    Notes
    -----
    P = p (I - K H) P + (1 - p) P per visible reflector, p the probability that it is detected: Sinopoli et al. 2004,
    with the localizer's own *predict* and *correct*.
    """
    prior_covariances, means, covariances, modes, seen, on_odometry, innovations = columns
    mode, last_seen_at, pivot = 0, metres[0], (belief.x, belief.y)
    for k in range(len(stamps_ns)):
        x, y, theta = poses[k, 0], poses[k, 1], poses[k, 2]
        step = step_to(poses, stamps_ns, k)
        if k > 0:
            belief = predict(belief, step[0], step[1], step[2], step[3], model.odometry)
        _write_covariance(belief, k, prior_covariances)
        prior, observation, first, last = (
            belief,
            observation_at(model.observations, scanners[k]),
            offsets[k],
            offsets[k + 1],
        )
        offset_x, offset_y = scanner_offset(theta, observation)
        reflectors = count_of(cross, model.observations)
        given = considering_at(room_for(cross, last - first), prior, pivot, twist_of(step), model.consider)
        begin(given, reflectors, scanners[k])
        take_out_all(given, blocks, indices, first, last)
        kept = same_size(given)
        passes, found = np.empty(last - first, np.bool_), 0
        for i in range(first, last):
            m = indices[i]
            target_x, target_y = places[m, 0] + shifts[m, 0], places[m, 1] + shifts[m, 1]
            truth = expect(x, y, theta, offset_x, offset_y, target_x, target_y, observation.mount_theta)
            at = BLOCKS + PER_REFLECTOR * (i - first)
            v = _expected_innovation(prior, truth.range, truth.bearing, places, m, observation, given, at)
            passes[i - first] = truth.range <= reach[m] and squared_distance(v) <= model.gate_d2
            innovations[i, 0], innovations[i, 1], innovations[i, 2] = v.s_rr, v.w, v.schur
        for i in range(first, last):
            if not passes[i - first]:
                continue
            m = indices[i]
            target_x, target_y = places[m, 0] + shifts[m, 0], places[m, 1] + shifts[m, 1]
            truth = expect(x, y, theta, offset_x, offset_y, target_x, target_y, observation.mount_theta)
            remember(given, kept)
            corrected = correct_given(
                belief,
                truth.range,
                truth.bearing,
                places[m, 0],
                places[m, 1],
                places[m, 2],
                observation,
                given,
                BLOCKS + PER_REFLECTOR * (i - first),
            )
            detected = worth(model.noise, int(model.kinds[scanners[k], m]), truth.range).probability
            found += detected >= LIKELY
            probability = detected * model.inside_gate * model.free_per_m**truth.range
            belief = mixed(belief, corrected, probability)
            mix(given, kept, probability)
        put_all_back(given, blocks, indices, first, last, reflectors, scanners[k])
        pivot = (belief.x, belief.y)
        mode = supervise(mode, belief, model.limits)
        if found > 0:
            last_seen_at = metres[k]
        means[k, 0], means[k, 1], means[k, 2] = belief.x, belief.y, belief.theta
        _write_covariance(belief, k, covariances)
        modes[k], seen[k], on_odometry[k] = mode, found, metres[k] - last_seen_at


@compiled_inline
def step_to(poses: FloatArray, stamps_ns: IntArray, k: int) -> tuple[float, float, float, float]:
    """Motion from the scan before to a scan [m, m, rad], and its time [s]; none to the first.

    Parameters
    ----------
    poses, stamps_ns : the scans of a drive.
    k : number of the scan.

    Notes
    -----
    T_k-1^-1 T_k, by definition.
    """
    if k == 0:
        return 0.0, 0.0, 0.0, 0.0
    back_x, back_y, back_theta = inverse_scalars(poses[k - 1, 0], poses[k - 1, 1], poses[k - 1, 2])
    dx, dy, dtheta = compose_scalars(back_x, back_y, back_theta, poses[k, 0], poses[k, 1], poses[k, 2])
    return dx, dy, dtheta, 1e-9 * (stamps_ns[k] - stamps_ns[k - 1])


@compiled_inline
def twist_of(step: tuple[float, float, float, float]) -> tuple[float, float, float]:
    """Velocity of base in a motion [m/s, m/s, rad/s], in base; none where it took no time.

    Notes
    -----
    log(displacement) / time, by definition of a constant twist.
    """
    if not step[3] > 0.0:
        return 0.0, 0.0, 0.0
    forward, left, turn = log_scalars(step[0], step[1], step[2])
    return forward / step[3], left / step[3], turn / step[3]


@compiled_inline
def count_of(cross: FloatArray | None, observations: FloatArray) -> int:
    """Number of reflectors that a cross covariance has columns for.

    Notes
    -----
    (columns - 5 S) / 2, by definition.
    """
    if cross is None:
        return 0
    return (cross.shape[1] - PER_SCANNER * len(observations)) // PER_REFLECTOR


@compiled_inline
def take_out_all(given: Considering | None, blocks: IntArray, indices: IntArray, first: int, last: int) -> None:
    """Write the columns of all visible reflectors of a scan.

    Parameters
    ----------
    given : of the scan, or None.
    blocks : (M,) columns that each reflector has in the covariance with the constants.
    indices : visible reflectors of all scans.
    first, last : those of this one, the last one excluded.

    Notes
    -----
    No formula: `take_out` of each.
    """
    if given is None:
        return
    for i in range(first, last):
        take_out(given, BLOCKS + PER_REFLECTOR * (i - first), int(blocks[indices[i]]))


@compiled_inline
def put_all_back(  # noqa: PLR0917 - the columns of a drive
    given: Considering | None,
    blocks: IntArray,
    indices: IntArray,
    first: int,
    last: int,
    reflectors: int,
    scanner: int,
) -> None:
    """Carry the covariance with all constants over a scan.

    Parameters
    ----------
    given, blocks, indices, first, last : as in `take_out_all`.
    reflectors : that the covariance with the constants has columns for.
    scanner : index of the scanner.

    Notes
    -----
    No formula: `put_back`, and `put_block` of each.
    """
    if given is None:
        return
    put_back(given, reflectors, scanner)
    for i in range(first, last):
        put_block(given, BLOCKS + PER_REFLECTOR * (i - first), int(blocks[indices[i]]))


@compiled_inline
def same_size(given: Considering | None) -> FloatArray | None:
    """Array of the size of a scan's working array, or None.

    Notes
    -----
    shape = (3, columns), by definition.
    """
    if given is None:
        return None
    return np.empty((3, given.room.work.shape[1]))


@compiled_inline
def remember(given: Considering | None, kept: FloatArray | None) -> None:
    """Copy a scan's working array.

    Notes
    -----
    kept = work, by definition.
    """
    if given is None or kept is None:
        return
    work = given.room.work
    for row in range(3):
        for j in range(work.shape[1]):
            kept[row, j] = work[row, j]


@compiled_inline
def mix(given: Considering | None, kept: FloatArray | None, probability: float) -> None:
    """Mean of the covariance with the constants with a detection and without it, as `mixed`.

    Parameters
    ----------
    given : of the scan, whose working array is with the detection; in place.
    kept : without it.
    probability : that there is one [0..1].

    Notes
    -----
    C = p C_after + (1 - p) C_before: Sinopoli et al. 2004, of the whole covariance.
    """
    if given is None or kept is None:
        return
    work = given.room.work
    for row in range(3):
        for j in range(work.shape[1]):
            work[row, j] = probability * work[row, j] + (1.0 - probability) * kept[row, j]


@compiled
def separations(  # noqa: PLR0917 - the columns of a drive
    rows: IntArray,
    scans: IntArray,
    poses: FloatArray,
    scanners: IntArray,
    innovations: FloatArray,
    places: FloatArray,
    reflector: int,
    neighbor: int,
    observations: FloatArray,
    squared: FloatArray,
) -> None:
    """Squared Mahalanobis distance between the expected observations of two reflectors at some scans.

    Parameters
    ----------
    rows : (n,) of `innovations`: where the reflector is seen.
    scans : (n,) rows of `poses`.
    poses : (K, 3) `T_map_base` of the scans of a drive [m, m, rad].
    scanners : (K,) scanner of each.
    innovations : (N, 3) as in `PredictionColumns`.
    places : (M, 4) as in `predict_covariances`.
    reflector, neighbor : rows of `places`; the covariance is that of the reflector's innovation.
    observations : (S, 6) `observation_rows` of the scanners.
    squared : (n,) output.

    Notes
    -----
    d2 = v^T S^-1 v with v = h(neighbor) - h(reflector): Sobreira et al. 2016, Algorithm 3, with a neighbor in the place
    of the detection. S is that of the filter, with what it considers.
    """
    for i in range(len(rows)):
        x, y, theta = poses[scans[i], 0], poses[scans[i], 1], poses[scans[i], 2]
        observation = observation_at(observations, int(scanners[int(scans[i])]))
        offset_x, offset_y = scanner_offset(theta, observation)
        mount = observation.mount_theta
        own = expect(x, y, theta, offset_x, offset_y, places[reflector, 0], places[reflector, 1], mount)
        other = expect(x, y, theta, offset_x, offset_y, places[neighbor, 0], places[neighbor, 1], mount)
        along, s_rr = other.range - own.range, innovations[rows[i], 0]
        across = wrap_scalar(other.bearing - own.bearing) - innovations[rows[i], 1] * along
        squared[i] = along * along / s_rr + across * across / innovations[rows[i], 2]


@compiled_inline
def _expected_innovation(  # noqa: PLR0917 - a measurement, number by number
    prior: PoseGaussian,
    distance: float,
    bearing: float,
    places: FloatArray,
    m: int,
    observation: ObservationModel,
    given: Considering | None,
    at: int,
) -> Innovation:
    """Innovation of the expected detection at the predicted belief, constants considered."""
    offset_x, offset_y = scanner_offset(prior.theta, observation)
    mount = observation.mount_theta
    expected = expect(prior.x, prior.y, prior.theta, offset_x, offset_y, places[m, 0], places[m, 1], mount)
    return innovation_given(prior, expected, distance, bearing, places[m, 2], observation, given, at)


@compiled_inline
def mixed(before: PoseGaussian, after: PoseGaussian, probability: float) -> PoseGaussian:
    """Mean of a belief with a detection and without it, by the probability of the detection.

    Parameters
    ----------
    before, after : belief without and with the detection.
    probability : that there is one [0..1].

    Notes
    -----
    P = p P_after + (1 - p) P_before: Sinopoli et al. 2004, the modified Riccati equation. Of the covariances alone: the
    filter knows whether it was corrected, so that the spread between the two means is no uncertainty of its own.
    """
    a, b = probability, 1.0 - probability
    return PoseGaussian(
        a * after.x + b * before.x,
        a * after.y + b * before.y,
        before.theta + a * wrap_scalar(after.theta - before.theta),
        a * after.xx + b * before.xx,
        a * after.xy + b * before.xy,
        a * after.xt + b * before.xt,
        a * after.yy + b * before.yy,
        a * after.yt + b * before.yt,
        a * after.tt + b * before.tt,
    )


@compiled_inline
def _write_covariance(belief: PoseGaussian, row: int, covariances: FloatArray) -> None:
    """Write a covariance to its row."""
    covariances[row, 0, 0], covariances[row, 0, 1], covariances[row, 0, 2] = belief.xx, belief.xy, belief.xt
    covariances[row, 1, 0], covariances[row, 1, 1], covariances[row, 1, 2] = belief.xy, belief.yy, belief.yt
    covariances[row, 2, 0], covariances[row, 2, 1], covariances[row, 2, 2] = belief.xt, belief.yt, belief.tt

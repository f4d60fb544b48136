"""Protection levels: how large the error of a run can be where one reflector misleads it and nobody notices.

Solution separation: beside the run, one filter for each reflector of late that leaves this reflector out. One step
judges a cycle: the supervisor calls it where it goes by protection levels, the study of a finished run for any run.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from commission.compiled import compiled, compiled_inline
from commission.geometry.angles import wrap_scalar
from commission.geometry.arrays import FloatArray, IntArray
from commission.localization.kalman import correct
from commission.localization.observation import ObservationModel, observation_at
from commission.localization.pose_gaussian import PoseGaussian, larger_eigenvalue, pose_in, write_pose
from commission.localization.supervisor import INITIALIZING, LOST
from commission.localization.temporary_joint import covariance_of, is_changed, solve_three
from commission.localization.zones import ZoneRows, kinds_at

SLOTS = 24
"""Reflectors that are left out, one by one, at most: those seen last."""
KEPT_CYCLES = 20
"""Cycles after its last sighting in which a reflector is left out in any case."""
NEGLIGIBLE = 1.05
"""Variance without a reflector, as a multiple of that with it, below which its filter is given up."""
INLIER = 0


EVERY, NEWEST = SLOTS, SLOTS + 1
"""Rows of the filter that leaves no reflector out, and of the run's own belief after its newest cycle."""


class Levels(NamedTuple):
    """What the kernel writes, a row per cycle."""

    position: FloatArray
    """(K,) largest error of the position [m]; inf where the vehicle is lost or not located."""
    heading: FloatArray
    """(K,) largest error of the heading [rad]."""
    reflector: IntArray
    """(K,) number of the reflector whose failure would be worst for the position; -1: no fault is."""


class Level(NamedTuple):
    """Protection level of one cycle."""

    position: float
    """Largest error of the position [m]."""
    heading: float
    """Largest error of the heading [rad]."""
    reflector: int
    """Number of the reflector whose failure would be worst for the position; -1: no fault is."""


class ProtectionModel(NamedTuple):
    """What levels are reckoned with, for kernels."""

    risk: float
    """Integrity risk per cycle."""
    fault: float
    """Probability that a reflector in sight misleads."""
    places: FloatArray
    """(N, 3) x, y [m] and variance [m^2] of each reflector of the map."""
    numbers: IntArray
    """(N,) number by which each is known; the same reflector has the same in all maps that a bank is used with."""
    others: bool
    """Whether what else corrects the pose knows nothing of reflectors, by which temporary landmarks got theirs."""


class Bank(NamedTuple):
    """Filters that leave one reflector out each, one that leaves none out, and the run's own belief; in and out."""

    beliefs: FloatArray
    """(SLOTS + 2, 9) x, y, theta, xx, xy, xt, yy, yt, tt."""
    owner: IntArray
    """(SLOTS,) number of the reflector that is left out; -1: the filter is not used."""
    unseen: IntArray
    """(SLOTS,) cycles since its last sighting."""
    begun: NDArray[np.bool_]
    """(1,) whether the rows that leave none out are in use."""


def new_bank() -> Bank:
    """Return a bank in which no filter is used."""
    owner, unseen = np.full(SLOTS, -1, dtype=np.int64), np.zeros(SLOTS, dtype=np.int64)
    return Bank(np.zeros((SLOTS + 2, 9)), owner, unseen, np.zeros(1, dtype=np.bool_))


@compiled_inline
def forget(bank: Bank) -> None:
    """Give all filters up: the next cycle begins anew, from the run's own belief.

    Parameters
    ----------
    bank : in and out.

    Notes
    -----
    No formula: it writes flags.
    """
    bank.owner[:] = -1
    bank.begun[0] = False


@compiled
def _belief_of(mean: FloatArray, covariance: FloatArray) -> PoseGaussian:
    """Belief of a mean (3,) and a covariance (3, 3)."""
    return PoseGaussian(
        mean[0],
        mean[1],
        mean[2],
        covariance[0, 0],
        covariance[0, 1],
        covariance[0, 2],
        covariance[1, 1],
        covariance[1, 2],
        covariance[2, 2],
    )


@compiled
def _carried(row: FloatArray, dx: float, dy: float) -> FloatArray:
    """(6,) covariance of a row after a motion by which base moves (dx, dy) [m] in the map.

    Notes
    -----
    F P F^T, F = [[1, 0, -dy], [0, 1, dx], [0, 0, 1]]: Thrun et al. 2005, equation 5.13, in the map frame.
    """
    xx, xy, xt, yy, yt, tt = row[3], row[4], row[5], row[6], row[7], row[8]
    moved = np.empty(6)
    moved[0] = xx - 2.0 * dy * xt + dy * dy * tt
    moved[1] = xy + dx * xt - dy * yt - dx * dy * tt
    moved[2] = xt - dy * tt
    moved[3] = yy + 2.0 * dx * yt + dx * dx * tt
    moved[4] = yt + dx * tt
    moved[5] = tt
    return moved


@compiled
def _predict(bank: Bank, prior: FloatArray) -> None:
    """Carry all filters over the motion between two cycles, as the run's own belief was carried.

    Parameters
    ----------
    bank : filters.
    prior : (9,) belief of the run before this cycle.
    """
    before = bank.beliefs[NEWEST]
    dx, dy = prior[0] - before[0], prior[1] - before[1]
    noise = prior[3:] - _carried(before, dx, dy)
    # With considered constants the difference need be no covariance.
    noise[0], noise[3], noise[5] = max(noise[0], 0.0), max(noise[3], 0.0), max(noise[5], 0.0)
    noise[1] = min(max(noise[1], -math.sqrt(noise[0] * noise[3])), math.sqrt(noise[0] * noise[3]))
    noise[2] = min(max(noise[2], -math.sqrt(noise[0] * noise[5])), math.sqrt(noise[0] * noise[5]))
    noise[4] = min(max(noise[4], -math.sqrt(noise[3] * noise[5])), math.sqrt(noise[3] * noise[5]))
    for slot in range(SLOTS + 1):
        if slot != EVERY and bank.owner[slot] < 0:
            continue
        row = bank.beliefs[slot]
        covariance = _carried(row, dx, dy) + noise
        ax, ay, turn = row[0] - before[0], row[1] - before[1], wrap_scalar(row[2] - before[2])
        row[0], row[1] = prior[0] + ax - dy * turn, prior[1] + ay + dx * turn
        row[2] = wrap_scalar(prior[2] + turn)
        row[3:] = covariance


@compiled
def _enter(bank: Bank, number: int) -> None:
    """See to it that there is a filter without a reflector: one that begins leaves it out from this scan on."""
    free, least = -1, math.inf
    for slot in range(SLOTS):
        if bank.owner[slot] == number:
            bank.unseen[slot] = 0
            return
        if bank.owner[slot] < 0:
            free, least = slot, -math.inf
        elif bank.beliefs[slot, 3] + bank.beliefs[slot, 6] < least:
            free, least = slot, bank.beliefs[slot, 3] + bank.beliefs[slot, 6]
    bank.owner[free], bank.unseen[free] = number, 0
    bank.beliefs[free] = bank.beliefs[EVERY]


@compiled
def _judge(bank: Bank, own: PoseGaussian, model: ProtectionModel) -> Level:
    """Level of a cycle; filters whose reflector matters no more are given up.

    Notes
    -----
    |e| <= |x - x_j| + K sigma_j for each reflector j that may mislead, K sigma for none: solution separation (Blanch et
    al., Navigation 62, 2015), with the position's K = sqrt(-2 ln p), by which exp(-K^2 / 2) bounds a distance in two
    dimensions, and the heading's such that erfc(K / sqrt 2) = p is bounded by the same.
    """
    used = 0
    for slot in range(SLOTS):
        used += bank.owner[slot] >= 0
    k0 = math.sqrt(-2.0 * math.log(0.5 * model.risk))
    kj = math.sqrt(max(-2.0 * math.log(min(0.5 * model.risk / max(used * model.fault, 1e-300), 1.0)), 0.0))
    variance = max(larger_eigenvalue(own.xx, own.xy, own.yy), 0.0)
    heading_variance = max(own.tt, 0.0)
    position, heading, worst = k0 * math.sqrt(variance), k0 * math.sqrt(heading_variance), -1
    every = bank.beliefs[EVERY]
    with_all = max(larger_eigenvalue(every[3], every[4], every[6]), 1e-12)
    for slot in range(SLOTS):
        if bank.owner[slot] < 0:
            continue
        row = bank.beliefs[slot]
        # What the run knows of constants makes its own variance larger than that of a filter of white noise.
        grown = max(larger_eigenvalue(row[3], row[4], row[6]) / with_all, 1.0)
        turned = max(row[8] / max(every[8], 1e-12), 1.0)
        apart = math.hypot(own.x - row[0], own.y - row[1])
        level = apart + kj * math.sqrt(variance * grown)
        if level > position:
            position, worst = level, bank.owner[slot]
        heading = max(heading, abs(wrap_scalar(own.theta - row[2])) + kj * math.sqrt(heading_variance * turned))
        if bank.unseen[slot] > KEPT_CYCLES and grown < NEGLIGIBLE and apart * apart < 0.05 * variance:
            bank.owner[slot] = -1
    return Level(position, heading, worst)


@compiled
def _correct_alike(bank: Bank, prior: PoseGaussian, own: PoseGaussian) -> None:
    """Correct all filters by what has corrected the run in a cycle in which no reflector did: contours, or tags.

    Parameters
    ----------
    bank : in and out.
    prior, own : belief of the run before and after the cycle.

    Notes
    -----
    I = P^-1 - P0^-1 is what the cycle has told, d = x - x0 what it has moved: P_j <- (P_j^-1 + I)^-1 and
    x_j <- x_j + P_j (P^-1 d - I (x_j - x0)): the information form (Thrun et al. 2005, table 3.5), derived.
    """
    before, after = _inverse(prior), _inverse(own)
    moved = np.array((own.x - prior.x, own.y - prior.y, wrap_scalar(own.theta - prior.theta)))
    told, pull = after - before, after @ moved
    for slot in range(SLOTS + 1):
        if slot != EVERY and bank.owner[slot] < 0:
            continue
        row = bank.beliefs[slot]
        information = _inverse(pose_in(row)) + told
        covariance = np.eye(3)
        if not solve_three(information, covariance):
            continue
        apart = np.array((row[0] - prior.x, row[1] - prior.y, wrap_scalar(row[2] - prior.theta)))
        step = covariance @ (pull - told @ apart)
        x, y, theta = row[0] + step[0], row[1] + step[1], wrap_scalar(row[2] + step[2])
        p = covariance
        write_pose(row, PoseGaussian(x, y, theta, p[0, 0], p[1, 0], p[2, 0], p[1, 1], p[2, 1], p[2, 2]))


@compiled
def _inverse(p: PoseGaussian) -> FloatArray:
    """(3, 3) inverse of a covariance; zeros where it is none."""
    inverse = np.eye(3)
    if not solve_three(covariance_of(p), inverse):
        inverse[:] = 0.0
    return inverse


@compiled
def protect_cycle(  # noqa: PLR0917 - a cycle, number by number
    bank: Bank,
    prior: PoseGaussian,
    own: PoseGaussian,
    first: int,
    last: int,
    detections: FloatArray,
    status: NDArray[np.int8],
    reflectors: IntArray,
    observation: ObservationModel,
    model: ProtectionModel,
) -> Level:
    """Carry the filters to a cycle, correct them by what the run has accepted, and return the level.

    Parameters
    ----------
    bank : in and out.
    prior, own : belief of the run before and after the cycle.
    first, last : rows of the scan's detections, the last one excluded.
    detections, status, reflectors : range [m] and bearing [rad], a `Status`, index into the reflector map.
    observation : mounting and noise of the scan's scanner.
    model : map, integrity risk and probability of a fault.

    Notes
    -----
    |e| <= |x - x_j| + K sigma_j, the largest over all j: solution separation, Blanch et al. 2015. Where no reflector
    corrects, what does is taken as right, and tells all filters what it tells the run.
    """
    row = np.empty(9)
    write_pose(row, prior)
    if bank.begun[0]:
        _predict(bank, row)
    else:
        bank.beliefs[EVERY] = row
        bank.begun[0] = True
    bank.unseen[:] += 1
    corrects = False
    for i in range(first, last):
        if status[i] == INLIER:
            corrects = True
            _enter(bank, int(model.numbers[reflectors[i]]))
    for i in range(first, last):
        if status[i] != INLIER:
            continue
        place, number = model.places[reflectors[i]], model.numbers[reflectors[i]]
        distance, bearing = detections[i, 0] - observation.range_bias, detections[i, 1]
        for slot in range(SLOTS + 1):
            if slot != EVERY and (bank.owner[slot] < 0 or bank.owner[slot] == number):
                continue
            belief = pose_in(bank.beliefs[slot])
            corrected = correct(belief, distance, bearing, place[0], place[1], place[2], observation)
            write_pose(bank.beliefs[slot], corrected)
    if not corrects and model.others and is_changed(prior, own):
        _correct_alike(bank, prior, own)
    write_pose(bank.beliefs[NEWEST], own)
    return _judge(bank, own, model)


@compiled
def protect(  # noqa: PLR0917 - the columns of a run
    first: int,
    prior_means: FloatArray,
    prior_covariances: FloatArray,
    means: FloatArray,
    covariances: FloatArray,
    modes: NDArray[np.int8],
    offsets: IntArray,
    range_bearing: FloatArray,
    status: NDArray[np.int8],
    reflectors: IntArray,
    scanners: IntArray,
    observations: FloatArray,
    model: ProtectionModel,
    bank: Bank,
    levels: Levels,
    zones: ZoneRows,
) -> None:
    """Judge some cycles of one setup in a row.

    Parameters
    ----------
    first : the first cycle; the bank is as the cycle before has left it.
    prior_means, prior_covariances : (B, 3), (B, 3, 3) beliefs before these cycles.
    means, covariances, modes : (K, ...) of the whole run, after each cycle.
    offsets, range_bearing, status, reflectors : detections of the whole run.
    scanners : (K,) of each cycle.
    observations : (S, 6) see `observation_rows`.
    model : map, integrity risk and probability of a fault.
    bank : in and out.
    levels : out.
    zones : where which kinds correct the pose.

    Notes
    -----
    No formula: `protect_cycle`. Nothing is promised while the vehicle is sought, nor in the cycle in which it is found,
    whose belief does not follow from the one before.
    """
    for k in range(len(prior_means)):
        cycle = first + k
        sought_before = cycle > 0 and (modes[cycle - 1] == INITIALIZING or modes[cycle - 1] == LOST)
        if sought_before or modes[cycle] == INITIALIZING or modes[cycle] == LOST:
            forget(bank)
            levels.position[cycle], levels.heading[cycle], levels.reflector[cycle] = math.inf, math.inf, -1
            continue
        here = kinds_at(zones, prior_means[k, 0], prior_means[k, 1])
        found = protect_cycle(
            bank,
            _belief_of(prior_means[k], prior_covariances[k]),
            _belief_of(means[cycle], covariances[cycle]),
            offsets[cycle],
            offsets[cycle + 1] if here.reflectors else offsets[cycle],
            range_bearing,
            status,
            reflectors,
            observation_at(observations, scanners[cycle]),
            model,
        )
        levels.position[cycle], levels.heading[cycle], levels.reflector[cycle] = found

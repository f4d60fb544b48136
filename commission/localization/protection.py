"""Protection levels: how large the error of a run can be where one reflector misleads it and nobody notices.

Solution separation: beside the run, one filter for each reflector of late that leaves this reflector out. A run is
judged cycle by cycle; the localizer itself knows nothing of it.
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
from commission.localization.observation import observation_at
from commission.localization.pose_gaussian import PoseGaussian, larger_eigenvalue
from commission.localization.supervisor import INITIALIZING, LOST

SLOTS = 24
"""Reflectors that are left out, one by one, at most: those seen last."""
KEPT_CYCLES = 20
"""Cycles after its last sighting in which a reflector is left out in any case."""
NEGLIGIBLE = 1.05
"""Variance without a reflector, as a multiple of that with it, below which its filter is given up."""
INLIER = 0


class Levels(NamedTuple):
    """What the kernel writes, a row per cycle."""

    position: FloatArray
    """(K,) largest error of the position [m]; inf where the vehicle is lost or not located."""
    heading: FloatArray
    """(K,) largest error of the heading [rad]."""
    reflector: IntArray
    """(K,) number of the reflector whose failure would be worst for the position; -1: no fault is."""


class Bank(NamedTuple):
    """Filters that leave one reflector out each; the last one leaves none out."""

    beliefs: FloatArray
    """(SLOTS + 1, 9) x, y, theta, xx, xy, xt, yy, yt, tt."""
    owner: IntArray
    """(SLOTS,) number of the reflector that is left out; -1: the filter is not used."""
    seen: IntArray
    """(SLOTS,) cycle of its last sighting."""


def new_bank() -> Bank:
    """Return a bank in which no filter is used."""
    return Bank(np.zeros((SLOTS + 1, 9)), np.full(SLOTS, -1, dtype=np.int64), np.zeros(SLOTS, dtype=np.int64))


@compiled_inline
def _belief(row: FloatArray) -> PoseGaussian:
    """Belief of a row.

    Notes
    -----
    No formula: it reads numbers.
    """
    return PoseGaussian(row[0], row[1], row[2], row[3], row[4], row[5], row[6], row[7], row[8])


@compiled_inline
def _write(row: FloatArray, p: PoseGaussian) -> None:
    """Write a belief to its row.

    Notes
    -----
    No formula: it writes numbers.
    """
    row[0], row[1], row[2] = p.x, p.y, p.theta
    row[3], row[4], row[5], row[6], row[7], row[8] = p.xx, p.xy, p.xt, p.yy, p.yt, p.tt


@compiled
def _row_of(mean: FloatArray, covariance: FloatArray) -> FloatArray:
    """(9,) mean (3,) and covariance (3, 3) in one row."""
    row = np.empty(9)
    row[:3] = mean
    row[3], row[4], row[5] = covariance[0, 0], covariance[0, 1], covariance[0, 2]
    row[6], row[7], row[8] = covariance[1, 1], covariance[1, 2], covariance[2, 2]
    return row


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
def _predict(bank: Bank, before: FloatArray, prior: FloatArray) -> None:
    """Carry all filters over the motion between two cycles, as the run's own belief was carried.

    Parameters
    ----------
    bank : filters.
    before : (9,) belief of the run after the cycle before.
    prior : (9,) its belief before this cycle.
    """
    dx, dy = prior[0] - before[0], prior[1] - before[1]
    noise = prior[3:] - _carried(before, dx, dy)
    # With considered constants the difference need be no covariance.
    noise[0], noise[3], noise[5] = max(noise[0], 0.0), max(noise[3], 0.0), max(noise[5], 0.0)
    noise[1] = min(max(noise[1], -math.sqrt(noise[0] * noise[3])), math.sqrt(noise[0] * noise[3]))
    noise[2] = min(max(noise[2], -math.sqrt(noise[0] * noise[5])), math.sqrt(noise[0] * noise[5]))
    noise[4] = min(max(noise[4], -math.sqrt(noise[3] * noise[5])), math.sqrt(noise[3] * noise[5]))
    for slot in range(SLOTS + 1):
        if slot < SLOTS and bank.owner[slot] < 0:
            continue
        row = bank.beliefs[slot]
        covariance = _carried(row, dx, dy) + noise
        ax, ay, turn = row[0] - before[0], row[1] - before[1], wrap_scalar(row[2] - before[2])
        row[0], row[1] = prior[0] + ax - dy * turn, prior[1] + ay + dx * turn
        row[2] = wrap_scalar(prior[2] + turn)
        row[3:] = covariance


@compiled
def _enter(bank: Bank, number: int, cycle: int, prior: FloatArray) -> None:
    """See to it that there is a filter without a reflector: one that begins leaves it out from this scan on."""
    free, least = -1, math.inf
    for slot in range(SLOTS):
        if bank.owner[slot] == number:
            bank.seen[slot] = cycle
            return
        if bank.owner[slot] < 0:
            free, least = slot, -math.inf
        elif bank.beliefs[slot, 3] + bank.beliefs[slot, 6] < least:
            free, least = slot, bank.beliefs[slot, 3] + bank.beliefs[slot, 6]
    bank.owner[free], bank.seen[free] = number, cycle
    bank.beliefs[free] = prior


@compiled
def _judge(bank: Bank, own: FloatArray, cycle: int, factors: tuple[float, float], levels: Levels) -> None:
    """Write the levels of a cycle.

    Notes
    -----
    |e| <= |x - x_j| + K sigma_j for each reflector j that may mislead, K sigma for none: solution separation (Blanch et
    al., Navigation 62, 2015), with the position's K = sqrt(-2 ln p), by which exp(-K^2 / 2) bounds a distance in two
    dimensions, and the heading's such that erfc(K / sqrt 2) = p is bounded by the same.
    """
    risk, fault = factors
    used = 0
    for slot in range(SLOTS):
        used += bank.owner[slot] >= 0
    k0 = math.sqrt(-2.0 * math.log(0.5 * risk))
    kj = math.sqrt(max(-2.0 * math.log(min(0.5 * risk / max(used * fault, 1e-300), 1.0)), 0.0))
    variance = max(larger_eigenvalue(own[3], own[4], own[6]), 0.0)
    heading_variance = max(own[8], 0.0)
    position, heading, worst = k0 * math.sqrt(variance), k0 * math.sqrt(heading_variance), -1
    every = bank.beliefs[SLOTS]
    with_all = max(larger_eigenvalue(every[3], every[4], every[6]), 1e-12)
    for slot in range(SLOTS):
        if bank.owner[slot] < 0:
            continue
        row = bank.beliefs[slot]
        # What the run knows of constants makes its own variance larger than that of a filter of white noise.
        grown = max(larger_eigenvalue(row[3], row[4], row[6]) / with_all, 1.0)
        turned = max(row[8] / max(every[8], 1e-12), 1.0)
        apart = math.hypot(own[0] - row[0], own[1] - row[1])
        level = apart + kj * math.sqrt(variance * grown)
        if level > position:
            position, worst = level, bank.owner[slot]
        heading = max(heading, abs(wrap_scalar(own[2] - row[2])) + kj * math.sqrt(heading_variance * turned))
        if cycle - bank.seen[slot] > KEPT_CYCLES and grown < NEGLIGIBLE and apart * apart < 0.05 * variance:
            bank.owner[slot] = -1
    levels.position[cycle], levels.heading[cycle], levels.reflector[cycle] = position, heading, worst


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
    numbers: IntArray,
    scanners: IntArray,
    observations: FloatArray,
    places: FloatArray,
    factors: tuple[float, float],
    bank: Bank,
    levels: Levels,
) -> None:
    """Judge some cycles of one setup in a row.

    Parameters
    ----------
    first : the first cycle; the bank is as the cycle before has left it.
    prior_means, prior_covariances : (B, 3), (B, 3, 3) beliefs before these cycles.
    means, covariances, modes : (K, ...) of the whole run, after each cycle.
    offsets, range_bearing, status, reflectors : detections of the whole run.
    numbers : (N,) number of each reflector of the setup, the same in all setups.
    scanners : (K,) of each cycle.
    observations : (S, 6) see `observation_rows`.
    places : (N, 3) x, y [m] and variance [m^2] of each reflector of the setup.
    factors : integrity risk per cycle, and probability that a reflector in sight misleads.
    bank : in and out.
    levels : out.

    Notes
    -----
    |e| <= |x - x_j| + K sigma_j, the largest over all j: solution separation, Blanch et al. 2015.
    """
    for k in range(len(prior_means)):
        cycle = first + k
        own = _row_of(means[cycle], covariances[cycle])
        if modes[cycle] == INITIALIZING or modes[cycle] == LOST:
            bank.owner[:] = -1
            bank.beliefs[SLOTS] = own
            levels.position[cycle], levels.heading[cycle], levels.reflector[cycle] = math.inf, math.inf, -1
            continue
        prior = _row_of(prior_means[k], prior_covariances[k])
        if cycle == 0 or modes[cycle - 1] == INITIALIZING or modes[cycle - 1] == LOST:
            bank.beliefs[SLOTS] = prior
        else:
            _predict(bank, _row_of(means[cycle - 1], covariances[cycle - 1]), prior)
        model = observation_at(observations, scanners[cycle])
        for i in range(offsets[cycle], offsets[cycle + 1]):
            if status[i] == INLIER:
                _enter(bank, int(numbers[reflectors[i]]), cycle, bank.beliefs[SLOTS])
        for i in range(offsets[cycle], offsets[cycle + 1]):
            if status[i] != INLIER:
                continue
            place = places[reflectors[i]]
            for slot in range(SLOTS + 1):
                if slot < SLOTS and (bank.owner[slot] < 0 or bank.owner[slot] == numbers[reflectors[i]]):
                    continue
                row = bank.beliefs[slot]
                distance = range_bearing[i, 0] - model.range_bias
                bearing = range_bearing[i, 1]
                _write(row, correct(_belief(row), distance, bearing, place[0], place[1], place[2], model))
        _judge(bank, own, cycle, factors, levels)

"""Compiled kernels of a fix: Fisher information of a pose from the reflectors it sees, and the figures drawn from it.

They know arrays and bits only; what the measurement models mean is said in `dilution`.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from commission.compiled import compiled
from commission.geometry.arrays import FloatArray, IntArray
from commission.planning.shadow_kernels import BitMask
from commission.planning.visibility import in_field_of_view, is_blind

# Below this share of all information the worst direction has none: the 1-sigma ellipse is a million times longer than
# it would be for the best direction. Sums of double precision are off by some 1e-15.
SINGULAR = 1e-12

FULL_TURN = 2.0 * math.pi
"""Width of a field of view that needs no test."""

SINGLE, WORST, BEST = 0, 1, 2
"""How figures of several headings become one: there is one heading only, the worst of each, the best of each."""

FIGURES = 7
"""Columns: position sigma, heading sigma, position DOP, heading DOP, expected visible, P(two or more), P(three)."""
PROMISING = 4
"""First column of which more is better."""

Counts = NDArray[np.int32]
Chosen = NDArray[np.uint64]

EVERY_HEADING = np.uint64(0xFFFFFFFFFFFFFFFF)
MOST_AT_ONCE = 32
"""Headings whose sets of reflectors are compared at once, as bits of a word that also holds them turned around."""
UNSURE = 1e-9
"""Angle from the edge of a field of view below which a reflector is looked at exactly [rad]."""

# Position of the lowest set bit of a word from its product with a de Bruijn sequence (Leiserson et al. 1998).
DE_BRUIJN = 0x03F79D71B4CB0A89
_BIT_OF_PRODUCT = np.zeros(64, dtype=np.int64)
for _bit in range(64):
    _BIT_OF_PRODUCT[((DE_BRUIJN << _bit) & 0xFFFFFFFFFFFFFFFF) >> 58] = _bit
_BIT_OF_PRODUCT.setflags(write=False)


class FixModel(NamedTuple):
    """Measurement model and headings, as plain numbers."""

    range_variance: float
    """Of a range [m^2]; inf where no range is measured."""
    bearing_variance: float
    """Of a bearing [rad^2]."""
    prior_position: float
    """Information on x and on y before the scan [1/m^2]."""
    prior_heading: float
    """Information on the heading before the scan [1/rad^2]."""
    fewest: int
    """Reflectors below which a fix is singular whatever the sums say."""
    position_noise: float
    """Divisor of the position's dilution: sigma of a range [m], of a bearing [rad] where no range is measured."""
    lever_x: float
    """Scanner relative to the point whose position is asked for, map frame [m]."""
    lever_y: float
    headings: FloatArray
    """(H,) headings of the scanner [rad], map frame."""
    first: float
    """First bearing of the field of view [rad]."""
    width: float
    """Width of the field of view [rad]."""
    blind: FloatArray
    """(S, 2) first bearing and width of each blind sector [rad]."""
    combine: int
    """SINGLE, WORST or BEST."""
    free_per_m: float
    """Probability that nobody blocks a metre of ray."""


@compiled
def lowest_bit(word: np.uint64) -> int:
    """Index of the lowest set bit of a word that is not zero.

    Notes
    -----
    table[((w & -w) * de Bruijn) >> 58] with w & -w = the lowest bit alone: Leiserson, Prokop, Randall 1998.
    """
    lowest = word & (~word + np.uint64(1))
    return _BIT_OF_PRODUCT[(lowest * np.uint64(DE_BRUIJN)) >> np.uint64(58)]


@compiled
def reflector_information(  # noqa: PLR0917 - one reflector, number by number
    dx: float,
    dy: float,
    lever_x: float,
    lever_y: float,
    range_weight: float,
    bearing_weight: float,
) -> tuple[float, float, float, float, float, float]:
    """What range and bearing of one reflector say about the pose, map axes.

    Parameters
    ----------
    dx, dy : reflector from the scanner [m].
    lever_x, lever_y : scanner from the point whose position is asked for [m].
    range_weight, bearing_weight : one over the variance of each [1/m^2, 1/rad^2].

    Returns
    -------
    xx, xy, xt, yy, yt, tt : upper triangle of the information; zeros for a scanner on the reflector itself.

    Notes
    -----
    H^T diag(1 / variance) H with H the Jacobian of range and bearing: Fisher information of Gaussian noise (Bar-Shalom,
    Li, Kirubarajan 2001, section 2.7).
    """
    r = math.sqrt(dx * dx + dy * dy)
    if r < 1e-9:
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    per_r = 1.0 / r
    ux, uy = dx * per_r, dy * per_r
    # Rows of the Jacobian: range and bearing by x, y and heading. The lever moves the scanner when the heading turns.
    range_t = ux * lever_y - uy * lever_x
    bearing_x, bearing_y = uy * per_r, -ux * per_r
    bearing_t = -1.0 - bearing_x * lever_y + bearing_y * lever_x
    return (
        range_weight * ux * ux + bearing_weight * bearing_x * bearing_x,
        range_weight * ux * uy + bearing_weight * bearing_x * bearing_y,
        -range_weight * ux * range_t + bearing_weight * bearing_x * bearing_t,
        range_weight * uy * uy + bearing_weight * bearing_y * bearing_y,
        -range_weight * uy * range_t + bearing_weight * bearing_y * bearing_t,
        range_weight * range_t * range_t + bearing_weight * bearing_t * bearing_t,
    )


@compiled
def position_covariance(  # noqa: PLR0917 - a symmetric matrix, number by number
    i_xx: float, i_xy: float, i_xt: float, i_yy: float, i_yt: float, i_tt: float
) -> tuple[bool, float, float, float]:
    """Covariance of the position, the heading being estimated with it.

    Parameters
    ----------
    i_xx, i_xy, i_xt, i_yy, i_yt, i_tt : upper triangle of the information.

    Returns
    -------
    regular, xx, xy, yy : whether there is a covariance, and it [m^2].

    Notes
    -----
    P = (I_pp - I_pt I_tp / I_tt)^-1, the inverse of the Schur complement of the heading: inverse of a block matrix, by
    definition. Its eigenvalues do not depend on the choice of axes.
    """
    if not i_tt > 0.0:
        return False, math.inf, 0.0, math.inf
    s_xx, s_xy, s_yy = i_xx - i_xt * i_xt / i_tt, i_xy - i_xt * i_yt / i_tt, i_yy - i_yt * i_yt / i_tt
    half_difference = 0.5 * (s_xx - s_yy)
    largest = 0.5 * (s_xx + s_yy) + math.sqrt(half_difference * half_difference + s_xy * s_xy)
    determinant = s_xx * s_yy - s_xy * s_xy
    if determinant <= SINGULAR * (i_xx + i_yy) * largest:
        return False, math.inf, 0.0, math.inf
    return True, s_yy / determinant, -s_xy / determinant, s_xx / determinant


@compiled
def heading_variance(  # noqa: PLR0917 - parts of two matrices, number by number
    i_xt: float, i_yt: float, i_tt: float, p_xx: float, p_xy: float, p_yy: float
) -> float:
    """Variance of the heading [rad^2], given the covariance of the position.

    Parameters
    ----------
    i_xt, i_yt, i_tt : last column of the information.
    p_xx, p_xy, p_yy : covariance of the position.

    Notes
    -----
    (1 + I_tp P I_pt / I_tt) / I_tt: the last element of the inverse of a block matrix, by definition.
    """
    return (1.0 + (i_xt * i_xt * p_xx + 2.0 * i_xt * i_yt * p_xy + i_yt * i_yt * p_yy) / i_tt) / i_tt


@compiled
def weights_of(
    dx: float, dy: float, survey_sigma: float, range_variance: float, bearing_variance: float
) -> tuple[float, float]:
    """Weights of the range and of the bearing of one reflector.

    Parameters
    ----------
    dx, dy : reflector from the scanner [m].
    survey_sigma : 1-sigma of the reflector's place, each axis [m].
    range_variance, bearing_variance : the scanner's noise of both [m^2, rad^2].

    Notes
    -----
    1 / (var_r + s^2) and 1 / (var_b + s^2 / r^2): the survey error adds to both noises, derived from the Jacobian of
    range and bearing by the reflector's place.
    """
    squared, survey = max(dx * dx + dy * dy, 1e-18), survey_sigma * survey_sigma
    return 1.0 / (range_variance + survey), 1.0 / (bearing_variance + survey / squared)


@compiled
def fix_at_heading(  # noqa: PLR0917 - one point and heading
    seen: int, parts: FloatArray, chosen: Chosen, free: FloatArray, h: int, model: FixModel, one: FloatArray
) -> int:
    """Fill the figures of one point and heading, variances in place of sigmas; return the number of reflectors.

    Parameters
    ----------
    seen : reflectors seen all around: rows in use of the next three.
    parts : (M, 6) information of each, see `reflector_information`.
    chosen : (M,) the headings in which each is in the field of view and not blind, a bit for each.
    free : (M,) probability that nobody stands before it.
    h : which heading, 0 to 63.
    model : prior and the fewest reflectors of a fix.
    one : (FIGURES,) output.

    Notes
    -----
    P = (prior + sum of parts)^-1; P(k of n) = p_n P(k - 1 of n - 1) + (1 - p_n) P(k of n - 1): recursion of the Poisson
    binomial distribution (Barlow, Heidtmann 1984).
    """
    i_xx, i_xy, i_xt = model.prior_position, 0.0, 0.0
    i_yy, i_yt, i_tt = model.prior_position, 0.0, model.prior_heading
    expected, none, single, pair = 0.0, 1.0, 0.0, 0.0
    is_crowded, bit = model.free_per_m < 1.0, np.uint64(1) << np.uint64(h)
    count = 0
    for k in range(seen):
        if chosen[k] & bit == np.uint64(0):
            continue
        count += 1
        i_xx += parts[k, 0]
        i_xy += parts[k, 1]
        i_xt += parts[k, 2]
        i_yy += parts[k, 3]
        i_yt += parts[k, 4]
        i_tt += parts[k, 5]
        if is_crowded:
            # Recursion of the Poisson binomial distribution: probabilities of none, one and two so far.
            p = free[k]
            expected += p
            pair += p * (single - pair)
            single += p * (none - single)
            none *= 1.0 - p
    one[:PROMISING] = math.inf
    if is_crowded:
        one[PROMISING] = expected
        # Rounding can leave a probability a hair outside.
        one[PROMISING + 1] = min(max(1.0 - none - single, 0.0), 1.0)
        one[PROMISING + 2] = min(max(1.0 - none - single - pair, 0.0), 1.0)
    else:
        one[PROMISING] = count
        one[PROMISING + 1] = 1.0 if count >= 2 else 0.0
        one[PROMISING + 2] = 1.0 if count >= 3 else 0.0
    if count >= model.fewest:
        regular, p_xx, p_xy, p_yy = position_covariance(i_xx, i_xy, i_xt, i_yy, i_yt, i_tt)
        if regular:
            half_difference = 0.5 * (p_xx - p_yy)
            one[0] = 0.5 * (p_xx + p_yy) + math.sqrt(half_difference * half_difference + p_xy * p_xy)
            one[1] = heading_variance(i_xt, i_yt, i_tt, p_xx, p_xy, p_yy)
            one[2] = p_xx + p_yy
    return count


@compiled
def keep_worse_or_better(one: FloatArray, combine: int, best: FloatArray) -> None:
    """Keep of each figure the worse or the better one of two headings.

    Parameters
    ----------
    one : (FIGURES,) of another heading.
    combine : WORST; anything else keeps the better.
    best : (FIGURES,) what is kept, changed in place.

    Notes
    -----
    No formula: the larger is worse of the first figures, better of those from `PROMISING` on.
    """
    for i in range(FIGURES):
        takes_larger = (i < PROMISING) == (combine == WORST)
        best[i] = max(best[i], one[i]) if takes_larger else min(best[i], one[i])


@compiled
def fill_figures(best: FloatArray, model: FixModel, figures: FloatArray) -> None:
    """Store the figures of one point: sigmas and dilutions from variances.

    Parameters
    ----------
    best : (FIGURES,) as `fix_at_heading` fills them.
    model : its noises are the divisors of the dilutions.
    figures : (FIGURES,) output.

    Notes
    -----
    sigma = sqrt(variance), DOP = sigma / noise of one measurement, by definition. Roots and quotients keep the order,
    so they can wait until the heading is chosen.
    """
    figures[0], figures[1] = math.sqrt(best[0]), math.sqrt(best[1])
    figures[2] = math.sqrt(best[2]) / model.position_noise
    figures[3] = figures[1] / math.sqrt(model.bearing_variance)
    for i in range(PROMISING, FIGURES):
        figures[i] = best[i]


@compiled
def fix_of_headings(  # noqa: PLR0917 - arrays in, arrays out
    seen: int,
    parts: FloatArray,
    turns: FloatArray,
    chosen: Chosen,
    free: FloatArray,
    model: FixModel,
    one: FloatArray,
    best: FloatArray,
) -> int:
    """Fill the worst or best figures of the headings of one point, and return the number of reflectors.

    Parameters
    ----------
    seen, parts, free, model : as for `fix_at_heading`.
    turns : (M,) bearing of each from the map's x-axis [rad].
    chosen : (M,) scratch; on entry each bit is set where the field of view is a full turn without blind sectors.
    one : (FIGURES,) scratch.
    best : (FIGURES,) output, variances in place of sigmas.

    Notes
    -----
    S a part of T => I(S) <= I(T), derived from the sum of positive semi-definite matrices: whatever is added to a set
    of reflectors adds information. So headings that see as much as a neighbor and more are left out for the worst,
    those that see less for the best, and of equal ones all but one.
    """
    many, narrow = len(model.headings), model.width < FULL_TURN or len(model.blind) > 0
    if not narrow:
        return fix_at_heading(seen, parts, chosen, free, 0, model, best)
    if 1 < many <= MOST_AT_ONCE and len(model.blind) == 0:
        left = deciding_headings(seen, turns, model, chosen)
        h = lowest_bit(left)
        count = fix_at_heading(seen, parts, chosen, free, h, model, best)
        left &= left - np.uint64(1)
        while left != np.uint64(0):
            other = fix_at_heading(seen, parts, chosen, free, lowest_bit(left), model, one)
            left &= left - np.uint64(1)
            count = min(count, other) if model.combine == WORST else max(count, other)
            keep_worse_or_better(one, model.combine, best)
        return count
    count = -1
    for heading in model.headings:
        for k in range(seen):
            is_in = in_field_of_view(turns[k] - heading, model.first, model.width)
            chosen[k] = np.uint64(is_in and not is_blind(turns[k] - heading, model.blind))
        other = fix_at_heading(seen, parts, chosen, free, 0, model, one)
        if count < 0:
            count, best[:] = other, one
        else:
            count = min(count, other) if model.combine == WORST else max(count, other)
            keep_worse_or_better(one, model.combine, best)
    return count


@compiled
def deciding_headings(seen: int, turns: FloatArray, model: FixModel, chosen: Chosen) -> np.uint64:
    """Find the headings among which the worst ones are, or the best: a bit for each.

    Parameters
    ----------
    seen : reflectors seen all around.
    turns : (M,) bearing of each from the map's x-axis [rad].
    model : at most `MOST_AT_ONCE` evenly spaced headings and a field of view without blind sectors.
    chosen : (M,) output: the headings in which each of them is in the field of view.

    Notes
    -----
    With S_h the set that heading h sees: lost has bit h where S_h holds what S_(h+1) does not, gained where S_(h+1)
    holds what S_h does not; S_(h+1) is a proper part of S_h where lost alone is set. Derived.
    """
    count = len(model.headings)
    every = (np.uint64(1) << np.uint64(count)) - np.uint64(1)
    lost, gained = np.uint64(0), np.uint64(0)
    for k in range(seen):
        mask = headings_that_see(turns[k], model)
        chosen[k] = mask
        onward = ((mask >> np.uint64(1)) | (mask << np.uint64(count - 1))) & every
        lost |= mask & ~onward
        gained |= onward & ~mask
    fewer_onward, more_onward, as_onward = lost & ~gained, gained & ~lost, every & ~(lost | gained)
    if model.combine != WORST:
        fewer_onward, more_onward = more_onward, fewer_onward
    # Of each heading, what the one before it says of it.
    before = more_onward | as_onward
    before = ((before << np.uint64(1)) | (before >> np.uint64(count - 1))) & every
    deciding = every & ~fewer_onward & ~before
    return deciding if deciding != np.uint64(0) else np.uint64(1)


@compiled
def headings_that_see(turn: float, model: FixModel) -> np.uint64:
    """Find the headings in which a reflector is in the field of view: a bit for each.

    Parameters
    ----------
    turn : its bearing from the map's x-axis [rad].
    model : at most `MOST_AT_ONCE` evenly spaced headings.

    Notes
    -----
    Headings h with (turn - heading_h - first) mod 2 pi <= width, by definition: a run of them around the circle. Where
    an end of the run is within rounding of the edge, each heading is asked by `in_field_of_view`.
    """
    count = len(model.headings)
    step = FULL_TURN / count
    offset = turn - model.headings[0] - model.first
    offset -= FULL_TURN * math.floor(offset / FULL_TURN)
    last = min(int(offset / step), count - 1)
    rest = offset - last * step
    span = (model.width - rest) / step
    run = math.floor(span)
    edge = min(rest, step - rest, (span - run) * step, (run + 1 - span) * step)
    if edge < UNSURE:
        mask = np.uint64(0)
        for h in range(count):
            if in_field_of_view(turn - model.headings[h], model.first, model.width):
                mask |= np.uint64(1) << np.uint64(h)
        return mask
    if run < 0:
        return np.uint64(0)
    length = min(run + 1, count)
    mask = ((np.uint64(1) << np.uint64(length)) - np.uint64(1)) << np.uint64((last - length + 1) % count)
    return (mask | (mask >> np.uint64(count))) & ((np.uint64(1) << np.uint64(count)) - np.uint64(1))


@compiled
def fill_fixes(  # noqa: PLR0917 - arrays in, arrays out
    centers: FloatArray,
    survey_sigmas: FloatArray,
    points: FloatArray,
    rows: IntArray,
    mask: BitMask,
    model: FixModel,
    counts: Counts,
    figures: FloatArray,
) -> None:
    """Fill `counts` and `figures` of chosen points from the bits of the reflectors they see.

    Reflectors are summed in the order of their index, whichever reflector was moved before: so a point that is
    computed again gives the same to the last bit.

    Parameters
    ----------
    centers, survey_sigmas : (M, 2) and (M,) arrays [m], map frame.
    points : (N, 2) array [m], map frame: positions of the scanner.
    rows : points to fill, indices into the other arrays.
    mask : (N, ceil(M / 64)) array.
    model : measurement model and headings.
    counts : (N,) array of visible reflectors.
    figures : (N, FIGURES) array.

    Notes
    -----
    Per point, sigma = sqrt(figure of `fix_at_heading`), the worst or best of the headings; DOP = sigma / noise of one
    measurement, by definition.
    """
    many = max(1, len(centers))
    parts, turns, free = np.empty((many, 6)), np.zeros(many), np.ones(many)
    chosen = np.full(many, EVERY_HEADING, dtype=np.uint64)
    one, best = np.empty(FIGURES), np.empty(FIGURES)
    free_per_m = model.free_per_m
    narrow = model.width < FULL_TURN or len(model.blind) > 0
    lever_x, lever_y = model.lever_x, model.lever_y
    # Divisions are the slow part, and most maps know no survey error.
    range_variance, bearing_variance = model.range_variance, model.bearing_variance
    sure_range_weight, sure_bearing_weight = weights_of(1.0, 0.0, 0.0, range_variance, bearing_variance)
    for n in rows:
        seen = 0
        for word_index in range(mask.shape[1]):
            word = mask[n, word_index]
            while word != np.uint64(0):
                m = 64 * word_index + lowest_bit(word)
                word &= word - np.uint64(1)
                dx, dy = centers[m, 0] - points[n, 0], centers[m, 1] - points[n, 1]
                if survey_sigmas[m] > 0.0:
                    range_weight, bearing_weight = weights_of(
                        dx, dy, survey_sigmas[m], range_variance, bearing_variance
                    )
                else:
                    range_weight, bearing_weight = sure_range_weight, sure_bearing_weight
                information = reflector_information(dx, dy, lever_x, lever_y, range_weight, bearing_weight)
                parts[seen, 0], parts[seen, 1], parts[seen, 2] = information[0], information[1], information[2]
                parts[seen, 3], parts[seen, 4], parts[seen, 5] = information[3], information[4], information[5]
                if narrow:
                    turns[seen] = math.atan2(dy, dx)
                if free_per_m < 1.0:
                    free[seen] = free_per_m ** math.hypot(dx, dy)
                seen += 1
        count = fix_of_headings(seen, parts, turns, chosen, free, model, one, best)
        counts[n] = count
        fill_figures(best, model, figures[n])


@compiled
def fill_covariances(  # noqa: PLR0917 - arrays in, arrays out
    centers: FloatArray,
    survey_sigmas: FloatArray,
    T_map_scanner: FloatArray,
    levers: FloatArray,
    offsets: IntArray,
    indices: IntArray,
    model: FixModel,
    covariances: FloatArray,
) -> None:
    """Fill covariances of base poses from the reflectors listed for each.

    Parameters
    ----------
    centers, survey_sigmas : (M, 2) and (M,) arrays [m], map frame.
    T_map_scanner : (N, 3) poses of the scanner [m, m, rad].
    levers : (N, 2) scanner from base [m], map axes.
    offsets, indices : (N + 1,) and flat: reflectors of pose n are indices[offsets[n] : offsets[n + 1]].
    model : measurement model; its headings and field of view are not read.
    covariances : (N, 3, 3) output [m, m, rad]; inf on the diagonal where singular.

    Notes
    -----
    P = (prior + sum of `reflector_information`)^-1: the Cramér-Rao bound (Bar-Shalom, Li, Kirubarajan 2001, section
    2.7).
    """
    for n in range(len(T_map_scanner)):
        i_xx, i_xy, i_xt = model.prior_position, 0.0, 0.0
        i_yy, i_yt, i_tt = model.prior_position, 0.0, model.prior_heading
        for m in indices[offsets[n] : offsets[n + 1]]:
            dx, dy = centers[m, 0] - T_map_scanner[n, 0], centers[m, 1] - T_map_scanner[n, 1]
            range_weight, bearing_weight = weights_of(
                dx, dy, float(survey_sigmas[m]), model.range_variance, model.bearing_variance
            )
            information = reflector_information(dx, dy, levers[n, 0], levers[n, 1], range_weight, bearing_weight)
            i_xx += information[0]
            i_xy += information[1]
            i_xt += information[2]
            i_yy += information[3]
            i_yt += information[4]
            i_tt += information[5]
        regular, p_xx, p_xy, p_yy = position_covariance(i_xx, i_xy, i_xt, i_yy, i_yt, i_tt)
        covariances[n] = 0.0
        if offsets[n + 1] - offsets[n] < model.fewest or not regular:
            covariances[n, 0, 0] = covariances[n, 1, 1] = covariances[n, 2, 2] = math.inf
            continue
        p_xt, p_yt = -(p_xx * i_xt + p_xy * i_yt) / i_tt, -(p_xy * i_xt + p_yy * i_yt) / i_tt
        covariances[n, 0, 0], covariances[n, 1, 1] = p_xx, p_yy
        covariances[n, 0, 1] = covariances[n, 1, 0] = p_xy
        covariances[n, 0, 2] = covariances[n, 2, 0] = p_xt
        covariances[n, 1, 2] = covariances[n, 2, 1] = p_yt
        covariances[n, 2, 2] = heading_variance(i_xt, i_yt, i_tt, p_xx, p_xy, p_yy)

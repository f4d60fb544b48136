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
from commission.planning.visibility import in_field_of_view

# Below this share of all information the worst direction has none: the 1-sigma ellipse is a million times longer than
# it would be for the best direction. Sums of double precision are off by some 1e-15.
SINGULAR = 1e-12

SINGLE, WORST, BEST = 0, 1, 2
"""How figures of several headings become one: there is one heading only, the worst of each, the best of each."""

FIGURES = 7
"""Columns: position sigma, heading sigma, position DOP, heading DOP, expected visible, P(two or more), P(three)."""
PROMISING = 4
"""First column of which more is better."""

Counts = NDArray[np.int32]

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
    combine: int
    """SINGLE, WORST or BEST."""
    free_per_m: float
    """Probability that nobody blocks a metre of ray."""


@compiled
def lowest_bit(word: np.uint64) -> int:
    """Index of the lowest set bit of a word that is not zero."""
    lowest = word & (~word + np.uint64(1))
    return _BIT_OF_PRODUCT[(lowest * np.uint64(DE_BRUIJN)) >> np.uint64(58)]


@compiled
def add_reflector(  # noqa: PLR0917 - one reflector, number by number
    dx: float,
    dy: float,
    lever_x: float,
    lever_y: float,
    survey_variance: float,
    model: FixModel,
    information: FloatArray,
) -> None:
    """Add what range and bearing of a reflector at (dx, dy) from the scanner say about the pose, map axes.

    The scanner stands at (lever_x, lever_y) from the point whose position is asked for. `information` holds the upper
    triangle row by row: xx, xy, xt, yy, yt, tt. The survey error of the reflector's place adds to both noises.
    """
    r = math.hypot(dx, dy)
    if r < 1e-9:
        return
    ux, uy = dx / r, dy / r
    # Rows of the Jacobian: range and bearing by x, y and heading. The lever moves the scanner when the heading turns.
    range_t = ux * lever_y - uy * lever_x
    bearing_x, bearing_y = uy / r, -ux / r
    bearing_t = -1.0 - bearing_x * lever_y + bearing_y * lever_x
    range_weight = 1.0 / (model.range_variance + survey_variance)
    bearing_weight = 1.0 / (model.bearing_variance + survey_variance / (r * r))
    information[0] += range_weight * ux * ux + bearing_weight * bearing_x * bearing_x
    information[1] += range_weight * ux * uy + bearing_weight * bearing_x * bearing_y
    information[2] += -range_weight * ux * range_t + bearing_weight * bearing_x * bearing_t
    information[3] += range_weight * uy * uy + bearing_weight * bearing_y * bearing_y
    information[4] += -range_weight * uy * range_t + bearing_weight * bearing_y * bearing_t
    information[5] += range_weight * range_t * range_t + bearing_weight * bearing_t * bearing_t


@compiled
def position_covariance(information: FloatArray) -> tuple[bool, float, float, float]:
    """Covariance xx, xy, yy of the position, the heading being estimated with it; whether there is one comes first.

    It is the inverse of the Schur complement of the heading, whose eigenvalues do not depend on the choice of axes.
    """
    i_xx, i_xy, i_xt = information[0], information[1], information[2]
    i_yy, i_yt, i_tt = information[3], information[4], information[5]
    if not i_tt > 0.0:
        return False, math.inf, 0.0, math.inf
    s_xx, s_xy, s_yy = i_xx - i_xt * i_xt / i_tt, i_xy - i_xt * i_yt / i_tt, i_yy - i_yt * i_yt / i_tt
    half_sum = 0.5 * (s_xx + s_yy)
    largest = half_sum + math.hypot(0.5 * (s_xx - s_yy), s_xy)
    determinant = s_xx * s_yy - s_xy * s_xy
    if determinant <= SINGULAR * (i_xx + i_yy) * largest:
        return False, math.inf, 0.0, math.inf
    return True, s_yy / determinant, -s_xy / determinant, s_xx / determinant


@compiled
def heading_variance(information: FloatArray, p_xx: float, p_xy: float, p_yy: float) -> float:
    """Variance of the heading [rad^2], given the covariance of the position."""
    b_x, b_y, i_tt = information[2], information[4], information[5]
    return (1.0 + (b_x * b_x * p_xx + 2.0 * b_x * b_y * p_xy + b_y * b_y * p_yy) / i_tt) / i_tt


@compiled
def start_information(model: FixModel, information: FloatArray) -> None:
    """Set the information to that of the prior."""
    information[:] = 0.0
    information[0] = information[3] = model.prior_position
    information[5] = model.prior_heading


@compiled
def write_figures(count: int, information: FloatArray, odds: FloatArray, model: FixModel, figures: FloatArray) -> None:
    """Fill the figures of one point and heading; `odds` holds expected, P(none), P(one), P(two) visible."""
    figures[:PROMISING] = math.inf
    figures[PROMISING] = odds[0]
    # Rounding can leave a probability a hair outside.
    figures[PROMISING + 1] = min(max(1.0 - odds[1] - odds[2], 0.0), 1.0)
    figures[PROMISING + 2] = min(max(1.0 - odds[1] - odds[2] - odds[3], 0.0), 1.0)
    regular, p_xx, p_xy, p_yy = position_covariance(information)
    if count < model.fewest or not regular:
        return
    longest = 0.5 * (p_xx + p_yy) + math.hypot(0.5 * (p_xx - p_yy), p_xy)
    heading_sigma = math.sqrt(heading_variance(information, p_xx, p_xy, p_yy))
    figures[0], figures[1] = math.sqrt(longest), heading_sigma
    figures[2], figures[3] = (
        math.sqrt(p_xx + p_yy) / model.position_noise,
        heading_sigma / math.sqrt(model.bearing_variance),
    )


@compiled
def add_odds(probability: float, odds: FloatArray) -> None:
    """Add one reflector that is seen with a probability: recursion of the Poisson binomial distribution."""
    odds[0] += probability
    odds[3] += probability * (odds[2] - odds[3])
    odds[2] += probability * (odds[1] - odds[2])
    odds[1] *= 1.0 - probability


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
    """
    many = max(1, len(centers))
    parts, bearings, free = np.empty((many, 6)), np.empty(many), np.empty(many)
    information, odds, one = np.empty(6), np.empty(4), np.empty(FIGURES)
    for n in rows:
        seen = 0
        for word_index in range(mask.shape[1]):
            word = mask[n, word_index]
            while word != np.uint64(0):
                m = 64 * word_index + lowest_bit(word)
                word &= word - np.uint64(1)
                dx, dy = centers[m, 0] - points[n, 0], centers[m, 1] - points[n, 1]
                parts[seen, :] = 0.0
                add_reflector(dx, dy, model.lever_x, model.lever_y, float(survey_sigmas[m]) ** 2, model, parts[seen])
                bearings[seen] = math.atan2(dy, dx)
                free[seen] = 1.0 if model.free_per_m == 1.0 else model.free_per_m ** math.hypot(dx, dy)
                seen += 1
        for h in range(len(model.headings)):
            start_information(model, information)
            odds[:] = 0.0
            odds[1] = 1.0
            count = 0
            for k in range(seen):
                if in_field_of_view(bearings[k] - model.headings[h], model.first, model.width):
                    count += 1
                    for i in range(6):
                        information[i] += parts[k, i]
                    add_odds(free[k], odds)
            write_figures(count, information, odds, model, one)
            if h == 0:
                counts[n] = count
                figures[n] = one
                continue
            counts[n] = min(counts[n], count) if model.combine == WORST else max(counts[n], count)
            for i in range(FIGURES):
                take_larger = (i < PROMISING) == (model.combine == WORST)
                figures[n, i] = max(figures[n, i], one[i]) if take_larger else min(figures[n, i], one[i])


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
    """Fill (N, 3, 3) covariances of base poses from the reflectors listed for each; inf on the diagonal if singular."""
    information = np.empty(6)
    for n in range(len(T_map_scanner)):
        start_information(model, information)
        for m in indices[offsets[n] : offsets[n + 1]]:
            dx, dy = centers[m, 0] - T_map_scanner[n, 0], centers[m, 1] - T_map_scanner[n, 1]
            add_reflector(dx, dy, levers[n, 0], levers[n, 1], float(survey_sigmas[m]) ** 2, model, information)
        regular, p_xx, p_xy, p_yy = position_covariance(information)
        covariances[n] = 0.0
        if offsets[n + 1] - offsets[n] < model.fewest or not regular:
            covariances[n, 0, 0] = covariances[n, 1, 1] = covariances[n, 2, 2] = math.inf
            continue
        i_xt, i_yt, i_tt = information[2], information[4], information[5]
        p_xt, p_yt = -(p_xx * i_xt + p_xy * i_yt) / i_tt, -(p_xy * i_xt + p_yy * i_yt) / i_tt
        covariances[n, 0, 0], covariances[n, 1, 1] = p_xx, p_yy
        covariances[n, 0, 1] = covariances[n, 1, 0] = p_xy
        covariances[n, 0, 2] = covariances[n, 2, 0] = p_xt
        covariances[n, 1, 2] = covariances[n, 2, 1] = p_yt
        covariances[n, 2, 2] = heading_variance(information, p_xx, p_xy, p_yy)

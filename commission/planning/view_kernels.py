"""Compiled kernels of a fix from several scanners of one vehicle: what each measures of a reflector adds up.

The arithmetic of one scanner is in `dilution_kernels`; what the views of a vehicle are is said in `vehicle_fixes`.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from commission.compiled import compiled
from commission.geometry.arrays import BoolArray, FloatArray, IntArray
from commission.planning.dilution_kernels import (
    EVERY_HEADING,
    FIGURES,
    WORST,
    Counts,
    FixModel,
    fill_figures,
    fix_at_heading,
    heading_variance,
    keep_worse_or_better,
    lowest_bit,
    position_covariance,
    reflector_information,
    weights_of,
)
from commission.planning.visibility import is_blind

ViewMask = NDArray[np.uint64]
"""(V, N, ceil(M / 64)) array: which of M reflectors each of V views sees from N points, all around."""


class ViewTables(NamedTuple):
    """Views of a vehicle's S scanners in H headings, as plain arrays."""

    levers: FloatArray
    """(V, 2) scanner of each view from the point asked for [m], map axes."""
    view_of: IntArray
    """(H, S) view of each scanner in each heading."""
    facing: FloatArray
    """(H, S, 2) unit vector to the middle of each scanner's field of view then, map axes."""
    cosine: FloatArray
    """(S,) cosine of half of each field of view; -2 for a full turn."""
    blind: FloatArray
    """(S, B, 2) first bearing of each blind sector from that middle, and its width [rad]; none has a negative width."""
    once: bool
    """Whether each reflector counts once, by the first scanner that sees it."""
    variances: FloatArray
    """(S, 2) of a range and of a bearing of each scanner [m^2, rad^2]."""
    weights: FloatArray
    """(S, 2) one over each of them."""


@compiled
def without_place(parts: FloatArray, variance: float) -> None:
    """Take from the information of one reflector what its own unknown place costs; in place.

    Parameters
    ----------
    parts : (6,) xx, xy, xt, yy, yt, tt of all that is measured of the reflector, as if its place were known.
    variance : of its place, each axis [m^2], greater than 0.

    Notes
    -----
    C - C_:p (C_pp + I / variance)^-1 C_p:, p the position: the Schur complement of the reflector's place in the joint
    information, derived from range and bearing depending on the difference of both places only. An error of the survey
    is the same for all scanners, so that it does not average out over them.
    """
    xx, xy, xt, yy, yt = parts[0], parts[1], parts[2], parts[3], parts[4]
    a, d = xx + 1.0 / variance, yy + 1.0 / variance
    determinant = a * d - xy * xy
    i_xx, i_xy, i_yy = d / determinant, -xy / determinant, a / determinant
    parts[0] -= i_xx * xx * xx + 2.0 * i_xy * xx * xy + i_yy * xy * xy
    parts[1] -= i_xx * xx * xy + i_xy * (xx * yy + xy * xy) + i_yy * xy * yy
    parts[2] -= i_xx * xx * xt + i_xy * (xx * yt + xy * xt) + i_yy * xy * yt
    parts[3] -= i_xx * xy * xy + 2.0 * i_xy * xy * yy + i_yy * yy * yy
    parts[4] -= i_xx * xy * xt + i_xy * (xy * yt + yy * xt) + i_yy * yy * yt
    parts[5] -= i_xx * xt * xt + 2.0 * i_xy * xt * yt + i_yy * yt * yt


@compiled
def information_of_scanners(  # noqa: PLR0917 - one reflector and several scanners
    center: FloatArray,
    survey_sigma: float,
    places: FloatArray,
    levers: FloatArray,
    facing: FloatArray,
    sees: BoolArray,
    views: ViewTables,
    parts: FloatArray,
) -> float:
    """Sum what the scanners that see a reflector say about the pose; return its distance to the nearest one.

    Parameters
    ----------
    center : (2,) the reflector [m], map frame.
    survey_sigma : 1-sigma of its place, each axis [m].
    places : (S, 2) places of the scanners [m], map frame.
    levers : (S, 2) each from the point whose position is asked for [m], map axes.
    facing : (S, 2) unit vectors to the middle of each field of view, map axes.
    sees : (S,) whether each scanner sees it, all around.
    views : fields of view, noise and weights.
    parts : (6,) output, as of `reflector_information`.

    Returns
    -------
    distance : to the nearest scanner that sees it [m]; inf where none does.

    Notes
    -----
    sum of `reflector_information` over the scanners, their noises being independent (Bar-Shalom, Li, Kirubarajan 2001,
    section 2.7); `without_place` where more than one measures a place that is uncertain. In the field of view is what
    has d . facing >= |d| cos(width / 2), by definition of the angle between two vectors; the bearing from its middle is
    atan2(facing x d, facing . d).
    """
    parts[:] = 0.0
    nearest, only, count = math.inf, -1, 0
    for s in range(len(sees)):
        if not sees[s] or (views.once and count > 0):
            continue
        dx, dy = center[0] - places[s, 0], center[1] - places[s, 1]
        distance = math.sqrt(dx * dx + dy * dy)
        along = dx * facing[s, 0] + dy * facing[s, 1]
        if along < views.cosine[s] * distance:
            continue
        if views.blind.shape[1] and is_blind(math.atan2(facing[s, 0] * dy - facing[s, 1] * dx, along), views.blind[s]):
            continue
        count += 1
        only = s
        nearest = min(nearest, distance)
        information = reflector_information(
            dx, dy, levers[s, 0], levers[s, 1], views.weights[s, 0], views.weights[s, 1]
        )
        for i in range(6):
            parts[i] += information[i]
    if survey_sigma > 0.0 and count == 1:
        dx, dy = center[0] - places[only, 0], center[1] - places[only, 1]
        range_weight, bearing_weight = weights_of(
            dx, dy, survey_sigma, views.variances[only, 0], views.variances[only, 1]
        )
        information = reflector_information(dx, dy, levers[only, 0], levers[only, 1], range_weight, bearing_weight)
        for i in range(6):
            parts[i] = information[i]
    elif survey_sigma > 0.0 and count > 1:
        without_place(parts, survey_sigma * survey_sigma)
    return nearest


@compiled
def parts_at_heading(  # noqa: PLR0917 - arrays in, arrays out
    centers: FloatArray,
    survey_sigmas: FloatArray,
    point: FloatArray,
    words: NDArray[np.uint64],
    h: int,
    views: ViewTables,
    model: FixModel,
    parts: FloatArray,
    free: FloatArray,
) -> int:
    """Fill `information_of_scanners` of the reflectors seen in one heading; return their number.

    Parameters
    ----------
    centers, survey_sigmas : (M, 2) and (M,) arrays [m], map frame.
    point : (2,) what the levers of the views start from [m], map frame.
    words : (S, ceil(M / 64)) which of the M reflectors each scanner sees then, all around.
    h : which heading.
    views : scanners, headings and fields of view.
    model : how likely people block a ray.
    parts : (M, 6) output, its first rows.
    free : (M,) output: probability that nobody blocks the reflector.

    Notes
    -----
    P(any ray free) >= max P(ray free) = free_per_m^shortest, by definition of a union: what two scanners see of one
    reflector may be blocked by one person.
    """
    scanners = len(words)
    places, levers = np.empty((scanners, 2)), np.empty((scanners, 2))
    sees = np.empty(scanners, dtype=np.bool_)
    for s in range(scanners):
        levers[s] = views.levers[views.view_of[h, s]]
        places[s] = point + levers[s]
    seen = 0
    for w in range(words.shape[1]):
        word = np.uint64(0)
        for s in range(scanners):
            word |= words[s, w]
        while word != np.uint64(0):
            bit = lowest_bit(word)
            word &= word - np.uint64(1)
            for s in range(scanners):
                sees[s] = (words[s, w] >> np.uint64(bit)) & np.uint64(1) == np.uint64(1)
            m = 64 * w + bit
            distance = information_of_scanners(
                centers[m], survey_sigmas[m], places, levers, views.facing[h], sees, views, parts[seen]
            )
            if distance < math.inf:
                if model.free_per_m < 1.0:
                    free[seen] = model.free_per_m**distance
                seen += 1
    return seen


@compiled
def fill_view_fixes(  # noqa: PLR0917 - arrays in, arrays out
    centers: FloatArray,
    survey_sigmas: FloatArray,
    points: FloatArray,
    rows: IntArray,
    mask: ViewMask,
    stands: BoolArray,
    views: ViewTables,
    model: FixModel,
    counts: Counts,
    figures: FloatArray,
) -> None:
    """Fill `counts` and `figures` of chosen points from the bits of the reflectors that the views see.

    Parameters
    ----------
    centers, survey_sigmas : (M, 2) and (M,) arrays [m], map frame.
    points : (N, 2) array [m], map frame: what the levers of the views start from.
    rows : points to fill, indices into the other arrays.
    mask : (V, N, ceil(M / 64)) array.
    stands : (N, H) whether the vehicle can stand so; other headings are not looked at.
    views : scanners, their noise, headings and fields of view.
    model : prior and divisors of the dilutions; its own headings and field of view are not read.
    counts : (N,) output: reflectors that any scanner sees.
    figures : (N, FIGURES) output.

    Notes
    -----
    Per point the worst or best of the headings of `fix_at_heading` over `parts_at_heading`; sigma = sqrt(variance), by
    definition. Where the vehicle cannot stand in any heading nothing is seen.
    """
    scanners, many = views.view_of.shape[1], max(1, len(centers))
    parts, free = np.empty((many, 6)), np.ones(many)
    chosen = np.full(many, EVERY_HEADING, dtype=np.uint64)
    one, best = np.empty(FIGURES), np.empty(FIGURES)
    words = np.empty((scanners, mask.shape[2]), dtype=np.uint64)
    for n in rows:
        count = -1
        for h in range(len(views.view_of)):
            if not stands[n, h]:
                continue
            for s in range(scanners):
                words[s] = mask[views.view_of[h, s], n]
            seen = parts_at_heading(centers, survey_sigmas, points[n], words, h, views, model, parts, free)
            found = fix_at_heading(seen, parts, chosen, free, 0, model, one)
            if count < 0:
                count, best[:] = found, one
            else:
                count = min(count, found) if model.combine == WORST else max(count, found)
                keep_worse_or_better(one, model.combine, best)
        if count < 0:
            count = fix_at_heading(0, parts, chosen, free, 0, model, best)
        counts[n] = count
        fill_figures(best, model, figures[n])


@compiled
def fill_view_covariances(  # noqa: PLR0917 - arrays in, arrays out
    centers: FloatArray,
    survey_sigmas: FloatArray,
    points: FloatArray,
    places: FloatArray,
    facing: FloatArray,
    sees: BoolArray,
    views: ViewTables,
    model: FixModel,
    covariances: FloatArray,
) -> None:
    """Fill covariances of poses of the base.

    Parameters
    ----------
    centers, survey_sigmas : (M, 2) and (M,) arrays [m], map frame.
    points : (N, 2) places of the base [m].
    places : (N, S, 2) places of the scanners [m].
    facing : (N, S, 2) unit vectors to the middle of each field of view, map axes.
    sees : (N, M, S) whether each scanner sees each reflector, all around.
    views : widths of the fields of view, noise, weights and `once`; its levers and headings are not read.
    model : prior; its noise, headings and field of view are not read.
    covariances : (N, 3, 3) output [m, m, rad]; inf on the diagonal where singular.

    Notes
    -----
    P = (prior + sum of `information_of_scanners`)^-1: the Cramér-Rao bound (Bar-Shalom, Li, Kirubarajan 2001, section
    2.7).
    """
    parts, levers = np.empty(6), np.empty((places.shape[1], 2))
    for n in range(len(points)):
        i_xx, i_xy, i_xt = model.prior_position, 0.0, 0.0
        i_yy, i_yt, i_tt = model.prior_position, 0.0, model.prior_heading
        for s in range(len(levers)):
            levers[s] = places[n, s] - points[n]
        count = 0
        for m in range(len(centers)):
            distance = information_of_scanners(
                centers[m], survey_sigmas[m], places[n], levers, facing[n], sees[n, m], views, parts
            )
            if distance == math.inf:
                continue
            count += 1
            i_xx += parts[0]
            i_xy += parts[1]
            i_xt += parts[2]
            i_yy += parts[3]
            i_yt += parts[4]
            i_tt += parts[5]
        regular, p_xx, p_xy, p_yy = position_covariance(i_xx, i_xy, i_xt, i_yy, i_yt, i_tt)
        covariances[n] = 0.0
        if count < model.fewest or not regular:
            covariances[n, 0, 0] = covariances[n, 1, 1] = covariances[n, 2, 2] = math.inf
            continue
        p_xt, p_yt = -(p_xx * i_xt + p_xy * i_yt) / i_tt, -(p_xy * i_xt + p_yy * i_yt) / i_tt
        covariances[n, 0, 0], covariances[n, 1, 1] = p_xx, p_yy
        covariances[n, 0, 1] = covariances[n, 1, 0] = p_xy
        covariances[n, 0, 2] = covariances[n, 2, 0] = p_xt
        covariances[n, 1, 2] = covariances[n, 2, 1] = p_yt
        covariances[n, 2, 2] = heading_variance(i_xt, i_yt, i_tt, p_xx, p_xy, p_yy)

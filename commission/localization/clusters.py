"""Runs of reflective beams in a scan: which beams are one body. Not what the body is.

A cluster is a run of neighboring reflective beams whose ranges do not jump: one body. Scanners drop single flags, and
real foils have dark beams in their middle. A dark beam at the range of the body is bridged, and one beam that misses it
(no echo, or one from behind), as long as the body is no wider than the largest reflector; a single one in any case.
They count as beams, because the filter's window speaks of width. A beam that sees something nearer ends a cluster.

A beam half on a body and half on what is behind it is flagged, and measures something in between. Such mixed beams at
the edges of a run belong to the body, whose width they tell, however far their ranges jump; where the body is, they do
not say (`body_of`). With equation 3 as printed, single missing beams alone are bridged, and mixed ones split bodies.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from commission.compiled import compiled, compiled_inline
from commission.localization.beam_echo import half_width_at
from commission.localization.detector_model import Beams, DetectorModel

MOST_MIXED = 2
"""Mixed beams at an edge of a body whose ranges jump: beams may be wider than the step between them."""
DEEPER = 3.0
"""Sigmas of the difference of two ranges by which a beam is deeper than a body can be."""
DARK_AT_START = 32
"""Dark beams before the one with which a full turn begins, where there are so many: bodies have dark beams inside."""


class ClusterRule(NamedTuple):
    """What makes beams a cluster: of `DetectorModel`, without its arrays, which cost atomic operations at each call."""

    range_jump: float
    widest: float
    half_divergence: float
    half_aperture: float
    steepest: float
    range_sigma: float


@compiled_inline
def cluster_rule(model: DetectorModel) -> ClusterRule:
    """Return what the steps of this module read.

    Notes
    -----
    No formula: fields of the model.
    """
    return ClusterRule(
        model.range_jump,
        model.widest,
        model.half_divergence,
        model.half_aperture,
        model.steepest,
        model.range_sigma,
    )


@compiled_inline
def _lit(ranges: NDArray[np.float32], flags: NDArray[np.bool_], beam: int) -> bool:
    """Whether a beam is reflective and has a range."""
    return flags[beam] and ranges[beam] > 0.0 and ranges[beam] < math.inf


@compiled_inline
def next_cluster(  # noqa: PLR0917 - a scan and a position in it
    ranges: NDArray[np.float32], flags: NDArray[np.bool_], beams: Beams, position: int, end: int, rule: ClusterRule
) -> tuple[int, int]:
    """First and last beam of the cluster at or after a position; first = end when none. Beams count on past a turn.

    Parameters
    ----------
    ranges, flags : (B,) range [m] of each beam, and whether it met something reflective.
    beams : bearings of the scan.
    position, end : first beam to look at, and the one before which to end.
    rule : the largest jump of the range within a cluster, and the width of the largest reflector.

    Notes
    -----
    No formula: what a cluster is, is said at the top of the module (Sobreira et al. 2016, Algorithm 2, lines 2 and 3).
    """
    first, count = position, beams.used
    while True:
        # Most beams are dark: this loop is most of the detector's time, so it does nothing else.
        while first < min(end, count) and not flags[first]:
            first += 1
        if first >= end or _lit(ranges, flags, first if first < count else first - count):
            break
        first += 1
    last = first
    while last + 1 < end:
        k = last + 1 if last + 1 < count else last + 1 - count
        if _lit(ranges, flags, k):
            if not abs(ranges[k] - ranges[last if last < count else last - count]) <= rule.range_jump:
                mixed = _mixed_beams(ranges, flags, beams, first, last, end, rule)
                ends = mixed != 1 or ranges[k] > ranges[first if first < count else first - count]
                last += mixed
                if ends:
                    break
                continue
            last += 1
            continue
        after = _next_of_body(ranges, flags, beams, first, last, end, rule)
        if after == last:
            break
        last = after
    return first, last


@compiled_inline
def _mixed_beams(  # noqa: PLR0917 - a scan and a cluster in it
    ranges: NDArray[np.float32],
    flags: NDArray[np.bool_],
    beams: Beams,
    first: int,
    last: int,
    end: int,
    rule: ClusterRule,
) -> int:
    """Beams behind a cluster's last one that are of the same body although their range jumps; 0 where they are not.

    Either the cluster so far is a few mixed beams before the body, or a few mixed ones follow it before it gets dark.
    """
    count = beams.used
    here = ranges[last if last < count else last - count]
    after = last + 1 if last + 1 < count else last + 1 - count
    if rule.widest == 0.0:
        return 0
    if ranges[after] < here:
        before = first - 1 if first > 0 else count - 1
        starts = (first == 0 and not beams.full_turn) or not _lit(
            ranges, flags, before if before < count else before - count
        )
        return 1 if starts and last - first < MOST_MIXED else 0
    beam, goes_on, is_behind = last + 1, True, True
    while goes_on and beam < end and beam - last <= MOST_MIXED + 1:
        k = beam if beam < count else beam - count
        goes_on = _lit(ranges, flags, k)
        # One at the range of the body again is of the body, and what lies before it no edge.
        is_behind &= not goes_on or ranges[k] > here + rule.range_jump
        beam += goes_on
    found = beam - last - 1
    return found if is_behind and found <= MOST_MIXED else 0


@compiled_inline
def body_of(  # noqa: PLR0917 - a scan and a cluster in it
    ranges: NDArray[np.float32], flags: NDArray[np.bool_], beams: Beams, first: int, last: int, rule: ClusterRule
) -> tuple[int, int]:
    """First and last beam of a cluster that measure the body: without those at its edges that are mixed.

    Parameters
    ----------
    ranges, flags : (B,) range [m] of each beam, and whether it met something reflective.
    beams : bearings of the scan.
    first, last : the cluster's first and last beam, which count on past a full turn.
    rule : size of the reflectors and noise of the ranges.

    Notes
    -----
    range - nearest <= max(largest radius, steepest slope d |b|) + 3 sqrt(2) sigma: how much deeper
    than its nearest beam a post or plate can be at the angle b from it, and noise. Derived.
    """
    if rule.widest == 0.0 or last == first:
        return first, last
    count = beams.used
    # Nearly always neither edge lies deeper than the middle, or the middle deeper than an edge.
    half = (last - first) // 2
    middle, low, high = first + half, first, last
    middle, low, high = (
        middle if middle < count else middle - count,
        low if low < count else low - count,
        high if high < count else high - count,
    )
    deep = max(0.5 * rule.widest, rule.steepest * ranges[middle] * abs(beams.increment) * half)
    if flags[middle] and abs(ranges[low] - ranges[middle]) <= deep and abs(ranges[high] - ranges[middle]) <= deep:
        return first, last
    return _without_mixed(ranges, flags, beams, first, last, rule)


@compiled_inline
def _without_mixed(  # noqa: PLR0917 - a scan and a cluster in it
    ranges: NDArray[np.float32], flags: NDArray[np.bool_], beams: Beams, first: int, last: int, rule: ClusterRule
) -> tuple[int, int]:
    """First and last beam of a cluster that are no deeper than the body can be beside its nearest beam."""
    count, nearest, at = beams.used, math.inf, first
    for beam in range(first, last + 1):
        k = beam if beam < count else beam - count
        if _lit(ranges, flags, k) and ranges[k] < nearest:
            nearest, at = float(ranges[k]), beam
    noise = DEEPER * math.sqrt(2.0) * rule.range_sigma
    per_beam = rule.steepest * nearest * abs(beams.increment)
    while first < at and _is_deeper(
        ranges, flags, count, first, nearest + noise + max(0.5 * rule.widest, per_beam * (at - first))
    ):
        first += 1
    while last > at and _is_deeper(
        ranges, flags, count, last, nearest + noise + max(0.5 * rule.widest, per_beam * (last - at))
    ):
        last -= 1
    return first, last


@compiled_inline
def _is_deeper(ranges: NDArray[np.float32], flags: NDArray[np.bool_], count: int, beam: int, deepest: float) -> bool:
    """Whether a beam measures nothing of a body that ends at some range."""
    k = beam if beam < count else beam - count
    return not _lit(ranges, flags, k) or ranges[k] > deepest


@compiled_inline
def _next_of_body(  # noqa: PLR0917 - a scan and a cluster in it
    ranges: NDArray[np.float32],
    flags: NDArray[np.bool_],
    beams: Beams,
    first: int,
    last: int,
    end: int,
    rule: ClusterRule,
) -> int:
    """Next reflective beam of the body of a cluster; its last one where there is none."""
    count, step = beams.used, abs(beams.increment)
    here = ranges[last if last < count else last - count]
    missed, beyond = 0, 0
    beam, found, searching = last + 1, last, True
    # One way out: from the middle of a loop, each array would cost two atomic operations.
    while searching and beam < end:
        k = beam if beam < count else beam - count
        if _lit(ranges, flags, k):
            fits = abs(ranges[k] - here) <= rule.range_jump
            # One beam may be missing whatever the width; more only within that of the largest reflector.
            dark = beam - last - 1
            one = dark == 0 or (dark == 1 and beyond == 0)
            if fits and (one or (beam - first) * step <= _widest(float(here), step, rule)):
                found = beam
            searching = False
        elif ranges[k] < here - rule.range_jump:
            searching = False
        else:
            missed += not ranges[k] <= here + rule.range_jump
            beyond += ranges[k] > here + rule.range_jump
            if missed > 1 or (beam > last + 1 and (beam - first) * step > _widest(float(here), step, rule)):
                searching = False
        beam += 1
    return found


@compiled_inline
def _widest(distance: float, step: float, rule: ClusterRule) -> float:
    """Angle between the first and the last beam of the largest reflector [rad]; 0 where bodies do not count."""
    if rule.widest == 0.0:
        return 0.0
    # A beam more: bearings have noise.
    half_width = half_width_at(distance, rule.half_divergence, rule.half_aperture)
    return rule.widest / distance + 2.0 * half_width + step


@compiled_inline
def start_of_turn(ranges: NDArray[np.float32], flags: NDArray[np.bool_], beams: Beams, rule: ClusterRule) -> int:
    """First beam after some dark ones, so that no cluster lies across the start of a full turn.

    Parameters
    ----------
    ranges, flags : (B,) range [m] of each beam, and whether it met something reflective.
    beams : bearings of the scan.
    rule : whether dark beams belong to a body.

    Notes
    -----
    No formula: the first beam after `DARK_AT_START` dark ones, by definition; after two where there are not so many.
    """
    if not beams.full_turn:
        return 0
    needed = 2 if rule.widest == 0.0 else DARK_AT_START
    while True:
        dark = 0
        for position in range(max(beams.used - needed, 0), 2 * beams.used):
            beam = position if position < beams.used else position - beams.used
            if dark >= needed and position >= beams.used:
                return beam
            dark = 0 if _lit(ranges, flags, beam) else dark + 1
        if needed == 2:
            return 0
        needed = 2


@compiled
def count_clusters(ranges: NDArray[np.float32], flags: NDArray[np.bool_], beams: Beams, model: DetectorModel) -> int:
    """Count the clusters in a scan, to reserve space for them.

    Parameters
    ----------
    ranges, flags : (B,) range [m] of each beam, and whether it met something reflective.
    beams : bearings of the scan.
    model : the largest jump of the range within a cluster is read.

    Notes
    -----
    No formula: what a cluster is, is said at the top of the module (Sobreira et al. 2016, Algorithm 2, lines 2 and 3).
    """
    rule = cluster_rule(model)
    position = start_of_turn(ranges, flags, beams, rule)
    end = position + beams.used if beams.full_turn else beams.used
    found = 0
    while position < end:
        first, last = next_cluster(ranges, flags, beams, position, end, rule)
        if first < end:
            found += 1
        position = last + 1
    return found

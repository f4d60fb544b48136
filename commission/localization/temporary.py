"""Temporary landmarks as an observation kind: goods that come and go help where what is fixed is rarely in sight.

"Gold-fish SLAM" (Andreasson et al. 2011): reels and corners of a scan are associated with landmarks that were seen
before, correct pose and landmarks together, become landmarks themselves, and are forgotten. What is fixed (reflectors,
contours, tags) never moves and corrects the pose before them. The joint Gaussian is `temporary_joint`'s.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from commission.compiled import compiled, compiled_inline
from commission.geometry.arrays import FloatArray, IntArray
from commission.localization.consider_columns import carry_over
from commission.localization.contour import ContourScan, beam_points
from commission.localization.corners import corner_of
from commission.localization.odometry import Motion, NextOdometry
from commission.localization.pose_gaussian import PoseGaussian
from commission.localization.reels import Sighting, cut_into_segments, reel_of
from commission.localization.temporary_joint import (
    carry_landmarks,
    correct_jointly,
    covariance_of,
    innovation_of,
    pose_in,
    put_pose,
    solve_three,
)
from commission.localization.temporary_life import (
    SMOOTHING,
    forget_landmarks,
    is_alike,
    is_doubtful,
    look_for_missing,
    remember_sighting,
)
from commission.localization.temporary_memory import (
    DRIFT_X,
    DRIFT_Y,
    KIND,
    LANDMARKS,
    MATCHES,
    MISSES,
    PER_LANDMARK,
    POSE,
    SEEN_NS,
    SHAPE,
    WAITING,
    TemporaryMemory,
)
from commission.localization.temporary_model import (
    AWAITED,
    BORN,
    CORNER,
    CORNERS,
    DOUBTFUL,
    FORGOTTEN,
    KNOWN,
    MATCHED,
    NIS_SUM,
    REEL,
    REELS,
    TemporaryModel,
)

MOST_SEEN = 128
"""Reels and corners of a scan that are used at most."""
NEAR = 2.0
"""Distance from a landmark beyond which a sighting is not compared with it [m]."""


class ScanGoods(NamedTuple):
    """Reels and corners of a scan, base frame at its stamp."""

    kinds: IntArray
    rows: FloatArray
    """(MOST_SEEN, 6) x, y [m], xx, xy, yy [m^2], radius [m] or heading [rad]."""


@compiled_inline
def sighting_at(sightings: ScanGoods, i: int) -> Sighting:
    """Return one sighting.

    Parameters
    ----------
    sightings : of a scan.
    i : which one.

    Notes
    -----
    No formula: its row.
    """
    r = sightings.rows
    return Sighting(True, r[i, 0], r[i, 1], r[i, 2], r[i, 3], r[i, 4], r[i, 5])


@compiled
def sightings_of(
    scan: ContourScan, model: TemporaryModel, motion: Motion, following: NextOdometry, found: ScanGoods
) -> int:
    """Write the reels and corners of a scan; return how many there are.

    Parameters
    ----------
    scan : its beams.
    model : rules and limits.
    motion, following : odometry before the scan and after it: the vehicle moves while the beam turns.
    found : out.

    Notes
    -----
    No formula: `beam_points`, `cut_into_segments`, and `reel_of` or else `corner_of` of each segment, Andreasson et al.
    2011, section 3.3.
    """
    points = np.empty((len(scan.ranges), 2))
    count = beam_points(scan, model.limits, model.blind, 1.0, motion, following, points)
    starts = np.empty(count + 1, np.int64)
    x, y = scan.observation.mount_x, scan.observation.mount_y
    pieces = cut_into_segments(points, count, model.gap, x, y, starts)
    seen = 0
    for piece in range(pieces if count else 0):
        segment = points[starts[piece] : starts[piece + 1]]
        if len(segment) < model.reel.fewest_points or seen == MOST_SEEN:
            continue
        kind, each = REEL, reel_of(segment, x, y, model.reel)
        if not each.found:
            kind, each = CORNER, corner_of(segment, x, y, model.corner)
        if each.found and math.hypot(each.x - x, each.y - y) <= model.reach:
            found.kinds[seen] = kind
            r = found.rows
            r[seen, 0], r[seen, 1], r[seen, 5] = each.x, each.y, each.shape
            r[seen, 2], r[seen, 3], r[seen, 4] = each.xx + model.floor_variance, each.xy, each.yy + model.floor_variance
            seen += 1
    return seen


@compiled
def observe_temporary(  # noqa: PLR0917 - the filter's state around one scan
    prior: PoseGaussian,
    belief: PoseGaussian,
    was_lost: bool,
    model: TemporaryModel,
    memory: TemporaryMemory,
    scan: ContourScan,
    motion: Motion,
    following: NextOdometry,
    stamp_ns: int,
    invariant: bool,
    cross: FloatArray | None,
    busy: IntArray | None,
    figures: FloatArray,
) -> PoseGaussian:
    """Correct a belief by the temporary landmarks of a scan, and remember what it shows.

    Parameters
    ----------
    prior : belief after *predict*.
    belief : after what is fixed has corrected it.
    was_lost : whether nobody knew before where the vehicle is: its landmarks are nowhere, then.
    model : rules and limits.
    memory : landmarks, written.
    scan : its beams; none of a record that has no whole scan.
    motion, following : odometry before the scan and after it.
    stamp_ns : of the scan [ns].
    invariant : whether the covariance is that of a right-invariant error.
    cross : covariance of the pose with the considered constants at `belief`, written in place, or None.
    busy : see `busy_chunks`; None: as `cross`.
    figures : (COLUMNS,) out: what became of it.

    Notes
    -----
    No formula: carry, extract, associate, *correct*, forget and remember: Andreasson et al. 2011, Fig. 1. Constants go
    with the pose: C = P' P^-1 C, exact where they tell nothing of landmarks but through it (Schmidt 1966).
    """
    figures[:] = 0.0
    if was_lost or not carry_landmarks(memory, prior, belief, invariant):
        figures[FORGOTTEN] = memory.counts[LANDMARKS]
        memory.counts[LANDMARKS] = memory.counts[WAITING] = 0
        memory.mean[0], memory.mean[1], memory.mean[2] = belief.x, belief.y, belief.theta
        return belief
    put_pose(memory, belief)
    found = ScanGoods(np.empty(MOST_SEEN, np.int64), np.empty((MOST_SEEN, 6)))
    count = sightings_of(scan, model, motion, following, found)
    whose = np.full(MOST_SEEN, -1)
    associate_temporary(memory, model, found, count, whose)
    matched = np.zeros(model.most, np.bool_)
    for i in range(count):
        figures[CORNERS if found.kinds[i] == CORNER else REELS] += 1.0
        if whose[i] >= 0 and _correct(memory, model, whose[i], sighting_at(found, i), stamp_ns, invariant, figures):
            matched[whose[i]] = True
    after = pose_in(memory)
    if cross is not None and busy is not None and figures[MATCHED] > 0.0:
        ratio, start = covariance_of(after), covariance_of(belief)
        if solve_three(start, ratio):
            carry_over(cross, ratio.T.copy(), busy)
    for i in range(count):
        if whose[i] < 0 and is_doubtful(memory, matched, found.kinds[i], sighting_at(found, i)):
            figures[DOUBTFUL] += 1.0
            whose[i] = 0
    look_for_missing(memory, matched, model, scan)
    figures[FORGOTTEN] += forget_landmarks(memory, model, stamp_ns)
    for i in range(count):
        if whose[i] < 0:
            figures[BORN] += remember_sighting(memory, model, found.kinds[i], sighting_at(found, i), stamp_ns, figures)
    figures[KNOWN], figures[AWAITED] = memory.counts[LANDMARKS], memory.counts[WAITING]
    return after


@compiled
def associate_temporary(
    memory: TemporaryMemory, model: TemporaryModel, found: ScanGoods, count: int, whose: IntArray
) -> None:
    """Decide which landmark each sighting is of.

    Parameters
    ----------
    memory : landmarks, and the pose.
    model : has the gate.
    found, count : sightings.
    whose : (MOST_SEEN,) out: slot of each, or -1.

    Notes
    -----
    NIS <= gate, the nearest pair of all first, exclusively: by definition. Only landmarks around the pose are compared:
    the submap of Andreasson et al. 2011, Fig. 1.
    """
    n, mean = memory.counts[LANDMARKS], memory.mean
    c, s = math.cos(mean[2]), math.sin(mean[2])
    distances = np.full((count, n), math.inf)
    for i in range(count):
        x, y = (
            mean[0] + c * found.rows[i, 0] - s * found.rows[i, 1],
            mean[1] + s * found.rows[i, 0] + c * found.rows[i, 1],
        )
        for slot in range(n):
            at = POSE + PER_LANDMARK * slot
            if memory.marks[slot, KIND] != found.kinds[i] or max(abs(x - mean[at]), abs(y - mean[at + 1])) > NEAR:
                continue
            if is_alike(found.kinds[i], found.rows[i, 5], mean[2], memory.shapes[slot, SHAPE]):
                nis = innovation_of(memory, slot, sighting_at(found, i)).nis
                if nis <= model.gate:
                    distances[i, slot] = nis
    for _ in range(min(count, n)):
        least, best, of = math.inf, -1, -1
        for i in range(count):
            for slot in range(n):
                if distances[i, slot] < least:
                    least, best, of = distances[i, slot], i, slot
        if best < 0:
            break
        whose[best] = of
        for slot in range(n):
            distances[best, slot] = math.inf
        for i in range(count):
            distances[i, of] = math.inf


@compiled_inline
def _correct(  # noqa: PLR0917 - a sighting, and what it is used for
    memory: TemporaryMemory,
    model: TemporaryModel,
    slot: int,
    seen: Sighting,
    stamp_ns: int,
    invariant: bool,
    figures: FloatArray,
) -> bool:
    """Correct by a sighting of a landmark, where it is inside of the gate of the freshest state, too."""
    v = innovation_of(memory, slot, seen)
    if not v.nis <= model.gate:
        return False
    marks, shapes, theta = memory.marks, memory.shapes, memory.mean[2]
    c, s = math.cos(theta), math.sin(theta)
    # In map axes: somebody who moves it moves it across the floor.
    shapes[slot, DRIFT_X] += SMOOTHING * (c * v.first - s * v.second - shapes[slot, DRIFT_X])
    shapes[slot, DRIFT_Y] += SMOOTHING * (s * v.first + c * v.second - shapes[slot, DRIFT_Y])
    correct_jointly(memory, slot, v, invariant)
    figures[MATCHED] += 1.0
    figures[NIS_SUM] += v.nis
    marks[slot, SEEN_NS] = stamp_ns
    marks[slot, MATCHES] += 1
    marks[slot, MISSES] = 0
    return True

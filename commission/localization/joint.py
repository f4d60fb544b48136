"""Associate detections of a scan together: those that fit with each other (JCBB), or none that contradict each other.

What one detection alone fits is `association`'s. Here are the ways that look at several of them, and at rivals.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from commission.compiled import compiled, compiled_inline
from commission.geometry.arrays import FloatArray, IntArray
from commission.geometry.directions import UnitVector, composed, turn_to
from commission.localization.consider import BLOCKS, PER_SCANNER, Considering, scanner_jacobian, seen_with
from commission.localization.consider_columns import take_out
from commission.localization.estimate import Status
from commission.localization.filter_kinds import innovation_by, is_invariant
from commission.localization.invariant import landing
from commission.localization.kalman import squared_distance
from commission.localization.observation import ObservationModel, expect_at
from commission.localization.pose_gaussian import PoseGaussian
from commission.localization.reflector_index import ReflectorIndex, cell_range
from commission.localization.scan_rows import ScanRows
from commission.localization.search import Viewpoint, radius2_by
from commission.site.parameters import ASSOCIATION_METHODS

EXCLUSIVE, NEAREST, CAREFUL, JOINT, SEVERAL_SCANS = range(len(ASSOCIATION_METHODS))
INLIER = int(Status.INLIER)
OUTLIER_ASSOCIATION = int(Status.OUTLIER_ASSOCIATION)
MOST_JOINTLY = 8
"""Detections that are decided on together; of more, the next as many after them."""
MOST_RIVALS = 4
"""Reflectors of one detection that are looked at, the likeliest ones."""
MOST_NODES = 2000
"""Pairs that are tried at most for as many detections, so that the time is bounded; eight clear ones take eight."""
CLEAR = 2.0 * math.log(20.0)
"""Difference of -2 ln(likelihood) from which one of two rivals is clearly the right one: odds of 20 to 1."""


class Rivals(NamedTuple):
    """Reflectors inside the gates of some detections, and what the joint covariance of their innovations is made of."""

    number: IntArray
    """(n,) of each detection."""
    entry: IntArray
    """(n, R) rows of `places`, the likeliest first."""
    d2: FloatArray
    """(n, R) squared Mahalanobis distances."""
    cost: FloatArray
    """(n, R) -2 ln(likelihood) up to a constant."""
    residual: FloatArray
    """(n, R, 2)."""
    jacobian: FloatArray
    """(n, R, 2, 3) H."""
    crossed: FloatArray
    """(n, R, 3, 2) C J^T; zero where nothing is considered."""
    of_scanner: FloatArray
    """(n, R, 2, 5) J of the constants of the scanner, times their 1-sigma."""
    noise: FloatArray
    """(n, R, 2, 2) what the detection has with no other one in common: R, and the survey of the reflector."""


@compiled
def no_rivals(detections: int) -> Rivals:
    """Room for the rivals of some detections.

    Parameters
    ----------
    detections : how many.

    Notes
    -----
    No formula: it makes arrays.
    """
    n, r = detections, MOST_RIVALS
    return Rivals(
        np.zeros(n, np.int64),
        np.zeros((n, r), np.int64),
        np.zeros((n, r)),
        np.zeros((n, r)),
        np.zeros((n, r, 2)),
        np.zeros((n, r, 2, 3)),
        np.zeros((n, r, 3, 2)),
        np.zeros((n, r, 2, PER_SCANNER)),
        np.zeros((n, r, 2, 2)),
    )


@compiled
def decide_together(  # noqa: PLR0917 - the scan's detections and the map, array by array
    method: int,
    kind: int | None,
    gates: tuple[float, ...],
    belief: PoseGaussian,
    facing: UnitVector,
    view: Viewpoint,
    reach: Viewpoint,
    rows: ScanRows,
    model: ObservationModel,
    index: ReflectorIndex,
    given: Considering | None,
) -> None:
    """Decide anew on those detections of a scan that alone are inliers.

    Parameters
    ----------
    method : CAREFUL or JOINT.
    kind : of the filter.
    gates : of one detection, of two, and so on, jointly.
    belief, facing : after *predict*, and the direction of its heading.
    view, reach : scanner's place, and the bounds of the search.
    rows : in and out: as `associate` has them for each detection alone.
    model, index, given : as in `associate`.

    Notes
    -----
    No formula: `leave_out`, or `most_compatible` of `MOST_JOINTLY` at once, those first that have rivals.
    """
    first, last, measured, aims, status, entries, d2 = rows
    members = np.flatnonzero(status[first:last] == INLIER) + first
    found, chosen = no_rivals(len(members)), np.full(len(members), -1)
    for m in range(len(members)):
        i = members[m]
        distance, aim = measured[i, 0] - model.range_bias, UnitVector(aims[i - first, 0], aims[i - first, 1])
        list_rivals(found, m, kind, gates[0], belief, facing, view, reach, distance, aim, model, index, given)
    if method == CAREFUL:
        leave_out(found, chosen)
    else:
        order = np.argsort(-_contested(found), kind="mergesort")
        for begin in range(0, len(order), MOST_JOINTLY):
            group = order[begin : begin + MOST_JOINTLY]
            for m in order[:begin]:
                if chosen[m] >= 0:
                    _take_off(found, group, int(found.entry[m, chosen[m]]))
            most_compatible(found, group, belief, gates, chosen)
    for m in range(len(members)):
        i = members[m]
        if chosen[m] < 0:
            status[i] = OUTLIER_ASSOCIATION
        else:
            entries[i], d2[i] = found.entry[m, chosen[m]], found.d2[m, chosen[m]]


@compiled
def _contested(found: Rivals) -> IntArray:
    """Count what each detection has to do with: its reflectors but one, and other detections that have one of them."""
    count = len(found.number)
    contested = np.maximum(found.number - 1, 0)
    for m in range(count):
        for other in range(count):
            for r in range(found.number[m]):
                for s in range(found.number[other]):
                    if other != m and found.entry[m, r] == found.entry[other, s]:
                        contested[m] += 1
    return contested


@compiled_inline
def _take_off(found: Rivals, group: IntArray, entry: int) -> None:
    """Let a reflector be no rival any more."""
    for m in group:
        for r in range(found.number[m]):
            if found.entry[m, r] == entry:
                found.cost[m, r] = math.inf


@compiled
def list_rivals(  # noqa: PLR0917 - a measurement, number by number, and the map
    found: Rivals,
    m: int,
    kind: int | None,
    gate_d2: float,
    belief: PoseGaussian,
    facing: UnitVector,
    view: Viewpoint,
    reach: Viewpoint,
    measured_range: float,
    aim: UnitVector,
    model: ObservationModel,
    index: ReflectorIndex,
    given: Considering | None,
) -> None:
    """List the reflectors inside the gate of a detection, the likeliest first.

    Parameters
    ----------
    found, m : where they are written, and for which of its detections.
    kind, gate_d2 : of the filter, and largest squared Mahalanobis distance.
    belief, facing, view, reach : what the detection is judged at, as in `associate`.
    measured_range, aim : range bias already taken off [m], and the bearing as a direction of base.
    model, index, given : as in `associate`.

    Notes
    -----
    d2 + ln(det S): Sobreira et al. 2016, Algorithm 3, line 4, with S that of the kind of the filter.
    """
    cells, places, cell_offsets = index
    ray = composed(facing, aim)
    px = belief.x + view.offset_x + measured_range * ray.cos - cells.origin_x
    py = belief.y + view.offset_y + measured_range * ray.sin - cells.origin_y
    surveyed = cells.largest_variance if given is None else 0.0
    radius = math.sqrt(radius2_by(kind, math.sqrt(gate_d2), measured_range, reach, model, surveyed))
    first_row, last_row = cell_range(py - radius, py + radius, cells.per_metre, cells.rows)
    first_column, last_column = cell_range(px - radius, px + radius, cells.per_metre, cells.columns)
    for row in range(first_row, last_row + 1 if last_column >= first_column else first_row):
        start = cell_offsets[row * cells.columns + first_column]
        for entry in range(start, cell_offsets[row * cells.columns + last_column + 1]):
            x, y, variance = places[entry, 0], places[entry, 1], places[entry, 2]
            if math.hypot(x - cells.origin_x - px, y - cells.origin_y - py) > radius:
                continue
            take_out(given, BLOCKS, entry)
            dx, dy = x - (belief.x + view.offset_x), y - (belief.y + view.offset_y)
            e = expect_at(dx, dy, math.nan, view.offset_x, view.offset_y)
            turn = turn_to(-e.range_x, -e.range_y, ray)
            v = innovation_by(
                kind,
                belief,
                facing,
                measured_range,
                ray,
                aim,
                e,
                x,
                y,
                variance,
                view.offset_x,
                view.offset_y,
                model,
                given,
                BLOCKS,
            )
            if not squared_distance(v) <= gate_d2:
                continue
            r = _insert(found, m, entry, squared_distance(v), squared_distance(v) + math.log(v.s_rr * v.schur))
            if r < 0:
                continue
            if is_invariant(kind):
                from_x, from_y = belief.x + view.offset_x, belief.y + view.offset_y
                seen = landing(from_x, from_y, ray, measured_range, x, y, belief.x, belief.y, 0.5)
                e, turn = seen.expected, seen.turn
            found.residual[m, r, 0], found.residual[m, r, 1] = measured_range - e.range, turn
            H, noise = found.jacobian[m, r], found.noise[m, r]
            H[0, 0], H[0, 1], H[0, 2] = e.range_x, e.range_y, e.range_theta
            H[1, 0], H[1, 1], H[1, 2] = e.bearing_x, e.bearing_y, e.bearing_theta
            for a in range(2):
                for b in range(2):
                    noise[a, b] = variance * (H[a, 0] * H[b, 0] + H[a, 1] * H[b, 1])
            noise[0, 0] += model.range_variance
            noise[1, 1] += model.bearing_variance
            if given is not None:
                d = seen_with(facing, e, variance, given, BLOCKS)
                D, J, p = found.crossed[m, r], found.of_scanner[m, r], given.variances
                D[0, 0], D[0, 1], D[1, 0], D[1, 1], D[2, 0], D[2, 1] = d.xr, d.xb, d.yr, d.yb, d.tr, d.tb
                j = scanner_jacobian(facing, e, given.speed_x, given.speed_y, given.turn_rate)
                position, clock = math.sqrt(p.mount_position), math.sqrt(p.clock)
                J[0, 0], J[1, 0] = position * j.mount_xr, position * j.mount_xb
                J[0, 1], J[1, 1] = position * j.mount_yr, position * j.mount_yb
                J[0, 2], J[1, 2] = 0.0, -math.sqrt(p.mount_heading)
                J[0, 3], J[1, 3] = math.sqrt(p.range_bias), 0.0
                J[0, 4], J[1, 4] = clock * j.clock_r, clock * j.clock_b


@compiled_inline
def _insert(found: Rivals, m: int, entry: int, d2: float, cost: float) -> int:
    """Make room for a rival by its cost; return its rank, or -1 where it is not among the likeliest."""
    rank = found.number[m]
    while rank > 0 and found.cost[m, rank - 1] > cost:
        rank -= 1
    if rank >= MOST_RIVALS:
        return -1
    for r in range(min(found.number[m], MOST_RIVALS - 1), rank, -1):
        found.entry[m, r], found.d2[m, r], found.cost[m, r] = (
            found.entry[m, r - 1],
            found.d2[m, r - 1],
            found.cost[m, r - 1],
        )
        # Number by number: an assignment of whole arrays takes a quarter of the time in which the filter compiles, for
        # the text of an error that none of them can have.
        for i in range(2):
            found.residual[m, r, i] = found.residual[m, r - 1, i]
            for j in range(3):
                found.jacobian[m, r, i, j] = found.jacobian[m, r - 1, i, j]
                found.crossed[m, r, j, i] = found.crossed[m, r - 1, j, i]
            for j in range(PER_SCANNER):
                found.of_scanner[m, r, i, j] = found.of_scanner[m, r - 1, i, j]
            for j in range(2):
                found.noise[m, r, i, j] = found.noise[m, r - 1, i, j]
    found.entry[m, rank], found.d2[m, rank], found.cost[m, rank] = entry, d2, cost
    found.number[m] = min(found.number[m] + 1, MOST_RIVALS)
    return rank


@compiled
def leave_out(found: Rivals, chosen: IntArray) -> None:
    """Choose the likeliest reflector of each detection, and none where another reflector or detection has it, too.

    Parameters
    ----------
    found : rivals of n detections.
    chosen : (n,) out: which of its rivals a detection belongs to, or -1.

    Notes
    -----
    No formula: what is not `CLEAR`ly likelier than its rival is left out, with its rival.
    """
    count = len(chosen)
    for m in range(count):
        chosen[m] = 0 if found.number[m] > 0 and found.cost[m, 0] < math.inf else -1
        if found.number[m] > 1 and found.cost[m, 1] - found.cost[m, 0] < CLEAR:
            chosen[m] = -1
    for m in range(count):
        if chosen[m] < 0:
            continue
        for other in range(count):
            if other == m:
                continue
            for r in range(found.number[other]):
                # The other one's claim counts whether or not it is left out itself.
                if found.entry[other, r] == found.entry[m, 0] and found.cost[other, r] - found.cost[m, 0] < CLEAR:
                    chosen[m] = -1


@compiled
def most_compatible(
    found: Rivals, group: IntArray, belief: PoseGaussian, gates: tuple[float, ...], chosen: IntArray
) -> None:
    """Choose the most pairs of detection and reflector that fit together; of as many, those that fit best.

    Parameters
    ----------
    found : rivals of detections.
    group : (n,) which of them, at most `MOST_JOINTLY`.
    belief : after *predict*.
    gates : of one pair, of two, and so on.
    chosen : of all detections; out: which of its rivals one of the group belongs to, or -1.

    Notes
    -----
    D2 = v^T S^-1 v of all pairs together <= chi-square of twice as many degrees of freedom, by branch and bound: Neira
    and Tardós 2001, Figure 4. S = L L^T grows by two rows with each pair. Ends after `MOST_NODES`, with the best of
    them.
    """
    n, best, best_d2, nodes, i = len(group), -1, math.inf, 0, 0
    tried, pairs, total = np.full(n + 1, -1), np.zeros(n + 1, np.int64), np.zeros(n + 1)
    member, rival = np.zeros(n, np.int64), np.zeros(n, np.int64)
    L, solved = np.zeros((2 * n, 2 * n)), np.zeros(2 * n)
    while i >= 0:
        p = pairs[i]
        if i == n:
            if p > best or (p == best and total[i] < best_d2):
                best, best_d2 = p, total[i]
                for m in group:
                    chosen[m] = -1
                for pair in range(p):
                    chosen[member[pair]] = rival[pair]
            i -= 1
            continue
        tried[i] += 1
        m = group[i]
        if tried[i] > found.number[m] or nodes >= MOST_NODES:
            tried[i] = -1
            i -= 1
            continue
        nodes += 1
        if p + n - i < best or (p + n - i == best and total[i] >= best_d2):
            continue
        if tried[i] == found.number[m]:
            if p + n - i - 1 >= best:
                pairs[i + 1], total[i + 1] = p, total[i]
                i += 1
            continue
        if _is_taken(found, member, rival, p, m, tried[i]) or not found.cost[m, tried[i]] < math.inf:
            continue
        member[p], rival[p] = m, tried[i]
        grown = total[i] + _grown(found, belief, member, rival, p, L, solved)
        if grown <= gates[p]:
            pairs[i + 1], total[i + 1] = p + 1, grown
            i += 1


@compiled_inline
def _is_taken(  # noqa: PLR0917 - a pair and the pairs so far
    found: Rivals, member: IntArray, rival: IntArray, pairs: int, i: int, r: int
) -> bool:
    """Whether a reflector belongs to another detection already."""
    taken = False
    for pair in range(pairs):
        taken = taken or found.entry[member[pair], rival[pair]] == found.entry[i, r]
    return taken


@compiled
def _grown(  # noqa: PLR0917 - the factors so far, array by array
    found: Rivals, belief: PoseGaussian, member: IntArray, rival: IntArray, p: int, L: FloatArray, solved: FloatArray
) -> float:
    """Add a pair to the factors of S; return what it adds to the joint distance."""
    added = 0.0
    for a in range(2):
        row = 2 * p + a
        for pair in range(p + 1):
            for b in range(2):
                column = 2 * pair + b
                if column > row:
                    continue
                value = _shared(found, belief, member[p], rival[p], a, member[pair], rival[pair], b)
                if pair == p:
                    value += found.noise[member[p], rival[p], a, b]
                for k in range(column):
                    value -= L[row, k] * L[column, k]
                if column < row:
                    L[row, column] = value / L[column, column]
                else:
                    # Not below the noise of one detection by more than rounding.
                    L[row, row] = math.sqrt(max(value, 1e-18))
        rest = found.residual[member[p], rival[p], a]
        for k in range(row):
            rest -= L[row, k] * solved[k]
        solved[row] = rest / L[row, row]
        added += solved[row] * solved[row]
    return added


@compiled_inline
def _shared(  # noqa: PLR0917 - two innovations
    found: Rivals, belief: PoseGaussian, i: int, r: int, a: int, j: int, s: int, b: int
) -> float:
    """Element of H P H^T + H C J^T + (H C J^T)^T + J P_p J^T of two detections, but for what only one of them has."""
    H, G, p = found.jacobian[i, r, a], found.jacobian[j, s, b], belief
    total = H[0] * (p.xx * G[0] + p.xy * G[1] + p.xt * G[2])
    total += H[1] * (p.xy * G[0] + p.yy * G[1] + p.yt * G[2])
    total += H[2] * (p.xt * G[0] + p.yt * G[1] + p.tt * G[2])
    for k in range(3):
        total += H[k] * found.crossed[j, s, k, b] + G[k] * found.crossed[i, r, k, a]
    for k in range(PER_SCANNER):
        total += found.of_scanner[i, r, a, k] * found.of_scanner[j, s, b, k]
    return total

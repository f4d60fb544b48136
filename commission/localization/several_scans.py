"""Associate over several scans: rival poses go along beside the run's own until detections tell which one is right.

Reid 1979, for one vehicle: each pose branches over the reflectors that a detection may be of, and over none of them;
what is unlikely is dropped, and poses that have become one are put together. So what one scan cannot tell is not
decided by it. The run goes on from the likeliest pose; `cycle` corrects it as any other.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from commission.compiled import compiled, compiled_inline
from commission.geometry.angles import wrap_scalar
from commission.geometry.arrays import FloatArray, IntArray
from commission.geometry.directions import UnitVector, direction_of
from commission.localization.consider import Considering
from commission.localization.estimate import Status
from commission.localization.joint import MOST_RIVALS, Rivals, list_rivals, no_rivals
from commission.localization.kalman import correct
from commission.localization.observation import ObservationModel
from commission.localization.pose_gaussian import PoseGaussian, pose_in, write_pose
from commission.localization.reflector_index import ReflectorIndex
from commission.localization.rival_poses import MOST_POSES, RivalPoses
from commission.localization.scan_rows import ScanRows
from commission.localization.search import viewpoint
from commission.localization.supervisor import SupervisorLimits

INLIER = int(Status.INLIER)
NOBODY = -1
SEEN_PER_FALSE = 6.0
"""Probability that a reflector is detected, over the density of false detections [m rad]: 0.3 over 0.05."""
LEAST = math.log(1e-4)
"""ln of the odds against the likeliest pose from which on one is dropped."""
SAME = 1.0
"""Squared Mahalanobis distance in which poses are one, by the covariance of either."""
CHANGE = math.log(3.0)
"""ln of the odds from which on the run goes on from another pose: it does not jump to and fro between equal ones."""
DOUBT = 0.05
"""Share of poses elsewhere from which on the vehicle is not to drive by its own."""


class Mix(NamedTuple):
    """What a pose is moved and widened by where others were put together with it."""

    x: float
    y: float
    theta: float
    xx: float
    xy: float
    xt: float
    yy: float
    yt: float
    tt: float


@compiled_inline
def no_mix() -> Mix:
    """Nothing to be added.

    Notes
    -----
    No formula: zeros.
    """
    return Mix(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


class Decision(NamedTuple):
    """What a scan is taken for."""

    is_other: bool
    """Whether the run goes on from another pose than its own."""
    prior: PoseGaussian
    """The pose before the scan that it goes on from."""
    mix: Mix
    """Of that pose, to be added once the scan has corrected it."""


class Branches(NamedTuple):
    """Poses during a scan, a row each; the first ones are in use."""

    beliefs: FloatArray
    """(B, 9) after the detections so far."""
    mixes: FloatArray
    """(B, 6) what others that were put together with it widen it by."""
    weights: FloatArray
    """(B,) ln of each."""
    roots: IntArray
    """(B,) from which pose before the scan."""
    entries: IntArray
    """(B, n) row of `places` of each detection, or NOBODY."""


@compiled
def _room(rows: int, detections: int) -> Branches:
    """Room for branches."""
    return Branches(
        np.zeros((rows, 9)),
        np.zeros((rows, 6)),
        np.zeros(rows),
        np.zeros(rows, np.int64),
        np.full((rows, detections), NOBODY),
    )


@compiled
def decide_over_scans(  # noqa: PLR0917 - a scan at several poses
    poses: RivalPoses,
    prior: PoseGaussian,
    rows: ScanRows,
    model: ObservationModel,
    gate_d2: float,
    index: ReflectorIndex,
    given: Considering | None,
    chosen: IntArray,
) -> Decision:
    """Take a scan in with all poses, and say which one the run goes on from.

    Parameters
    ----------
    poses : rivals, in and out: those that are left, after the scan.
    prior : the run's own pose after *predict*.
    rows : the scan's detections; what becomes of them is not written.
    model : of the observation.
    gate_d2 : largest squared Mahalanobis distance of one detection.
    index : the map.
    given : of the scan, where constants are considered, else None.
    chosen : (n,) out: row of `places` of each of the scan's detections, or NOBODY.

    Notes
    -----
    ln w += ln(P_D / (2 pi lambda)) - (d2 + ln det S) / 2 of a detection that is of a reflector, nothing where it is of
    none: Reid 1979, equation 16. The freshest state of each pose counts, so that a scan is decided on jointly.
    """
    first, last, measured, aims, status, _, _ = rows
    now, after = _room(MOST_POSES, last - first), _room(MOST_POSES * (1 + MOST_RIVALS), last - first)
    write_pose(now.beliefs[0], prior)
    count = 1 + _carry_along(poses, prior, now)
    roots, found = _room(MOST_POSES, 0).beliefs, no_rivals(1)
    for h in range(count):
        write_pose(roots[h], pose_in(now.beliefs[h]))
    for i in range(first, last):
        if status[i] != INLIER:
            continue
        distance, bearing, detection = measured[i, 0] - model.range_bias, measured[i, 1], i - first
        seen = noise_with(model, given, distance)
        aim = UnitVector(aims[i - first, 0], aims[i - first, 1])
        grown = 0
        for h in range(count):
            grown = _branch(now, h, detection, distance, bearing, aim, seen, gate_d2, index, found, after, grown)
        count = _left(after, grown, now)
    told = 0
    for h in range(1, count):
        # Rows are in the order of their weights: the own one stays while it is nearly as likely as the first.
        if now.roots[h] == 0 and now.roots[told] != 0 and now.weights[h] > now.weights[0] - CHANGE:
            told = h
    for i in range(last - first):
        chosen[i] = now.entries[told, i]
    root = now.roots[told]
    mix = _mix_of(now, told, roots[root], rows, model, given, index.places)
    _remember(poses, now, count, told)
    return Decision(root != 0, pose_in(roots[root]), mix)


@compiled_inline
def noise_with(model: ObservationModel, given: Considering | None, measured_range: float) -> ObservationModel:
    """Model of the observation whose noise holds the constants of the scanner.

    Parameters
    ----------
    model : of the observation.
    given : of the scan, where constants are considered, else None.
    measured_range : of the detection [m].

    Notes
    -----
    R + J B J^T as if mounting, range bias and clock were noise, in any direction of the motion: derived.
    """
    if given is None:
        return model
    p = given.variances
    moving = p.mount_position + p.clock * (given.speed_x * given.speed_x + given.speed_y * given.speed_y)
    turning = p.mount_heading + p.clock * given.turn_rate * given.turn_rate
    return ObservationModel(
        model.mount_x,
        model.mount_y,
        model.mount_theta,
        model.range_variance + p.range_bias + moving,
        model.bearing_variance + turning + moving / max(measured_range * measured_range, 1e-2),
        model.range_bias,
    )


@compiled
def _carry_along(poses: RivalPoses, prior: PoseGaussian, now: Branches) -> int:
    """Carry rivals over the motion since the scan before, as the run's own pose was; return how many there are.

    Notes
    -----
    P <- R N R^T + F P F^T, N = P_own - F P_own F^T what odometry has added, R the turn between the two headings: Thrun
    et al. 2005, equation 5.13, in the map frame.
    """
    if not poses.begun[0]:
        return 0
    before, count = poses.newest, 0
    dx, dy, turned = prior.x - before[0], prior.y - before[1], prior.theta - before[2]
    own = carried(pose_in(before), dx, dy)
    noise_xx, noise_yy, noise_tt = max(prior.xx - own.xx, 0.0), max(prior.yy - own.yy, 0.0), max(prior.tt - own.tt, 0.0)
    # With considered constants the difference need be no covariance.
    noise_xy = _bounded(prior.xy - own.xy, noise_xx * noise_yy)
    noise_xt = _bounded(prior.xt - own.xt, noise_xx * noise_tt)
    noise_yt = _bounded(prior.yt - own.yt, noise_yy * noise_tt)
    for row in range(len(poses.weights)):
        if not poses.weights[row] > -math.inf:
            continue
        rival = pose_in(poses.beliefs[row])
        c, s = direction_of(rival.theta - before[2])
        mx, my = c * dx - s * dy, s * dx + c * dy
        moved = carried(rival, mx, my)
        count += 1
        now.beliefs[count, 0], now.beliefs[count, 1] = rival.x + mx, rival.y + my
        now.beliefs[count, 2] = wrap_scalar(rival.theta + turned)
        now.beliefs[count, 3] = moved.xx + c * c * noise_xx - 2.0 * c * s * noise_xy + s * s * noise_yy
        now.beliefs[count, 4] = moved.xy + c * s * (noise_xx - noise_yy) + (c * c - s * s) * noise_xy
        now.beliefs[count, 5] = moved.xt + c * noise_xt - s * noise_yt
        now.beliefs[count, 6] = moved.yy + s * s * noise_xx + 2.0 * c * s * noise_xy + c * c * noise_yy
        now.beliefs[count, 7] = moved.yt + s * noise_xt + c * noise_yt
        now.beliefs[count, 8] = moved.tt + noise_tt
        now.weights[count], now.roots[count] = poses.weights[row], count
    return count


@compiled_inline
def _bounded(value: float, square: float) -> float:
    """Covariance of two variances whose product is given."""
    most = math.sqrt(square)
    return min(max(value, -most), most)


@compiled_inline
def carried(p: PoseGaussian, dx: float, dy: float) -> PoseGaussian:
    """Pose whose covariance is that after a motion by (dx, dy) [m] in the map; its mean is not moved.

    Parameters
    ----------
    p : before it.
    dx, dy : motion [m], map frame.

    Notes
    -----
    F P F^T, F = [[1, 0, -dy], [0, 1, dx], [0, 0, 1]]: Thrun et al. 2005, equation 5.13, in the map frame.
    """
    return PoseGaussian(
        p.x,
        p.y,
        p.theta,
        p.xx - 2.0 * dy * p.xt + dy * dy * p.tt,
        p.xy + dx * p.xt - dy * p.yt - dx * dy * p.tt,
        p.xt - dy * p.tt,
        p.yy + 2.0 * dx * p.yt + dx * dx * p.tt,
        p.yt + dx * p.tt,
        p.tt,
    )


@compiled
def _branch(  # noqa: PLR0917 - a pose, a detection and the map
    now: Branches,
    h: int,
    detection: int,
    measured_range: float,
    bearing: float,
    aim: UnitVector,
    model: ObservationModel,
    gate_d2: float,
    index: ReflectorIndex,
    found: Rivals,
    after: Branches,
    grown: int,
) -> int:
    """Write what becomes of a pose by a detection: of no reflector, or of one of those near it; return the next row."""
    belief = pose_in(now.beliefs[h])
    facing = direction_of(belief.theta)
    view = viewpoint(belief, facing, model)
    found.number[0] = 0
    list_rivals(found, 0, None, gate_d2, belief, facing, view, view, measured_range, aim, model, index, None)
    for r in range(-1, found.number[0]):
        entry = NOBODY if r < 0 else found.entry[0, r]
        taken = False
        for other in range(detection):
            taken = taken or (entry != NOBODY and now.entries[h, other] == entry)
        if taken:
            continue
        _copy(now, h, after, grown)
        after.entries[grown, detection] = entry
        if entry != NOBODY:
            place = index.places[entry]
            corrected = correct(belief, measured_range, bearing, place[0], place[1], place[2], model)
            write_pose(after.beliefs[grown], corrected)
            after.weights[grown] += math.log(SEEN_PER_FALSE / (2.0 * math.pi)) - 0.5 * found.cost[0, r]
        grown += 1
    return grown


@compiled
def _copy(source: Branches, row: int, target: Branches, to: int) -> None:
    """Copy a branch, number by number: an assignment of whole rows takes long to compile."""
    for k in range(9):
        target.beliefs[to, k] = source.beliefs[row, k]
    for k in range(6):
        target.mixes[to, k] = source.mixes[row, k]
    for k in range(source.entries.shape[1]):
        target.entries[to, k] = source.entries[row, k]
    target.weights[to], target.roots[to] = source.weights[row], source.roots[row]


@compiled
def _left(after: Branches, grown: int, now: Branches) -> int:
    """Keep the likeliest branches, those that are one put together; return how many."""
    order = np.argsort(-after.weights[:grown], kind="mergesort")
    least = after.weights[order[0]] + LEAST
    count = 0
    for row in order:
        if after.weights[row] < least:
            break
        same = -1
        for kept in range(count):
            if same < 0 and _are_one(now.beliefs[kept], after.beliefs[row]):
                same = kept
        if same >= 0:
            _put_together(now, same, after, row)
        elif count < MOST_POSES:
            _copy(after, row, now, count)
            count += 1
    return count


@compiled
def _are_one(a: FloatArray, b: FloatArray) -> bool:
    """Whether two poses are one: d^T P^-1 d < SAME by the covariance of both."""
    dx, dy, dt = b[0] - a[0], b[1] - a[1], wrap_scalar(b[2] - a[2])
    for row in (a, b):
        if not (dx * dx < SAME * row[3] and dy * dy < SAME * row[6] and dt * dt < SAME * row[8]):
            return False
        # d^T P^-1 d by the factors L D L^T of P, heading first.
        w, v = row[5] / row[8], row[7] / row[8]
        xx, xy, yy = row[3] - w * row[5], row[4] - w * row[7], row[6] - v * row[7]
        ex, ey = dx - w * dt, dy - v * dt
        u = xy / xx
        rest = ey - u * ex
        if not dt * dt / row[8] + ex * ex / xx + rest * rest / (yy - u * xy) < SAME:
            return False
    return True


@compiled
def _put_together(now: Branches, kept: int, after: Branches, other: int) -> None:
    """Move and widen a pose by another one that is the same, as a mixture has it; the covariance is the likelier's.

    Notes
    -----
    x <- x + b d, P <- P + a b d d^T with the shares a, b of both and their distance d: moments of a mixture (Bar-
    Shalom, Li, Kirubarajan 2001, equation 1.4.16-9).
    """
    row, ratio = after.beliefs[other], math.exp(after.weights[other] - now.weights[kept])
    b = ratio / (1.0 + ratio)
    pose, mix = now.beliefs[kept], now.mixes[kept]
    d = (row[0] - pose[0], row[1] - pose[1], wrap_scalar(row[2] - pose[2]))
    k = 0
    for i in range(3):
        for j in range(i, 3):
            spread = b * (1.0 - b) * d[i] * d[j]
            pose[3 + k] += spread
            mix[k] += spread
            k += 1
    pose[0], pose[1], pose[2] = pose[0] + b * d[0], pose[1] + b * d[1], wrap_scalar(pose[2] + b * d[2])
    now.weights[kept] += math.log1p(ratio)


@compiled
def _mix_of(  # noqa: PLR0917 - a branch and its detections
    now: Branches,
    told: int,
    root: FloatArray,
    rows: ScanRows,
    model: ObservationModel,
    given: Considering | None,
    places: FloatArray,
) -> Mix:
    """How a branch differs from its pose as the detections alone correct it: others were put together with it."""
    spread = now.mixes[told]
    if not (spread[0] > 0.0 or spread[3] > 0.0 or spread[5] > 0.0):
        return no_mix()
    alone = pose_in(root)
    for i in range(rows.first, rows.last):
        entry = now.entries[told, i - rows.first]
        if rows.status[i] == INLIER and entry != NOBODY:
            distance = rows.measured[i, 0] - model.range_bias
            seen, place = noise_with(model, given, distance), places[entry]
            alone = correct(alone, distance, rows.measured[i, 1], place[0], place[1], place[2], seen)
    pose = now.beliefs[told]
    return Mix(
        pose[0] - alone.x,
        pose[1] - alone.y,
        wrap_scalar(pose[2] - alone.theta),
        spread[0],
        spread[1],
        spread[2],
        spread[3],
        spread[4],
        spread[5],
    )


@compiled_inline
def mixed(p: PoseGaussian, mix: Mix) -> PoseGaussian:
    """Pose after what others that were put together with it add.

    Parameters
    ----------
    p : after the scan's detections.
    mix : what they add.

    Notes
    -----
    No formula: sums.
    """
    return PoseGaussian(
        p.x + mix.x,
        p.y + mix.y,
        wrap_scalar(p.theta + mix.theta),
        p.xx + mix.xx,
        p.xy + mix.xy,
        p.xt + mix.xt,
        p.yy + mix.yy,
        p.yt + mix.yt,
        p.tt + mix.tt,
    )


@compiled
def _remember(poses: RivalPoses, now: Branches, count: int, told: int) -> None:
    """Keep all branches but the one that is told, weighed against it."""
    row = 0
    poses.weights[:] = -math.inf
    for h in range(count):
        if h != told:
            write_pose(poses.beliefs[row], pose_in(now.beliefs[h]))
            poses.weights[row] = now.weights[h] - now.weights[told]
            row += 1


@compiled_inline
def forget(poses: RivalPoses | None) -> None:
    """Drop all rivals.

    Parameters
    ----------
    poses : in and out, or None.

    Notes
    -----
    No formula: it writes weights.
    """
    if poses is None:
        return
    poses.weights[:] = -math.inf


@compiled_inline
def keep_own(poses: RivalPoses | None, own: PoseGaussian, is_proven: bool) -> None:
    """Keep the run's own pose after a cycle: rivals are carried along with it.

    Parameters
    ----------
    poses : in and out, or None.
    own : after all that has corrected it.
    is_proven : whether something that knows no reflectors has told the whole pose: then there are no rivals.

    Notes
    -----
    No formula: it writes numbers.
    """
    if poses is None:
        return
    write_pose(poses.newest, own)
    poses.begun[0] = True
    if is_proven:
        forget(poses)


@compiled_inline
def is_contested(poses: RivalPoses | None, own: PoseGaussian, limits: SupervisorLimits) -> bool:
    """Whether poses elsewhere are too likely for the vehicle to drive by its own.

    Parameters
    ----------
    poses : after the scan, or None.
    own : after it.
    limits : of the supervisor: what is beyond one of them is elsewhere.

    Notes
    -----
    sum w_elsewhere / sum w > DOUBT, by definition.
    """
    if poses is None:
        return False
    elsewhere, whole = 0.0, 1.0
    for row in range(len(poses.weights)):
        weight = math.exp(poses.weights[row])
        rival = poses.beliefs[row]
        apart, turned = math.hypot(rival[0] - own.x, rival[1] - own.y), abs(wrap_scalar(rival[2] - own.theta))
        whole += weight
        if apart > limits.position or turned > limits.heading:
            elsewhere += weight
    return limits.enabled and elsewhere > DOUBT * whole

"""The joint Gaussian of pose and temporary landmarks: how it moves, is corrected, grows and shrinks. No scan in here.

EKF-SLAM with the pose in the filter's own state: whatever else corrects the pose (reflectors, contours, tags, by any
kind of filter) tells nothing of a landmark but through the pose, so that p(landmarks | pose) stays what it was.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from commission.compiled import compiled, compiled_inline
from commission.geometry.angles import wrap_scalar
from commission.geometry.arrays import FloatArray
from commission.localization.invariant import about_elsewhere
from commission.localization.pose_gaussian import PoseGaussian
from commission.localization.reels import Sighting
from commission.localization.temporary_memory import (
    LANDMARKS,
    PER_LANDMARK,
    POSE,
    SHAPE,
    TemporaryMemory,
)


class JointInnovation(NamedTuple):
    """A sighting against a landmark: residual whitened by Cholesky's factor of S, and that factor."""

    nis: float
    x: float
    """Measured less expected, base frame [m]."""
    y: float
    first: float
    """Whitened."""
    second: float
    l11: float
    l21: float
    l22: float
    s11: float
    s12: float
    s22: float


@compiled_inline
def used_of(memory: TemporaryMemory) -> int:
    """Return how many entries of the joint state are in use.

    Parameters
    ----------
    memory : of the landmarks.

    Notes
    -----
    size = 3 + 2 n, by definition.
    """
    return POSE + PER_LANDMARK * memory.counts[LANDMARKS]


@compiled_inline
def covariance_of(belief: PoseGaussian) -> FloatArray:
    """(3, 3) covariance of a belief.

    Parameters
    ----------
    belief : of the pose.

    Notes
    -----
    No formula: both triangles.
    """
    b = belief
    return np.array(((b.xx, b.xy, b.xt), (b.xy, b.yy, b.yt), (b.xt, b.yt, b.tt)))


@compiled
def solve_three(A: FloatArray, columns: FloatArray) -> bool:
    """Solve A X = B in place by Cholesky's factors; return whether A is positive definite.

    Parameters
    ----------
    A : (3, 3) symmetric; overwritten by its factor.
    columns : (3, n) B in, X out.

    Notes
    -----
    A = L L^T, L Y = B, L^T X = Y, by definition.
    """
    for i in range(3):
        for j in range(i):
            for k in range(j):
                A[i, j] -= A[i, k] * A[j, k]
            A[i, j] /= A[j, j]
            A[i, i] -= A[i, j] * A[i, j]
        if not A[i, i] > 0.0:
            return False
        A[i, i] = math.sqrt(A[i, i])
    for c in range(columns.shape[1]):
        for i in range(3):
            for k in range(i):
                columns[i, c] -= A[i, k] * columns[k, c]
            columns[i, c] /= A[i, i]
        for i in range(2, -1, -1):
            for k in range(i + 1, 3):
                columns[i, c] -= A[k, i] * columns[k, c]
            columns[i, c] /= A[i, i]
    return True


@compiled
def carry_landmarks(memory: TemporaryMemory, prior: PoseGaussian, posterior: PoseGaussian, invariant: bool) -> bool:
    """Carry the joint state over *predict* and over corrections by what tells of the pose alone.

    Parameters
    ----------
    memory : at the last cycle, written.
    prior : belief after *predict*.
    posterior : after those corrections.
    invariant : whether the covariance is that of a right-invariant error.

    Returns
    -------
    kept : False where the prior is no covariance: then nothing is known of landmarks any more.

    Notes
    -----
    P_Lx = P_Lx F^T (Sobreira et al. 2016, Algorithm 1, line 3). With G = P_Lx P^-1 of the prior, whose p(L | x) stays:
    L += G (x' - x), P_Lx = G P', P_LL -= G (P - P') G^T; derived. It is the joint EKF's correction by rows that are 0
    for landmarks.
    """
    n, mean, P = used_of(memory), memory.mean, memory.covariance
    dx, dy = prior.x - mean[0], prior.y - mean[1]
    mean[0], mean[1], mean[2] = posterior.x, posterior.y, posterior.theta
    if n == POSE:
        return True
    for j in range(POSE, n):
        P[j, 0] -= dy * P[j, 2]
        P[j, 1] += dx * P[j, 2]
    if not is_changed(prior, posterior):
        return True
    way_x, way_y, turn = posterior.x - prior.x, posterior.y - prior.y, wrap_scalar(posterior.theta - prior.theta)
    # A right-invariant error is about where the mean is; both covariances about where it was.
    after = about_elsewhere(posterior, -way_x, -way_y) if invariant else posterior
    before, corrected, lost = covariance_of(prior), covariance_of(after), np.empty((3, 3))
    for a in range(3):
        for b in range(3):
            lost[a, b] = before[a, b] - corrected[a, b]
    G = np.empty((3, n))
    for j in range(POSE, n):
        for a in range(3):
            G[a, j] = P[j, a]
    if not solve_three(before, G[:, POSE:]):
        return False
    for j in range(POSE, n):
        g0, g1, g2 = G[0, j], G[1, j], G[2, j]
        mean[j] += g0 * way_x + g1 * way_y + g2 * turn
        for a in range(3):
            P[j, a] = corrected[a, 0] * g0 + corrected[a, 1] * g1 + corrected[a, 2] * g2
        if invariant:
            P[j, 0] -= way_y * P[j, 2]
            P[j, 1] += way_x * P[j, 2]
        a0 = g0 * lost[0, 0] + g1 * lost[1, 0] + g2 * lost[2, 0]
        a1 = g0 * lost[0, 1] + g1 * lost[1, 1] + g2 * lost[2, 1]
        a2 = g0 * lost[0, 2] + g1 * lost[1, 2] + g2 * lost[2, 2]
        for k in range(POSE, j + 1):
            P[j, k] -= a0 * G[0, k] + a1 * G[1, k] + a2 * G[2, k]
    return True


@compiled_inline
def is_changed(a: PoseGaussian, b: PoseGaussian) -> bool:
    """Whether something was corrected.

    Parameters
    ----------
    a, b : belief before and after.

    Notes
    -----
    No formula: number by number.
    """
    mean = a.x == b.x and a.y == b.y and a.theta == b.theta
    same = a.xx == b.xx and a.xy == b.xy and a.yy == b.yy and a.xt == b.xt and a.yt == b.yt and a.tt == b.tt
    return not (mean and same)


@compiled_inline
def put_pose(memory: TemporaryMemory, belief: PoseGaussian) -> None:
    """Write the pose into the joint state.

    Parameters
    ----------
    memory : written.
    belief : of the pose.

    Notes
    -----
    No formula: the lower triangle.
    """
    mean, P = memory.mean, memory.covariance
    mean[0], mean[1], mean[2] = belief.x, belief.y, belief.theta
    P[0, 0], P[1, 0], P[1, 1] = belief.xx, belief.xy, belief.yy
    P[2, 0], P[2, 1], P[2, 2] = belief.xt, belief.yt, belief.tt


@compiled_inline
def pose_in(memory: TemporaryMemory) -> PoseGaussian:
    """Return the pose of the joint state.

    Parameters
    ----------
    memory : of the landmarks.

    Notes
    -----
    No formula: the lower triangle.
    """
    m, P = memory.mean, memory.covariance
    return PoseGaussian(m[0], m[1], m[2], P[0, 0], P[1, 0], P[2, 0], P[1, 1], P[2, 1], P[2, 2])


@compiled_inline
def _row(P: FloatArray, j: int, k: int) -> float:
    """Entry of a symmetric matrix of which only the lower triangle exists."""
    return P[j, k] if j >= k else P[k, j]


@compiled
def jacobian_of(memory: TemporaryMemory, slot: int) -> tuple[float, float, FloatArray]:
    """Expected place of a landmark in base [m], and its Jacobian with respect to pose and landmark.

    Parameters
    ----------
    memory : of the landmarks.
    slot : which one.

    Returns
    -------
    x, y : expected place [m], base frame.
    H : (2, 5) with respect to x, y and heading of base, x and y of the landmark.

    Notes
    -----
    h = R(theta)^T (l - p), H = [-R^T, (h_y, -h_x), R^T]: derived; Thrun, Burgard and Fox 2005, section 10.2, where it
    is range and bearing.
    """
    mean, at = memory.mean, POSE + PER_LANDMARK * slot
    c, s = math.cos(mean[2]), math.sin(mean[2])
    dx, dy = mean[at] - mean[0], mean[at + 1] - mean[1]
    x, y = c * dx + s * dy, c * dy - s * dx
    return x, y, np.array(((-c, -s, y, c, s), (s, -c, -x, -s, c)))


@compiled
def innovation_of(memory: TemporaryMemory, slot: int, seen: Sighting) -> JointInnovation:
    """Compare a sighting with a landmark.

    Parameters
    ----------
    memory : of the landmarks, the pose in it.
    slot : which one.
    seen : place and covariance, base frame.

    Notes
    -----
    v = z - h, S = H P H^T + R, NIS = v^T S^-1 v by Cholesky's factor: Thrun, Burgard and Fox 2005, table 10.2.
    """
    x, y, H = jacobian_of(memory, slot)
    P, at = memory.covariance, POSE + PER_LANDMARK * slot
    where = (0, 1, 2, at, at + 1)
    s11, s12, s22 = seen.xx, seen.xy, seen.yy
    for a in range(5):
        first, second = 0.0, 0.0
        for b in range(5):
            value = _row(P, where[a], where[b])
            first += value * H[0, b]
            second += value * H[1, b]
        s11 += H[0, a] * first
        s12 += H[0, a] * second
        s22 += H[1, a] * second
    l11 = math.sqrt(max(s11, 1e-18))
    l21 = s12 / l11
    l22 = math.sqrt(max(s22 - l21 * l21, 1e-18))
    vx, vy = seen.x - x, seen.y - y
    one = vx / l11
    two = (vy - l21 * one) / l22
    return JointInnovation(one * one + two * two, vx, vy, one, two, l11, l21, l22, s11, s12, s22)


@compiled
def correct_jointly(memory: TemporaryMemory, slot: int, v: JointInnovation, invariant: bool) -> None:
    """Correct pose and all landmarks by a sighting of one.

    Parameters
    ----------
    memory : of the landmarks, the pose in it; written.
    slot : which one was seen.
    v : its innovation at this state.
    invariant : whether the covariance is that of a right-invariant error.

    Notes
    -----
    K = P H^T S^-1, x += K v, P -= K W^T + (W - K S) K^T with W = P H^T: Joseph's form (I - K H) P (I - K H)^T + K R K^T
    multiplied out; Thrun, Burgard and Fox 2005, table 10.1, lines 16 to 20.
    """
    n, mean, P, at = used_of(memory), memory.mean, memory.covariance, POSE + PER_LANDMARK * slot
    _, _, H = jacobian_of(memory, slot)
    W, K, A = np.empty((2, n)), np.empty((2, n)), np.empty((2, n))
    for j in range(n):
        p0, p1, p2 = _row(P, j, 0), _row(P, j, 1), _row(P, j, 2)
        p3, p4 = _row(P, j, at), _row(P, j, at + 1)
        for r in range(2):
            W[r, j] = H[r, 0] * p0 + H[r, 1] * p1 + H[r, 2] * p2 + H[r, 3] * p3 + H[r, 4] * p4
        one = W[0, j] / v.l11
        two = (W[1, j] - v.l21 * one) / v.l22
        K[1, j] = two / v.l22
        K[0, j] = (one - v.l21 * K[1, j]) / v.l11
        A[0, j] = W[0, j] - (K[0, j] * v.s11 + K[1, j] * v.s12)
        A[1, j] = W[1, j] - (K[0, j] * v.s12 + K[1, j] * v.s22)
    x, y = mean[0], mean[1]
    for j in range(n):
        mean[j] += K[0, j] * v.x + K[1, j] * v.y
        k0, k1, a0, a1 = K[0, j], K[1, j], A[0, j], A[1, j]
        for k in range(j + 1):
            P[j, k] -= k0 * W[0, k] + k1 * W[1, k] + a0 * K[0, k] + a1 * K[1, k]
    mean[2] = wrap_scalar(mean[2])
    if invariant:
        way_x, way_y = mean[0] - x, mean[1] - y
        put_pose(memory, about_elsewhere(pose_in(memory), way_x, way_y))
        for j in range(POSE, n):
            P[j, 0] -= way_y * P[j, 2]
            P[j, 1] += way_x * P[j, 2]


@compiled
def add_landmark(memory: TemporaryMemory, seen: Sighting) -> int:
    """Take in a landmark where it is seen, behind all others; return its slot.

    Parameters
    ----------
    memory : of the landmarks, the pose in it, with room for one more; written but for `marks`.
    seen : place, covariance and shape, base frame.

    Notes
    -----
    l = p + R z, P_l. = G P with G = [I, R' z] of the pose, P_ll = G P G^T + R Z R^T: Smith, Self and Cheeseman 1990,
    section 3.2.
    """
    slot, n = memory.counts[LANDMARKS], used_of(memory)
    mean, P = memory.mean, memory.covariance
    c, s = math.cos(mean[2]), math.sin(mean[2])
    ox, oy = c * seen.x - s * seen.y, s * seen.x + c * seen.y
    mean[n], mean[n + 1] = mean[0] + ox, mean[1] + oy
    for k in range(n):
        p0, p1, p2 = _row(P, k, 0), _row(P, k, 1), _row(P, k, 2)
        P[n, k], P[n + 1, k] = p0 - oy * p2, p1 + ox * p2
    xx = c * c * seen.xx - 2.0 * c * s * seen.xy + s * s * seen.yy
    xy = c * s * (seen.xx - seen.yy) + (c * c - s * s) * seen.xy
    yy = s * s * seen.xx + 2.0 * c * s * seen.xy + c * c * seen.yy
    P[n, n] = xx + P[n, 0] - oy * P[n, 2]
    P[n + 1, n] = xy + P[n + 1, 0] - oy * P[n + 1, 2]
    P[n + 1, n + 1] = yy + P[n + 1, 1] + ox * P[n + 1, 2]
    memory.shapes[slot, :] = 0.0
    memory.shapes[slot, SHAPE] = seen.shape
    memory.counts[LANDMARKS] = slot + 1
    return slot


@compiled
def drop_landmark(memory: TemporaryMemory, slot: int) -> None:
    """Forget a landmark: the last one moves to its slot.

    Parameters
    ----------
    memory : of the landmarks; written.
    slot : which one.

    Notes
    -----
    P = P without its rows and columns: the marginal of the others, by definition.
    """
    last = memory.counts[LANDMARKS] - 1
    memory.counts[LANDMARKS] = last
    if slot == last:
        return
    to, of, P = POSE + PER_LANDMARK * slot, POSE + PER_LANDMARK * last, memory.covariance
    for r in range(PER_LANDMARK):
        memory.mean[to + r] = memory.mean[of + r]
        for k in range(to):
            P[to + r, k] = P[of + r, k]
        for k in range(to + PER_LANDMARK, of):
            P[k, to + r] = P[of + r, k]
        for q in range(r + 1):
            P[to + r, to + q] = P[of + r, of + q]
    for column in range(memory.marks.shape[1]):
        memory.marks[slot, column] = memory.marks[last, column]
    for column in range(memory.shapes.shape[1]):
        memory.shapes[slot, column] = memory.shapes[last, column]

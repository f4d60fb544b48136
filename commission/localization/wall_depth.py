"""How far behind the faces that a map draws beams really end: one number, learned while driving.

A map that scans have drawn holds a wall as a band of cells, as thick as scans and poses were uncertain, and beams end
in its middle. Taken for faces, the walls on all sides ask for as many poses: the vehicle follows whichever it sees.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from commission.compiled import compiled, compiled_inline
from commission.geometry.arrays import FloatArray
from commission.localization.contour_match import GridPose
from commission.localization.contour_tables import ContourTables, read_distance

LEARNED_FROM = 3
"""Of so many points one is enough."""
OF_A_SCAN = 0.02
"""1-sigma of what one scan says, where all its walls face each other [m]: they are not drawn equally thick."""
NEW_WALLS_AFTER = 1.0
"""Way after which a scan says as much again [m]: one from the same place sees the same walls."""
REMEMBERED = 20.0
"""Ways of that kind that count: what was learned in another part of the hall is forgotten."""
FIT_ITERATIONS = 10
"""Steps of Gauss and Newton at most."""
SMALLEST_STEP = 0.0003
"""It ends when all are smaller [m]."""
FARTHEST = 0.3
"""Points that are farther off tell nothing [m]; nearer ones do, also those that the match has left out: where it has
followed one wall, the opposite one lies behind its faces."""
LARGEST_STEP = 0.05
"""Of the depth [m]."""
DAMPED = 1e-3
"""Share of the weights."""
LEAST_SHARE = 0.05
"""Share of the depth that the pose has to leave."""
DEEPEST = 0.15
"""Depth at most [m]: what lies farther behind a face is something else."""


class WallDepth(NamedTuple):
    """What is known of it."""

    depth: float
    """How far behind the drawn faces beams end [m]; not negative."""
    information: float
    """What scans have said, as 1/variance [1/m^2]."""


AS_DRAWN = WallDepth(0.0, 0.0)
"""Before anything is known."""


@compiled_inline
def deepened(tables: ContourTables, depth: float) -> ContourTables:
    """Tables whose contours lie behind the faces that the map draws.

    Parameters
    ----------
    tables : of the map.
    depth : by how much [m].

    Notes
    -----
    d' = d + depth, d the signed distance from a face (derived): 0 that far inside of a wall.
    """
    return ContourTables(tables.distances, tables.resolution, tables.x, tables.y, tables.theta, depth)


@compiled
def learned(  # noqa: PLR0917 - a match and its points
    known: WallDepth,
    prior_variance: float,
    moved: float,
    pose: GridPose,
    lever: float,
    points: FloatArray,
    tables: ContourTables,
    length: float,
) -> WallDepth:
    """Return what is known after a scan that was accepted.

    Parameters
    ----------
    known : before it.
    prior_variance : of the depth, before any scan [m^2]; 0: it is known to be 0.
    moved : way since the scan before [m].
    pose : where the scan matches [cells, rad].
    lever : cells that a radian counts for.
    points : (n, 2) points of the scan [cells], base frame.
    tables : that it was matched with.
    length : L of the cost [m].

    Notes
    -----
    depth' = depth + K (z - depth), K = i / (1 / prior + I + i): Kalman 1960, of a constant; z as in `fitted`, its
    information i = share / `OF_A_SCAN`^2 of what is new since the scan before (derived).
    """
    if not prior_variance > 0.0:
        return WallDepth(0.0, 0.0)
    fresh = 1.0 if known.information == 0.0 else min(moved / NEW_WALLS_AFTER, 1.0)
    if fresh == 0.0:
        return known
    measured, share = fitted(pose, lever, points[::LEARNED_FROM], tables, length)
    if not share > LEAST_SHARE:
        return known
    said = fresh * share / (OF_A_SCAN * OF_A_SCAN)
    gain = said / (1.0 / prior_variance + known.information + said)
    depth = min(max(known.depth + gain * (measured - known.depth), 0.0), DEEPEST)
    return WallDepth(depth, min(known.information + said, REMEMBERED / (OF_A_SCAN * OF_A_SCAN)))


@compiled
def fitted(
    pose: GridPose, lever: float, points: FloatArray, tables: ContourTables, length: float
) -> tuple[float, float]:
    """Fit pose and depth to a scan; return the depth [m] and the share [0..1] of it that the pose leaves.

    Parameters
    ----------
    pose : near to where the scan matches [cells, rad].
    lever : cells that a radian counts for.
    points : (n, 2) points of the scan [cells], base frame.
    tables : their depth is where it starts.
    length : L of the cost [m].

    Notes
    -----
    ((A, b), (b^T, n)) (step, dz) = -(g, g_w), weights as in `cost_of`, g_w = sum w d: the normal equations of Gauss and
    Newton with the depth as fourth unknown; dz = -(g_w - b^T A^-1 g) / s with s = n - b^T A^-1 b (Schur complement).
    The share is s / n: 0 where walls stand on one side alone, as the pose takes it all.
    """
    u, v, theta, depth, share = pose.u, pose.v, pose.theta, tables.depth, 0.0
    per_cell, per_lever, l2 = 1.0 / tables.resolution, 1.0 / lever, length * length
    for _ in range(FIT_ITERATIONS):
        c, s = math.cos(theta), math.sin(theta)
        xx, xy, xt, yy, yt, tt = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        gx, gy, gt, bx, by, bt, off, total = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for i in range(len(points)):
            px, py = points[i, 0], points[i, 1]
            ax, ay = c * px - s * py, s * px + c * py
            drawn, jx, jy = read_distance(tables.distances, u + ax, v + ay)
            d = drawn + depth
            if not abs(d) <= FARTHEST:
                continue
            jx, jy = jx * per_cell, jy * per_cell
            jt = (jy * ax - jx * ay) * per_lever
            weight = l2 / (l2 + d * d)
            weight *= weight
            xx, xy, xt = xx + weight * jx * jx, xy + weight * jx * jy, xt + weight * jx * jt
            yy, yt, tt = yy + weight * jy * jy, yt + weight * jy * jt, tt + weight * jt * jt
            gx, gy, gt = gx + weight * d * jx, gy + weight * d * jy, gt + weight * d * jt
            bx, by, bt = bx + weight * jx, by + weight * jy, bt + weight * jt
            off, total = off + weight * d, total + weight
        if not total > 0.0:
            return depth, 0.0
        # Cholesky, a little damped: a direction that no point tells takes nothing.
        damp = DAMPED * total
        l11 = math.sqrt(xx + damp)
        l21, l31 = xy / l11, xt / l11
        l22 = math.sqrt(max(yy + damp - l21 * l21, damp))
        l32 = (yt - l21 * l31) / l22
        l33 = math.sqrt(max(tt + damp - l31 * l31 - l32 * l32, damp))
        b1 = bx / l11
        b2 = (by - l21 * b1) / l22
        b3 = (bt - l31 * b1 - l32 * b2) / l33
        g1 = gx / l11
        g2 = (gy - l21 * g1) / l22
        g3 = (gt - l31 * g1 - l32 * g2) / l33
        share = (total - b1 * b1 - b2 * b2 - b3 * b3) / total
        if not share > LEAST_SHARE:
            return depth, 0.0
        deeper = -(off - b1 * g1 - b2 * g2 - b3 * g3) / (share * total)
        deeper = min(max(deeper, -LARGEST_STEP), LARGEST_STEP)
        q1, q2, q3 = -g1 - b1 * deeper, -g2 - b2 * deeper, -g3 - b3 * deeper
        dt = q3 / l33
        dv = (q2 - l32 * dt) / l22
        du = (q1 - l21 * dv - l31 * dt) / l11
        depth, u, v, theta = depth + deeper, u + du * per_cell, v + dv * per_cell, theta + dt * per_cell * per_lever
        if max(abs(deeper), abs(du), abs(dv), abs(dt)) < SMALLEST_STEP:
            break
    return depth, share

"""Contours of the floor map as an observation kind: what a scan's match says of the pose, and its correction.

The match is `contour_match`'s, the order of things `cycle`'s. A match is one measurement of the pose (Sobreira et al.
2015, equations 2 to 5), split into the directions in which the contours tell anything: a corridor says nothing of the
place along it. The map's own error does not average out: it is considered, like the constants of `consider`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from enum import IntEnum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from commission.compiled import compiled, compiled_inline
from commission.geometry.angles import wrap_scalar
from commission.geometry.arrays import FloatArray, IntArray, read_only
from commission.geometry.gaussian import chi_square_gate
from commission.geometry.se2 import compose_scalars, exp_scalars, inverse_scalars
from commission.localization.consider import PER_REFLECTOR, PER_SCANNER, ConsiderModel
from commission.localization.contour_match import (
    GridPose,
    MatchRule,
    Spread,
    best_start,
    cost_of,
    information_of,
    match,
)
from commission.localization.contour_sight import share_through_walls
from commission.localization.contour_tables import ContourTables, contour_tables
from commission.localization.observation import ObservationModel
from commission.localization.odometry import Motion, NextOdometry, trend, velocity
from commission.localization.pose_gaussian import PoseGaussian
from commission.localization.pose_rows import PoseRows, correct_all_by_rows, nis_of_rows, told_directions
from commission.localization.sweep import Sweep
from commission.localization.wall_depth import WallDepth, deepened, learned
from commission.site.floor_map import FloorMap
from commission.site.parameters import ContourParameters
from commission.site.scanner import Scanner

PER_MAP = 3
"""Considered constants of the map's contours: how far they are off along x and y, and turned, where the vehicle is."""
FLAT = 10.0
"""L of a cost that is the square of the distance [m]."""
FEWEST_POINTS = 20
"""Points of a scan that are matched at least: fewer say nothing."""
WELL_MATCHED = 0.6
"""Share of the points that lie on contours, below which beams are asked whether they went through walls: among people
and boxes, where it may be less, they end before one. In an office drawn in three ways 3 of 33,132 scans had less."""
MATCHED_ANYWHERE = 0.5
"""Share of the points that lie on contours, below which a match speaks for no pose: so much may by chance."""
MOST_THROUGH = 0.15
"""Share of beams through walls beyond which they contradict a pose: elsewhere in a hall with a pillar and a niche it is
more in 99 of 100 places, at the true pose next to none. Doors that are drawn closed let fewer through."""
MATCHED_WHERE_LOST = 0.85
"""Share of the points that lie on contours where a lost vehicle is found: usually 0.93 at right places of an office
with people and a coarse map; 0.60 and less at wrong places of a room, 0.84 at one. Behind a crowd it waits."""


class ContourUse(IntEnum):
    """What became of a scan's contours."""

    NONE = 0
    """They were not looked at: the scan has too few points, or the kind is switched off."""
    ACCEPTED = 1
    REJECTED = 2
    """The pose that they say lies outside of the gate."""
    UNMATCHED = 3
    """Too few points lie on contours of the map, or they tell no direction."""
    CONTRADICTED = 4
    """They tell nothing, or a part of the pose, and from the one that is believed many beams would go through walls; or
    the vehicle is lost, and where they match best too few points lie on walls, or too many beyond."""


ACCEPTED, REJECTED, UNMATCHED = int(ContourUse.ACCEPTED), int(ContourUse.REJECTED), int(ContourUse.UNMATCHED)
CONTRADICTED = int(ContourUse.CONTRADICTED)
USE, POINTS, MATCHED, THRESHOLD, COST, NIS, ROWS, MATCH_X, MATCH_Y, MATCH_THETA, ITERATIONS, SIGMA = range(12)
DEPTH, LEARNED_DEPTH, LEARNED_INFORMATION = range(12, 15)
"""Columns of what is known of a scan's contours; `contour_figures` names them. The depth is that of the walls that it
was matched with; learned is what `wall_depth` makes of an accepted one."""
COLUMNS = 15
WHOLE_POSE = 3
"""Rows of a match that tells place and heading."""


class ContourModel(NamedTuple):
    """Table, rule and limits, for kernels."""

    tables: ContourTables
    rule: MatchRule
    least_matched: float
    least_share: float
    gates: tuple[float, float, float]
    """Largest NIS of an accepted match with one, two and three rows."""
    map_position: float
    """Variance of the map's error, along x and along y [m^2]."""
    map_heading: float
    depth_variance: float
    """Of how far behind the drawn faces beams end, before any scan [m^2]."""
    map_per_metre: float
    """One divided by the way over which the map's error is the same [1/m]."""
    limits: FloatArray
    """(S, 2) smallest and largest range of each scanner [m]."""
    blind: FloatArray
    """(B, 3) scanner, first bearing and width of each blind sector [rad], as reported."""


class ContourScan(NamedTuple):
    """A scan whose contours are matched, for kernels."""

    ranges: NDArray[np.float32]
    angle_min: float
    angle_increment: float
    scanner: int
    observation: ObservationModel
    """Mounting of its scanner."""
    sweep: Sweep
    beams: int = 0
    """How many of the ranges are its own: rows of several scanners are as wide as the widest."""


def contour_model(floor: FloorMap | None, scanners: Sequence[Scanner], given: ContourParameters) -> ContourModel | None:
    """Return what kernels need; None where contours are switched off or there is no map.

    Parameters
    ----------
    floor : the map.
    scanners : of the vehicle.
    given : the parameters.
    """
    if floor is None or not given.enabled:
        return None
    rule = MatchRule(
        given.method == "rprop",
        float(given.length),
        int(given.iterations),
        float(given.smallest_step),
        float(given.largest_error),
        float(given.beam_sigma),
    )
    one, two, three = (chi_square_gate(given.gate_probability, dof) for dof in (1, 2, 3))
    return ContourModel(
        contour_tables(floor),
        rule,
        float(given.least_matched),
        float(given.least_share),
        (one, two, three),
        given.map_sigma**2,
        given.map_heading_sigma**2,
        given.depth_sigma**2,
        1.0 / given.map_correlation,
        *what_is_no_echo(scanners),
    )


def what_is_no_echo(scanners: Sequence[Scanner]) -> tuple[FloatArray, FloatArray]:
    """Return `limits` and `blind` of a `ContourModel`."""
    blind = [
        (number, *sector) for number, each in enumerate(scanners) for sector in each.reported_blind_sectors.tolist()
    ]
    return (
        read_only(np.array([each.range for each in scanners], dtype=np.float64).reshape(-1, 2)),
        read_only(np.array(blind, dtype=np.float64).reshape(-1, 3)),
    )


@compiled
def scan_points(
    scan: ContourScan, model: ContourModel, motion: Motion, following: NextOdometry, points: FloatArray
) -> int:
    """Write the points of a scan as they lie at its stamp; return how many there are.

    Parameters
    ----------
    scan : its beams.
    model : says what is no echo.
    motion, following : odometry before the scan and after it: the vehicle moves while the beam turns.
    points : (B, 2) out: points [cells], base frame.

    Notes
    -----
    q = exp(tau v) m p with p the measured point, m the mounting, tau its time after the stamp, v the twist of base:
    motion at a constant twist (Solà et al. 2018, equations 156 to 158).
    """
    per_cell = 1.0 / model.tables.resolution
    return beam_points(scan, model.limits, model.blind, per_cell, motion, following, points)


@compiled_inline
def beam_points(  # noqa: PLR0917 - a scan, what is no echo, and the motion around it
    scan: ContourScan,
    limits: FloatArray,
    blind: FloatArray,
    scale: float,
    motion: Motion,
    following: NextOdometry,
    points: FloatArray,
) -> int:
    """Write the points of a scan as they lie at its stamp, in any unit; return how many there are.

    Parameters
    ----------
    scan : its beams.
    limits, blind : see `ContourModel`.
    scale : units in a metre.
    motion, following : odometry before the scan and after it.
    points : (B, 2) out: points, base frame.

    Notes
    -----
    q = exp(tau v) m p, as in `scan_points` (Solà et al. 2018, equations 156 to 158).
    """
    forward, left, turn = motion.trend_x, motion.trend_y, motion.trend_theta
    if following.known:
        forward, left, turn = trend(motion, following.stamp_ns, following.dx, following.dy, following.dtheta)
    mount, sweep = scan.observation, scan.sweep
    nearest, farthest = limits[scan.scanner, 0], limits[scan.scanner, 1]
    moves = sweep.seconds_per_rad != 0.0 or sweep.seconds_at_middle != 0.0
    count = 0
    for i in range(len(scan.ranges)):
        distance = np.float64(scan.ranges[i])
        if not nearest <= distance <= farthest:
            continue
        bearing = scan.angle_min + scan.angle_increment * i
        if len(blind) and is_blind(bearing, scan.scanner, blind):
            continue
        direction = mount.mount_theta + sweep.upright * bearing
        x, y = mount.mount_x + distance * math.cos(direction), mount.mount_y + distance * math.sin(direction)
        if moves:
            tau = sweep.seconds_at_middle + sweep.seconds_per_rad * wrap_scalar(bearing - sweep.middle)
            dx, dy, angle = exp_scalars(tau * forward, tau * left, tau * turn)
            c, s = math.cos(angle), math.sin(angle)
            x, y = dx + c * x - s * y, dy + s * x + c * y
        points[count, 0], points[count, 1] = x * scale, y * scale
        count += 1
    return count


@compiled_inline
def is_blind(bearing: float, scanner: int, blind: FloatArray) -> bool:
    """Whether the vehicle itself is in the way of a beam.

    Parameters
    ----------
    bearing : of the beam [rad], as reported.
    scanner : its number.
    blind : (B, 3) see `ContourModel`.

    Notes
    -----
    (bearing - first) mod 2 pi <= width: by definition.
    """
    found = False
    for i in range(len(blind)):
        if blind[i, 0] == scanner:
            offset = bearing - blind[i, 1]
            found = found or offset - 2.0 * math.pi * math.floor(offset / (2.0 * math.pi)) <= blind[i, 2]
    return found


@compiled_inline
def to_grid(pose: PoseGaussian, tables: ContourTables) -> GridPose:
    """Pose of base in cells of the table.

    Parameters
    ----------
    pose : its mean.
    tables : of the map.

    Notes
    -----
    T_grid_base = T_grid_map T_map_base, in cells whose centers are whole numbers: by definition.
    """
    x, y, theta = compose_scalars(tables.x, tables.y, tables.theta, pose.x, pose.y, pose.theta)
    return GridPose(x / tables.resolution - 0.5, y / tables.resolution - 0.5, theta)


@compiled_inline
def from_grid(pose: GridPose, tables: ContourTables) -> tuple[float, float, float]:
    """Pose of base in the map [m, m, rad].

    Parameters
    ----------
    pose : in cells.
    tables : of the map.

    Notes
    -----
    No formula: the inverse of `to_grid`.
    """
    x, y, theta = inverse_scalars(tables.x, tables.y, tables.theta)
    u, v = (pose.u + 0.5) * tables.resolution, (pose.v + 0.5) * tables.resolution
    return compose_scalars(x, y, theta, u, v, pose.theta)


@compiled
def observe_contours(  # noqa: PLR0917 - the filter's state around one scan
    belief: PoseGaussian,
    scan: ContourScan,
    model: ContourModel,
    motion: Motion,
    following: NextOdometry,
    moved: float,
    walls: WallDepth,
    reflectors: int,
    variances: ConsiderModel,
    cross: FloatArray | None,
    busy: IntArray | None,
    figures: FloatArray,
    invariant: bool,
    lost: bool,
) -> PoseGaussian:
    """Match the contours of a scan and correct a belief by what they say.

    Parameters
    ----------
    belief : at the stamp of the scan.
    scan : its beams.
    model : of the contours.
    motion, following : odometry before the scan and after it.
    moved : way since the scan before [m]: the map's error changes along it.
    walls : how deep they are known to be.
    reflectors : N of the reflector map.
    variances : of the constants of the scanner.
    cross : (3, 2 N + 5 S + 3) covariance of the pose with the constants at `belief`, written in place, or None: the
        constants then count as noise, as they do for reflectors.
    busy : see `busy_chunks`.
    figures : (COLUMNS,) out: what became of it.
    invariant : whether the covariance is that of a right-invariant error.
    lost : whether the vehicle is: its gate is wide, and a place that merely resembles its own would pass.

    Notes
    -----
    No formula: `scan_points`, `best_start`, `match`, `told_directions`, `nis_of_rows`, `correct_all_by_rows` in turn.
    """
    columns = np.zeros((3, PER_SCANNER + PER_MAP))
    first, last = PER_REFLECTOR * reflectors + PER_SCANNER * scan.scanner, 0
    if cross is not None:
        last = cross.shape[1] - PER_MAP
        kept = math.exp(-moved * model.map_per_metre)
        for row in range(3):
            for i in range(PER_SCANNER):
                columns[row, i] = cross[row, first + i]
            for i in range(PER_MAP):
                cross[row, last + i] *= kept
                columns[row, PER_SCANNER + i] = cross[row, last + i]
    points = np.empty((len(scan.ranges), 2))
    count = scan_points(scan, model, motion, following, points)
    figures[:] = 0.0
    figures[POINTS] = count
    if count < FEWEST_POINTS:
        return belief
    points = points[:count]
    resolution = model.tables.resolution
    lever = lever_of(points)
    spread = Spread(
        math.sqrt(0.5 * (belief.xx + belief.yy)) / resolution,
        math.sqrt(0.5 * (belief.xx + belief.yy)) / resolution,
        math.sqrt(belief.tt),
    )
    believed = to_grid(belief, model.tables)
    tables = deepened(model.tables, walls.depth)
    start = best_start(believed, spread, lever, points, tables, model.rule)
    found = match(start, lever, points, tables, model.rule)
    rows = rows_of_match(belief, found.pose, found.threshold, lever, points, tables, model, figures)
    figures[ITERATIONS], figures[DEPTH] = found.iterations, walls.depth
    told = len(rows.residuals) if figures[MATCHED] >= model.least_matched * count else 0
    x, y = scan.observation.mount_x / resolution, scan.observation.mount_y / resolution
    is_weak = told < WHOLE_POSE or figures[MATCHED] < WELL_MATCHED * count
    if told == 0 or (is_weak and not lost):
        # A single wall fits many places, and so do two with a few boxes: what else is seen has to fit as well.
        at = believed if told < WHOLE_POSE else found.pose
        if share_through_walls(at, points, x, y, model.tables) > MOST_THROUGH:
            figures[USE] = CONTRADICTED
            return belief
    if told == 0:
        figures[USE] = UNMATCHED
        return belief
    if lost:
        few = figures[MATCHED] < MATCHED_WHERE_LOST * count
        if few or share_through_walls(found.pose, points, x, y, model.tables) > MOST_THROUGH:
            figures[USE] = CONTRADICTED
            return belief
    twist = velocity(motion, following)
    constant_jacobians(belief, rows, scan.observation, twist)
    considered = np.array(
        (
            variances.mount_position,
            variances.mount_position,
            variances.mount_heading,
            variances.range_bias,
            variances.clock,
            model.map_position,
            model.map_position,
            model.map_heading,
        )
    )
    nis = nis_of_rows(belief, columns, considered, rows)
    figures[NIS] = nis
    if not nis <= model.gates[len(rows.residuals) - 1]:
        figures[USE] = REJECTED
        return belief
    figures[USE] = ACCEPTED
    figures[LEARNED_DEPTH], figures[LEARNED_INFORMATION] = learned(
        walls, model.depth_variance, moved, found.pose, lever, points, tables, model.rule.length
    )
    stretches = (first, PER_SCANNER), (last, PER_MAP)
    return correct_all_by_rows(belief, columns, considered, rows, stretches, cross, busy, invariant)


@compiled_inline
def lever_of(points: FloatArray) -> float:
    """Length that a radian counts for [cells]: root mean square of the distances of points (n, 2) from base.

    Notes
    -----
    sqrt(sum |p|^2 / n), by definition; 1 at least.
    """
    total = 0.0
    for i in range(len(points)):
        total += points[i, 0] * points[i, 0] + points[i, 1] * points[i, 1]
    return max(math.sqrt(total / max(len(points), 1)), 1.0)


@compiled_inline
def rows_of_match(  # noqa: PLR0917 - a match and its points
    belief: PoseGaussian,
    pose: GridPose,
    threshold: float,
    lever: float,
    points: FloatArray,
    tables: ContourTables,
    model: ContourModel,
    figures: FloatArray,
) -> PoseRows:
    """Rows of a match, without the constants.

    Parameters
    ----------
    belief : before it.
    pose : that was found [cells, rad].
    threshold : of matched points [m].
    lever : cells that a radian counts for.
    points : (n, 2) points of the scan [cells], base frame.
    tables : that they were matched with.
    model : of the contours.
    figures : written: points, cost, and the pose.

    Notes
    -----
    P_match = 2 s^2 / L^2 (sum E'' n n^T)^-1 along each direction that is told, n as in `information_of`: the cost's
    second derivative (Sobreira et al. 2015, section 3) but for the curvature of the distance itself, scaled so that it
    is that of d^2 / (2 s^2) near 0; s is the noise of a beam, or what the matched points show where that is more.
    """
    resolution, length = tables.resolution, model.rule.length
    at = information_of(pose, lever, points, tables, length, threshold)
    # Of d alone: what a matched point is off, from the cost of a cost function so wide that it is quadratic.
    wide = cost_of(pose, lever, points, tables, FLAT, threshold, False)
    outside = (len(points) - wide.beams) * (1.0 - FLAT * FLAT / (FLAT * FLAT + threshold * threshold))
    squares = max(wide.total - outside, 0.0) * FLAT * FLAT
    matched = max(at.beams, 1.0)
    sigma = max(model.rule.sigma, math.sqrt(squares / matched))
    scale = 0.5 * length * length / (resolution * resolution)
    # From the axes of the table to those of the map.
    c, s = math.cos(tables.theta), math.sin(tables.theta)
    xx, xy, yy, xt, yt = scale * at.xx, scale * at.xy, scale * at.yy, scale * at.xt, scale * at.yt
    second = np.empty((3, 3))
    second[0, 0] = c * c * xx + 2.0 * c * s * xy + s * s * yy
    second[0, 1] = second[1, 0] = c * s * (yy - xx) + (c * c - s * s) * xy
    second[1, 1] = s * s * xx - 2.0 * c * s * xy + c * c * yy
    second[0, 2] = second[2, 0] = c * xt + s * yt
    second[1, 2] = second[2, 1] = c * yt - s * xt
    second[2, 2] = scale * at.tt
    beams, jacobians = told_directions(second, lever * resolution, model.least_share * matched)
    x, y, theta = from_grid(pose, tables)
    off = np.array((x - belief.x, y - belief.y, wrap_scalar(theta - belief.theta)))
    residuals, noise = np.zeros(len(beams)), np.empty(len(beams))
    for k in range(len(beams)):
        noise[k] = sigma * sigma / beams[k]
        for a in range(3):
            residuals[k] += jacobians[k, a] * off[a]
    figures[MATCHED], figures[THRESHOLD], figures[ROWS] = at.beams, threshold, len(beams)
    figures[COST] = cost_of(pose, lever, points, tables, length, math.inf, False).total / len(points)
    figures[MATCH_X], figures[MATCH_Y], figures[MATCH_THETA] = x, y, theta
    figures[SIGMA] = sigma
    return PoseRows(residuals, jacobians, noise, np.zeros((len(beams), PER_SCANNER + PER_MAP)))


@compiled_inline
def constant_jacobians(
    belief: PoseGaussian, rows: PoseRows, mount: ObservationModel, twist: tuple[float, float, float]
) -> None:
    """Write how constants change the rows of a match.

    Parameters
    ----------
    belief : before it.
    rows : of the match; `constants` is written.
    mount : mounting of the scanner.
    twist : velocity of base [m/s, m/s, rad/s], in base.

    Notes
    -----
    h R of the mounting's place; h (R (t_y, -t_x), 1) of its heading, about the scanner, t its place; -h Xdot of a late
    clock; h itself of the map: derived from X_match = X (m + dm) m^-1.
    """
    c, s = math.cos(belief.theta), math.sin(belief.theta)
    tx, ty = mount.mount_x, mount.mount_y
    for k in range(len(rows.residuals)):
        hx, hy, ht = rows.jacobians[k, 0], rows.jacobians[k, 1], rows.jacobians[k, 2]
        forward, left = hx * c + hy * s, hy * c - hx * s
        rows.constants[k, 0], rows.constants[k, 1] = forward, left
        rows.constants[k, 2] = forward * ty - left * tx + ht
        rows.constants[k, 4] = -(forward * twist[0] + left * twist[1] + ht * twist[2])
        rows.constants[k, 5], rows.constants[k, 6], rows.constants[k, 7] = hx, hy, ht

"""How well a pose explains a long trail of scans: it is led along by odometry and corrected scan by scan.

For sensors that see one or two things at a time, of which none comes back soon: joined by odometry alone they smear
before there are enough of them. What is known of the map's reflectors nearby keeps the pose from drifting meanwhile.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from commission.compiled import compiled, compiled_inline
from commission.geometry.angles import TURN, wrap_scalar
from commission.geometry.arrays import FloatArray
from commission.localization.kalman import correct, innovation, squared_distance
from commission.localization.observation import ObservationModel, expect, observation_at, scanner_offset
from commission.localization.pose_gaussian import PoseGaussian, write_pose
from commission.localization.reflector_index import ReflectorIndex, cell_range
from commission.localization.several_scans import carried
from commission.localization.sightings import noise_on_floor

OF_THE_MAP = 0.8
"""Share of the detections that are taken to be of reflectors, where the pose is right."""
GATE = 16.0
"""Squared distance up to which a detection may be of a reflector: 99.97 % of chi-square with 2 degrees of freedom."""
INDEPENDENT_M = 0.1
INDEPENDENT_RAD = 0.1
"""Way [m] and turn [rad] after which what is seen counts in full: a vehicle at rest sees one error all the time."""
LEAST_COUNTED = 0.02
"""Part that a scan counts at least where it corrects the pose."""
MORE_OF_ONE = 1.5
"""What a place of the map gives at most, beyond ln of the likelihood ratio of its best detection: as much as a dozen
independent ones, however often it is seen. A thing that stands beside a reflector of a wrong pose stays there."""
LEAST_PART = 0.1
"""Part of a detection from which on it tells how much a reflector may give."""
LEAST_OF_ONE = -1.6
"""The same of a place where the map has none: one detection that is of no reflector."""
MOST_STRANGE = 64
"""Places without a reflector that are told apart; beyond, the last one stands for all others."""
ONE_PLACE = 0.5
"""Detections nearer to each other [m] are of one such place."""
RIVALS = 8
"""Reflectors that a detection may be of at most: the likeliest."""
FARTHEST = 2.0
"""Reflectors farther from a detection are not looked at [m]."""
BEGIN = (0.3, 0.15)
"""1-sigma that each pose begins with, at the newest scan and at the oldest one: position [m], heading [rad]."""
MET = 6
"""Numbers of how a reflector was met: weight of its detections; times weight, how far they lie from its place, x and y
[m], and their noise on the floor, xx, xy, yy [m^2]."""
INFLATION = 2.25
"""Factor of the variance of a detection: errors of map, mounting and shape add to the sensor's, and stay."""


class Trail(NamedTuple):
    """Scans of the way that is remembered, oldest first; for kernels."""

    scans: FloatArray
    """(K, 8) time [s]; pose of base in the frame of odometry [m, m, rad]; variance of the odometry up to there, of
    position [m^2] and heading [rad^2]; index of the scanner; end of its detections in `seen`."""
    seen: FloatArray
    """(M, 2) range [m] and bearing [rad]."""


class Explained(NamedTuple):
    """What a pose that was led along a trail explains of it."""

    pose: PoseGaussian
    """Of base at the last scan that it was led to, map frame."""
    evidence: float
    """ln of how much likelier the detections are than were they at random places."""
    share: float
    """Share of the detections that are of reflectors [0..1]."""
    places: float
    """How many places of the map were seen; reflectors close beside each other are one."""


@compiled
def follow(  # noqa: PLR0917 - a pose, the trail and the map
    begin: PoseGaussian,
    forth: bool,
    trail: Trail,
    models: FloatArray,
    eyes: FloatArray,
    longest: float,
    crowd: FloatArray,
    index: ReflectorIndex,
    met: FloatArray,
) -> Explained:
    """Lead a pose along a trail, from its first scan to its last or the other way.

    Parameters
    ----------
    begin : pose of base at the scan to begin with, map frame.
    forth : from the oldest scan to the newest; else back.
    trail : see `Trail`.
    models : (S, 6) see `observation_rows`.
    eyes : see `SearchMap`.
    longest : range up to which anything is seen [m].
    crowd : (N,) one over the reflectors of the map that stand at the place of each, itself among them.
    index : the map.
    met : (N, MET) out: how each reflector was met, see `trail_misfit`; (0, MET) where nobody asks.

    Notes
    -----
    L = (1 - w) + w A / n sum N(z; h_j, S_j) of each detection, n reflectors in view, A the area of range and bearing in
    which false ones are even: Bar-Shalom et al. 2009, "The probabilistic data association filter", with each detection
    counted by the way since the scan before. The pose is corrected by the mixture's mean and covariance (equations 40
    to 45 there). Evidence is the sum of ln L, that of each place bounded.
    """
    places = index.places
    gains, most = np.zeros(len(places)), np.zeros(len(places))
    strange, strangers = np.empty((MOST_STRANGE, 3)), 0
    work = np.empty((RIVALS, 11))
    pose, evidence, fits, count, since, visible = begin, 0.0, 0.0, 0.0, math.inf, 1.0
    before = -1
    for step in range(len(trail.scans)):
        k = step if forth else len(trail.scans) - 1 - step
        scan, counts = trail.scans[k], 1.0
        if before >= 0:
            pose, way = _led(pose, trail.scans[before], scan)
            counts = min(way, 1.0)
            since += way
        before = k
        model = _louder(observation_at(models, int(scan[6])), INFLATION)
        if since >= 0.5:
            visible, since = in_view(pose, model, int(scan[6]), eyes, longest, places), 0.0
        odds = OF_THE_MAP * _seen_area(int(scan[6]), eyes, longest) / visible
        for i in range(int(trail.scans[k - 1, 7]) if k > 0 else 0, int(scan[7])):
            rivals, total = _weigh(
                pose,
                trail.seen[i, 0] - model.range_bias,
                trail.seen[i, 1],
                model,
                1.0 / max(counts, LEAST_COUNTED),
                index,
                work,
            )
            ratio = 1.0 - OF_THE_MAP + odds * total
            gain = counts * math.log(ratio)
            count += counts
            fits += counts * (1.0 - (1.0 - OF_THE_MAP) / ratio)
            if gain < 0.0:
                strangers = _unknown(strange, strangers, pose, trail.seen[i, 0], trail.seen[i, 1], model, gain)
            else:
                for r in range(rivals):
                    entry, part = int(work[r, 10]), work[r, 9] / total
                    gains[entry] += gain * part
                    most[entry] = max(most[entry], math.log(ratio) if part > LEAST_PART else 0.0)
            if rivals:
                pose = _mixed(pose, rivals, (1.0 - OF_THE_MAP) / ratio, odds / ratio, work)
                if len(met):
                    z, bearing = trail.seen[i, 0] - model.range_bias, trail.seen[i, 1]
                    _meet(met, pose, z, bearing, model, places, counts * odds / ratio, rivals, work)
    for at in range(strangers):
        evidence += max(strange[at, 2], LEAST_OF_ONE)
    told = 0.0
    for entry in range(len(places)):
        if gains[entry] > 0.0:
            bound = crowd[entry] * (most[entry] + MORE_OF_ONE)
            evidence += min(gains[entry], bound)
            told += crowd[entry] * min(1.0, gains[entry] / (0.5 * bound))
    return Explained(pose, evidence, fits / max(count, 1e-9), told)


@compiled_inline
def _unknown(  # noqa: PLR0917 - a pose and a detection
    strange: FloatArray,
    count: int,
    pose: PoseGaussian,
    measured: float,
    bearing: float,
    model: ObservationModel,
    gain: float,
) -> int:
    """Count a detection that is of no reflector at its place; return the number of such places."""
    ox, oy = scanner_offset(pose.theta, model)
    direction = pose.theta + model.mount_theta + bearing
    x, y = pose.x + ox + measured * math.cos(direction), pose.y + oy + measured * math.sin(direction)
    at = 0
    while at < count and (strange[at, 0] - x) ** 2 + (strange[at, 1] - y) ** 2 > ONE_PLACE * ONE_PLACE:
        at += 1
    if at == count and count < MOST_STRANGE:
        strange[at, 0], strange[at, 1], strange[at, 2] = x, y, 0.0
        count += 1
    strange[min(at, MOST_STRANGE - 1), 2] += gain
    return count


@compiled_inline
def _meet(  # noqa: PLR0917 - a pose and a detection
    met: FloatArray,
    pose: PoseGaussian,
    measured: float,
    bearing: float,
    model: ObservationModel,
    places: FloatArray,
    odds: float,
    rivals: int,
    work: FloatArray,
) -> None:
    """Count how far a detection lies from the reflectors that it may be of."""
    ox, oy = scanner_offset(pose.theta, model)
    direction = pose.theta + model.mount_theta + bearing
    x, y = pose.x + ox + measured * math.cos(direction), pose.y + oy + measured * math.sin(direction)
    across = model.bearing_variance * measured * measured
    xx, xy, yy = noise_on_floor(model.range_variance, across, direction)
    for r in range(rivals):
        entry, part = int(work[r, 10]), odds * work[r, 9]
        met[entry, 0] += part
        met[entry, 1] += part * (x - places[entry, 0])
        met[entry, 2] += part * (y - places[entry, 1])
        met[entry, 3] += part * xx
        met[entry, 4] += part * xy
        met[entry, 5] += part * yy


@compiled_inline
def _louder(model: ObservationModel, factor: float) -> ObservationModel:
    """Model whose variances are as many times as large."""
    return ObservationModel(
        model.mount_x,
        model.mount_y,
        model.mount_theta,
        factor * model.range_variance,
        factor * model.bearing_variance,
        model.range_bias,
    )


@compiled_inline
def _led(pose: PoseGaussian, before: FloatArray, scan: FloatArray) -> tuple[PoseGaussian, float]:
    """Pose after the motion between two scans, in either direction, and how independent what is seen there is."""
    c, s = math.cos(before[3]), math.sin(before[3])
    ox, oy = scan[1] - before[1], scan[2] - before[2]
    ahead, left, turn = c * ox + s * oy, c * oy - s * ox, wrap_scalar(scan[3] - before[3])
    c, s = math.cos(pose.theta), math.sin(pose.theta)
    dx, dy = c * ahead - s * left, s * ahead + c * left
    position, heading = abs(scan[4] - before[4]), abs(scan[5] - before[5])
    moved = carried(pose, dx, dy)
    way = math.sqrt(dx * dx + dy * dy) / INDEPENDENT_M + abs(turn) / INDEPENDENT_RAD
    return PoseGaussian(
        pose.x + dx,
        pose.y + dy,
        wrap_scalar(pose.theta + turn),
        moved.xx + position,
        moved.xy,
        moved.xt,
        moved.yy + position,
        moved.yt,
        moved.tt + heading,
    ), way


@compiled_inline
def _seen_area(scanner: int, eyes: FloatArray, longest: float) -> float:
    """Area of range and bearing in which a scanner sees anything [m rad]."""
    area = 0.0
    for e in range(len(eyes)):
        if int(eyes[e, 0]) == scanner:
            area += eyes[e, 2] * max(min(eyes[e, 4], longest) - eyes[e, 3], 0.1)
    return area


@compiled
def in_view(  # noqa: PLR0917 - a pose and the map
    pose: PoseGaussian, model: ObservationModel, scanner: int, eyes: FloatArray, longest: float, places: FloatArray
) -> float:
    """How many reflectors a scanner could see, one at least.

    Parameters
    ----------
    pose : of base, map frame.
    model : of the scanner.
    scanner : its index.
    eyes : see `SearchMap`.
    longest : range up to which anything is seen [m].
    places : the map, see `ReflectorIndex`.

    Notes
    -----
    No angle is taken of any reflector: v is within a turn w <= pi from u where u x v >= 0 and v x w >= 0, and within
    a wider one where either is; derived. Stretches of the field of view of one scanner do not overlap.
    """
    ox, oy = scanner_offset(pose.theta, model)
    x, y, count = pose.x + ox, pose.y + oy, 0
    for e in range(len(eyes)):
        if int(eyes[e, 0]) != scanner:
            continue
        first, width = pose.theta + model.mount_theta + eyes[e, 1], eyes[e, 2]
        c, s, end_c, end_s = math.cos(first), math.sin(first), math.cos(first + width), math.sin(first + width)
        nearest, farthest = eyes[e, 3] ** 2, min(eyes[e, 4], longest) ** 2
        is_narrow, is_round = width <= math.pi, width >= TURN
        for entry in range(len(places)):
            dx, dy = places[entry, 0] - x, places[entry, 1] - y
            square = dx * dx + dy * dy
            behind_first, before_end = c * dy - s * dx >= 0.0, dx * end_s - dy * end_c >= 0.0
            within = (behind_first and before_end) if is_narrow else (behind_first or before_end or is_round)
            if within and nearest <= square <= farthest:
                count += 1
    return max(float(count), 1.0)


@compiled
def _weigh(  # noqa: PLR0917 - a pose, a detection and the map
    pose: PoseGaussian,
    measured: float,
    bearing: float,
    model: ObservationModel,
    tempered: float,
    index: ReflectorIndex,
    work: FloatArray,
) -> tuple[int, float]:
    """Write what the pose becomes by each reflector that a detection may be of, with its likelihood and row.

    Notes
    -----
    N(z; h, S) decides; the correction takes R / c for R where the scan counts for a part c only: derived.
    """
    ox, oy = scanner_offset(pose.theta, model)
    direction = pose.theta + model.mount_theta + bearing
    px, py = pose.x + ox + measured * math.cos(direction), pose.y + oy + measured * math.sin(direction)
    cells, places, cell_offsets = index
    spread = max(pose.xx, pose.yy) + abs(pose.xy) + model.range_variance + cells.largest_variance
    spread += measured * measured * (pose.tt + model.bearing_variance)
    reach = min(math.sqrt(GATE * spread), FARTHEST)
    first_row, last_row = cell_range(
        py - reach - cells.origin_y, py + reach - cells.origin_y, cells.per_metre, cells.rows
    )
    first_column, last_column = cell_range(
        px - reach - cells.origin_x, px + reach - cells.origin_x, cells.per_metre, cells.columns
    )
    count, total = 0, 0.0
    for row in range(first_row, last_row + 1 if last_column >= first_column else first_row):
        start = cell_offsets[row * cells.columns + first_column]
        for entry in range(start, cell_offsets[row * cells.columns + last_column + 1]):
            if (places[entry, 0] - px) ** 2 + (places[entry, 1] - py) ** 2 > reach * reach:
                continue
            e = expect(pose.x, pose.y, pose.theta, ox, oy, places[entry, 0], places[entry, 1], model.mount_theta)
            v = innovation(pose, e, measured, wrap_scalar(bearing - e.bearing), places[entry, 2], model)
            d2 = squared_distance(v)
            if d2 > GATE:
                continue
            likelihood = math.exp(-0.5 * d2) / (2.0 * math.pi * math.sqrt(v.s_rr * v.schur))
            at = count
            if count == RIVALS:
                at = int(np.argmin(work[:, 9]))
                if work[at, 9] >= likelihood:
                    continue
                total -= work[at, 9]
            else:
                count += 1
            total += likelihood
            at_x, at_y, variance = places[entry, 0], places[entry, 1], places[entry, 2]
            write_pose(work[at], correct(pose, measured, bearing, at_x, at_y, variance, _louder(model, tempered)))
            work[at, 9], work[at, 10] = likelihood, float(entry)
    return count, total


@compiled_inline
def _mixed(pose: PoseGaussian, rivals: int, none: float, odds: float, work: FloatArray) -> PoseGaussian:
    """Mean and covariance of what the pose becomes by all of the reflectors, and by none of them.

    Notes
    -----
    m = sum b_j m_j, P = sum b_j (P_j + (m_j - m) (m_j - m)^T), about the pose before: by definition.
    """
    x, y, t = 0.0, 0.0, 0.0
    xx, xy, xt = none * pose.xx, none * pose.xy, none * pose.xt
    yy, yt, tt = none * pose.yy, none * pose.yt, none * pose.tt
    for r in range(rivals):
        b = odds * work[r, 9]
        dx, dy, dt = work[r, 0] - pose.x, work[r, 1] - pose.y, wrap_scalar(work[r, 2] - pose.theta)
        x, y, t = x + b * dx, y + b * dy, t + b * dt
        xx, xy, xt = xx + b * (work[r, 3] + dx * dx), xy + b * (work[r, 4] + dx * dy), xt + b * (work[r, 5] + dx * dt)
        yy, yt, tt = yy + b * (work[r, 6] + dy * dy), yt + b * (work[r, 7] + dy * dt), tt + b * (work[r, 8] + dt * dt)
    return PoseGaussian(
        pose.x + x,
        pose.y + y,
        wrap_scalar(pose.theta + t),
        xx - x * x,
        xy - x * y,
        xt - x * t,
        yy - y * y,
        yt - y * t,
        tt - t * t,
    )


@compiled
def explain(  # noqa: PLR0917 - poses, the trail and the map
    poses: FloatArray,
    trail: Trail,
    models: FloatArray,
    eyes: FloatArray,
    longest: float,
    crowd: FloatArray,
    index: ReflectorIndex,
    explained: FloatArray,
) -> None:
    """Say of each pose at the newest scan what it explains of a trail, and where it comes to stand by it.

    Parameters
    ----------
    poses : (H, 3) of base at the newest scan [m, m, rad], map frame.
    trail, models, eyes, longest, crowd, index : as in `follow`.
    explained : (H, 12) out: the pose (see `write_pose`), evidence, share and places as in `Explained`.

    Notes
    -----
    Led back first, so that the odometry of the whole way does not move where the trail began; then forth from there,
    each with the same covariance. Evidence holds (2 pi)^(3/2) det(P)^(1/2) of it: of a density, by definition.
    """
    position, heading, nobody = BEGIN[0] ** 2, BEGIN[1] ** 2, np.zeros((0, MET))
    volume = 1.5 * math.log(2.0 * math.pi) + math.log(BEGIN[0] ** 2 * BEGIN[1])
    for h in range(len(poses)):
        begin = PoseGaussian(poses[h, 0], poses[h, 1], poses[h, 2], position, 0.0, 0.0, position, 0.0, heading)
        back = follow(begin, False, trail, models, eyes, longest, crowd, index, nobody).pose
        begin = PoseGaussian(back.x, back.y, back.theta, position, 0.0, 0.0, position, 0.0, heading)
        of_it = follow(begin, True, trail, models, eyes, longest, crowd, index, nobody)
        write_pose(explained[h], of_it.pose)
        explained[h, 9], explained[h, 10], explained[h, 11] = of_it.evidence + volume, of_it.share, of_it.places

"""Hypotheses of where a vehicle is by the contours of the hall: what a scan suggests, judged view by view on the way.

Each attempt looks in the whole hall and leads what was found before along; beams that end where the map has walls speak
for a place, those that end behind them against it. Halls repeat: which of them it is, the way tells. Whether the first
one is believed is `relocalization`'s.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from commission.compiled import compiled
from commission.geometry.angles import wrap
from commission.geometry.arrays import FloatArray, read_only
from commission.geometry.ray_kernels import RayTables
from commission.geometry.se2 import compose, inverse
from commission.localization.contour import MOST_THROUGH, ContourModel, lever_of, scan_points
from commission.localization.contour_match import GridPose, MatchRule, information_of, match
from commission.localization.contour_scans import scan_seen_by
from commission.localization.contour_search import ScanPoints, places_of
from commission.localization.contour_sight import share_through_walls
from commission.localization.contour_tables import ContourTables
from commission.localization.hypotheses import (
    ODDS,
    base_poses,
    each_place_once,
    others_beside,
    prior_of,
    times_in_a_row,
)
from commission.localization.hypothesis_fit import ROW, density
from commission.localization.odometry import Motion
from commission.localization.search_map import SearchMap
from commission.localization.search_state import ContourViews, Search
from commission.localization.seen_of_late import SeenScan
from commission.localization.wall_depth import WallDepth, deepened
from commission.localization.wall_evidence import MOST_FOR, log_walls

FEWEST_POINTS = 40
"""Points of a scan by which a place is looked for at least."""
MATCHED_BY = 180
"""Points with which places are compared."""
BEAMS = 60
"""Beams of which it is asked where they end."""
NEW_VIEW_M, NEW_VIEW_RAD = 0.5, 0.4
"""A view counts again after that way or turn [m], [rad]: before, it is the same one."""
KEPT = 0.7
"""Share of what earlier views said that counts beside the newest one: a place that was overlooked still catches up."""
HYPOTHESES = 16
"""Places that are led along."""
LEAST_MATCHED = 0.7
"""Share of the points that must lie on contours at a place that is believed: half as much lie there by chance."""
STANDING = 0.5
"""What an attempt counts that only has the view of the one before: people in it come and go."""
PERIOD_S = 0.4
"""Time between two attempts at least [s]."""
LONGEST_PERIOD_S = 10.0
"""Time between two attempts at most [s]."""
POSITION_SIGMA, HEADING_SIGMA = 0.15, 0.05
"""1-sigma of a place that is believed [m], [rad]: the filter matches anew from there."""
_U, _V, _T, _MATCHED, _THROUGH, _SAID = range(6)


class _ReadyScan(NamedTuple):
    """A scan, made ready."""

    seen: ScanPoints
    """Its points."""
    beams: FloatArray
    """(B, 4) start x, y [m] and direction [rad] in base, length [m]."""


@compiled
def judge_places(
    starts: FloatArray, scan: ScanPoints, tables: ContourTables, rule: MatchRule, judged: FloatArray
) -> None:
    """Match a scan from each start, and say how much of it lies on contours there.

    Parameters
    ----------
    starts : (n, 3) u, v [cells], heading [rad].
    scan : its points.
    tables, rule : as in `match`.
    judged : (n, 6) out: u, v, heading, share of the points matched, share of the beams through walls; the last one is
        not written.

    Notes
    -----
    No formula: `match`, `information_of`, `share_through_walls` in turn.
    """
    for k in range(len(starts)):
        found = match(GridPose(starts[k, 0], starts[k, 1], starts[k, 2]), scan.lever, scan.points, tables, rule)
        at = information_of(found.pose, scan.lever, scan.points, tables, rule.length, found.threshold)
        judged[k, 0], judged[k, 1], judged[k, 2] = found.pose.u, found.pose.v, found.pose.theta
        judged[k, 3] = at.beams / len(scan.points)
        judged[k, 4] = share_through_walls(found.pose, scan.points, scan.x, scan.y, tables)


@compiled
def beams_say(poses: FloatArray, beams: FloatArray, walls: RayTables, said: FloatArray) -> None:
    """Write what the ends of beams say of each pose.

    Parameters
    ----------
    poses : (n, 3) of base [m, m, rad], map frame.
    beams : (B, 4) start x, y [m] and direction [rad] in base, length [m].
    walls : of the floor map.
    said : (n,) out: log of how much likelier they are there than anywhere else.

    Notes
    -----
    No formula: `log_walls`.
    """
    for k in range(len(poses)):
        said[k] = log_walls(poses[k, 0], poses[k, 1], poses[k, 2], beams, walls)


def seen_again(search: Search, scan: SeenScan, motion: Motion, depth: WallDepth, around: SearchMap) -> Search:
    """Judge hypotheses by the contours of the newest scan, and new ones that it suggests.

    Parameters
    ----------
    search : with the scan taken in.
    scan : what was seen.
    motion : odometry before the scan: the vehicle moves while the beam turns.
    depth : how far behind the drawn faces walls are known to be.
    around : the map to search.
    """
    contours, known = around.contours, search.contours
    waits_ns = search.waits_ns(scan.stamp_ns, PERIOD_S, LONGEST_PERIOD_S)
    if contours is None or scan.stamp_ns - known.judged_ns < waits_ns:
        return search
    ready = _made_ready(scan, motion, contours.model, contours.sweep_rows)
    if len(ready.seen.points) < FEWEST_POINTS:
        return search
    tables, track = deepened(contours.model.tables, depth.depth), np.array(search.track[:3])
    moved = compose(inverse(known.view), track) if known.judged_ns >= search.since_ns else np.full(3, math.inf)
    is_new = math.hypot(*moved[:2]) >= NEW_VIEW_M or abs(moved[2]) >= NEW_VIEW_RAD
    if not is_new and known.scanner != scan.scanner:
        # Else two scanners of a vehicle that stands would take turns, each time a view that has not been there before.
        return search
    led, before = base_poses(known.hypotheses, search.track), known.past
    if is_new:
        before = KEPT * (known.past + known.said)
    starts = _in_cells(led, tables)
    if is_new or not len(led):
        found = places_of(ready.seen, tables, contours.floor, contours.model.rule)
        chosen = found[:, :3] * (tables.resolution, tables.resolution, 1.0)
        found = found[each_place_once(chosen, HYPOTHESES)]
        starts, before = np.concatenate((starts, found[:, :3])), np.append(before, np.zeros(len(found)))
    judged = _judged(starts, ready, tables, contours.model.rule, around.walls)
    poses = _in_map(judged[:, :3], tables)
    ranked = _ranked(poses, judged, before, search, around, is_new)
    view = tuple(track.tolist()) if is_new else known.view
    hypotheses, past, said = ranked
    return replace(
        search,
        contours=ContourViews(
            hypotheses=read_only(hypotheses),
            past=read_only(past),
            said=read_only(said),
            judged_ns=scan.stamp_ns,
            view=(view[0], view[1], view[2]),
            scanner=scan.scanner,
        ),
    )


def _made_ready(scan: SeenScan, motion: Motion, model: ContourModel, sweep_rows: FloatArray) -> _ReadyScan:
    """Return the points of a scan at its stamp, and the beams that have come to them."""
    per_cell = 1.0 / model.tables.resolution
    at = scan.observation.mount_x, scan.observation.mount_y
    whole = scan.ranges()
    if whole is None:
        return _ReadyScan(ScanPoints(np.empty((0, 2)), 0.0, *at), np.empty((0, 4)))
    seen = scan_seen_by(whole, scan.scanner, scan.observation, sweep_rows)
    points = np.empty((len(seen.ranges), 2))
    points = points[: scan_points(seen, model, motion, scan.following, points)]
    few = points[:: max(1, len(points) // BEAMS)] / per_cell - at
    start = np.broadcast_to(at, (len(few), 2))
    beams = np.column_stack((start, np.arctan2(few[:, 1], few[:, 0]), np.hypot(few[:, 0], few[:, 1])))
    in_cells = ScanPoints(read_only(points), lever_of(points), at[0] * per_cell, at[1] * per_cell)
    return _ReadyScan(in_cells, read_only(beams))


def _judged(
    starts: FloatArray, ready: _ReadyScan, tables: ContourTables, rule: MatchRule, walls: RayTables
) -> FloatArray:
    """(n, 6) where a scan matches from each start [cells, rad], how well, and what its beams say of that."""
    judged, said = np.empty((len(starts), 6)), np.empty(len(starts))
    few = ready.seen.thinned(MATCHED_BY)
    judge_places(read_only(starts), few._replace(lever=lever_of(few.points)), tables, rule, judged)
    beams_say(read_only(_in_map(judged[:, :3], tables)), ready.beams, walls, said)
    judged[:, _SAID] = said
    return judged


def _ranked(  # noqa: PLR0917 - places and what is known of them
    poses: FloatArray, judged: FloatArray, before: FloatArray, search: Search, around: SearchMap, is_new: bool
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Hypotheses by their evidence, each place once, what earlier views and what the newest one say of each.

    Those that were led along come first among `poses`: they keep what was said of them.
    """
    prior = prior_of(search, around)
    even = math.exp(prior.log_even)
    favors = [min(math.log(density(prior, *pose) / even), MOST_FOR) for pose in poses.tolist()]
    evidence = before + judged[:, _SAID] + favors
    kept = each_place_once(poses, len(poses))
    kept = kept[np.argsort(-evidence[kept], kind="stable")][:HYPOTHESES]
    rows = np.zeros((len(kept), ROW))
    rows[:, :3] = compose(poses[kept], inverse(search.track[:3]))
    rows[:, [3, 6]], rows[:, 8] = POSITION_SIGMA**2, HEADING_SIGMA**2
    rows[:, 9] = evidence[kept]
    rows[:, 10] = np.round(100.0 * judged[kept, _MATCHED])
    if len(rows) and _is_alone(evidence[kept], judged[kept[0]]):
        times = times_in_a_row(rows, search.contours.hypotheses, search.track)
        rows[0, 11] = times if is_new else times - 1.0 + STANDING
    return rows, before[kept], judged[kept, _SAID]


def _is_alone(evidence: FloatArray, best: FloatArray) -> bool:
    """Whether the first place is far likelier than all others and than none, and fits by itself."""
    return others_beside(evidence, 0.0) * ODDS <= 1.0 and bool(
        best[_MATCHED] >= LEAST_MATCHED and best[_THROUGH] <= MOST_THROUGH
    )


def _in_map(places: FloatArray, tables: ContourTables) -> FloatArray:
    """(n, 3) poses of base [m, m, rad], map frame, of u, v [cells] and heading: the inverse of `to_grid`."""
    at = (places[:, :2] + 0.5) * tables.resolution
    T_map_grid = inverse((tables.x, tables.y, tables.theta))
    return compose(T_map_grid, np.column_stack((at, places[:, 2])))


def _in_cells(poses: FloatArray, tables: ContourTables) -> FloatArray:
    """(n, 3) u, v [cells] and heading of poses of base in the map, as `to_grid` has them."""
    at = compose(np.array((tables.x, tables.y, tables.theta)), poses)
    return np.column_stack((at[:, :2] / tables.resolution - 0.5, wrap(at[:, 2])))

"""Where a vehicle is that does not know: hypotheses that go along with odometry, until one of them is left.

It decides what is believed and when; what fits where is `start`'s. Every step takes a state and returns another one, so
that live and whole runs call the same functions and agree to the last bit. Nothing of it runs while a vehicle knows
where it is.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from commission.geometry.arrays import FloatArray, IntArray, read_only
from commission.geometry.se2 import compose
from commission.localization.association import NOBODY
from commission.localization.cycle import Cycle, process_odometry
from commission.localization.estimate import Mode, Status
from commission.localization.observation import ObservationModel
from commission.localization.odometry import NextOdometry, OdometryNoise, advance, reach
from commission.localization.pose_gaussian import PoseGaussian
from commission.localization.rejection import NO_EVIDENCE
from commission.localization.search_map import SearchMap
from commission.localization.search_state import NOTHING, Search, new_search
from commission.localization.sightings import CERTAIN, COLUMNS, MOST_THINGS, join
from commission.localization.start import (
    CANDIDATES,
    HYPOTHESES,
    PAIRS,
    ROW,
    SAME_HEADING,
    SAME_PLACE,
    Prior,
    candidates,
    judge,
)
from commission.localization.state import FilterState
from commission.localization.supervisor import SupervisorLimits

ODDS = 1e5
"""How much likelier one hypothesis must be than all others together, and than that what is seen is none of the map's
reflectors: if things stood at random, one of 100,000 places would be believed wrongly."""
CONFIRMATIONS = 5
"""Scans in a row in which one hypothesis must have these odds."""
FEWEST_FITS = 3
"""Things that must fit: two fit wherever two reflectors are as far apart."""
LEAST_SHARE = 0.5
"""Share of the things seen of late that must fit."""
PERIOD_S = 0.1
"""Time between two attempts at least [s]."""
PATIENCE = 0.02
"""Share of the time of the search that lies between two attempts: what was not found in a minute comes no sooner by
ten attempts a second."""
LONGEST_PERIOD_S = 2.0
"""Time between two attempts at most [s]."""
SEARCH_PERIOD_S = 0.5
"""Time between two searches of all pairs; in between, hypotheses are judged anew [s]."""
VIEWS = 5
"""Places on the way from which reflectors should have been seen."""
VIEW_S = 0.3
"""Time between two of them at least [s]."""
OPTIMISM = 2.0
"""Factor of the covariance of a hypothesis that is believed: its things have errors in common."""
LEAST_SIGMAS = (0.03, 0.01)
"""1-sigma that it begins with at least: position [m], heading [rad]."""
AROUND_M = 1.0
AROUND_RAD = 0.3
"""1-sigma about the last good pose [m], [rad]: a slip, a push, a wrong association."""


def is_sought(state: FilterState, limits: SupervisorLimits) -> bool:
    """Whether the vehicle has to be found: it was never located, or it is lost and may look for itself.

    Parameters
    ----------
    state : before or after a scan.
    limits : of the supervisor.
    """
    return state.mode == Mode.INITIALIZING or (state.mode == Mode.LOST and limits.find_again)


def searching_odometry(
    state: FilterState, stamp_ns: int, displacement: tuple[float, float, float], noise: OdometryNoise
) -> FilterState:
    """Take in an odometry record while a search is on: the filter's belief and the frame of odometry go along.

    Parameters
    ----------
    state : before the record.
    stamp_ns : of the record [ns].
    displacement : [m, m, rad].
    noise : variances per metre, radian and second.
    """
    search, cross = state.search, state.cross
    if search is None:
        raise ValueError("the state has no search; expected one of a vehicle that is lost or not located yet")
    track, _ = advance(search.track, state.motion, stamp_ns, *displacement, noise)
    bare = state._replace(cross=None, search=None)
    moved = process_odometry(bare, stamp_ns, *displacement, noise)
    if state.mode == Mode.INITIALIZING:
        moved = moved._replace(belief=state.belief)
    return moved._replace(cross=cross, search=replace(search, track=track))


def unlocated(state: FilterState, stamp_ns: int, following: NextOdometry, noise: OdometryNoise) -> Cycle:
    """Reach the stamp of a scan without a belief to correct; nothing is associated.

    Parameters
    ----------
    state : before the scan.
    stamp_ns : of the scan [ns].
    following : the odometry record at or after the scan, where it is known.
    noise : of odometry.
    """
    _, motion = reach(state.belief, state.motion, stamp_ns, following, noise)
    return Cycle(state.belief, state._replace(belief_ns=stamp_ns, motion=motion, newest_ns=stamp_ns))


def associate_nothing(status: NDArray[np.int8], reflectors: IntArray, d2: FloatArray) -> None:
    """Write what becomes of the detections of a scan while nobody knows where it was made.

    Parameters
    ----------
    status : (n,) in: INLIER or OUTLIER_DETECTOR; out: outliers all.
    reflectors, d2 : (n,) out: no reflector, no distance.
    """
    status[status == Status.INLIER] = Status.OUTLIER_ASSOCIATION
    reflectors[:] = NOBODY
    d2[:] = math.nan


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class SeenScan:
    """A scan's detections, for the search."""

    stamp_ns: int
    """Of the scan [ns]."""
    detections: FloatArray
    """(n, 2) range [m] and bearing [rad] at the stamp, scanner frame, upright."""
    status: NDArray[np.int8]
    """(n,) a `Status` each."""
    scanner: int
    """Index of the scanner."""
    observation: ObservationModel
    """Its mounting and noise."""
    following: NextOdometry
    """The odometry record at or after the scan, where it is known."""


def sought(before: FilterState, after: FilterState, scan: SeenScan, around: SearchMap) -> FilterState:
    """Go on searching after a scan; return the state, located where one hypothesis is left.

    Parameters
    ----------
    before : state before the scan.
    after : state after it, as the filter and its supervisor have it.
    scan : what was seen.
    around : the map to search.
    """
    if before.search is None:
        if after.mode != Mode.LOST:
            return after
        search = new_search(scan.stamp_ns, _last_good(before, scan.stamp_ns, around))
        track = NOTHING
    else:
        search = before.search
        track, _ = reach(search.track, before.motion, scan.stamp_ns, scan.following, around.odometry)
    search = _joined(search, track, scan)
    now_ns = scan.stamp_ns
    waits = max(PERIOD_S * 1e9, min(PATIENCE * (now_ns - search.since_ns), LONGEST_PERIOD_S * 1e9))
    if now_ns - search.judged_ns >= waits:
        search = _judged(search, now_ns, around)
        best = _confirmed(search)
        if best is not None:
            return _located(after, search, best, now_ns)
    if before.mode == Mode.INITIALIZING:
        return after._replace(belief=_spread(search, around), search=search)
    # What its own detections make of it is no confirmation: they may fit wrong reflectors.
    return after._replace(mode=int(Mode.LOST), search=search, output=before.output, output_ns=before.output_ns)


def _last_good(state: FilterState, stamp_ns: int, around: SearchMap) -> PoseGaussian:
    """Return where the vehicle was when it was last operational, as uncertain as it is by now."""
    seconds = (stamp_ns - state.output_ns) * 1e-9
    missing, turning = around.odometry.missing_per_s2, around.odometry.turning_per_s2
    position = AROUND_M**2 + missing * seconds * seconds
    heading = min(AROUND_RAD**2 + turning * seconds * seconds, math.pi**2 / 3.0)
    last = state.output
    return PoseGaussian(last.x, last.y, last.theta, position, 0.0, 0.0, position, 0.0, heading)


def _joined(search: Search, track: PoseGaussian, scan: SeenScan) -> Search:
    """Join a scan's detections to the things seen, and remember from where."""
    position = search.drift[0] + max(track.xx, track.yy)
    heading = search.drift[1] + track.tt
    seconds = (scan.stamp_ns - search.since_ns) * 1e-9
    things = np.empty((MOST_THINGS, COLUMNS))
    things[: len(search.things)] = search.things
    count = join(
        things,
        len(search.things),
        seconds,
        position,
        heading,
        track.x,
        track.y,
        track.theta,
        read_only(scan.detections),
        scan.status,
        scan.observation,
    )
    views = search.views
    mine = views[views[:, 3] == scan.scanner]
    # A scan that saw nothing may be a covered one, of which nobody knows the scanner.
    if len(scan.detections) and (len(mine) == 0 or seconds - mine[-1, 4] >= VIEW_S):
        model = scan.observation
        at = compose((track.x, track.y, track.theta), (model.mount_x, model.mount_y, model.mount_theta))
        mine = np.vstack((mine, (*at, float(scan.scanner), seconds)))[-VIEWS:]
        views = np.concatenate((views[views[:, 3] != scan.scanner], mine))
    still = track._replace(xx=0.0, xy=0.0, xt=0.0, yy=0.0, yt=0.0, tt=0.0)
    return replace(
        search,
        track=still,
        drift=(position, heading),
        things=read_only(things[:count].copy()),
        views=read_only(views),
    )


def certain_things(search: Search) -> FloatArray:
    """(C, 5) x, y [m] and covariance [m^2] of things that came back, as of now; those seen most often first."""
    things = search.things[search.things[:, 5] >= CERTAIN]
    things = things[np.argsort(-things[:, 5], kind="stable")]
    away2 = (things[:, 0] - search.track.x) ** 2 + (things[:, 1] - search.track.y) ** 2
    drifted = search.drift[0] - things[:, 7] + (search.drift[1] - things[:, 8]) * away2
    known = np.minimum(things[:, 5], 4.0)[:, np.newaxis]
    result = np.column_stack((things[:, :2], things[:, 2:5] / known))
    result[:, 2] += drifted + 1e-4
    result[:, 4] += drifted + 1e-4
    return read_only(result[result[:, 2] + result[:, 4] < 0.5])


def _pairs(things: FloatArray) -> IntArray:
    """(P, 2) pairs of things to be looked up: long ones of things seen often first, no thing in too many of them."""
    count = min(len(things), 16)
    pairs = np.array(list(itertools.combinations(range(count), 2)), dtype=np.int64).reshape(-1, 2)
    deltas = things[pairs[:, 0], :2] - things[pairs[:, 1], :2]
    length = np.hypot(deltas[:, 0], deltas[:, 1])
    sigma = np.sqrt(things[:, 2] + things[:, 4])
    score = length / (sigma[pairs[:, 0]] + sigma[pairs[:, 1]] + 0.05)
    order = np.argsort(-score, kind="stable")
    used = np.zeros(count, dtype=np.int64)
    chosen: list[int] = []
    most = max(3, 2 * PAIRS // max(count, 1) + 1)
    for each in order.tolist():
        i, j = pairs[each]
        if length[each] > 0.3 and used[i] < most and used[j] < most:
            used[i] += 1
            used[j] += 1
            chosen.append(each)
        if len(chosen) == PAIRS:
            break
    return read_only(pairs[chosen])


def _judged(search: Search, now_ns: int, around: SearchMap) -> Search:
    """Judge all hypotheses by all that was seen; look for new ones from time to time."""
    things = certain_things(search)
    search = replace(search, judged_ns=now_ns)
    if len(things) < FEWEST_FITS or len(around.table.distances) == 0:
        return replace(search, hypotheses=read_only(search.hypotheses[:0]))
    poses = search.hypotheses[:, :3]
    if now_ns - search.searched_ns >= SEARCH_PERIOD_S * 1e9 or len(search.hypotheses) == 0:
        found = np.empty((CANDIDATES, 4))
        count = candidates(
            things,
            _pairs(things),
            around.table.distances,
            around.table.ends,
            around.cells,
            around.places,
            around.offsets,
            found,
        )
        poses = np.concatenate((poses, found[:count, :3]))
        search = replace(search, searched_ns=now_ns)
    judged = np.empty((len(poses), ROW))
    views = search.views.copy()
    for scanner in np.unique(views[:, 3]):
        its = views[:, 3] == scanner
        views[its, 4] = 1.0 / its.sum()
    judge(
        read_only(poses),
        things,
        search.track.x,
        search.track.y,
        _clutter(things, search),
        _prior(search, around),
        read_only(views),
        around.eyes,
        around.walls,
        around.walled,
        around.facings,
        around.cells,
        around.places,
        around.offsets,
        judged,
    )
    return replace(search, hypotheses=read_only(_ranked(judged, search)))


def _clutter(things: FloatArray, search: Search) -> float:
    """Density of things, were none of them a reflector [1 / m^2]."""
    away = np.hypot(things[:, 0] - search.track.x, things[:, 1] - search.track.y)
    return len(things) / (math.pi * max(float(away.max()), 1.0) ** 2)


def _prior(search: Search, around: SearchMap) -> Prior:
    """Return what is known before anything is seen."""
    even = -math.log(2.0 * math.pi * around.table.area)
    if search.around is None:
        return Prior(even, False, 0.0, 0.0, 0.0, 1.0, 1.0)
    # The vehicle has moved since, by what odometry says.
    x, y, theta = compose(
        (search.around.x, search.around.y, search.around.theta), (search.track.x, search.track.y, search.track.theta)
    ).tolist()
    position, heading = search.around.xx + search.drift[0], search.around.tt + search.drift[1]
    return Prior(even, True, x, y, theta, position, heading)


def base_poses(hypotheses: FloatArray, track: PoseGaussian) -> FloatArray:
    """(H, 3) where the vehicle is by each hypothesis [m, m, rad], map frame.

    Parameters
    ----------
    hypotheses : (H, ROW) see `start`.
    track : pose of base in the frame of odometry.
    """
    return compose(hypotheses[:, :3], np.array((track.x, track.y, track.theta)))


def _ranked(judged: FloatArray, search: Search) -> FloatArray:
    """Hypotheses by their evidence, each place once; one that goes on keeps count of its scans."""
    judged = judged[np.isfinite(judged[:, 9])]
    judged = judged[np.argsort(-judged[:, 9], kind="stable")]
    poses = base_poses(judged, search.track)
    kept: list[int] = []
    for i in range(len(judged)):
        if len(kept) == HYPOTHESES:
            break
        if not any(_same(poses[i], poses[j]) for j in kept):
            kept.append(i)
    ranked = judged[kept]
    if len(ranked) and _is_alone(ranked, search):
        old = search.hypotheses
        again = len(old) > 0 and _same(poses[kept[0]], base_poses(old[:1], search.track)[0])
        ranked[0, 11] = 1.0 + (old[0, 11] if again else 0.0)
    return ranked


def _same(a: FloatArray, b: FloatArray) -> bool:
    """Whether two poses are one place."""
    turn = math.remainder(float(a[2] - b[2]), 2.0 * math.pi)
    return math.hypot(a[0] - b[0], a[1] - b[1]) < SAME_PLACE and abs(turn) < SAME_HEADING


def probabilities(hypotheses: FloatArray) -> FloatArray:
    """(H,) probability of each hypothesis; what is missing to one is that the vehicle is none of them.

    Parameters
    ----------
    hypotheses : (H, ROW) see `start`.

    Notes
    -----
    exp(evidence) / (1 + sum exp(evidence)): Bayes, with even odds that what is seen is none of the map's reflectors.
    """
    if len(hypotheses) == 0:
        return np.empty(0)
    most = max(float(hypotheses[:, 9].max()), 0.0)
    weights = np.exp(hypotheses[:, 9] - most)
    return np.asarray(weights / (weights.sum() + math.exp(-most)), dtype=np.float64)


def _is_alone(ranked: FloatArray, search: Search) -> bool:
    """Whether the first hypothesis is far likelier than all others, and than none."""
    best = float(ranked[0, 9])
    others = float(np.exp(np.minimum(ranked[1:, 9] - best, 0.0)).sum()) + math.exp(min(-best, 0.0))
    count = len(certain_things(search))
    return others * ODDS <= 1.0 and ranked[0, 10] >= max(FEWEST_FITS, LEAST_SHARE * count)


def _confirmed(search: Search) -> FloatArray | None:
    """Return the hypothesis that is left, once enough scans agree."""
    if len(search.hypotheses) and search.hypotheses[0, 11] >= CONFIRMATIONS:
        return search.hypotheses[0]
    return None


def _located(after: FilterState, search: Search, best: FloatArray, stamp_ns: int) -> FilterState:
    """Return the state of a filter that begins anew where the vehicle was found; the supervisor still withholds it."""
    belief = _belief_of(best, search.track)
    return after._replace(
        belief=belief,
        belief_ns=stamp_ns,
        mode=int(Mode.FAIL),
        evidence=NO_EVIDENCE._replace(stamp_ns=stamp_ns, confirmed=0.0),
        pivot=(belief.x, belief.y),
        cross=None,
        search=None,
    )


def _belief_of(best: FloatArray, track: PoseGaussian) -> PoseGaussian:
    """Pose and covariance of base by a hypothesis."""
    x, y, theta = base_poses(best[np.newaxis], track)[0].tolist()
    xx, xy, xt, yy, yt, tt = (OPTIMISM * best[3:9]).tolist()
    position, heading = LEAST_SIGMAS[0] ** 2, LEAST_SIGMAS[1] ** 2
    return PoseGaussian(x, y, theta, xx + position, xy, xt, yy + position, yt, tt + heading)


def _spread(search: Search, around: SearchMap) -> PoseGaussian:
    """Belief of a vehicle that is not located: the likeliest hypothesis, as wide as all of them together."""
    chances = probabilities(search.hypotheses)
    if len(chances) == 0 or chances.sum() < 0.5:
        return around.anywhere
    poses = base_poses(search.hypotheses, search.track)
    best = _belief_of(search.hypotheses[0], search.track)
    rest = 1.0 - float(chances.sum())
    dx, dy = poses[:, 0] - poses[0, 0], poses[:, 1] - poses[0, 1]
    turn = np.array([math.remainder(float(each), 2.0 * math.pi) for each in poses[:, 2] - poses[0, 2]])
    wide = around.anywhere
    return PoseGaussian(
        best.x,
        best.y,
        best.theta,
        best.xx + float((chances * dx * dx).sum()) + rest * wide.xx,
        best.xy + float((chances * dx * dy).sum()),
        best.xt + float((chances * dx * turn).sum()),
        best.yy + float((chances * dy * dy).sum()) + rest * wide.yy,
        best.yt + float((chances * dy * turn).sum()),
        best.tt + float((chances * turn * turn).sum()) + rest * wide.tt,
    )

"""Where a vehicle is that does not know: hypotheses that go along with odometry, until one of them is left.

It decides what is believed and when; what fits where is `hypotheses`' business, what was seen `seen_of_late`'s. Every
step takes a state and returns another one, so that live and whole runs call the same functions and agree to the last
bit. Nothing of it runs while a vehicle knows where it is.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from commission.geometry.arrays import FloatArray, IntArray
from commission.localization.association import NOBODY
from commission.localization.contour_hypotheses import seen_again
from commission.localization.estimate import Mode, Status
from commission.localization.hypotheses import gaussian_of, judged_again, spread
from commission.localization.odometry import NextOdometry, OdometryNoise, advance, reach
from commission.localization.pose_gaussian import PoseGaussian
from commission.localization.rejection import NO_EVIDENCE
from commission.localization.search_map import SearchMap, anywhere
from commission.localization.search_state import NOTHING, Search, new_search
from commission.localization.seen_of_late import SeenScan, joined_scan
from commission.localization.setup import LocalizerSetup
from commission.localization.state import FilterState, Tracking
from commission.localization.supervisor import SupervisorLimits
from commission.localization.trail_search import CONFIRMED, explained_again

CONFIRMATIONS = 5
"""Scans in a row in which one hypothesis must have these odds."""
CONFIRMED_BY_CONTOURS = 8.0
"""Views in a row in which one place must be the only one left by the contours of the hall."""
PERIOD_S = 0.1
"""Time between two attempts at least [s]."""
LONGEST_PERIOD_S = 2.0
"""Time between two attempts at most [s]."""
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
    mode = state.tracking.mode
    return mode == Mode.INITIALIZING or (mode == Mode.LOST and limits.find_again)


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
    search, tracking = state.search, state.tracking
    if search is None:
        raise ValueError("the state has no search; expected one of a vehicle that is lost or not located yet")
    track, motion = advance(search.track, tracking.motion, stamp_ns, *displacement, noise)
    belief = tracking.belief
    if tracking.mode != Mode.INITIALIZING:
        belief, _ = advance(belief, tracking.motion, stamp_ns, *displacement, noise)
    # As `process_odometry` has it; to hand a kernel all of `tracking` takes ten times as long as to advance the belief.
    moved = tracking._replace(belief=belief, belief_ns=stamp_ns, motion=motion, newest_ns=stamp_ns)
    return state._replace(tracking=moved, protection=None, search=replace(search, track=track))


def forgotten(state: FilterState, setup: LocalizerSetup) -> FilterState:
    """Return the state of a vehicle whose pose is thrown away: it looks where it is, and withholds its output.

    Parameters
    ----------
    state : before.
    setup : its reflectors, and its floor map where contours are looked at, say how large the floor is.
    """
    belief, now_ns = anywhere(setup.index.places, setup.contour_floor), state.tracking.belief_ns
    tracking = state.tracking._replace(
        belief=belief,
        mode=int(Mode.INITIALIZING),
        evidence=NO_EVIDENCE._replace(stamp_ns=now_ns),
        pivot=(belief.x, belief.y),
    )
    return FilterState(tracking, state.sensor_detects, search=new_search(now_ns))


def unlocated(
    state: FilterState, stamp_ns: int, following: NextOdometry, noise: OdometryNoise
) -> tuple[PoseGaussian, FilterState]:
    """Reach the stamp of a scan without a belief to correct; return the belief before it, and the state after it.

    Parameters
    ----------
    state : before the scan.
    stamp_ns : of the scan [ns].
    following : the odometry record at or after the scan, where it is known.
    noise : of odometry.
    """
    tracking = state.tracking
    _, motion = reach(tracking.belief, tracking.motion, stamp_ns, following, noise)
    reached = tracking._replace(belief_ns=stamp_ns, motion=motion, newest_ns=stamp_ns)
    return tracking.belief, state._replace(tracking=reached)


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
        if after.tracking.mode != Mode.LOST:
            return after
        search = new_search(scan.stamp_ns, _last_good(before.tracking, scan.stamp_ns, around))
        track = NOTHING
    else:
        search = before.search
        track, _ = reach(search.track, before.tracking.motion, scan.stamp_ns, scan.following, around.odometry)
    search = joined_scan(search, track, scan)
    now_ns, never_located = scan.stamp_ns, before.tracking.mode == Mode.INITIALIZING
    if now_ns - search.judged_ns >= search.waits_ns(now_ns, PERIOD_S, LONGEST_PERIOD_S):
        search = judged_again(search, now_ns, around)
        search = explained_again(search, None if never_located else after.tracking.belief, now_ns, around)
    search = seen_again(search, scan, before.tracking.motion, before.tracking.walls, around)
    best = _confirmed(search)
    if best is not None:
        return _located(before, after, search, best)
    if not around.has_reflectors and after.tracking.mode not in (Mode.LOST, Mode.INITIALIZING):
        # By contours, which have to match far better then: see `observe_contours`.
        return after._replace(search=None)
    if never_located:
        return after._replace(tracking=after.tracking._replace(belief=spread(search, around)), search=search)
    # What its own detections make of it is no confirmation: they may fit wrong reflectors.
    lost = after.tracking._replace(
        mode=int(Mode.LOST), output=before.tracking.output, output_ns=before.tracking.output_ns
    )
    return after._replace(tracking=lost, search=search)


def _last_good(before: Tracking, stamp_ns: int, around: SearchMap) -> PoseGaussian:
    """Return where the vehicle was when it was last operational, as uncertain as it is by now."""
    seconds = (stamp_ns - before.output_ns) * 1e-9
    missing, turning = around.odometry.missing_per_s2, around.odometry.turning_per_s2
    position = AROUND_M**2 + missing * seconds * seconds
    heading = min(AROUND_RAD**2 + turning * seconds * seconds, math.pi**2 / 3.0)
    last = before.output
    return PoseGaussian(last.x, last.y, last.theta, position, 0.0, 0.0, position, 0.0, heading)


def _confirmed(search: Search) -> FloatArray | None:
    """Return the hypothesis that is left, once enough scans agree."""
    if len(search.hypotheses) and search.hypotheses[0, 11] >= CONFIRMATIONS:
        return search.hypotheses[0]
    if len(search.explained) and search.explained[0, 11] >= CONFIRMED:
        return search.explained[0]
    views = search.contours.hypotheses
    if len(views) and views[0, 11] >= CONFIRMED_BY_CONTOURS:
        return views[0]
    return None


def _located(before: FilterState, after: FilterState, search: Search, best: FloatArray) -> FilterState:
    """Return the state of a filter that begins anew where the vehicle was found; the supervisor still withholds it."""
    belief, stamp_ns = gaussian_of(best, search.track), after.tracking.belief_ns
    tracking = after.tracking._replace(
        belief=belief,
        mode=int(Mode.FAIL),
        evidence=NO_EVIDENCE._replace(stamp_ns=stamp_ns, confirmed=0.0),
        # The filter may have believed its detections in this very scan.
        output=before.tracking.output,
        output_ns=before.tracking.output_ns,
        pivot=(belief.x, belief.y),
    )
    return FilterState(tracking, after.sensor_detects)

"""Hypotheses of where a vehicle is whose scans see one or two things: each led along the way, until one is left.

`hypotheses` judges by things that came back and are joined by odometry; where they do not, or odometry drifts too far
before enough of them have been seen, each hypothesis is judged by what it makes of all scans of the way (`trail_fit`).
So it is where things alone do not tell it for long: three of four that fit are no proof at a single place.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from commission.geometry.arrays import FloatArray, read_only
from commission.geometry.se2 import compose, inverse
from commission.localization.contradiction import Contradiction, contradiction
from commission.localization.hypotheses import (
    ODDS,
    base_poses,
    each_place_once,
    gaussian_of,
    is_same_place,
    prior_of,
    times_in_a_row,
)
from commission.localization.hypothesis_fit import NEGLIGIBLE, ROW, density
from commission.localization.pose_gaussian import PoseGaussian
from commission.localization.search_map import SearchMap
from commission.localization.search_state import Search
from commission.localization.seen_of_late import pairs_of
from commission.localization.start import CANDIDATES, candidates
from commission.localization.trail import newest_things
from commission.localization.trail_fit import explain

SPARSE = 4.0
"""Detections a scan on average from which on things that come back tell it sooner."""
AFTER_S = 2.0
"""The search has been going on for so long [s]: where scans hold enough, it has ended by then."""
AFTER_ALL_S = 5.0
"""After so long [s], scans that hold enough have not told it: one of few reflectors may stand elsewhere, or be gone."""
KEPT = 12
"""Hypotheses that are carried on."""
NEW_WAY = 1.0
"""Part of the way, see `way_between`, between two attempts at least."""
TRIED = 16
"""Poses that pairs suggest and that are led along, those that most things fit."""
ALIKE = 0.25
"""Poses within that part of one place are led along once: they come to stand at the same place."""
ODDS_AGAINST_NONE = 1e4
"""How much likelier it must be than that what is seen is none of the map's reflectors; than all others as `ODDS`
says. With maps of other places a real robot reached 1e3 at most, in 48 minutes of driving."""
CONFIRMED = 3.0
"""Attempts in a row in which one hypothesis must be the only one left."""
LEAST_SHARE = 0.6
"""Share of the detections that must be of reflectors by it."""
MOST_CONTRADICTED = 1.0 / 3.0
"""Share of the reflectors met that may stand elsewhere by it."""
FEWEST_PLACES = 3.0
"""Places of the map that must have been seen by it."""


def has_to_tell(search: Search, now_ns: int) -> bool:
    """Whether the way as a whole has to tell: scans see too little, or things that came back have not told it for long.

    Parameters
    ----------
    search : with the newest scan taken in.
    now_ns : its stamp [ns].
    """
    trail = search.trail
    if len(trail.scans) < 2:
        return False
    return len(trail.seen) < SPARSE * len(trail.scans) or now_ns - search.since_ns > AFTER_ALL_S * 1e9


def explained_again(search: Search, belief: PoseGaussian | None, now_ns: int, around: SearchMap) -> Search:
    """Judge hypotheses by the way as a whole, and new ones that the newest scans suggest.

    Parameters
    ----------
    search : with the newest scan taken in.
    belief : the filter's own, which may be right; None: it has none.
    now_ns : stamp of the newest scan [ns].
    around : the map to search.
    """
    if not has_to_tell(search, now_ns):
        return replace(search, explained=read_only(search.explained[:0])) if len(search.explained) else search
    if search.way < NEW_WAY or now_ns - search.since_ns < AFTER_S * 1e9:
        return search
    things = newest_things(search.trail, around.models)
    if len(around.table.distances) == 0 or len(things) < 2:
        return search
    found = np.empty((CANDIDATES, 4))
    table, track = around.table, np.array((search.track.x, search.track.y, search.track.theta))
    count = candidates(
        things,
        pairs_of(things),
        table.distances,
        table.ends,
        around.reflectors,
        found,
    )
    known = (base_poses(each, search.track) for each in (search.explained, search.hypotheses))
    poses = [*known, compose(found[: min(count, TRIED), :3], track)]
    if belief is not None:
        poses.append(np.array(((belief.x, belief.y, belief.theta),)))
    tried = np.concatenate(poses)
    tried = tried[each_place_once(tried, len(tried), ALIKE)]
    explained = np.empty((len(tried), 12))
    explain(
        read_only(tried),
        search.trail,
        around.models,
        around.eyes,
        max(float(search.trail.seen[:, 0].max()), 1.0),
        around.crowd,
        around.reflectors,
        explained,
    )
    return replace(search, explained=read_only(_ranked(explained, search, belief, around)), way=0.0)


def _ranked(explained: FloatArray, search: Search, belief: PoseGaussian | None, around: SearchMap) -> FloatArray:
    """(H, ROW) hypotheses by their evidence, each place once, as `hypotheses` has them."""
    prior = prior_of(search, around)
    rows = np.zeros((len(explained), ROW))
    track = np.array((search.track.x, search.track.y, search.track.theta))
    rows[:, :3] = compose(explained[:, :3], inverse(track))
    rows[:, 3:9] = explained[:, 3:9]
    densities = [density(prior, *pose) for pose in explained[:, :3].tolist()]
    rows[:, 9], rows[:, 10] = explained[:, 9] + np.log(densities), np.floor(explained[:, 11] + 0.5)
    # One that leaves too much unexplained is no likelier than that it is none of them.
    is_weak = (explained[:, 10] < LEAST_SHARE) | (explained[:, 11] < FEWEST_PLACES)
    rows[is_weak, 12] = np.maximum(rows[is_weak, 9], 0.0)
    rows = rows[np.isfinite(rows[:, 9])]
    rows = rows[np.argsort(-rows[:, 9], kind="stable")]
    rows = rows[rows[:, 9] > rows[0, 9] - NEGLIGIBLE] if len(rows) else rows
    ranked = rows[each_place_once(base_poses(rows, search.track), KEPT)]
    if len(ranked) and _is_alone(ranked):
        found = contradiction(gaussian_of(ranked[0], search.track), search.trail, around)
        if _may_be_believed(ranked[0], found, search, belief, around):
            ranked[0, 11] = times_in_a_row(ranked, search.explained, search.track)
        # What lies beside its place on average is not drawn anew each time.
        ranked[0, [3, 6]] += found.misfit
    return ranked


def _is_alone(ranked: FloatArray) -> bool:
    """Whether the first hypothesis is far likelier than all others, and than none."""
    best, none = float(ranked[0, 9]), float(ranked[0, 12])
    others = np.exp(np.minimum(ranked[1:, 9] - best, 0.0))
    # One that leaves too much unexplained can itself not be believed: it is one of the ways to be none of them.
    is_weak = ranked[1:, 12] >= ranked[1:, 9]
    nowhere = float(others[is_weak].sum()) + math.exp(min(none - best, 0.0))
    return float(others[~is_weak].sum()) * ODDS <= 1.0 and nowhere * ODDS_AGAINST_NONE <= 1.0


def _may_be_believed(
    best: FloatArray, found: Contradiction, search: Search, belief: PoseGaussian | None, around: SearchMap
) -> bool:
    """Whether a hypothesis contradicts few of the reflectors that it met, and no more than the filter's own belief."""
    if found.contradicted > MOST_CONTRADICTED * found.met:
        return False
    if belief is None or not found.contradicted or not is_same_place(gaussian_of(best, search.track), belief):
        return True
    return contradiction(belief, search.trail, around).contradicted >= found.contradicted

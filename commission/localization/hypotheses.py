"""Hypotheses of where a vehicle is: judged by all that was seen, ranked, and how likely each of them is.

What was seen is `seen_of_late`'s; whether the first one is believed is `relocalization`'s.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from commission.compiled import compiled
from commission.geometry.angles import difference, wrap_scalar
from commission.geometry.arrays import BoolArray, FloatArray, IntArray, read_only
from commission.geometry.se2 import compose
from commission.localization.hypothesis_fit import ROW, Prior, judge
from commission.localization.missed import Sights
from commission.localization.pose_gaussian import PoseGaussian, to_belief
from commission.localization.search_map import SearchMap
from commission.localization.search_state import Search, SearchMoment
from commission.localization.seen_of_late import certain_things, clutter, pairs_of
from commission.localization.start import CANDIDATES, HYPOTHESES, SAME_HEADING, SAME_PLACE, candidates
from commission.localization.wall_evidence import NO_BEAMS, wall_beams

ODDS = 1e5
"""How much likelier one hypothesis must be than all others together, and than that what is seen is none of the map's
reflectors: if things stood at random, one of 100,000 places would be believed wrongly."""
FEWEST_FITS = 3
"""Things that must fit: two fit wherever two reflectors are as far apart."""
LEAST_SHARE = 0.5
"""Share of the things seen of late that must fit."""
SEARCH_PERIOD_S = 0.5
"""Time between two searches of all pairs; in between, hypotheses are judged anew [s]."""
OPTIMISM = 2.0
"""Factor of the covariance of a hypothesis that is believed: its things have errors in common."""
LEAST_SIGMAS = (0.03, 0.01)
"""1-sigma that it begins with at least: position [m], heading [rad]."""


def judged_again(search: Search, now_ns: int, around: SearchMap) -> Search:
    """Judge all hypotheses by all that was seen; look for new ones from time to time.

    Parameters
    ----------
    search : with the newest scan taken in.
    now_ns : its stamp [ns].
    around : the map to search.
    """
    things = certain_things(search)
    search = replace(search, judged_ns=now_ns)
    if len(things) < FEWEST_FITS or len(around.table.distances) == 0:
        return replace(search, hypotheses=read_only(search.hypotheses[:0]))
    poses = search.hypotheses[:, :3]
    if now_ns - search.searched_ns >= SEARCH_PERIOD_S * 1e9 or len(search.hypotheses) == 0:
        found = np.empty((CANDIDATES, 4))
        count = candidates(
            things,
            pairs_of(things),
            around.table.distances,
            around.table.ends,
            around.reflectors,
            found,
        )
        poses = np.concatenate((poses, found[:count, :3]))
        search = replace(search, searched_ns=now_ns)
    judged = np.empty((len(poses), ROW))
    views = search.views.copy()
    for scanner in np.unique(views[:, 3]):
        its = views[:, 3] == scanner
        views[its, 4] = 1.0 / its.sum()
    beams = wall_beams(search.views, search.ends, search.things) if around.walled else NO_BEAMS
    judge(
        read_only(poses),
        things,
        search.track.x,
        search.track.y,
        clutter(things, search),
        prior_of(search, around),
        Sights(read_only(views), search.ends, around.eyes, around.walls, around.walled, around.facings, beams),
        around.reflectors,
        judged,
    )
    return replace(search, hypotheses=read_only(_ranked(judged, search)))


def prior_of(search: Search, around: SearchMap) -> Prior:
    """Return what is known before anything is seen.

    Parameters
    ----------
    search : with the last good pose, where there is one.
    around : the map to search.
    """
    even = -math.log(2.0 * math.pi * around.area)
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
    ranked = judged[each_place_once(poses, HYPOTHESES)]
    if len(ranked) and _is_alone(ranked, search):
        ranked[0, 11] = times_in_a_row(ranked, search.hypotheses, search.track)
    return ranked


def each_place_once(poses: FloatArray, most: int, part: float = 1.0) -> IntArray:
    """Return rows of poses, from the first on, that are places of their own.

    Parameters
    ----------
    poses : (n, 3) [m, m, rad], the likeliest first.
    most : rows at most.
    part : of the distance and of the turn within which two are one place.
    """
    kept = np.empty(min(most, len(poses)), dtype=np.int64)
    return kept[: _of_their_own(read_only(np.ascontiguousarray(poses)), part, kept)]


@compiled
def _of_their_own(poses: FloatArray, part: float, kept: IntArray) -> int:
    """Write the rows of `each_place_once`; return their number.

    Notes
    -----
    No formula: it compares pairs.
    """
    count = 0
    for row in range(len(poses)):
        if count == len(kept):
            break
        is_known = False
        for at in range(count):
            x, y = poses[row, 0] - poses[kept[at], 0], poses[row, 1] - poses[kept[at], 1]
            turn = abs(wrap_scalar(poses[row, 2] - poses[kept[at], 2]))
            is_known = is_known or (math.hypot(x, y) < part * SAME_PLACE and turn < part * SAME_HEADING)
        if not is_known:
            kept[count] = row
            count += 1
    return count


def times_in_a_row(ranked: FloatArray, before: FloatArray, track: PoseGaussian) -> float:
    """How many attempts in a row, this one among them, the first hypothesis has been the only one left.

    Parameters
    ----------
    ranked : (H, ROW) hypotheses, of which the first is the only one left now.
    before : (G, ROW) those of the attempt before.
    track : pose of base in the frame of odometry.
    """
    again = len(before) > 0 and bool(_same(base_poses(ranked[:1], track), base_poses(before[:1], track)[0])[0])
    return 1.0 + (float(before[0, 11]) if again else 0.0)


def is_same_place(one: PoseGaussian, other: PoseGaussian) -> bool:
    """Whether two poses are one place.

    Parameters
    ----------
    one, other : [m, m, rad], map frame.
    """
    return bool(_same(np.array([one[:3]]), np.array(other[:3]))[0])


def _same(poses: FloatArray, other: FloatArray) -> BoolArray:
    """(n,) whether each of some poses is one place with another one."""
    apart = np.hypot(poses[:, 0] - other[0], poses[:, 1] - other[1])
    return (apart < SAME_PLACE) & (np.abs(difference(poses[:, 2], other[2])) < SAME_HEADING)


def probabilities(hypotheses: FloatArray) -> FloatArray:
    """(H,) probability of each hypothesis; what is missing to one is that the vehicle is none of them.

    Parameters
    ----------
    hypotheses : (H, ROW) see `start`.

    Notes
    -----
    exp(evidence) / (exp(n) + sum exp(evidence)): Bayes, with even odds that what is seen is none of the map's
    reflectors; n is what counts among places alone of the likeliest one's.
    """
    if len(hypotheses) == 0:
        return np.empty(0)
    none = float(hypotheses[np.argmax(hypotheses[:, 9]), 12])
    most = max(float(hypotheses[:, 9].max()), none)
    weights = np.exp(hypotheses[:, 9] - most)
    return np.asarray(weights / (weights.sum() + math.exp(none - most)), dtype=np.float64)


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Hypothesis:
    """A place where the vehicle may be."""

    pose: FloatArray
    """(3,) of base [m, m, rad], map frame."""
    covariance: FloatArray
    """(3, 3) of it, as it would be believed."""
    probability: float
    """By all that was seen [0..1]; what is missing to one over all is that it is none of them."""
    fits: int
    """Things seen of late that fit a reflector there; by contours, percent of the newest scan that lies on walls."""
    by_contours: bool
    """Whether it is one by the contours of the hall."""
    agreed: int
    """Attempts in a row in which it was the only one left."""


def hypotheses_of(moment: SearchMoment) -> tuple[Hypothesis, ...]:
    """Return the hypotheses at a moment of a search, the likeliest first.

    Parameters
    ----------
    moment : see `RunColumns.search`.
    """
    beliefs = [to_belief(gaussian_of(row, moment.track), 0) for row in moment.hypotheses]
    return tuple(
        Hypothesis(
            pose=belief.mean,
            covariance=belief.covariance,
            probability=float(probability),
            fits=int(row[10]),
            agreed=int(row[11]),
            by_contours=moment.by_contours,
        )
        for belief, probability, row in zip(beliefs, probabilities(moment.hypotheses), moment.hypotheses, strict=True)
    )


def _is_alone(ranked: FloatArray, search: Search) -> bool:
    """Whether the first hypothesis is far likelier than all others, and than none."""
    count = len(certain_things(search))
    others = others_beside(ranked[:, 9], float(ranked[0, 12]))
    return others * ODDS <= 1.0 and ranked[0, 10] >= max(FEWEST_FITS, LEAST_SHARE * count)


def others_beside(evidence: FloatArray, none: float) -> float:
    """Return how likely all other hypotheses and none of them are together, beside the first.

    Parameters
    ----------
    evidence : (n,) logarithm of how likely each is, n at least 1.
    none : the same of none of them.
    """
    best = float(evidence[0])
    return float(np.exp(np.minimum(evidence[1:] - best, 0.0)).sum()) + math.exp(min(none - best, 0.0))


def gaussian_of(best: FloatArray, track: PoseGaussian) -> PoseGaussian:
    """Pose and covariance of base by a hypothesis."""
    x, y, theta = base_poses(best[np.newaxis], track)[0].tolist()
    xx, xy, xt, yy, yt, tt = (OPTIMISM * best[3:9]).tolist()
    position, heading = LEAST_SIGMAS[0] ** 2, LEAST_SIGMAS[1] ** 2
    return PoseGaussian(x, y, theta, xx + position, xy, xt, yy + position, yt, tt + heading)


def spread(search: Search, around: SearchMap) -> PoseGaussian:
    """Belief of a vehicle that is not located: the likeliest hypothesis, as wide as all of them together."""
    chances = probabilities(search.told)
    if len(chances) == 0 or chances.sum() < 0.5:
        return around.anywhere
    poses = base_poses(search.told, search.track)
    best = gaussian_of(search.told[0], search.track)
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

"""One cycle of the localizer for a reflex of a goniometer: its own time is reached, its bearing corrects.

Beside `cycle`, which is that of a scan, and called by the same two: live, and by the compiled loop of whole runs. So a
bearing needs no evolution between reflexes: the pose goes along with odometry, and each bearing meets it at its time.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from commission.compiled import compiled, compiled_inline
from commission.geometry.arrays import FloatArray, IntArray
from commission.localization.bearings import (
    ACCEPTED,
    LASTING,
    NIS,
    OFF,
    REFLECTOR,
    REJECTED,
    USE,
    BearingModel,
    correct_by_bearing_alone,
    lasting_part,
    stands_apart,
)
from commission.localization.consider import ConsiderModel, ConstantsRoom, busy_of, cross_of
from commission.localization.consider_columns import carry_to
from commission.localization.cycle import Cycle, TemporaryLook, held_back, supervised, with_temporary
from commission.localization.filter_kinds import is_invariant
from commission.localization.lasting import MET, lasts, remember, with_lasting
from commission.localization.observation import scanner_offset
from commission.localization.odometry import NextOdometry, reach, velocity
from commission.localization.pose_gaussian import PoseGaussian
from commission.localization.rejection import (
    FEWEST_AGAINST,
    MOST_FOR,
    Evidence,
    RejectionRule,
    decayed,
    is_doubtful,
)
from commission.localization.rival_poses import RivalPoses
from commission.localization.setup import FilterModel
from commission.localization.state import Tracking
from commission.localization.zones import ZoneRows, kinds_at


class Reflexes(NamedTuple):
    """Reflexes of a stretch of cycles, for kernels."""

    is_reflex: NDArray[np.bool_]
    """(K,) whether a cycle is a reflex, and no scan."""
    rows: IntArray
    """(K,) reflexes of the stretch before each cycle: the row of one that is a reflex."""
    bearings: FloatArray
    """(n,) see `BearingLog`."""
    entries: IntArray
    """(n,) row of the reflector of each, or NOT_NAMED, NOT_IN_MAP."""
    model: BearingModel
    lasting: FloatArray
    """(N, REMEMBERED) of the reflectors of the map, by their numbers, in and out, see `remember`."""


@compiled
def process_reflex(  # noqa: PLR0917 - a reflex and all that it is looked at with
    state: Tracking,
    stamp_ns: int,
    following: NextOdometry,
    row: int,
    reflexes: Reflexes,
    figures: FloatArray,
    model: FilterModel,
    places: FloatArray,
    zones: ZoneRows,
    room: ConstantsRoom | None,
    temporary: TemporaryLook | None,
    rivals: RivalPoses | None,
) -> Cycle:
    """Process a reflex.

    Parameters
    ----------
    state : after everything before this reflex.
    stamp_ns : of the reflex [ns].
    following : the odometry record at or after the reflex, where it is known.
    row : of the reflex.
    reflexes : bearings, and the goniometer.
    figures : (n, COLUMNS) out, see `bearings`.
    model : of the whole filter.
    places : the map, see `ReflectorIndex`.
    zones : where which kinds correct the pose; bearings do where reflectors do.
    room : covariance of the pose with the considered constants, in and out; None: none is considered.
    temporary : as in `process_scan`; the scan of a reflex has no beams.
    rivals : where the vehicle may stand as well, or None; a bearing alone decides on none of them.

    Notes
    -----
    No formula: `reach`, `correct_by_bearing_alone` and `supervised` in turn.
    """
    prior, motion = reach(state.belief, state.motion, stamp_ns, following, model.odometry)
    carry_to(room, prior, state.pivot)
    belief, twist = prior, velocity(state.motion, following)
    if kinds_at(zones, prior.x, prior.y).reflectors:
        belief = correct_by_bearing_alone(
            belief,
            reflexes.bearings[row],
            reflexes.entries[row],
            places,
            reflexes.model,
            twist,
            model.consider,
            cross_of(room),
            busy_of(room),
            figures[row],
            is_invariant(model.gate.kind),
        )
    belief = with_temporary(prior, belief, temporary, state, motion, following, stamp_ns, model, room)
    use, named = figures[row, USE], reflexes.entries[row] >= 0
    near = 0.0
    if use == ACCEPTED:
        reflexes.lasting[int(figures[row, REFLECTOR]), MET] = stamp_ns * 1e-9
    elif use == REJECTED and named:
        near = 1.0 if figures[row, REFLECTOR] >= 0 else 0.0
    elif use == REJECTED:
        near = share_missing(prior, stamp_ns, places, reflexes)
    evidence = weigh_bearing(state.evidence, stamp_ns, prior, use, near, model)
    evidence = weigh_lasting(evidence, stamp_ns, prior, figures[row], named, reflexes, places, twist, model.consider)
    figures[row, LASTING] = 1.0 if evidence.lasting else 0.0
    pivot = state.pivot if room is None else (belief.x, belief.y)
    after = supervised(state, stamp_ns, belief, motion, evidence, pivot, state.walls, model)
    return Cycle(prior, held_back(rivals, state, after, model))


@compiled_inline
def weigh_lasting(  # noqa: PLR0917 - a reflex and what is known around it
    evidence: Evidence,
    stamp_ns: int,
    prior: PoseGaussian,
    figures: FloatArray,
    named: bool,
    reflexes: Reflexes,
    places: FloatArray,
    twist: tuple[float, float, float],
    considered: ConsiderModel,
) -> Evidence:
    """Remember an accepted bearing, and say whether innovations of some reflector do not average out.

    Parameters
    ----------
    evidence : this reflex included.
    stamp_ns : of the reflex [ns].
    prior : that the bearing was associated at.
    figures : (COLUMNS,) what became of it.
    named : whether it is said which reflector it is of.
    reflexes : what is remembered, in and out, and the goniometer.
    places : the map, see `ReflectorIndex`.
    twist : velocity of base [m/s, m/s, rad/s], in base.
    considered : variances of the constants.

    Notes
    -----
    S = v^2 / NIS, by definition; `remember` and `lasts` in turn.
    """
    model = reflexes.model
    if figures[USE] == ACCEPTED and figures[NIS] > 0.0:
        number = int(figures[REFLECTOR])
        variance, noise = figures[OFF] * figures[OFF] / figures[NIS], model.observation.bearing_variance
        for entry in range(len(places)):
            if int(places[entry, 3]) == number:
                if not (named or stands_apart(prior, entry, places, model, variance)):
                    break
                constant, distance = lasting_part(prior, places[entry], model, twist, considered)
                row = reflexes.lasting[number]
                remember(row, stamp_ns, figures[OFF], variance, noise, constant, distance, model.lasting)
    if not model.lasting.limit > 0.0:
        return evidence
    return with_lasting(evidence, lasts(reflexes.lasting, stamp_ns, evidence.lasting, model.lasting))


@compiled_inline
def share_missing(prior: PoseGaussian, stamp_ns: int, places: FloatArray, reflexes: Reflexes) -> float:
    """Share of the reflectors within reach that no bearing of late was of [0..1].

    Parameters
    ----------
    prior : where the vehicle believes to be.
    stamp_ns : of now [ns].
    places : the map, see `ReflectorIndex`.
    reflexes : the goniometer, and when each reflector was met.

    Notes
    -----
    missing / (missing + met), by definition. A bearing that fits none of the map's is of a thing that the map lacks, or
    of a reflector that is expected elsewhere: the more of those are missing, the likelier.
    """
    model = reflexes.model
    offset_x, offset_y = scanner_offset(prior.theta, model.observation)
    x, y = prior.x + offset_x, prior.y + offset_y
    missing, within = 0.0, 0.0
    for entry in range(len(places)):
        distance = math.hypot(places[entry, 0] - x, places[entry, 1] - y)
        if model.nearest <= distance <= model.farthest:
            within += 1.0
            met = reflexes.lasting[int(places[entry, 3]), MET]
            missing += 1.0 if stamp_ns * 1e-9 - met > model.turns_s or met == 0.0 else 0.0
    return missing / max(within, 1.0)


@compiled_inline
def weigh_bearing(  # noqa: PLR0917 - a reflex and what is known around it
    evidence: Evidence, stamp_ns: int, prior: PoseGaussian, use: float, near: float, model: FilterModel
) -> Evidence:
    """Count what became of a bearing, as `weigh` counts detections.

    Parameters
    ----------
    evidence : before the reflex.
    stamp_ns : of the reflex [ns].
    prior : that the bearing was associated at.
    use : a `BearingUse`.
    near : how much of it is one of a reflector of the map where it is rejected: 1 where it is said which one.
    model : of the whole filter.

    Notes
    -----
    against <- max(against + (rejected - accepted / (1 / 4)) / 3, 0), by definition: a scan that holds three rejected
    detections and at most a quarter as many accepted ones speaks against the pose, so that each rejected bearing counts
    a third of such a scan, and an accepted one takes back what four rejected ones counted. Windows as in
    `decayed`.
    """
    rule: RejectionRule = model.rejection
    accepted, rejected = 1.0 if use == ACCEPTED else 0.0, 1.0 if use == REJECTED else 0.0
    confirmed, against = evidence.confirmed, evidence.against
    against = max(against + (rejected - accepted / MOST_FOR) / FEWEST_AGAINST, 0.0)
    if is_doubtful(prior, rule):
        accepted, confirmed = 0.0, 0.0
    return decayed(evidence, stamp_ns, accepted, rejected, near, confirmed + accepted, against, rule)

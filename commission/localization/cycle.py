"""One cycle of the localizer: the scan's stamp is reached, its detections are associated, corrected and supervised.

The one implementation of the cycle: `Localizer.feed` calls it per record and `whole_run` in a compiled loop, so that
live, replay and simulation agree to the last bit. From a state and a record to the state after it; nothing is kept.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from commission.compiled import compiled_inline
from commission.geometry.arrays import FloatArray, IntArray
from commission.geometry.directions import UnitVector, direction_of
from commission.localization.association import INLIER, NOBODY, Gate
from commission.localization.consider import (
    BLOCKS,
    PER_REFLECTOR,
    Considering,
    ConstantsRoom,
    busy_of,
    considering,
    cross_of,
)
from commission.localization.consider_columns import busy_chunks, put_back, put_block, take_along
from commission.localization.contour import (
    ACCEPTED,
    CONTRADICTED,
    LEARNED_DEPTH,
    LEARNED_INFORMATION,
    MATCHED,
    MATCHED_ANYWHERE,
    POINTS,
    REJECTED,
    ROWS,
    USE,
    WHOLE_POSE,
    ContourModel,
    ContourScan,
    observe_contours,
)
from commission.localization.filter_kinds import correct_by, is_invariant
from commission.localization.joint import NEAREST
from commission.localization.observation import ObservationModel
from commission.localization.odometry import Motion, NextOdometry, OdometryNoise, advance, reach
from commission.localization.pose_gaussian import PoseGaussian
from commission.localization.reflector_index import ReflectorIndex
from commission.localization.rejection import Evidence, count_detections, rejects_the_world, weigh
from commission.localization.rival_poses import RivalPoses
from commission.localization.scan_association import associate_by, prepare, with_mix
from commission.localization.scan_rows import ScanRows
from commission.localization.setup import FilterModel
from commission.localization.several_scans import is_contested, keep_own
from commission.localization.state import Tracking
from commission.localization.supervisor import FAIL, LOST, OPERATIONAL, supervise
from commission.localization.temporary import TemporaryModel, observe_temporary
from commission.localization.temporary_memory import TemporaryMemory
from commission.localization.wall_depth import WallDepth
from commission.localization.zones import ZoneRows, kinds_at

LOST_DRIFT, LOST_TURN = 0.15, 0.08
"""By how much a lost vehicle is taken to be farther off after a second [m], [rad]: a few times what is driven blindly
by the worst wheels that were tried, so that contours find it within seconds, and too little to reach the next room."""


class Cycle(NamedTuple):
    """State after a scan, and the belief just before its detections were used."""

    prior: PoseGaussian
    state: Tracking


@compiled_inline
def process_odometry(  # noqa: PLR0917 - one odometry record, number by number
    state: Tracking, stamp_ns: int, dx: float, dy: float, dtheta: float, noise: OdometryNoise
) -> Tracking:
    """Predict over the motion of an odometry record: `advance`, in the filter's state.

    Parameters
    ----------
    state : before the record.
    stamp_ns : of the record [ns].
    dx, dy, dtheta : its displacement [m, m, rad].
    noise : variances per metre, radian and second.
    """
    belief, motion = advance(state.belief, state.motion, stamp_ns, dx, dy, dtheta, noise)
    return Tracking(
        belief,
        stamp_ns,
        motion,
        state.mode,
        state.evidence,
        state.output,
        state.output_ns,
        stamp_ns,
        state.pivot,
        state.walls,
    )


class ContourLook(NamedTuple):
    """A scan that is matched with the contours of the map."""

    model: ContourModel
    scan: ContourScan
    figures: FloatArray
    """(COLUMNS,) out, see `contour`."""


class TemporaryLook(NamedTuple):
    """A scan in which temporary landmarks are looked for."""

    model: TemporaryModel
    memory: TemporaryMemory
    """Those that are known, written."""
    scan: ContourScan
    figures: FloatArray
    """(COLUMNS,) out, see `temporary`."""


@compiled_inline
def process_scan(  # noqa: PLR0917 - a scan and all that it is looked at with
    state: Tracking,
    stamp_ns: int,
    following: NextOdometry,
    scanner: int,
    rows: ScanRows,
    model: FilterModel,
    observation: ObservationModel,
    index: ReflectorIndex,
    zones: ZoneRows,
    room: ConstantsRoom | None,
    contours: ContourLook | None,
    temporary: TemporaryLook | None,
    rivals: RivalPoses | None,
) -> Cycle:
    """Process the detections of a scan.

    Parameters
    ----------
    state : after everything before this scan.
    stamp_ns : of the scan [ns].
    following : the odometry record at or after the scan, where it is known.
    scanner : index of the scan's scanner.
    rows : the scan's detections, in and out; afterwards, entries are indices into the reflector map.
    model : of the whole filter.
    observation : mounting and noise of the scan's scanner.
    index : the map.
    zones : where which kinds correct the pose.
    room : covariance of the pose with the considered constants, in and out; None: none is considered.
    contours : the scan as they are matched with it; None: they are not looked at.
    temporary : the scan as temporary landmarks are looked for in it; None: they are not.
    rivals : where the vehicle may stand as well, in and out; None: scans are decided on one by one.

    Notes
    -----
    No formula: `reach`, `associate`, `correct` and `supervise` in turn: Sobreira et al. 2016, Algorithms 1, 3 and 4;
    then the rule by rejections, which overrules it. Contours come after reflectors, from the freshest state,
    and temporary landmarks after both.
    """
    prior, motion = reach(state.belief, state.motion, stamp_ns, following, model.odometry)
    given = considering(room, prior, state.pivot, state.motion, following, model.consider)
    facing = direction_of(prior.theta)
    here = kinds_at(zones, prior.x, prior.y)
    prepare(rows, observation, given, len(index.places), scanner)
    prior, facing, given, mix = associate_by(
        rivals, here.reflectors, prior, facing, rows, observation, model.gate, index, given, scanner
    )
    posterior = corrected(here.reflectors, prior, facing, rows, observation, model.gate, index.places, given, scanner)
    posterior = with_mix(rivals, posterior, mix)
    if here.contours:
        posterior = with_contours(
            posterior, contours, state, stamp_ns, motion, following, len(index.places), model, room
        )
    posterior = with_temporary(prior, posterior, temporary, state, motion, following, stamp_ns, model, room)
    pivot = state.pivot if room is None else (posterior.x, posterior.y)
    counted = count_detections(prior, rows, observation, index, model.rejection)
    said = said_by_contours(contours)
    for i in range(rows.first, rows.last):
        if rows.entries[i] != NOBODY:
            rows.entries[i] = int(index.places[rows.entries[i], 3])
    evidence = weigh(state.evidence, stamp_ns, prior, counted, said, model.rejection)
    keep_own(rivals, posterior, said == 1.0)
    after = supervised(state, stamp_ns, posterior, motion, evidence, pivot, walls_after(state.walls, contours), model)
    return Cycle(prior, held_back(rivals, state, after, model))


@compiled_inline
def held_back(rivals: RivalPoses | None, before: Tracking, after: Tracking, model: FilterModel) -> Tracking:
    """State after a cycle, not operational where the vehicle may as well stand elsewhere.

    Parameters
    ----------
    rivals : of its pose, after the scan, or None.
    before, after : state before the cycle, and after it otherwise.
    model : of the whole filter.

    Notes
    -----
    No formula: `is_contested`.
    """
    if rivals is None:
        return after
    if after.mode == OPERATIONAL and is_contested(rivals, after.belief, model.limits):
        return with_mode(before, after, FAIL)
    return after


@compiled_inline
def supervised(  # noqa: PLR0917 - what a cycle has found, value by value
    before: Tracking,
    stamp_ns: int,
    posterior: PoseGaussian,
    motion: Motion,
    evidence: Evidence,
    pivot: tuple[float, float],
    walls: WallDepth,
    model: FilterModel,
) -> Tracking:
    """State after a cycle, whatever kind of observation it was.

    Parameters
    ----------
    before : state before it.
    stamp_ns : of the cycle [ns].
    posterior, motion : belief after all corrections, and motion up to the stamp.
    evidence : what was accepted and rejected of late, this cycle included.
    pivot : where `cross` is about [m].
    walls : what is known of them, this cycle included.
    model : of the whole filter.

    Notes
    -----
    No formula: `supervise`, Sobreira et al. 2016, Algorithm 4; then the rules by confirmations, by innovations that do
    not average out, and by rejections, which overrule it.
    """
    was_lost = before.mode == LOST
    mode = supervise(FAIL if was_lost else before.mode, posterior, model.limits)
    if evidence.confirmed < model.rejection.confirmations or evidence.lasting:
        mode = FAIL
    if rejects_the_world(was_lost, evidence, model.rejection):
        mode = LOST
    output, output_ns = before.output, before.output_ns
    if mode == OPERATIONAL:
        output, output_ns = posterior, stamp_ns
    return Tracking(posterior, stamp_ns, motion, mode, evidence, output, output_ns, stamp_ns, pivot, walls)


@compiled_inline
def with_mode(before: Tracking, after: Tracking, mode: int) -> Tracking:
    """State after a cycle whose mode is another one: what the vehicle is given goes along with it.

    Parameters
    ----------
    before : state before the cycle.
    after : state after it, by another judgement.
    mode : its mode.

    Notes
    -----
    No formula: the belief while it is operational, and the last such one otherwise.
    """
    output = after.belief if mode == OPERATIONAL else before.output
    output_ns = after.belief_ns if mode == OPERATIONAL else before.output_ns
    return Tracking(
        after.belief,
        after.belief_ns,
        after.motion,
        mode,
        after.evidence,
        output,
        output_ns,
        after.newest_ns,
        after.pivot,
        after.walls,
    )


@compiled_inline
def spread_where_lost(belief: PoseGaussian, seconds: float) -> PoseGaussian:
    """Belief of a vehicle that is lost, as wide as it has to be for contours to find it back.

    Parameters
    ----------
    belief : at the stamp of a scan.
    seconds : since the cycle before [s].

    Notes
    -----
    P = P + diag(`LOST_DRIFT`^2, `LOST_DRIFT`^2, `LOST_TURN`^2) dt (derived): contours have rejected the pose, so
    either the odometry is not what its noise says, or the vehicle was carried away. Where the belief stays as narrow as
    it was, the gate never opens again, and a match is looked for nowhere else.
    """
    place, turned = LOST_DRIFT**2 * seconds, LOST_TURN**2 * seconds
    return PoseGaussian(
        belief.x,
        belief.y,
        belief.theta,
        belief.xx + place,
        belief.xy,
        belief.xt,
        belief.yy + place,
        belief.yt,
        belief.tt + turned,
    )


@compiled_inline
def with_contours(  # noqa: PLR0917 - the filter's state around one scan
    belief: PoseGaussian,
    look: ContourLook | None,
    before: Tracking,
    stamp_ns: int,
    motion: Motion,
    following: NextOdometry,
    reflectors: int,
    model: FilterModel,
    room: ConstantsRoom | None,
) -> PoseGaussian:
    """Correct a belief by the contours of a scan, where they are looked at.

    Parameters
    ----------
    belief : after the reflectors of the scan.
    look : the scan; None: they are not looked at.
    before : state before the scan.
    stamp_ns : of the scan [ns].
    motion, following : odometry before the scan and after it.
    reflectors : N of the reflector map.
    model : of the whole filter.
    room : covariance with the constants, about `belief`, or None.

    Notes
    -----
    No formula: `observe_contours`, and before it `spread_where_lost`.
    """
    if look is None:
        return belief
    if before.mode == LOST:
        belief = spread_where_lost(belief, 1e-9 * (stamp_ns - before.evidence.stamp_ns))
    dx, dy = belief.x - before.pivot[0], belief.y - before.pivot[1]
    moved = math.sqrt(dx * dx + dy * dy)
    return observe_contours(
        belief,
        look.scan,
        look.model,
        motion,
        following,
        moved,
        before.walls,
        reflectors,
        model.consider,
        cross_of(room),
        busy_of(room),
        look.figures,
        is_invariant(model.gate.kind),
        before.mode == LOST,
    )


@compiled_inline
def with_temporary(  # noqa: PLR0917 - the filter's state around one scan
    prior: PoseGaussian,
    belief: PoseGaussian,
    look: TemporaryLook | None,
    before: Tracking,
    motion: Motion,
    following: NextOdometry,
    stamp_ns: int,
    model: FilterModel,
    room: ConstantsRoom | None,
) -> PoseGaussian:
    """Correct a belief by the temporary landmarks of a scan, where they are looked at.

    Parameters
    ----------
    prior : belief after *predict*.
    belief : after reflectors and contours.
    look : the scan; None: they are not looked at.
    before : state before the scan.
    motion, following : odometry before the scan and after it.
    stamp_ns : of the scan [ns].
    model : of the whole filter.
    room : covariance with the constants, about `belief`, or None.

    Notes
    -----
    No formula: `observe_temporary`.
    """
    if look is None:
        return belief
    was_lost, invariant = before.mode == LOST, is_invariant(model.gate.kind)
    return observe_temporary(
        prior,
        belief,
        was_lost,
        look.model,
        look.memory,
        look.scan,
        motion,
        following,
        stamp_ns,
        invariant,
        cross_of(room),
        busy_of(room),
        look.figures,
    )


@compiled_inline
def said_by_contours(look: ContourLook | None) -> float:
    """What the contours of a scan say of the pose: 1 for it, 0.5 for a part of it, -1 against it, 0 nothing.

    Parameters
    ----------
    look : the scan, after it was looked at, or None.

    Notes
    -----
    No formula: accepted, or rejected or contradicted. In a corridor they tell two of place and heading, which fit
    everywhere along it; where they do not fit, the pose is wrong for all that. Of a scan of which less than half lies
    on contours some pose would be accepted anywhere: it speaks for none.
    """
    if look is None:
        return 0.0
    use = look.figures[USE]
    if use == ACCEPTED:
        if look.figures[MATCHED] < MATCHED_ANYWHERE * look.figures[POINTS]:
            return 0.0
        return 1.0 if look.figures[ROWS] == WHOLE_POSE else 0.5
    return -1.0 if use in (REJECTED, CONTRADICTED) else 0.0


def constants_room(cross: FloatArray | None, detections: int) -> ConstantsRoom | None:
    """Return the room for scans of up to as many detections; None where no constants are considered."""
    if cross is None:
        return None
    work = np.empty((3, BLOCKS + PER_REFLECTOR * max(detections, 1)))
    return ConstantsRoom(cross, work, busy_chunks(cross))


@compiled_inline
def corrected(  # noqa: PLR0917 - a scan at a belief
    corrects: bool,
    prior: PoseGaussian,
    facing: UnitVector,
    rows: ScanRows,
    observation: ObservationModel,
    gate: Gate,
    places: FloatArray,
    given: Considering | None,
    scanner: int,
) -> PoseGaussian:
    """Correct a belief, and its covariance with the considered constants, by all accepted detections of a scan.

    Parameters
    ----------
    corrects : whether reflectors correct the pose here; where not, constants are only carried over the scan.
    prior, facing : after *predict*, and the direction of its heading.
    rows : the scan's detections, associated.
    observation : mounting and noise of the scanner.
    gate : of the association filter, which says of what kind the filter is, and whether two detections may be of one
        reflector.
    places : the map, see `ReflectorIndex`.
    given : of the scan, where constants are considered, else None.
    scanner : index of the scanner.

    Notes
    -----
    No formula: `correct_by` the kind of the filter for each in turn, from the freshest state; constants that the
    scan does not see are carried over it at the end, in one go.
    """
    first, last, measured, aims, status, entries, _ = rows
    last = last if corrects else first
    belief = prior
    if given is None:
        for i in range(first, last):
            if status[i] == INLIER:
                entry, distance = entries[i], measured[i, 0] - observation.range_bias
                aim = UnitVector(aims[i - first, 0], aims[i - first, 1])
                x, y, variance = places[entry, 0], places[entry, 1], places[entry, 2]
                belief, facing = correct_by(
                    gate.kind, belief, facing, distance, aim, x, y, variance, observation, None, 0, 0
                )
        return belief
    width = BLOCKS
    for i in range(first, last):
        if status[i] != INLIER:
            continue
        entry, distance = entries[i], measured[i, 0] - observation.range_bias
        alone = gate.enabled and gate.method != NEAREST
        earlier = i if alone else _earlier(i, first, status, entries)
        if earlier == i:
            at = width
            take_along(given, at, entry)
            width += PER_REFLECTOR
        else:
            at = int(aims[earlier - first, 2])
        aims[i - first, 2] = at
        aim = UnitVector(aims[i - first, 0], aims[i - first, 1])
        x, y, variance = places[entry, 0], places[entry, 1], places[entry, 2]
        belief, facing = correct_by(
            gate.kind, belief, facing, distance, aim, x, y, variance, observation, given, width, at
        )
    put_back(given, len(places), scanner)
    for i in range(first, last):
        if status[i] == INLIER:
            put_block(given, int(aims[i - first, 2]), entries[i])
    return belief


@compiled_inline
def _earlier(i: int, first: int, status: NDArray[np.int8], entries: IntArray) -> int:
    """First accepted detection of the scan of that reflector: without the association filter there may be several.

    Backwards, without a way out of the middle of the loop: that would cost two atomic operations for each array.
    """
    found = i
    for other in range(i - 1, first - 1, -1):
        if status[other] == INLIER and entries[other] == entries[i]:
            found = other
    return found


@compiled_inline
def walls_after(before: WallDepth, look: ContourLook | None) -> WallDepth:
    """What is known of the walls' depth after a scan.

    Parameters
    ----------
    before : what was known.
    look : the scan, after its contours were looked at, or None.

    Notes
    -----
    No formula: an accepted scan has told, see `wall_depth.learned`.
    """
    if look is None:
        return before
    if look.figures[USE] != ACCEPTED:
        return before
    return WallDepth(look.figures[LEARNED_DEPTH], look.figures[LEARNED_INFORMATION])

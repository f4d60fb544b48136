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
from commission.localization.consider import BLOCKS, PER_REFLECTOR, Considering, considering
from commission.localization.consider_columns import busy_chunks, put_back, put_block, take_along
from commission.localization.contour import (
    ACCEPTED,
    CONTRADICTED,
    LEARNED_DEPTH,
    LEARNED_INFORMATION,
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
from commission.localization.rejection import Evidence, rejects_the_world, weigh
from commission.localization.rival_poses import RivalPoses
from commission.localization.scan_association import associate_by, prepare, with_mix
from commission.localization.setup import FilterModel
from commission.localization.several_scans import is_contested, keep_own
from commission.localization.state import FilterState
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
    state: FilterState


@compiled_inline
def process_odometry(  # noqa: PLR0917 - one odometry record, number by number
    state: FilterState, stamp_ns: int, dx: float, dy: float, dtheta: float, noise: OdometryNoise
) -> FilterState:
    """Predict over the motion of an odometry record: `advance`, in the filter's state.

    Parameters
    ----------
    state : before the record.
    stamp_ns : of the record [ns].
    dx, dy, dtheta : its displacement [m, m, rad].
    noise : variances per metre, radian and second.
    """
    belief, motion = advance(state.belief, state.motion, stamp_ns, dx, dy, dtheta, noise)
    return FilterState(
        belief,
        stamp_ns,
        motion,
        state.mode,
        state.evidence,
        state.output,
        state.output_ns,
        stamp_ns,
        state.sensor_detects,
        state.pivot,
        state.cross,
        state.search,
        state.protection,
        state.temporary,
        state.rivals,
        state.lasting,
        state.walls,
    )


@compiled_inline
def process_scan(  # noqa: PLR0917 - outputs are written into the arrays of the whole run
    state: FilterState,
    stamp_ns: int,
    first: int,
    last: int,
    detections: FloatArray,
    model: FilterModel,
    observation: ObservationModel,
    places: FloatArray,
    cell_offsets: IntArray,
    cross: FloatArray | None,
    work: FloatArray | None,
    aims: FloatArray,
    busy: IntArray | None,
    scanner: int,
    status: NDArray[np.int8],
    reflectors: IntArray,
    d2: FloatArray,
    following: NextOdometry,
    contours: ContourModel | None,
    scan: ContourScan | None,
    figures: FloatArray | None,
    zones: ZoneRows,
    temporary: TemporaryModel | None,
    memory: TemporaryMemory | None,
    goods: FloatArray | None,
    rivals: RivalPoses | None,
) -> Cycle:
    """Process the detections of a scan.

    Parameters
    ----------
    state : after everything before this scan.
    stamp_ns : of the scan [ns].
    first, last : rows of the scan's detections, the last one excluded.
    detections : (n, 2) measured range [m] and bearing [rad], scanner frame.
    model : of the whole filter.
    observation : mounting and noise of the scan's scanner.
    places, cell_offsets : the map, see `ReflectorIndex`.
    cross : (3, 2 N + 5 S) in and out: covariance of the pose with the considered constants; None: none is considered.
    work, aims : (3, 8 + 2 n), (n, 3) room for the largest scan, see `room_for_scans`; no work: as `cross`.
    busy : see `busy_chunks`; None: as `cross`.
    scanner : index of the scan's scanner.
    status : (n,) in: INLIER or OUTLIER_DETECTOR; out: a `Status`.
    reflectors : (n,) out: index into the reflector map, or -1.
    d2 : (n,) out: squared Mahalanobis distance at the prior, NaN for none.
    following : the odometry record at or after the scan, where it is known.
    contours, scan : contours of the map, and the scan that is matched with them; None: they are not looked at.
    figures : (COLUMNS,) out, see `contour`; None: as `contours`.
    zones : where which kinds correct the pose.
    temporary, memory : rules of temporary landmarks, and those that are known, written; None: none are looked at.
    goods : (COLUMNS,) out, see `temporary`; None: as `temporary`.
    rivals : where the vehicle may stand as well, in and out; None: scans are decided on one by one.

    Notes
    -----
    No formula: `reach`, `associate`, `correct` and `supervise` in turn: Sobreira et al. 2016, Algorithms 1, 3 and 4;
    then the rule by rejections, which overrules it. Contours come after reflectors, from the freshest state,
    and temporary landmarks after both.
    """
    prior, motion = reach(state.belief, state.motion, stamp_ns, following, model.odometry)
    given = considering(cross, prior, state.pivot, state.motion, following, model.consider)
    facing = direction_of(prior.theta)
    here = kinds_at(zones, prior.x, prior.y)
    prepare(cross, given, work, aims, first, last, detections, observation, len(places), scanner)
    prior, facing, given, mix = associate_by(
        rivals,
        here.reflectors,
        prior,
        facing,
        first,
        last,
        detections,
        aims,
        observation,
        model.gate,
        model.cells,
        places,
        cell_offsets,
        cross,
        given,
        work,
        scanner,
        status,
        reflectors,
        d2,
    )
    posterior = corrected(
        prior,
        facing,
        first,
        last if here.reflectors else first,
        detections,
        aims,
        observation,
        model.gate,
        places,
        cross,
        given,
        work,
        busy,
        scanner,
        status,
        reflectors,
    )
    posterior = with_mix(rivals, posterior, mix)
    if here.contours:
        posterior = with_contours(
            posterior, contours, scan, state, stamp_ns, motion, following, len(places), model, cross, busy, figures
        )
    posterior = with_temporary(
        prior, posterior, temporary, memory, scan, state, motion, following, stamp_ns, model, cross, busy, goods
    )
    pivot = state.pivot if cross is None else (posterior.x, posterior.y)
    for i in range(first, last):
        if reflectors[i] != NOBODY:
            reflectors[i] = int(places[reflectors[i], 3])
    evidence = weigh(
        state.evidence,
        stamp_ns,
        prior,
        first,
        last,
        detections,
        observation,
        model.cells,
        places,
        cell_offsets,
        status,
        said_by_contours(figures),
        model.rejection,
    )
    keep_own(rivals, posterior, said_by_contours(figures) == 1.0)
    after = supervised(state, stamp_ns, posterior, motion, evidence, pivot, walls_after(state.walls, figures), model)
    return Cycle(prior, held_back(rivals, state, after, model))


@compiled_inline
def held_back(rivals: RivalPoses | None, before: FilterState, after: FilterState, model: FilterModel) -> FilterState:
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
    before: FilterState,
    stamp_ns: int,
    posterior: PoseGaussian,
    motion: Motion,
    evidence: Evidence,
    pivot: tuple[float, float],
    walls: WallDepth,
    model: FilterModel,
) -> FilterState:
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
    return FilterState(
        posterior,
        stamp_ns,
        motion,
        mode,
        evidence,
        output,
        output_ns,
        stamp_ns,
        before.sensor_detects,
        pivot,
        before.cross,
        before.search,
        before.protection,
        before.temporary,
        before.rivals,
        before.lasting,
        walls,
    )


@compiled_inline
def with_mode(before: FilterState, after: FilterState, mode: int) -> FilterState:
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
    return FilterState(
        after.belief,
        after.belief_ns,
        after.motion,
        mode,
        after.evidence,
        output,
        output_ns,
        after.newest_ns,
        after.sensor_detects,
        after.pivot,
        after.cross,
        after.search,
        after.protection,
        after.temporary,
        after.rivals,
        after.lasting,
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
    contours: ContourModel | None,
    scan: ContourScan | None,
    before: FilterState,
    stamp_ns: int,
    motion: Motion,
    following: NextOdometry,
    reflectors: int,
    model: FilterModel,
    cross: FloatArray | None,
    busy: IntArray | None,
    figures: FloatArray | None,
) -> PoseGaussian:
    """Correct a belief by the contours of a scan, where they are looked at.

    Parameters
    ----------
    belief : after the reflectors of the scan.
    contours, scan, figures : as in `process_scan`.
    before : state before the scan.
    stamp_ns : of the scan [ns].
    motion, following : odometry before the scan and after it.
    reflectors : N of the reflector map.
    model : of the whole filter.
    cross, busy : covariance with the constants, about `belief`, or None.

    Notes
    -----
    No formula: `observe_contours`, and before it `spread_where_lost`.
    """
    if contours is None or scan is None or figures is None:
        return belief
    if before.mode == LOST:
        belief = spread_where_lost(belief, 1e-9 * (stamp_ns - before.evidence.stamp_ns))
    dx, dy = belief.x - before.pivot[0], belief.y - before.pivot[1]
    moved = math.sqrt(dx * dx + dy * dy)
    return observe_contours(
        belief,
        scan,
        contours,
        motion,
        following,
        moved,
        before.walls,
        reflectors,
        model.consider,
        cross,
        busy,
        figures,
        is_invariant(model.gate.kind),
        before.mode == LOST,
    )


@compiled_inline
def with_temporary(  # noqa: PLR0917 - the filter's state around one scan
    prior: PoseGaussian,
    belief: PoseGaussian,
    temporary: TemporaryModel | None,
    memory: TemporaryMemory | None,
    scan: ContourScan | None,
    before: FilterState,
    motion: Motion,
    following: NextOdometry,
    stamp_ns: int,
    model: FilterModel,
    cross: FloatArray | None,
    busy: IntArray | None,
    goods: FloatArray | None,
) -> PoseGaussian:
    """Correct a belief by the temporary landmarks of a scan, where they are looked at.

    Parameters
    ----------
    prior : belief after *predict*.
    belief : after reflectors and contours.
    temporary, memory, scan, goods : as in `process_scan`.
    before : state before the scan.
    motion, following : odometry before the scan and after it.
    stamp_ns : of the scan [ns].
    model : of the whole filter.
    cross, busy : covariance with the constants, about `belief`, or None.

    Notes
    -----
    No formula: `observe_temporary`.
    """
    if temporary is None or memory is None or scan is None or goods is None:
        return belief
    was_lost, invariant = before.mode == LOST, is_invariant(model.gate.kind)
    return observe_temporary(
        prior,
        belief,
        was_lost,
        temporary,
        memory,
        scan,
        motion,
        following,
        stamp_ns,
        invariant,
        cross,
        busy,
        goods,
    )


@compiled_inline
def said_by_contours(figures: FloatArray | None) -> float:
    """What the contours of a scan say of the pose: 1 for it, 0.5 for a part of it, -1 against it, 0 nothing.

    Parameters
    ----------
    figures : of the scan's contours, or None.

    Notes
    -----
    No formula: accepted, or rejected or contradicted. In a corridor they tell two of place and heading, which fit
    everywhere along it;
    where they do not fit, the pose is wrong for all that.
    """
    if figures is None:
        return 0.0
    if figures[USE] == ACCEPTED:
        return 1.0 if figures[ROWS] == WHOLE_POSE else 0.5
    return -1.0 if figures[USE] == REJECTED or figures[USE] == CONTRADICTED else 0.0


class Room(NamedTuple):
    """What `process_scan` writes to and reads from."""

    aims: FloatArray
    work: FloatArray | None
    busy: IntArray | None


def room_for_scans(cross: FloatArray | None, detections: int) -> Room:
    """Return the room for scans of up to as many detections; work is None where no constants are considered."""
    aims = np.empty((detections, 3))
    if cross is None:
        return Room(aims, None, None)
    return Room(aims, np.empty((3, BLOCKS + PER_REFLECTOR * max(detections, 1))), busy_chunks(cross))


@compiled_inline
def corrected(  # noqa: PLR0917 - the scan's detections and the map, array by array
    prior: PoseGaussian,
    facing: UnitVector,
    first: int,
    last: int,
    detections: FloatArray,
    aims: FloatArray,
    observation: ObservationModel,
    gate: Gate,
    places: FloatArray,
    cross: FloatArray | None,
    given: Considering | None,
    work: FloatArray | None,
    busy: IntArray | None,
    scanner: int,
    status: NDArray[np.int8],
    entries: IntArray,
) -> PoseGaussian:
    """Correct a belief, and its covariance with the considered constants, by all accepted detections of a scan.

    Parameters
    ----------
    prior, facing : after *predict*, and the direction of its heading.
    first, last : rows of the scan's detections, the last one excluded.
    detections : (n, 2) measured range [m] and bearing [rad], scanner frame.
    aims : see `prepare`.
    observation : mounting and noise of the scanner.
    gate : of the association filter, which says of what kind the filter is, and whether two detections may be of one
        reflector.
    places : the map, see `ReflectorIndex`.
    cross : covariance of the pose with the constants, written in place; None: none is considered.
    given, work, busy : of the scan, where constants are considered, else None.
    scanner : index of the scanner.
    status : (n,) a `Status` each.
    entries : (n,) row of `places` of each, or NOBODY.

    Notes
    -----
    No formula: `correct_by` the kind of the filter for each in turn, from the freshest state; constants that the
    scan does not see are carried over it at the end, in one go.
    """
    belief = prior
    if cross is None or given is None or work is None or busy is None:
        for i in range(first, last):
            if status[i] == INLIER:
                entry, distance = entries[i], detections[i, 0] - observation.range_bias
                aim = UnitVector(aims[i - first, 0], aims[i - first, 1])
                x, y, variance = places[entry, 0], places[entry, 1], places[entry, 2]
                belief, facing = correct_by(
                    gate.kind, belief, facing, distance, aim, x, y, variance, observation, None, None, 0, 0
                )
        return belief
    width = BLOCKS
    for i in range(first, last):
        if status[i] != INLIER:
            continue
        entry, distance = entries[i], detections[i, 0] - observation.range_bias
        alone = gate.enabled and gate.method != NEAREST
        earlier = i if alone else _earlier(i, first, status, entries)
        if earlier == i:
            at = width
            take_along(work, at, cross, entry)
            width += PER_REFLECTOR
        else:
            at = int(aims[earlier - first, 2])
        aims[i - first, 2] = at
        aim = UnitVector(aims[i - first, 0], aims[i - first, 1])
        x, y, variance = places[entry, 0], places[entry, 1], places[entry, 2]
        belief, facing = correct_by(
            gate.kind, belief, facing, distance, aim, x, y, variance, observation, given, work, width, at
        )
    put_back(cross, work, len(places), scanner, busy)
    for i in range(first, last):
        if status[i] == INLIER:
            put_block(cross, work, int(aims[i - first, 2]), entries[i], busy)
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
def walls_after(before: WallDepth, figures: FloatArray | None) -> WallDepth:
    """What is known of the walls' depth after a scan.

    Parameters
    ----------
    before : what was known.
    figures : of the scan's contours, or None.

    Notes
    -----
    No formula: an accepted scan has told, see `wall_depth.learned`.
    """
    if figures is None or figures[USE] != ACCEPTED:
        return before
    return WallDepth(figures[LEARNED_DEPTH], figures[LEARNED_INFORMATION])

"""The compiled loop of a whole run over one stretch of cycles, and the columns that it writes.

It knows one setup and one state at its beginning; what lies before and after the stretch is `whole_run`'s.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from commission.compiled import compiled, compiled_inline
from commission.geometry.arrays import FloatArray, IntArray, read_only
from commission.localization.bearing_cycle import Reflexes, process_reflex
from commission.localization.bearings import COLUMNS as BEARING_COLUMNS
from commission.localization.bearings import entries_named
from commission.localization.consider import ConstantsRoom
from commission.localization.contour import COLUMNS as CONTOUR_COLUMNS
from commission.localization.contour import ContourModel, ContourScan
from commission.localization.contour_scans import ContourScans, contour_scan_at, contour_scans
from commission.localization.cross_covariance import columns_of, cross_covariance
from commission.localization.cycle import (
    ContourLook,
    TemporaryLook,
    constants_room,
    process_odometry,
    process_scan,
)
from commission.localization.detection_log import DetectionLog
from commission.localization.lasting import lasting_innovations, mean_rows
from commission.localization.observation import observation_at
from commission.localization.odometry import NOT_YET, NextOdometry, OdometryNoise, waits_until
from commission.localization.pose_gaussian import PoseGaussian
from commission.localization.priors import PriorRows
from commission.localization.protected_cycle import ProtectionRoom, supervised_by_level
from commission.localization.protection_state import bank_of, protection_state
from commission.localization.reflector_index import ReflectorIndex
from commission.localization.relocalization import (
    associate_nothing,
    is_sought,
    searching_odometry,
    sought,
    unlocated,
)
from commission.localization.rival_poses import RivalPoses, kept_poses, poses_of
from commission.localization.run_columns import RunColumns
from commission.localization.scan_rows import ScanRows
from commission.localization.search_map import SearchMap, search_map
from commission.localization.search_state import SearchMoment
from commission.localization.seen_of_late import SeenScan
from commission.localization.setup import FilterModel, LocalizerSetup
from commission.localization.state import FilterState, Tracking
from commission.localization.supervisor import INITIALIZING, LOST
from commission.localization.sweep import bring_to_stamp, sweep_at
from commission.localization.tag_cycle import TagFrames, process_tags
from commission.localization.tag_start import told_by_tags
from commission.localization.tags import COLUMNS as TAG_COLUMNS
from commission.localization.tags import entries_of
from commission.localization.temporary_memory import TemporaryMemory, landmarks_in, memory_of
from commission.localization.temporary_model import COLUMNS as TEMPORARY_COLUMNS
from commission.localization.temporary_model import TemporaryModel
from commission.localization.wheel_scale import as_driven
from commission.localization.zones import ZoneRows
from commission.site.record_log import RecordLog
from commission.site.records import Scan


class Columns(NamedTuple):
    """Where the loop writes: a row per cycle, then a row per detection."""

    means: FloatArray
    covariances: FloatArray
    modes: NDArray[np.int8]
    status: NDArray[np.int8]
    reflectors: IntArray
    d2: FloatArray
    settled: FloatArray
    """(n, 2) detections at the stamp of their scan, upright; (0, 2) where they are what was measured."""
    contours: FloatArray
    """(K, 15) what became of the contours of each cycle, see `contour`; (0, 15) where they are not looked at."""
    tags: FloatArray
    """(m, 6) what became of each sighting of a tag, see `tags`; (0, 6) where they are not looked at."""
    levels: FloatArray
    """(K, 2) protection level of position [m] and heading [rad], NaN where the supervisor does not go by it; (0, 2)
    where it never does."""
    temporary: FloatArray
    """(K, 9) what became of temporary landmarks in each cycle, see `temporary`; (0, 9) where they are not looked at."""
    bearings: FloatArray
    """(b, 4) what became of each reflex, see `bearings`; (0, 4) where they are not looked at."""


def empty_columns(detected: DetectionLog, setups: Sequence[LocalizerSetup]) -> Columns:
    """Columns to be written, the detector's verdict in them.

    Parameters
    ----------
    detected : what was measured.
    setups : all that are used: whether any scanner measures other than at once and upright, and contours are looked at.
    """
    sweeping = any(len(setup.sweep_rows) for setup in setups)
    matching = any(setup.contour is not None for setup in setups)
    looking = any(setup.tag_model is not None for setup in setups)
    turning = any(setup.bearing_model is not None for setup in setups)
    protecting = any(setup.protection is not None for setup in setups)
    remembering = any(setup.temporary is not None for setup in setups)
    cycles, total = len(detected), len(detected.range_bearing)
    return Columns(
        np.empty((cycles, 3)),
        np.empty((cycles, 3, 3)),
        np.empty(cycles, dtype=np.int8),
        detected.status.copy(),
        np.empty(total, dtype=np.int64),
        np.empty(total),
        detected.range_bearing.copy() if sweeping else np.empty((0, 2)),
        np.zeros((cycles if matching else 0, CONTOUR_COLUMNS)),
        np.zeros((len(detected.tags.sightings) if detected.tags is not None and looking else 0, TAG_COLUMNS)),
        np.full((cycles if protecting else 0, 2), np.nan),
        np.zeros((cycles if remembering else 0, TEMPORARY_COLUMNS)),
        np.zeros((len(detected.bearings.bearings) if detected.bearings and turning else 0, BEARING_COLUMNS)),
    )


def cut(columns: Columns, detected: DetectionLog, first: int, last: int) -> Columns:
    """Views of some cycles.

    Parameters
    ----------
    columns : of the whole run.
    detected : says which detections belong to which cycle.
    first, last : cycles, the last one excluded.
    """
    rows = slice(int(detected.offsets[first]), int(detected.offsets[last]))
    tags = columns.tags
    if detected.tags is not None and len(tags):
        tags = tags[int(detected.tags.offsets[first]) : int(detected.tags.offsets[last])]
    bearings = columns.bearings
    if detected.bearings is not None and len(bearings):
        bearings = bearings[detected.bearings.rows_before(first) : detected.bearings.rows_before(last)]
    return Columns(
        columns.means[first:last],
        columns.covariances[first:last],
        columns.modes[first:last],
        columns.status[rows],
        columns.reflectors[rows],
        columns.d2[rows],
        columns.settled[rows] if len(columns.settled) else columns.settled,
        columns.contours[first:last] if len(columns.contours) else columns.contours,
        tags,
        columns.levels[first:last] if len(columns.levels) else columns.levels,
        columns.temporary[first:last] if len(columns.temporary) else columns.temporary,
        bearings,
    )


def take_over(
    earlier: RunColumns, columns: Columns, rows: tuple[int, int], sightings: int = 0, reflexes: int = 0
) -> None:
    """Copy the first cycles of another run.

    Parameters
    ----------
    earlier : what is copied from.
    columns : what is written to.
    rows : how many of cycles, and of detections.
    sightings, reflexes : how many rows of those kinds.
    """
    cycles, detections = rows
    columns.means[:cycles] = earlier.means[:cycles]
    columns.covariances[:cycles] = earlier.covariances[:cycles]
    columns.modes[:cycles] = earlier.modes[:cycles]
    columns.status[:detections] = earlier.status[:detections]
    columns.reflectors[:detections] = earlier.reflector[:detections]
    columns.d2[:detections] = earlier.d2[:detections]
    if len(columns.settled):
        columns.settled[:detections] = earlier.range_bearing[:detections]
    if len(columns.contours) and len(earlier.contours):
        columns.contours[:cycles] = earlier.contours[:cycles]
    if len(columns.temporary) and len(earlier.temporary):
        columns.temporary[:cycles] = earlier.temporary[:cycles]
    if len(columns.tags) and len(earlier.tags):
        columns.tags[:sightings] = earlier.tags[:sightings]
    if len(columns.bearings) and len(earlier.bearings):
        columns.bearings[:reflexes] = earlier.bearings[:reflexes]
    if len(columns.levels) and len(earlier.levels):
        columns.levels[:cycles] = earlier.levels[:cycles]


def odometry_rows(log: RecordLog, stamps_ns: IntArray, first: int, last: int) -> tuple[int, int]:
    """Rows of odometry that are delivered between the cycle before `first` and the last cycle before `last`.

    Parameters
    ----------
    log : all records of the drive.
    stamps_ns : (K,) stamp of each cycle [ns].
    first, last : cycles.
    """
    row, end = (
        int(np.searchsorted(log.odometry_stamps_ns, stamps_ns[cycle - 1], side="right")) if cycle else 0
        for cycle in (first, last)
    )
    return row, end


class CycleStretch(NamedTuple):
    """Cycles to go over, and where they are written."""

    first: int
    """The first of them, in the whole run."""
    rows: tuple[int, int]
    """First row of odometry to be delivered, and the one behind the last."""
    detected: DetectionLog
    """Detections of its scans."""
    columns: Columns
    """Rows of its cycles and detections."""
    priors: PriorRows
    """Where its priors are written."""
    searches: list[SearchMoment] | None = None
    """Where hypotheses are written; None: nowhere."""


def continued(log: RecordLog, setup: LocalizerSetup, state: FilterState, stretch: CycleStretch) -> FilterState:
    """Go on from a state over a stretch, whose cycles are written; return the state after its last record.

    Parameters
    ----------
    log : all records of the drive.
    setup : reflector map, scanner and parameters.
    state : before the stretch.
    stretch : what to go over, and where its cycles are written.
    """
    own, detected = log.detection_stamps_ns, stretch.detected
    done, (row, end), count = 0, stretch.rows, len(detected)
    search: SearchMap | None = None
    while True:
        if state.search is None:
            state, cycles, rows = _tracked(log, setup, state, _part(stretch, (done, count), (row, end)))
        elif done < count:
            search = search or search_map(setup)
            cycles, rows = 1, _until(log, int(detected.stamps_ns[done]), (row, end))
            state = _searched(log, setup, search, state, _part(stretch, (done, done + 1), (row, row + rows)))
        else:
            cycles, rows = 0, end - row
            state = _carried(log, setup, state, (row, end))
        done, row = done + cycles, row + rows
        if is_sought(state, setup.filter.limits) and state.search is None:
            # The scan that told so is the first one of the search.
            search = search or search_map(setup)
            newest = _part(stretch, (done - 1, done), (row, row))
            state = _found(log, setup, search, (state, state), newest, NOT_YET)
        if cycles and state.search is not None and stretch.searches is not None:
            stretch.searches.append(state.search.moment(stretch.first + done - 1))
        if done == count and row == end:
            break
    if len(own) and count and detected.stamps_ns[-1] >= own[0]:
        return state._replace(sensor_detects=True)
    return state


def _part(stretch: CycleStretch, cycles: tuple[int, int], rows: tuple[int, int]) -> CycleStretch:
    """Cut some cycles and some rows of odometry out of a stretch."""
    if cycles == (0, len(stretch.detected)):
        return stretch._replace(rows=rows)
    here = slice(*cycles)
    priors = PriorRows(stretch.priors.means[here], stretch.priors.covariances[here])
    columns, first = cut(stretch.columns, stretch.detected, *cycles), stretch.first + cycles[0]
    return CycleStretch(first, rows, stretch.detected.part(*cycles), columns, priors, stretch.searches)


def _until(log: RecordLog, stamp_ns: int, rows: tuple[int, int]) -> int:
    """Rows of odometry that are delivered before a scan."""
    return int(np.searchsorted(log.odometry_stamps_ns[slice(*rows)], stamp_ns, side="right"))


def _carried(log: RecordLog, setup: LocalizerSetup, state: FilterState, rows: tuple[int, int]) -> FilterState:
    """Take in odometry while a search is on."""
    for row in range(*rows):
        stamp_ns = int(log.odometry_stamps_ns[row])
        state = searching_odometry(state, stamp_ns, _driven(log, setup, row), setup.filter.odometry)
    return state


def _driven(log: RecordLog, setup: LocalizerSetup, row: int) -> tuple[float, float, float]:
    """Displacement of a row of odometry [m, m, rad], with what is known of the wheels."""
    dx, dy, dtheta = as_driven(log.displacements[row : row + 1], setup.parameters.odometry)[0].tolist()
    return dx, dy, dtheta


def _found(  # noqa: PLR0917 - a cycle and what is known around it
    log: RecordLog,
    setup: LocalizerSetup,
    search: SearchMap,
    states: tuple[FilterState, FilterState],
    cycle: CycleStretch,
    following: NextOdometry,
) -> FilterState:
    """Go on searching after a single cycle, from the states before and after it; a tag tells at once."""
    before, after = states
    tags = cycle.detected.tags
    if tags is not None and tags.is_frame[0]:
        told = told_by_tags(states, setup, tags.sightings, tags.ids, cycle.columns.tags)
        if told is not None:
            return told
    return sought(before, after, _seen(log, setup, before, cycle, following), search)


def _seen(
    log: RecordLog, setup: LocalizerSetup, state: FilterState, cycle: CycleStretch, following: NextOdometry
) -> SeenScan:
    """Return what the scan of a single cycle saw."""
    scanner = int(cycle.detected.scanners[0])
    settled, stamp_ns = cycle.columns.settled, int(cycle.detected.stamps_ns[0])
    is_scan = cycle.detected.is_scan
    beamless = is_scan is not None and not is_scan[0]
    return SeenScan(
        stamp_ns=stamp_ns,
        detections=settled if len(settled) else cycle.detected.range_bearing,
        status=cycle.detected.status,
        scanner=scanner,
        observation=setup.observations[scanner],
        ranges=lambda: None if state.sensor_detects or beamless else _scan_at(log, setup, stamp_ns, scanner),
        upside_down=setup.scanners[scanner].upside_down,
        following=following,
    )


def _scan_at(log: RecordLog, setup: LocalizerSetup, stamp_ns: int, scanner: int) -> Scan | None:
    """Return the scan that a cycle is of; None where the sensor has told its detections alone."""
    own = log.detection_stamps_ns
    if len(own) and own[0] <= stamp_ns:
        return None
    indices = setup.indices_of(log.scanners)
    for scans in log.scans:
        if indices[scans.scanner] == scanner:
            row = int(np.searchsorted(scans.stamps_ns, stamp_ns))
            if row < len(scans) and scans.stamps_ns[row] == stamp_ns:
                return scans.scan(row)
    return None


def _searched(
    log: RecordLog, setup: LocalizerSetup, search: SearchMap, state: FilterState, cycle: CycleStretch
) -> FilterState:
    """Go over a single cycle while a search is on; what it has found is written in place of what the filter has."""
    state = _carried(log, setup, state, cycle.rows)
    stamp_ns, row = int(cycle.detected.stamps_ns[0]), cycle.rows[1]
    following = NOT_YET
    if row < len(log.odometry_stamps_ns) and log.odometry_stamps_ns[row] <= waits_until(
        state.tracking.motion, stamp_ns
    ):
        following = NextOdometry(True, int(log.odometry_stamps_ns[row]), *_driven(log, setup, row))
    columns, scanner = cycle.columns, int(cycle.detected.scanners[0])
    if state.tracking.mode == INITIALIZING:
        if len(columns.settled):
            measured, sweep = cycle.detected.range_bearing, sweep_at(setup.sweep_rows, scanner)
            rows = (0, len(measured))
            bring_to_stamp(
                state.tracking.motion, following, *rows, measured, sweep, setup.observations[scanner], columns.settled
            )
        prior, after = unlocated(state, stamp_ns, following, setup.filter.odometry)
        associate_nothing(columns.status, columns.reflectors, columns.d2)
        if setup.protection is not None:
            columns.levels[0] = math.inf
        _write_belief(prior, 0, cycle.priors.means, cycle.priors.covariances)
    else:
        after, _, _ = _tracked(log, setup, state._replace(search=None), cycle._replace(rows=(row, row)))
        if not is_sought(state, setup.filter.limits):
            return after
    state = _found(log, setup, search, (state, after), cycle, following)
    _write_belief(state.tracking.belief, 0, columns.means, columns.covariances)
    columns.modes[0] = state.tracking.mode
    return state


def _tracked(
    log: RecordLog, setup: LocalizerSetup, state: FilterState, stretch: CycleStretch
) -> tuple[FilterState, int, int]:
    """Go over a stretch until the vehicle is lost; return the state, and how many cycles and rows that took."""
    detected, (first, last) = stretch.detected, stretch.rows
    # One row more than is delivered: the last scans may lie between it and the row before.
    rows = slice(first, last + 1)
    cross = columns_of(state.cross, setup.constants)
    bank = bank_of(state.protection, setup.protected_names)
    memory = None if setup.temporary is None else memory_of(state.temporary, setup.temporary.most)
    rivals = poses_of(state.rivals, wanted=setup.decides_over_scans)
    names = tuple(each.id for each in setup.reflectors.reflectors)
    reflexes = _reflexes(setup, detected, mean_rows(state.lasting, names))
    settled = stretch.columns.settled
    most = int(np.diff(detected.offsets).max(initial=0))
    own = log.detection_stamps_ns
    scans = int(np.searchsorted(detected.stamps_ns, own[0])) if len(own) else len(detected)
    scans = 0 if state.sensor_detects else scans
    is_scan = detected.is_scan
    numbers = np.arange(scans) if is_scan is None else np.flatnonzero(is_scan[:scans])
    before = stretch.first - detected.others_before
    tracking, cycles, delivered = _run(
        OdometryRows(
            read_only(log.odometry_stamps_ns[rows]),
            read_only(as_driven(log.displacements[rows], setup.parameters.odometry)),
            last - first,
        ),
        CycleRows(
            detected.stamps_ns,
            detected.offsets,
            detected.range_bearing,
            read_only(settled) if len(settled) else detected.range_bearing,
            detected.scanners,
        ),
        ScannerRows(setup.observation_rows, setup.sweep_rows),
        setup.filter,
        setup.index,
        setup.zone_rows,
        np.empty((most, 3)),
        constants_room(cross, most),
        state.tracking,
        stretch.columns,
        stretch.priors,
        setup.contour,
        None if setup.temporary is None or memory is None else TemporaryRules(setup.temporary, memory),
        contour_scans(log, setup, (before, numbers), len(detected)),
        _frames(setup, detected),
        reflexes,
        None if setup.protection is None or bank is None else ProtectionRoom(setup.protection, bank),
        rivals,
    )
    moved = state._replace(tracking=tracking)
    if len(detected):
        # Odometry alone changes nothing of it, nor does another setup before its first scan.
        moved = moved._replace(
            cross=cross_covariance(cross, setup.constants),
            protection=protection_state(bank, setup.protected_names),
            temporary=state.temporary if memory is None else landmarks_in(memory),
            rivals=kept_poses(rivals),
            lasting=state.lasting if reflexes is None else lasting_innovations(reflexes.lasting, names),
        )
    return moved, cycles, delivered


def _frames(setup: LocalizerSetup, detected: DetectionLog) -> TagFrames | None:
    """Frames of a stretch for the loop; None where tags are not looked at."""
    tags, model = detected.tags, setup.tag_model
    if tags is None or model is None:
        return None
    return TagFrames(tags.is_frame, tags.offsets, tags.sightings, entries_of(tags.ids, setup.tags), model)


def _reflexes(setup: LocalizerSetup, detected: DetectionLog, lasting: FloatArray) -> Reflexes | None:
    """Reflexes of a stretch for the loop; None where bearings are not looked at."""
    met, model = detected.bearings, setup.bearing_model
    if met is None or model is None:
        return None
    entries = entries_named(met.reflectors, setup.reflectors.reflectors, setup.index.places)
    return Reflexes(met.is_reflex, read_only(met.numbers - met.first), met.bearings, entries, model, lasting)


class OdometryRows(NamedTuple):
    """Odometry of a stretch, for the loop."""

    stamps_ns: IntArray
    """(n,) [ns]; the row behind those that are delivered only tells the motion of scans before it."""
    displacements: FloatArray
    """(n, 3) [m, m, rad], with what is known of the wheels."""
    delivered: int
    """Rows that are."""


class CycleRows(NamedTuple):
    """Cycles of a stretch, for the loop."""

    stamps_ns: IntArray
    """(K,) [ns]."""
    offsets: IntArray
    """(K + 1,) detections of cycle k: offsets[k] to offsets[k + 1]."""
    measured: FloatArray
    """(n, 2) range [m] and bearing [rad] of each detection, scanner frame."""
    detections: FloatArray
    """(n, 2) the same at the stamp of the scan: where there are sweeps, a view of the column `settled`, which is
    written before it is read."""
    scanners: IntArray
    """(K,) index of the scanner of each cycle."""


class ScannerRows(NamedTuple):
    """Scanners, for the loop."""

    observations: FloatArray
    """(S, 6) see `observation_rows`."""
    sweeps: FloatArray
    """(S, 4) see `sweep_rows`; (0, 4) where all measure at once and upright."""


class TemporaryRules(NamedTuple):
    """What temporary landmarks are looked for with."""

    model: TemporaryModel
    memory: TemporaryMemory
    """Those that are known, written."""


@compiled
def _run(  # noqa: PLR0917 - a stretch and all that it is looked at with
    odometry: OdometryRows,
    cycles: CycleRows,
    scanners: ScannerRows,
    model: FilterModel,
    index: ReflectorIndex,
    zones: ZoneRows,
    aims: FloatArray,
    room: ConstantsRoom | None,
    state: Tracking,
    columns: Columns,
    priors: PriorRows,
    contours: ContourModel | None,
    temporary: TemporaryRules | None,
    scans: ContourScans | None,
    frames: TagFrames | None,
    reflexes: Reflexes | None,
    protected: ProtectionRoom | None,
    rivals: RivalPoses | None,
) -> tuple[Tracking, int, int]:
    """Deliver odometry and scans in the order of their stamps, odometry first, until the vehicle is lost.

    Returns the state after the last record, and how many scans and rows of odometry were delivered.
    """
    stamps_ns, offsets, measured, detections, numbers = cycles
    observations, sweeps = scanners
    delivered = 0
    for k in range(len(stamps_ns)):
        while delivered < odometry.delivered and odometry.stamps_ns[delivered] <= stamps_ns[k]:
            state = _with_odometry(state, odometry, delivered, model.odometry)
            delivered += 1
        following = _following(odometry, delivered, waits_until(state.motion, stamps_ns[k]))
        observation = observation_at(observations, numbers[k])
        rows = ScanRows(offsets[k], offsets[k + 1], detections, aims, columns.status, columns.reflectors, columns.d2)
        scan = contour_scan_at(scans, k, observations, sweeps)
        looked = temporary_look(temporary, scan, columns.temporary, k)
        if frames is not None and frames.is_frame[k]:
            first, last = frames.offsets[k], frames.offsets[k + 1]
            cycle = process_tags(
                state,
                stamps_ns[k],
                following,
                first,
                last,
                frames,
                columns.tags,
                model,
                zones,
                room,
                looked,
                rivals,
            )
        elif reflexes is not None and reflexes.is_reflex[k]:
            cycle = process_reflex(
                state,
                stamps_ns[k],
                following,
                reflexes.rows[k],
                reflexes,
                columns.bearings,
                model,
                index.places,
                zones,
                room,
                looked,
                rivals,
            )
        else:
            if len(sweeps):
                sweep = sweep_at(sweeps, numbers[k])
                bring_to_stamp(
                    state.motion, following, offsets[k], offsets[k + 1], measured, sweep, observation, columns.settled
                )
            cycle = process_scan(
                state,
                stamps_ns[k],
                following,
                numbers[k],
                rows,
                model,
                observation,
                index,
                zones,
                room,
                contour_look(contours, scan, columns.contours, k),
                looked,
                rivals,
            )
        if protected is not None:
            levels = columns.levels[k]
            state = supervised_by_level(state, cycle, rows, observation, model, protected, levels, zones, rivals)
        else:
            state = cycle.state
        _write_belief(cycle.prior, k, priors.means, priors.covariances)
        _write_belief(state.belief, k, columns.means, columns.covariances)
        columns.modes[k] = state.mode
        if state.mode == LOST and model.limits.find_again:
            return state, k + 1, delivered
    while delivered < odometry.delivered:
        state = _with_odometry(state, odometry, delivered, model.odometry)
        delivered += 1
    return state, len(stamps_ns), delivered


@compiled_inline
def _with_odometry(state: Tracking, odometry: OdometryRows, row: int, noise: OdometryNoise) -> Tracking:
    """State after a row of odometry."""
    moved = odometry.displacements
    return process_odometry(state, odometry.stamps_ns[row], moved[row, 0], moved[row, 1], moved[row, 2], noise)


@compiled_inline
def _following(odometry: OdometryRows, row: int, until_ns: int) -> NextOdometry:
    """A row of odometry as the one that follows a scan, where it comes in time."""
    if row < len(odometry.stamps_ns) and odometry.stamps_ns[row] <= until_ns:
        moved = odometry.displacements
        return NextOdometry(True, odometry.stamps_ns[row], moved[row, 0], moved[row, 1], moved[row, 2])
    return NextOdometry(False, 0, 0.0, 0.0, 0.0)


@compiled_inline
def contour_look(
    model: ContourModel | None, scan: ContourScan | None, figures: FloatArray, cycle: int
) -> ContourLook | None:
    """Scan of a cycle as contours are matched with it, or None where they are not looked at.

    Parameters
    ----------
    model : of the contours, or None.
    scan : of the cycle, or None.
    figures : (K, COLUMNS) of the stretch.
    cycle : in it.

    Notes
    -----
    No formula: it puts together.
    """
    if model is None:
        return None
    if scan is None:
        return None
    return ContourLook(model, scan, figures[cycle])


@compiled_inline
def temporary_look(
    rules: TemporaryRules | None, scan: ContourScan | None, figures: FloatArray, cycle: int
) -> TemporaryLook | None:
    """Scan of a cycle as temporary landmarks are looked for in it, or None where they are not.

    Parameters
    ----------
    rules : what they are looked for with, or None.
    scan, figures, cycle : as in `contour_look`.

    Notes
    -----
    No formula: it puts together.
    """
    if rules is None:
        return None
    if scan is None:
        return None
    return TemporaryLook(rules.model, rules.memory, scan, figures[cycle])


@compiled_inline
def _write_belief(belief: PoseGaussian, row: int, means: FloatArray, covariances: FloatArray) -> None:
    """Write a belief to its row."""
    means[row, 0], means[row, 1], means[row, 2] = belief.x, belief.y, belief.theta
    covariances[row, 0, 0], covariances[row, 0, 1], covariances[row, 0, 2] = belief.xx, belief.xy, belief.xt
    covariances[row, 1, 0], covariances[row, 1, 1], covariances[row, 1, 2] = belief.xy, belief.yy, belief.yt
    covariances[row, 2, 0], covariances[row, 2, 1], covariances[row, 2, 2] = belief.xt, belief.yt, belief.tt

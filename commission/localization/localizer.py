"""The localizer as a vehicle runs it: fed record by record, the only mutable class of this package.

Every step is a kernel that the compiled whole run calls too; nothing is computed here. A scan that lies between two
odometry records waits for the second one, for at most one interval of odometry: its motion is then interpolated.
"""

from __future__ import annotations

import math
from collections import deque

import numpy as np

from commission.errors import SourceError
from commission.geometry.arrays import FloatArray, IntArray, read_only
from commission.localization.bearing_cycle import Reflexes, process_reflex
from commission.localization.bearings import COLUMNS as BEARING_COLUMNS
from commission.localization.bearings import entries_named
from commission.localization.contour import COLUMNS, ContourScan
from commission.localization.contour_scans import contour_scan
from commission.localization.cross_covariance import columns_of, cross_covariance
from commission.localization.cycle import (
    ContourLook,
    Cycle,
    TemporaryLook,
    constants_room,
    process_odometry,
    process_scan,
)
from commission.localization.detector import DetectedReflectors, detect, room_for, status_of_reported
from commission.localization.estimate import Belief, Estimate, Mode, SeenBearing, SeenTags
from commission.localization.lasting import lasting_innovations, mean_rows
from commission.localization.observation import project_detections
from commission.localization.odometry import NOT_YET, NextOdometry, waits_until
from commission.localization.pose_gaussian import PoseGaussian, to_belief
from commission.localization.protected_cycle import ProtectionRoom, supervised_by_level
from commission.localization.protection_state import bank_of, protection_state
from commission.localization.relocalization import (
    associate_nothing,
    forgotten,
    is_sought,
    searching_odometry,
    sought,
    unlocated,
)
from commission.localization.rival_poses import RivalPoses, kept_poses, poses_of
from commission.localization.scan_rows import ScanRows
from commission.localization.search_map import SearchMap, search_map
from commission.localization.seen_of_late import SeenScan
from commission.localization.setup import LocalizerSetup
from commission.localization.state import FilterState, Tracking, belief_of, output_of, state_at_start
from commission.localization.sweep import Sweep, bring_to_stamp
from commission.localization.tag_cycle import TagFrames, process_tags
from commission.localization.tag_start import told_by_tags
from commission.localization.tags import COLUMNS as TAG_COLUMNS
from commission.localization.tags import entries_of
from commission.localization.temporary_memory import TemporaryMemory, landmarks_in, memory_of
from commission.localization.temporary_model import COLUMNS as TEMPORARY_COLUMNS
from commission.localization.wheel_scale import as_driven
from commission.site.parameters import OdometryParameters, Parameters
from commission.site.records import Detections, Odometry, Record, ReferencePose, Reflex, Scan, TagSightings
from commission.site.reflectors import Reflector, ReflectorMap
from commission.site.scanner import Scanner

NOTHING_DETECTED = DetectedReflectors(*room_for(0))
"""What a frame with tags has of reflectors."""
LAST_NS = 2**63 - 1
"""No record is newer [ns]."""


WARM_UP_NS, WARM_UP_SCANS = 1_000_000_000, 25
"""Time of the search that compiles its kernels [ns], and scans in it."""


def warm_up() -> None:
    """Compile every kernel that a live localizer needs, by feeding it one record of each kind."""
    sweeping = Scanner(sweep_duration=0.01)
    setup = LocalizerSetup(
        reflectors=ReflectorMap((Reflector(id="A", x=2.0, y=0.0),)), scanners=(sweeping,), parameters=Parameters()
    )
    localizer = Localizer(setup, Belief(0, np.zeros(3), 1e-4 * np.eye(3)))
    localizer.feed(Odometry(0, np.zeros(3)))
    localizer.feed(Odometry(1, np.zeros(3)))
    flags = np.array([False, False, True, False])
    localizer.feed(
        Scan(
            stamp_ns=2,
            ranges=np.full(4, 1.96, dtype=np.float32),
            angle_min=-0.02,
            angle_increment=0.01,
            intensities=None,
            reflector=flags,
        )
    )
    localizer.feed(Detections(3, np.array([[2.0, 0.0]])))
    localizer.flush()
    _warm_up_search()
    as_driven(np.zeros((1, 3)), OdometryParameters(forward_scale=0.01))


def _warm_up_search() -> None:
    """Compile what looks for a vehicle that is lost: else the scan with which it is lost waits for that."""
    places = np.array([[2.0, 0.0], [3.0, 1.5], [1.0, -2.0], [-1.5, 1.0]])
    reflectors = ReflectorMap(tuple(Reflector(id=f"R{i}", x=x, y=y) for i, (x, y) in enumerate(places.tolist())))
    setup = LocalizerSetup(reflectors=reflectors, scanners=(Scanner(),), parameters=Parameters())
    localizer = Localizer(setup, Belief(0, np.zeros(3), 1e-4 * np.eye(3)))
    localizer.locate()
    seen = np.column_stack((np.hypot(*places.T), np.arctan2(places[:, 1], places[:, 0])))
    for stamp_ns in range(0, WARM_UP_NS, WARM_UP_NS // WARM_UP_SCANS):
        localizer.feed(Odometry(stamp_ns, np.array([0.001, 0.0, 0.0])))
        localizer.feed(Detections(stamp_ns, seen))
    localizer.flush()


class Localizer:
    """Tracks the pose of a vehicle from its odometry and the reflectors it sees.

    Parameters
    ----------
    setup : reflector map, scanner and parameters; `replace_setup` changes them between two records.
    start : belief before the first record, or the state in which another run was left.
    """

    def __init__(self, setup: LocalizerSetup, start: Belief | FilterState) -> None:
        self._setup = setup
        self._state = state_at_start(start) if isinstance(start, Belief) else start
        self._newest_ns = self._horizon_ns = self._state.tracking.newest_ns
        self._waiting: deque[Record] = deque()
        self._map: SearchMap | None = None

    @property
    def setup(self) -> LocalizerSetup:
        """What the next record is processed with."""
        return self._setup

    @property
    def state(self) -> FilterState:
        """All that is remembered of the records so far: a run goes on from it as if it had not been interrupted.

        Records that are `waiting` are not in it.
        """
        return self._state

    @property
    def waiting(self) -> tuple[Record, ...]:
        """Records that have been taken in and not been processed: a scan that waits for odometry, and what follows."""
        return tuple(self._waiting)

    @property
    def belief(self) -> Belief:
        """The filter's own belief after the newest record that does not wait; it goes on in fail mode."""
        return belief_of(self._state)

    @property
    def mode(self) -> Mode:
        """State of the supervisor after the newest scan."""
        return Mode(self._state.tracking.mode)

    def replace_setup(self, setup: LocalizerSetup) -> None:
        """Use other parameters (or another map) for what is processed from now on; the state stays."""
        self._setup, self._map = setup, None

    def locate(self) -> None:
        """Throw the pose away: from the next scan on the vehicle looks where it is."""
        self._state = forgotten(self._state, self._setup)

    def feed(self, record: Record) -> tuple[Estimate, ...]:
        """Take in one record, and process what can be processed now: `push`, then every `pull`.

        Parameters
        ----------
        record : its stamp is not before that of any record so far.

        Returns
        -------
        estimates : one for each scan, and for each set of detections of the sensor itself, that has been processed; of
            a sensor that has ever sent detections of its own, scans give none: its detections win. A reference pose is
            never used.

        Raises
        ------
        SourceError
            when the record is older than one before it.
        """
        self.push(record)
        return tuple(iter(self.pull, None))

    def push(self, record: Record) -> None:
        """Take in one record without processing it; raises SourceError when it is older than one before it."""
        if record.stamp_ns < self._newest_ns:
            raise SourceError(
                f"{type(record).__name__} has stamp {record.stamp_ns} ns, {self._newest_ns - record.stamp_ns} ns "
                "before the record that came before it; expected ascending stamps"
            )
        self._newest_ns = self._horizon_ns = int(record.stamp_ns)
        self._waiting.append(record)

    def pull(self) -> Estimate | None:
        """Process records up to the next scan and return its estimate; None when there is none, or it has to wait."""
        while self._waiting:
            record, following = self._waiting[0], NOT_YET
            if isinstance(record, Scan | Detections | TagSightings | Reflex):
                found = self._following(record.stamp_ns)
                if found is None:
                    return None
                following = found
            self._waiting.popleft()
            estimate = self._taken_in(record, following)
            if estimate is not None:
                return estimate
        return None

    def flush(self) -> tuple[Estimate, ...]:
        """Process everything that waits, since no more records come; returns the estimates of its scans."""
        self.release()
        return tuple(iter(self.pull, None))

    def release(self) -> None:
        """Let nothing that has been pushed wait any longer: every `pull` processes more of it."""
        self._horizon_ns = LAST_NS

    def _following(self, stamp_ns: int) -> NextOdometry | None:
        """Odometry that follows the first scan that waits; None while it may still come in time."""
        until_ns = waits_until(self._state.tracking.motion, stamp_ns)
        for record in self._waiting:
            if isinstance(record, Odometry):
                if record.stamp_ns > until_ns:
                    return NOT_YET
                dx, dy, dtheta = self._driven(record)
                return NextOdometry(True, int(record.stamp_ns), dx, dy, dtheta)
        return NOT_YET if until_ns == stamp_ns or self._horizon_ns > until_ns else None

    def _taken_in(self, record: Record, following: NextOdometry) -> Estimate | None:
        """Process one record."""
        tracking = self._state.tracking._replace(newest_ns=int(record.stamp_ns))
        self._state = self._state._replace(tracking=tracking)
        match record:
            case Odometry():
                self._advance(record)
                return None
            case ReferencePose():
                return None
            case Detections():
                self._state = self._state._replace(sensor_detects=True)
                count = len(record.range_bearing)
                blind = self._setup.scanners[record.scanner].reported_blind_sectors
                status, unknown = status_of_reported(record.range_bearing, blind), np.full(count, np.nan)
                seen = DetectedReflectors(record.range_bearing, np.zeros(count, dtype=np.int64), unknown, status)
                return self._process(record, seen, following)
            case TagSightings() | Reflex():
                return self._process(record, NOTHING_DETECTED, following)
            case Scan():
                if self._state.sensor_detects:
                    return None
                model = self._setup.detectors[record.scanner]
                blind = self._setup.scanners[record.scanner].reported_blind_sectors
                detected = detect(record, model, self._setup.parameters.detector, blind)
                return self._process(record, detected, following)

    def _driven(self, record: Odometry) -> tuple[float, float, float]:
        """Displacement of an odometry record [m, m, rad], with what is known of the wheels."""
        driven = as_driven(record.displacement[np.newaxis], self._setup.parameters.odometry)
        dx, dy, dtheta = driven[0].tolist()
        return dx, dy, dtheta

    def _advance(self, record: Odometry) -> None:
        """Predict over the motion of an odometry record."""
        dx, dy, dtheta = self._driven(record)
        noise = self._setup.filter.odometry
        state = self._state
        if state.search is not None:
            self._state = searching_odometry(state, record.stamp_ns, (dx, dy, dtheta), noise)
            return
        moved = process_odometry(state.tracking, record.stamp_ns, dx, dy, dtheta, noise)
        self._state = state._replace(tracking=moved)

    def _at_stamp(self, scanner: int, measured: FloatArray, following: NextOdometry) -> FloatArray:
        """Return the detections of a scan at its stamp, upright: what was measured, where there is no other."""
        setup, sweeps = self._setup, self._setup.sweep_rows
        if not len(sweeps):
            return measured
        settled, sweep, model = np.empty(measured.shape), Sweep(*sweeps[scanner].tolist()), setup.observations[scanner]
        bring_to_stamp(self._state.tracking.motion, following, 0, len(measured), measured, sweep, model, settled)
        return read_only(settled)

    def _process(
        self, scan: Scan | Detections | TagSightings | Reflex, seen: DetectedReflectors, following: NextOdometry
    ) -> Estimate:
        """Predict to the scan's stamp, associate, correct, supervise."""
        stamp_ns, before = scan.stamp_ns, self._state
        scanner = 0 if isinstance(scan, TagSightings | Reflex) else scan.scanner
        measured = read_only(seen.range_bearing)
        detections = self._at_stamp(scanner, measured, following)
        count = len(detections)
        status = seen.status.copy()
        reflector: IntArray = np.empty(count, dtype=np.int64)
        d2 = np.empty(count)
        rows = ScanRows(0, count, read_only(detections), np.empty((count, 3)), status, reflector, d2)
        figures = None if self._setup.contour is None else np.zeros(COLUMNS)
        goods = None if self._setup.temporary is None else np.zeros(TEMPORARY_COLUMNS)
        tags, met = self._seen_tags(scan), self._seen_bearing(scan)
        levels = None if self._setup.protection is None else np.full(2, math.inf)
        is_located = before.tracking.mode != Mode.INITIALIZING
        if not is_located:
            associate_nothing(status, reflector, d2)
            prior, after = unlocated(before, stamp_ns, following, self._setup.filter.odometry)
        elif isinstance(scan, TagSightings) and tags is not None and tags.figures is not None:
            prior, after = self._tagged(scan, following, tags.figures, goods)
        elif isinstance(scan, Reflex) and met is not None and met.figures is not None:
            prior, after = self._met(scan, following, met.figures, goods)
        else:
            prior, after = self._filtered(scan, rows, following, figures, goods)
        if levels is not None and is_located:
            after = self._by_level(before, prior, after, scanner, rows, levels)
        self._state = after
        if not is_sought(before, self._setup.filter.limits):
            self._state = after._replace(search=None)
        if is_sought(before, self._setup.filter.limits) or is_sought(self._state, self._setup.filter.limits):
            scan_seen = SeenScan(
                stamp_ns=stamp_ns,
                detections=detections,
                status=seen.status,
                scanner=scanner,
                observation=self._setup.observations[scanner],
                ranges=lambda: scan if isinstance(scan, Scan) else None,
                upside_down=self._setup.scanners[scanner].upside_down,
                following=following,
            )
            self._state = self._sought(before, after, scan_seen, tags)
        posterior = belief_of(self._state)
        offsets = np.array((0, count), dtype=np.int64)
        scanners = np.array((scanner,), dtype=np.int64)
        points = project_detections(
            posterior.mean[np.newaxis], offsets, detections, self._setup.observation_rows, scanners=scanners
        )
        return Estimate(
            stamp_ns=stamp_ns,
            prior=to_belief(prior, stamp_ns),
            posterior=posterior,
            output=output_of(self._state),
            mode=self.mode,
            detections=detections,
            measured=measured,
            beams=seen.beams,
            expected_beams=seen.expected,
            points_map=points,
            status=status,
            reflector=reflector,
            d2=d2,
            gate=self._setup.filter.gate.d2,
            scanner=scanner,
            contours=figures if tags is None and met is None else None,
            temporary=goods,
            tags=tags,
            bearing=met,
            levels=levels,
        )

    def _by_level(  # noqa: PLR0917 - a cycle and what became of it
        self,
        before: FilterState,
        prior: PoseGaussian,
        after: FilterState,
        scanner: int,
        rows: ScanRows,
        levels: FloatArray,
    ) -> FilterState:
        """Let the supervisor go by the protection level, which is written."""
        setup = self._setup
        bank = bank_of(before.protection, setup.protected_names)
        if setup.protection is None or bank is None:
            raise ValueError("protection levels are asked for where the supervisor goes by 2-sigma")
        tracking = supervised_by_level(
            before.tracking,
            Cycle(prior, after.tracking),
            rows,
            setup.observations[scanner],
            setup.filter,
            ProtectionRoom(setup.protection, bank),
            levels,
            setup.zone_rows,
            poses_of(after.rivals, wanted=setup.decides_over_scans),
        )
        return after._replace(tracking=tracking, protection=protection_state(bank, setup.protected_names))

    def _seen_bearing(self, record: Scan | Detections | TagSightings | Reflex) -> SeenBearing | None:
        """What a reflex told, with room for what becomes of it where bearings are looked at; None of a scan."""
        if not isinstance(record, Reflex):
            return None
        figures = None if self._setup.bearing_model is None else np.zeros(BEARING_COLUMNS)
        return SeenBearing(record.bearing, record.reflector, figures)

    def _met(
        self, reflex: Reflex, following: NextOdometry, figures: FloatArray, goods: FloatArray | None
    ) -> tuple[PoseGaussian, FilterState]:
        """Let the filter process a reflex; what becomes of it is written."""
        setup, memory, rivals = self._setup, self._memory(), self._rivals()
        cross = columns_of(self._state.cross, setup.constants)
        if setup.bearing_model is None:
            raise ValueError("a reflex is processed where none are looked at; expected a goniometer in the setup")
        names = tuple(each.id for each in setup.reflectors.reflectors)
        reflexes = Reflexes(
            read_only(np.ones(1, np.bool_)),
            read_only(np.zeros(1, np.int64)),
            read_only(np.array((reflex.bearing,))),
            entries_named((reflex.reflector,), setup.reflectors.reflectors, setup.index.places),
            setup.bearing_model,
            mean_rows(self._state.lasting, names),
        )
        cycle = process_reflex(
            self._state.tracking,
            reflex.stamp_ns,
            following,
            0,
            reflexes,
            figures[np.newaxis],
            setup.filter,
            setup.index.places,
            setup.zone_rows,
            constants_room(cross, 0),
            self._temporary_look(contour_scan(setup, None, 0), memory, goods),
            rivals,
        )
        after = self._with_arrays(cycle.state, cross, memory, rivals)
        return cycle.prior, after._replace(lasting=lasting_innovations(reflexes.lasting, names))

    def _seen_tags(self, record: Scan | Detections | TagSightings | Reflex) -> SeenTags | None:
        """What a frame saw of tags, with room for what becomes of it where they are looked at; None of a scan."""
        if not isinstance(record, TagSightings):
            return None
        figures = None if self._setup.tag_model is None else np.zeros((len(record.ids), TAG_COLUMNS))
        return SeenTags(record.sightings, record.ids, figures)

    def _sought(self, before: FilterState, after: FilterState, scan: SeenScan, tags: SeenTags | None) -> FilterState:
        """Go on searching after a scan or a frame; a tag tells at once."""
        if tags is not None and tags.figures is not None:
            ids = np.array(tags.ids, dtype=np.str_)
            told = told_by_tags((before, after), self._setup, tags.sightings, ids, tags.figures)
            if told is not None:
                return told
        if self._map is None:
            self._map = search_map(self._setup)
        return sought(before, after, scan, self._map)

    def _tagged(
        self, frame: TagSightings, following: NextOdometry, figures: FloatArray, goods: FloatArray | None
    ) -> tuple[PoseGaussian, FilterState]:
        """Let the filter process a frame with tags; what becomes of them is written."""
        setup, constants, count = self._setup, self._setup.constants, len(frame.ids)
        cross = columns_of(self._state.cross, constants)
        entries = entries_of(np.array(frame.ids, dtype=np.str_), setup.tags)
        offsets = np.array((0, count), dtype=np.int64)
        memory, rivals = self._memory(), self._rivals()
        if setup.tag_model is None:
            raise ValueError("a frame with tags is processed where none are looked at; expected tags in the setup")
        cycle = process_tags(
            self._state.tracking,
            frame.stamp_ns,
            following,
            0,
            count,
            TagFrames(read_only(np.ones(1, np.bool_)), read_only(offsets), frame.sightings, entries, setup.tag_model),
            figures,
            setup.filter,
            setup.zone_rows,
            constants_room(cross, 0),
            self._temporary_look(contour_scan(setup, None, 0), memory, goods),
            rivals,
        )
        return cycle.prior, self._with_arrays(cycle.state, cross, memory, rivals)

    def _memory(self) -> TemporaryMemory | None:
        """Temporary landmarks as arrays to be written; None where they are not looked at."""
        rules = self._setup.temporary
        return None if rules is None else memory_of(self._state.temporary, rules.most)

    def _rivals(self) -> RivalPoses | None:
        """Rivals of the pose as arrays to be written; None where scans are decided on one by one."""
        return poses_of(self._state.rivals, wanted=self._setup.decides_over_scans)

    def _with_arrays(
        self,
        tracking: Tracking,
        cross: FloatArray | None,
        memory: TemporaryMemory | None,
        rivals: RivalPoses | None,
    ) -> FilterState:
        """Put what a cycle has left, also in its arrays, into the state."""
        return self._state._replace(
            tracking=tracking,
            cross=cross_covariance(cross, self._setup.constants),
            protection=None,
            temporary=self._state.temporary if memory is None else landmarks_in(memory),
            rivals=kept_poses(rivals),
        )

    def _contour_look(self, scan: ContourScan | None, figures: FloatArray | None) -> ContourLook | None:
        """A scan as contours are matched with it; None where they are not looked at."""
        model = self._setup.contour
        return None if model is None or scan is None or figures is None else ContourLook(model, scan, figures)

    def _temporary_look(
        self, scan: ContourScan | None, memory: TemporaryMemory | None, figures: FloatArray | None
    ) -> TemporaryLook | None:
        """A scan as temporary landmarks are looked for in it; None where they are not."""
        model = self._setup.temporary
        if model is None or memory is None or scan is None or figures is None:
            return None
        return TemporaryLook(model, memory, scan, figures)

    def _filtered(
        self,
        record: Scan | Detections | TagSightings | Reflex,
        rows: ScanRows,
        following: NextOdometry,
        figures: FloatArray | None,
        goods: FloatArray | None,
    ) -> tuple[PoseGaussian, FilterState]:
        """Let the filter process a scan; what becomes of its detections, contours and goods is written."""
        setup = self._setup
        scanner = 0 if isinstance(record, TagSightings | Reflex) else record.scanner
        cross = columns_of(self._state.cross, setup.constants)
        memory, rivals = self._memory(), self._rivals()
        scan = contour_scan(setup, record if isinstance(record, Scan) else None, scanner)
        cycle = process_scan(
            self._state.tracking,
            record.stamp_ns,
            following,
            scanner,
            rows,
            setup.filter,
            setup.observations[scanner],
            setup.index,
            setup.zone_rows,
            constants_room(cross, rows.last),
            self._contour_look(scan, figures),
            self._temporary_look(scan, memory, goods),
            rivals,
        )
        return cycle.prior, self._with_arrays(cycle.state, cross, memory, rivals)

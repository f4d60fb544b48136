"""One scan as its sensor saw it: intensity over bearing, what the detector made of it, and beams against expectation.

Numbers for whoever chooses the threshold and looks for shiny things; nothing is drawn in here.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from commission.geometry.arrays import BoolArray, FloatArray, IntArray
from commission.localization.detector import passing_widths, reflective_beams, threshold_at, without_blind
from commission.localization.estimate import Status
from commission.localization.observation import range_bearing
from commission.localization.run_columns import RunColumns
from commission.localization.setup import LocalizerSetup
from commission.planning.visibility import faces
from commission.site.record_log import RecordLog
from commission.site.records import Scan
from commission.studies.inputs import StudyInput

CURVE = 60
"""Ranges at which the window of beams is told."""
MOST_CLUSTERS = 1_500
"""Clusters of the drive so far that are held against it: of more, every second, third, ... one."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class SensorInput(StudyInput):
    """What the study may read."""

    log: RecordLog
    """The records."""
    columns: RunColumns
    """The run over them."""
    setup: LocalizerSetup
    """What is set now: its threshold is the one that is drawn."""
    stamp_ns: int
    """The newest scan up to here is looked at [ns]."""
    scanner: int = 0
    """Which scanner: index in the setup."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class SeenCluster:
    """What the localizer took for one body in this scan."""

    range: float
    """To its center [m]."""
    bearing: float
    """Of its center [rad], as the scanner reports it."""
    beams: int
    """Its width [beams]; 0: the sensor itself detected."""
    window: tuple[int, int] | None
    """Fewest and most beams with which it would pass as a reflector of the map; None: the map has none."""
    status: Status
    """What became of it."""
    reflector: str
    """Id of the reflector that it is taken for; empty: none."""
    peak: float
    """Largest intensity of its beams [sensor's unit]; NaN where there are none."""
    place: tuple[float, float]
    """Where it stands by the belief after the scan [m], map frame."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class SensorView:
    """A scan under the glass."""

    scan: Scan
    """As it came."""
    name: str
    """The scanner's."""
    time: float
    """After the start of the drive [s]."""
    thresholds: FloatArray
    """(B,) intensity from which each beam counts as reflective [sensor's unit]."""
    reflective: BoolArray
    """(B,) whether each does."""
    clusters: tuple[SeenCluster, ...]
    """In the order of their bearings; empty where the scan is no cycle of the run."""
    expected: tuple[tuple[str, float, float], ...]
    """Reflectors that the scanner faces: id, range [m] and bearing [rad] from the belief before the scan."""
    widths: FloatArray
    """(n, 3) clusters of the drive so far: range [m], beams, and 1 where the beams passed."""
    window: FloatArray
    """(CURVE, 3) range [m], fewest and most beams of a reflector there; (0, 3): the map has none."""

    @property
    def has_intensities(self) -> bool:
        """Whether the threshold decides what is reflective."""
        return self.scan.intensities is not None and self.scan.reflector is None


def sensor_view(inputs: SensorInput) -> SensorView | None:
    """Return the newest scan of a scanner; None where there is none yet.

    Parameters
    ----------
    inputs : records, run, and where in it.
    """
    log, setup = inputs.log, inputs.setup
    indices = setup.indices_of(log.scanners)
    store = next((each for each in log.scans if int(indices[each.scanner]) == inputs.scanner), None)
    row = -1 if store is None else int(np.searchsorted(store.stamps_ns, inputs.stamp_ns, side="right")) - 1
    if store is None or row < 0:
        return None
    scan = store.scan(row)
    scanner, detector = setup.scanners[inputs.scanner], setup.parameters.detector
    flags = reflective_beams(scan.ranges, scan.intensities, scan.reflector, detector)
    blind = scanner.reported_blind_sectors
    _, flags = without_blind(scan.ranges, flags, (np.array(scan.angle_min), np.array(scan.angle_increment)), blind)
    cycle = _cycle_of(inputs, scan.stamp_ns)
    return SensorView(
        scan=scan,
        name=scanner.name,
        time=(scan.stamp_ns - log.first_ns) * 1e-9,
        thresholds=np.broadcast_to(threshold_at(scan.ranges, detector), scan.ranges.shape),
        reflective=flags,
        clusters=() if cycle < 0 else _clusters(inputs, scan, cycle),
        expected=() if cycle < 0 else _expected(inputs, cycle),
        widths=_widths(inputs, scan.stamp_ns),
        window=_window(inputs, scan.angle_increment),
    )


def _cycle_of(inputs: SensorInput, stamp_ns: int) -> int:
    """Cycle of the run that is a scan; -1 where there is none."""
    stamps = inputs.columns.stamps_ns
    first, last = np.searchsorted(stamps, (stamp_ns, stamp_ns + 1)).tolist()
    of = inputs.columns.detected.scanners[first:last]
    found = np.flatnonzero(of == inputs.scanner)
    return int(first + found[0]) if len(found) else -1


def _clusters(inputs: SensorInput, scan: Scan, cycle: int) -> tuple[SeenCluster, ...]:
    """Return what the localizer made of the scan."""
    columns, setup = inputs.columns, inputs.setup
    used = columns.segment(cycle).setup
    rows = slice(int(columns.offsets[cycle]), int(columns.offsets[cycle + 1]))
    ids = [reflector.id for reflector in used.reflectors.reflectors]
    model, step = setup.detectors[inputs.scanner], scan.angle_increment
    found: list[SeenCluster] = []
    for (distance, bearing), beams, status, reflector, (x, y) in zip(
        columns.detected.range_bearing[rows].tolist(),
        columns.detected.beams[rows].tolist(),
        columns.status[rows].tolist(),
        columns.reflector[rows].tolist(),
        columns.estimate(cycle).points_map.tolist(),
        strict=True,
    ):
        kinds = [passing_widths(distance, step, kind, model) for kind in range(len(model.radii))]
        found.append(
            SeenCluster(
                range=distance,
                bearing=bearing,
                beams=beams,
                window=(min(low for low, _ in kinds), max(high for _, high in kinds)) if kinds and beams else None,
                status=Status(status),
                reflector=ids[reflector] if reflector >= 0 else "",
                peak=peak_of(scan, bearing, beams),
                place=(x, y),
            )
        )
    return tuple(sorted(found, key=lambda each: each.bearing))


def peak_of(scan: Scan, bearing: float, beams: int) -> float:
    """Return the largest intensity of the beams of a cluster [sensor's unit]; NaN where there is none.

    Parameters
    ----------
    scan : that it is in.
    bearing : of its center, as the scanner reports it [rad].
    beams : its width; 0: the sensor itself detected.
    """
    if scan.intensities is None or not beams:
        return math.nan
    middle = (bearing - scan.angle_min) / scan.angle_increment
    # A center that is fitted lies beside the middle of its beams by some.
    half = 0.5 * beams + 2.0
    about = np.arange(math.floor(middle - half), math.ceil(middle + half) + 1) % len(scan.ranges)
    return float(np.max(scan.intensities[about]))


def _expected(inputs: SensorInput, cycle: int) -> tuple[tuple[str, float, float], ...]:
    """Return where the reflectors that the scanner faces should be, by the belief before the scan."""
    setup = inputs.columns.segment(cycle).setup
    if not len(setup.reflectors):
        return ()
    scanner = setup.scanners[inputs.scanner]
    mean = inputs.columns.estimate(cycle).prior.mean
    seen = range_bearing(mean, scanner.mounting, setup.reflectors.centers)
    near = seen[:, 0] <= min(scanner.reflector_range, scanner.range[1])
    shown = np.flatnonzero(faces(scanner, seen[:, 1]) & near)
    reported = scanner.upright(seen[:, 1])
    reflectors = setup.reflectors.reflectors
    return tuple((reflectors[i].id, float(seen[i, 0]), float(reported[i])) for i in shown.tolist())


def _widths(inputs: SensorInput, stamp_ns: int) -> FloatArray:
    """(n, 3) range [m], beams, and whether they passed, of the clusters of a scanner up to a scan."""
    columns = inputs.columns
    last = int(np.searchsorted(columns.stamps_ns, stamp_ns, side="right"))
    rows = int(columns.offsets[last])
    of: IntArray = np.repeat(columns.detected.scanners[:last], np.diff(columns.offsets[: last + 1]))
    beams: IntArray = columns.detected.beams[:rows]
    chosen: NDArray[np.int64] = np.flatnonzero((of == inputs.scanner) & (beams > 0))
    chosen = chosen[:: max(1, -(-len(chosen) // MOST_CLUSTERS))]
    passed = columns.detected.status[chosen] == Status.INLIER
    return np.column_stack((columns.detected.range_bearing[chosen, 0], beams[chosen], passed)).astype(np.float64)


def _window(inputs: SensorInput, step: float) -> FloatArray:
    """(CURVE, 3) range [m], fewest and most beams of any reflector of the map there."""
    setup = inputs.setup
    model, scanner = setup.detectors[inputs.scanner], setup.scanners[inputs.scanner]
    if not len(model.radii):
        return np.empty((0, 3))
    ranges = np.geomspace(max(0.3, scanner.range[0]), min(scanner.reflector_range, scanner.range[1]), CURVE)
    rows: list[tuple[float, int, int]] = []
    for distance in ranges.tolist():
        kinds = [passing_widths(distance, step, kind, model) for kind in range(len(model.radii))]
        rows.append((distance, min(low for low, _ in kinds), max(high for _, high in kinds)))
    return np.array(rows, dtype=np.float64)

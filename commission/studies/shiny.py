"""Shiny things: what is as bright as a reflector to a scanner, stands still, and is none of the map.

By the poses of a run over a drive; it changes nothing. Which reflectors were moved or added, `monitor` says.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from commission.geometry.arrays import BoolArray, FloatArray, IntArray
from commission.localization.detector import threshold_at
from commission.localization.estimate import Mode, Status
from commission.localization.run_columns import RunColumns
from commission.localization.setup import LocalizerSetup
from commission.progress import Progress, silent
from commission.site.quantity import PERCENT, number_text
from commission.site.record_log import RecordLog
from commission.studies.heaps import heaps_of, middle_of, nearest_of
from commission.studies.inputs import StudyInput
from commission.studies.sensor_view import peak_of

CELL_M = 0.1
"""Side of the squares of the floor in which sightings are joined; those of neighbors are one thing [m]."""
FEWEST = 5
"""Scans below which something is not listed: stray echoes."""
WIDEST_M = 0.5
"""Spread beyond which sightings are of no one thing, or of one that moves [m]."""
BESIDE_M = 0.5
"""A thing so near to a reflector of the map stands beside it [m]."""
PEAKS = 12
"""Scans of each thing whose intensities are looked at, evenly over its sightings."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class ShinyInput(StudyInput):
    """What the study may read."""

    log: RecordLog
    """The records."""
    columns: RunColumns
    """The run over them."""
    setup: LocalizerSetup
    """What is set now: its threshold is the one that is compared with."""
    stamp_ns: int | None = None
    """Scans up to here count [ns]; None: all."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ShinyThing:
    """Something bright that is no reflector of the map."""

    x: float
    """Its place [m], map frame."""
    y: float
    """Its place [m], map frame."""
    spread: float
    """Median distance of its sightings from there [m]."""
    scans: int
    """Scans in which it was seen."""
    first_ns: int
    """Stamp of the first of them [ns]."""
    last_ns: int
    """Stamp of the last of them [ns]."""
    passed: float
    """Share of its sightings whose beams pass as a reflector's [0..1]: only the map told them from one."""
    beams: float
    """Median of its width [beams]."""
    nearest: float
    """Smallest range that it was seen at [m]."""
    farthest: float
    """Largest range that it was seen at [m]."""
    intensity: float
    """Median of the largest intensity in its beams [sensor's unit]; NaN where the sensor gives none, or flags."""
    threshold: float
    """Median of the intensity from which such a beam is reflective [sensor's unit]; NaN in the same cases."""
    beside: str
    """The reflector that it stands beside; empty: none."""

    @property
    def text(self) -> str:
        """What it is, in words."""
        bright = (
            ""
            if math.isnan(self.intensity)
            else f", intensity {number_text(self.intensity, 4)} against a threshold of {number_text(self.threshold, 4)}"
        )
        beside = f", beside {self.beside}" if self.beside else ""
        return (
            f"at {self.x:.2f}, {self.y:.2f} m: seen in {self.scans} scans from {self.nearest:.1f} to "
            f"{self.farthest:.1f} m, {self.beams:.0f} beams{bright}; {PERCENT.text(self.passed, '.0f')} pass as a "
            f"reflector{beside}"
        )


def shiny_things(inputs: ShinyInput, progress: Progress = silent) -> tuple[ShinyThing, ...]:
    """Return bright things that are no reflectors of the map, the one that was seen most often first.

    Only scans while the vehicle knows its pose count: of others nobody knows where what they saw is.

    Parameters
    ----------
    inputs : records and run.
    progress : told how far it is; may raise to cancel.
    """
    rows, cycles, places = _unknown(inputs)
    if len(rows) < FEWEST:
        return ()
    found: list[ShinyThing] = []
    heaps = heaps_of(places, CELL_M)
    for number, of in enumerate(heaps):
        progress(number / len(heaps), "")
        if len(of) < FEWEST:
            break
        thing = _thing(inputs, (rows[of], cycles[of], places[of]))
        if thing is not None:
            found.append(thing)
    return tuple(sorted(found, key=lambda each: -each.scans))


def _unknown(inputs: ShinyInput) -> tuple[NDArray[np.int64], IntArray, FloatArray]:
    """Detections that no reflector stands for: their rows, their cycles, their places (n, 2) [m] in the map."""
    columns = inputs.columns
    last = len(columns)
    if inputs.stamp_ns is not None:
        last = int(np.searchsorted(columns.stamps_ns, inputs.stamp_ns, "right"))
    counts = np.diff(columns.offsets[: last + 1])
    cycles = np.repeat(np.arange(last), counts)
    count = int(columns.offsets[last])
    known: BoolArray = columns.modes[:last] == Mode.OPERATIONAL
    rows = np.flatnonzero((columns.reflector[:count] < 0) & known[cycles])
    cycles = cycles[rows]
    return rows, cycles, columns.points_map()[rows]


def _thing(inputs: ShinyInput, of: tuple[NDArray[np.int64], IntArray, FloatArray]) -> ShinyThing | None:
    """Return what one heap of sightings is; None where they are of no one thing."""
    (rows, cycles, places), columns = of, inputs.columns
    middle, spread = middle_of(places)
    scans = np.unique(cycles)
    if spread > WIDEST_M or len(scans) < FEWEST:
        return None
    nearest = nearest_of(inputs.setup.reflectors.centers, middle, BESIDE_M)
    beside = inputs.setup.reflectors.reflectors[nearest].id if nearest >= 0 else ""
    ranges = columns.detected.range_bearing[rows, 0]
    intensity, threshold = _intensities(inputs, rows, cycles)
    return ShinyThing(
        x=float(middle[0]),
        y=float(middle[1]),
        spread=spread,
        scans=len(scans),
        first_ns=int(columns.stamps_ns[scans[0]]),
        last_ns=int(columns.stamps_ns[scans[-1]]),
        passed=float(np.mean(columns.detected.status[rows] == Status.INLIER)),
        beams=float(np.median(columns.detected.beams[rows])),
        nearest=float(ranges.min()),
        farthest=float(ranges.max()),
        intensity=intensity,
        threshold=threshold,
        beside=beside,
    )


def _intensities(inputs: ShinyInput, rows: NDArray[np.int64], cycles: IntArray) -> tuple[float, float]:
    """Medians of the largest intensity of a thing's beams, and of the threshold there [sensor's unit]; else NaN."""
    log, columns, detector = inputs.log, inputs.columns, inputs.setup.parameters.detector
    stores = {int(inputs.setup.indices_of(log.scanners)[each.scanner]): each for each in log.scans}
    peaks: list[tuple[float, float]] = []
    for at in np.unique(np.linspace(0, len(rows) - 1, PEAKS).astype(np.int64)).tolist():
        row, cycle = int(rows[at]), int(cycles[at])
        store = stores.get(int(columns.detected.scanners[cycle]))
        if store is None:
            continue
        number = int(np.searchsorted(store.stamps_ns, columns.stamps_ns[cycle]))
        if number == len(store) or int(store.stamps_ns[number]) != int(columns.stamps_ns[cycle]):
            continue
        scan = store.scan(number)
        if scan.intensities is None or scan.reflector is not None:
            continue
        distance, bearing = columns.detected.range_bearing[row].tolist()
        peak = peak_of(scan, bearing, int(columns.detected.beams[row]))
        peaks.append((peak, float(threshold_at(np.array(distance), detector))))
    if not peaks:
        return math.nan, math.nan
    intensity, threshold = np.median(np.array(peaks), axis=0).tolist()
    return intensity, threshold

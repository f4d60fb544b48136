"""How brightly each detection of a run came back: the largest intensity of its beams, for many scans at once.

`sensor_view.peak_of` is the same of a single cluster.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from commission.geometry.arrays import FloatArray, IntArray
from commission.localization.detection_log import DetectionLog
from commission.localization.setup import LocalizerSetup
from commission.site.record_log import RecordLog
from commission.site.record_store import ScanLog, ScanStore

MOST_SCANS = 20_000
"""Scans that are read, spread over the drive: of hours, all of them are gigabytes and say the same again."""
AT_ONCE = 1024
"""Scans in memory."""
BESIDE = 2.0
"""Beams on either side of a cluster that are looked at: a center that is fitted lies beside their middle by some."""


def intensity_peaks(log: RecordLog, detected: DetectionLog, setup: LocalizerSetup) -> FloatArray:
    """Return the largest intensity of the beams of each detection.

    Parameters
    ----------
    log : the recording.
    detected : what was detected in it.
    setup : of the localizer: it says which scanner is which.

    Returns
    -------
    peaks : (n,) array [sensor's unit]; NaN where a scan is not read or holds none, or the sensor itself detected.
    """
    peaks = np.full(len(detected.range_bearing), math.nan)
    indices = setup.indices_of(log.scanners)
    for store in log.scans:
        for cycles, scans in _read(store, detected, int(indices[store.scanner])):
            if scans.intensities is not None:
                _write(peaks, scans, cycles, detected)
    return peaks


def _read(store: ScanStore, detected: DetectionLog, scanner: int) -> Iterator[tuple[IntArray, ScanLog]]:
    """Cycles of one scanner and their scans, some at a time."""
    cycles = np.flatnonzero((detected.scanners == scanner) & (np.diff(detected.offsets) > 0))
    numbers = np.minimum(np.searchsorted(store.stamps_ns, detected.stamps_ns[cycles]), len(store) - 1)
    is_scan = store.stamps_ns[numbers] == detected.stamps_ns[cycles] if len(store) else np.zeros(len(cycles), np.bool_)
    cycles, numbers = cycles[is_scan], numbers[is_scan]
    every = -(-len(cycles) // MOST_SCANS) or 1
    cycles, numbers = cycles[::every], numbers[::every]
    for first in range(0, len(cycles), AT_ONCE):
        here = slice(first, first + AT_ONCE)
        yield cycles[here], store.chosen(numbers[here].astype(np.int64))


def _write(peaks: FloatArray, scans: ScanLog, cycles: IntArray, detected: DetectionLog) -> None:
    """Write the peaks of the clusters of some scans."""
    counts = np.diff(detected.offsets)[cycles]
    scan = np.repeat(np.arange(len(cycles)), counts)
    ends = np.cumsum(counts)
    rows = np.arange(ends[-1]) - np.repeat(ends - counts, counts) + np.repeat(detected.offsets[cycles], counts)
    widths = detected.beams[rows]
    scan, rows, widths = scan[widths > 0], rows[widths > 0], widths[widths > 0]
    if not len(rows) or scans.intensities is None:
        return
    middle = (detected.range_bearing[rows, 1] - scans.angle_min[scan]) / scans.angle_increment[scan]
    half = 0.5 * widths + BESIDE
    first, last = np.floor(middle - half).astype(np.int64), np.ceil(middle + half).astype(np.int64)
    beams = np.asarray(scans.beams)[scan]
    largest = np.full(len(rows), -math.inf)
    for step in range(int((last - first).max()) + 1):
        at = np.minimum(first + step, last) % beams
        np.fmax(largest, scans.intensities[scan, at], out=largest)
    peaks[rows] = np.where(np.isfinite(largest), largest, math.nan)

"""Scans as contours and temporary landmarks read them: those of a stretch of cycles, in memory. No filter in here."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from commission.compiled import compiled_inline
from commission.geometry.arrays import FloatArray, IntArray, read_only
from commission.localization.contour import ContourScan
from commission.localization.observation import ObservationModel, observation_at
from commission.localization.setup import LocalizerSetup
from commission.localization.sweep import AT_ONCE, Sweep, sweep_at
from commission.site.record_log import RecordLog
from commission.site.records import Scan


class ContourScans(NamedTuple):
    """A row per cycle."""

    ranges: NDArray[np.float32]
    """(K, B) [m]; NaN where nothing came back, and throughout a cycle that is no scan."""
    angle_min: FloatArray
    angle_increment: FloatArray
    scanners: IntArray
    beams: IntArray
    """How many there are; 0 in a cycle that is no scan."""


def contour_scans(
    log: RecordLog, setup: LocalizerSetup, scans: tuple[int, IntArray], cycles: int
) -> ContourScans | None:
    """Read the scans of a stretch of cycles; None where nobody looks at it.

    Parameters
    ----------
    log : all records of the drive.
    setup : says whether they are.
    scans : number of the first scan of the stretch, and which of its cycles are scans: all of them are delivered
        before any detections of the sensor itself.
    cycles : of the stretch.
    """
    if setup.contour is None and setup.temporary is None:
        return None
    first, among = scans
    numbers, indices = log.scan_order[first : first + len(among)], setup.indices_of(log.scanners)
    widest = max((int(each.beams.max(initial=0)) for each in log.scans), default=0)
    ranges = np.full((cycles, widest), np.nan, dtype=np.float32)
    angles, (scanners, beams) = np.zeros((2, cycles)), np.zeros((2, cycles), dtype=np.int64)
    start = 0
    for each in log.scans:
        where = np.flatnonzero((numbers >= start) & (numbers < start + len(each)))
        if len(where):
            block = each.block(int(numbers[where[0]]) - start, int(numbers[where[-1]]) - start + 1)
            rows = among[where]
            ranges[rows, : block.ranges.shape[1]] = block.ranges
            angles[0, rows], angles[1, rows] = block.angle_min, block.angle_increment
            scanners[rows], beams[rows] = indices[each.scanner], block.beams
        start += len(each)
    numbers_of_each = read_only(angles[0]), read_only(angles[1]), read_only(scanners), read_only(beams)
    return ContourScans(read_only(ranges), *numbers_of_each)


def contour_scan(setup: LocalizerSetup, scan: Scan | None, scanner: int) -> ContourScan | None:
    """Return one scan for kernels; None where nobody looks at it.

    Parameters
    ----------
    setup : says whether they are.
    scan : the scan; None where the sensor itself has detected, which says nothing of contours.
    scanner : index of the scanner.
    """
    if setup.contour is None and setup.temporary is None:
        return None
    if scan is None:
        scanner = 0
    return scan_seen_by(scan, scanner, setup.observations[scanner], setup.sweep_rows)


def scan_seen_by(scan: Scan | None, scanner: int, observation: ObservationModel, sweep_rows: FloatArray) -> ContourScan:
    """Return one scan for kernels.

    Parameters
    ----------
    scan : the scan; None: one without beams.
    scanner : index of the scanner.
    observation : its mounting and noise.
    sweep_rows : see `LocalizerSetup`.
    """
    ranges = np.empty(0, dtype=np.float32) if scan is None else scan.ranges
    return ContourScan(
        read_only(np.ascontiguousarray(ranges, dtype=np.float32)),
        0.0 if scan is None else float(scan.angle_min),
        0.0 if scan is None else float(scan.angle_increment),
        scanner,
        observation,
        Sweep(*sweep_rows[scanner].tolist()) if len(sweep_rows) else AT_ONCE,
        len(ranges),
    )


@compiled_inline
def contour_scan_at(
    scans: ContourScans | None, cycle: int, observations: FloatArray, sweeps: FloatArray
) -> ContourScan | None:
    """Scan of a cycle, or None where nobody looks at it.

    Parameters
    ----------
    scans : of the stretch, or None.
    cycle : in the stretch.
    observations, sweeps : see `observation_rows`, `sweep_rows`.

    Notes
    -----
    No formula: a row of each column.
    """
    if scans is None:
        return None
    scanner = scans.scanners[cycle]
    sweep = sweep_at(sweeps, scanner) if len(sweeps) else Sweep(1.0, 0.0, 0.0, 0.0)
    return ContourScan(
        scans.ranges[cycle],
        scans.angle_min[cycle],
        scans.angle_increment[cycle],
        scanner,
        observation_at(observations, scanner),
        sweep,
        scans.beams[cycle],
    )

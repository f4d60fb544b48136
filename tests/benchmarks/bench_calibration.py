"""Calibration of twenty minutes of driving: seconds for 4 and for 120 reflectors, and scipy's solver for a part.

Run: `python -m tests.benchmarks.bench_calibration [MINUTES]` from the checkout. Figures of eight in the laboratory, and
laps of the warehouse, both at 25 scans/s without beams; nobody looks at the truth. The peer in the same run is one fit
by scipy's sparse least squares of the first minute in the laboratory: poses, mounting, range bias and wheels, from the
truth on, with every detection given to its reflector; no association, no noise, no halves to judge by, no map: a
calibration makes seven fits of eight rounds each. Required: 20 s.
"""

from __future__ import annotations

import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.optimize import least_squares
from scipy.sparse import lil_array

from commission.geometry.arrays import FloatArray
from commission.io.project_file import load_project
from commission.localization.setup import LocalizerSetup
from commission.simulation.scenario import start_of
from commission.site.project import Project
from commission.site.record_log import RecordLog
from commission.studies.calibration import CalibrationInput, calibrate
from commission.studies.shadow_drives import ShadowWorld, shadow_drive
from commission.studies.start import Start, StartOrigin, belief_at
from tests.acceptance.eight import eight

MINUTES, PEER_S, LAP_S = 20.0, 60.0, (37.0, 185.0)
MAPS = Path(__file__).parents[2] / "maps"
CONSTANTS = 6
"""Of the peer: mounting x, y and heading, range bias, scale of the way, scale of turns."""


def laboratory(minutes: float) -> Project:
    """Laps of a figure of eight among four reflectors."""
    return replace(load_project(MAPS / "laboratory"), routes=(eight(round(60.0 * minutes / LAP_S[0])),))


def warehouse(minutes: float) -> Project:
    """Laps of the outer loop among 120 reflectors."""
    project = load_project(MAPS / "warehouse")
    route = next(each for each in project.routes if each.name == "Outer loop")
    lap = route.segments[0]
    points = np.tile(np.asarray(lap.control_points), (max(1, round(60.0 * minutes / LAP_S[1])), 1))
    return replace(project, routes=(replace(route, segments=(replace(lap, control_points=points),)),))


def driven(project: Project) -> tuple[RecordLog, Start]:
    """A drive of the only route, and what is known of its start."""
    name = project.routes[0].name
    log = shadow_drive(ShadowWorld.of(project, LocalizerSetup.of(project), (name,)), project, name, 1)
    begin = start_of(project, name)
    return log, Start(belief_at(log.first_ns, begin.pose, tuple(begin.sigmas.tolist())), StartOrigin.DRIVE)


def blind(log: RecordLog) -> RecordLog:
    """The drive without its truth."""
    return replace(log, truth=None, reference_stamps_ns=np.empty(0, np.int64), reference_poses=np.empty((0, 3)))


def peer_seconds(project: Project, log: RecordLog, seconds: float) -> float:
    """Processor time of scipy's sparse least squares for the first part of a drive [s].

    Parameters
    ----------
    project : with the reflectors, one scanner.
    log : the drive, its reference poses among it: associations and the first guess are taken from them.
    seconds : how much of it.
    """
    count = int(np.searchsorted(log.detection_stamps_ns, log.first_ns + 1e9 * seconds))
    stamps, centers = log.detection_stamps_ns[:count], project.reflectors.centers
    truth = log.reference_poses[np.searchsorted(log.reference_stamps_ns, stamps)].copy()
    truth[:, 2] = np.unwrap(truth[:, 2])
    cycle = np.repeat(np.arange(count), np.diff(log.detection_offsets[: count + 1]))
    measured = log.range_bearing[: len(cycle)]
    way = np.cumsum(log.displacements, axis=0)
    at = np.searchsorted(log.odometry_stamps_ns, stamps)
    steps = np.diff(way[np.minimum(at, len(way) - 1)], axis=0)
    mounting = project.scanners[0].mounting

    def seen(poses: FloatArray, mount: FloatArray, rows: FloatArray) -> FloatArray:
        c, s = np.cos(poses[:, 2]), np.sin(poses[:, 2])
        x, y = poses[:, 0] + c * mount[0] - s * mount[1], poses[:, 1] + s * mount[0] + c * mount[1]
        dx, dy = rows[:, 0] - x, rows[:, 1] - y
        return np.stack((np.hypot(dx, dy), np.arctan2(dy, dx) - poses[:, 2] - mount[2]), axis=1)

    each = np.stack([seen(truth[cycle], mounting, np.broadcast_to(c, (len(cycle), 2))) for c in centers], axis=1)
    off = each - measured[:, np.newaxis]
    off[..., 1] = np.remainder(off[..., 1] + np.pi, 2.0 * np.pi) - np.pi
    target = centers[np.argmin(np.abs(off[..., 0]) + 5.0 * np.abs(off[..., 1]), axis=1)]

    def residuals(x: FloatArray) -> FloatArray:
        poses, constants = x[CONSTANTS:].reshape(-1, 3), x[:CONSTANTS]
        left = seen(poses[cycle], constants[:3], target) - measured
        left[:, 0] += constants[3]
        left[:, 1] = np.remainder(left[:, 1] + np.pi, 2.0 * np.pi) - np.pi
        moved, theta = np.diff(poses, axis=0), poses[:-1, 2]
        c, s = np.cos(theta), np.sin(theta)
        local = np.stack((c * moved[:, 0] + s * moved[:, 1], c * moved[:, 1] - s * moved[:, 0], moved[:, 2]), axis=1)
        scaled = steps * (1.0 + constants[[4, 4, 5]])
        return np.concatenate(((left / (0.01, 0.002)).ravel(), ((local - scaled) / (1e-3, 1e-3, 1e-3)).ravel()))

    pattern = lil_array((2 * len(cycle) + 3 * (count - 1), CONSTANTS + 3 * count), dtype=np.int8)
    pattern[:, :CONSTANTS] = 1
    for row, pose in enumerate(cycle):
        pattern[2 * row : 2 * row + 2, CONSTANTS + 3 * pose : CONSTANTS + 3 * pose + 3] = 1
    for pose in range(count - 1):
        rows = 2 * len(cycle) + 3 * pose
        pattern[rows : rows + 3, CONSTANTS + 3 * pose : CONSTANTS + 3 * pose + 6] = 1
    began = time.process_time()
    first = np.concatenate((mounting, np.zeros(3), truth.ravel()))
    found = least_squares(residuals, first, jac_sparsity=pattern, x_scale="jac")
    took = time.process_time() - began
    print(f"scipy's least squares: {count} poses, {found.njev} steps, {took:.1f} s, mounted at {found.x[:3]}")
    return took


def main(minutes: float = MINUTES) -> None:
    """Measure and print."""
    sites = {"4 reflectors, figures of eight": laboratory(minutes), "120 reflectors, laps": warehouse(minutes)}
    calibrate(CalibrationInput.of(sites["4 reflectors, figures of eight"], *_blind(laboratory(1.0))))  # compiles
    spent: list[float] = []
    for name, project in sites.items():
        log, start = driven(project)
        began, worked = time.perf_counter(), time.process_time()
        found = calibrate(CalibrationInput.of(project, blind(log), start))
        took = time.perf_counter() - began
        spent.append(time.process_time() - worked)
        duration = 1e-9 * (log.last_ns - log.first_ns) / 60.0
        print(
            f"{name}: {duration:.1f} minutes, {len(log.range_bearing)} detections, {len(found.values)} values: "
            f"{took:.1f} s (<= 20 s), {spent[-1]:.1f} s of processor time",
            flush=True,
        )
    project = sites["4 reflectors, figures of eight"]
    peer = peer_seconds(project, driven(project)[0], PEER_S) * 60.0 * minutes / PEER_S
    print(f"that scaled to all of the drive: {peer:.1f} s, ratio {peer / spent[0]:.2f} to all of the calibration")


def _blind(project: Project) -> tuple[RecordLog, Start]:
    log, start = driven(project)
    return blind(log), start


if __name__ == "__main__":
    main(*(float(argument) for argument in sys.argv[1:2]))

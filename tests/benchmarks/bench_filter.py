"""Time of the filter per cycle against a loop over filterpy's EKF, and its independence of the map's size.

Run: `python -m tests.benchmarks.bench_filter [CYCLES]` from the checkout. Both sides do the same work in one run:
odometry prediction, association of five detections with the whole map, sequential correction. Only ratios count, and
processor time is measured, so that a busy machine matters less.
"""

from __future__ import annotations

import math
import sys
import time
import warnings
from dataclasses import replace

import numpy as np

from commission.geometry.arrays import FloatArray
from commission.localization import whole_run
from commission.localization.detection_log import extract_detections
from commission.localization.estimate import Belief
from commission.localization.observation import jacobians, range_bearing
from commission.localization.odometry import odometry_noise
from commission.localization.run_columns import RunColumns
from commission.localization.setup import LocalizerSetup
from commission.site.fields import with_field
from commission.site.parameters import ASSOCIATION_METHODS, FILTER_KINDS, Parameters
from commission.site.record_log import RecordLog
from commission.site.reflectors import Reflector, ReflectorMap
from commission.site.scanner import Scanner

CYCLES = 540_000  # six hours at 25 scans per second
PEER_CYCLES = 300
DETECTIONS = 5
SPEED, PERIOD_NS = 0.5, 40_000_000
DENSITY = 0.025  # reflectors per square metre: 20 of them stand in the paper's shop floor


def hall(count: int) -> LocalizerSetup:
    """Reflectors at one density, in a hall as large as they need."""
    rng = np.random.default_rng(count)
    side = math.sqrt(count / DENSITY)
    places = rng.uniform(-0.5 * side, 0.5 * side, (count, 2))
    reflectors = tuple(Reflector(id=str(i), x=float(x), y=float(y)) for i, (x, y) in enumerate(places))
    return LocalizerSetup(reflectors=ReflectorMap(reflectors), scanners=(Scanner(),), parameters=Parameters())


def drive(setup: LocalizerSetup, cycles: int) -> tuple[RecordLog, Belief]:
    """A circle of 6 m radius; the five nearest reflectors are seen in each scan, noise as the filter assumes."""
    rng = np.random.default_rng(0)
    turn = SPEED * PERIOD_NS * 1e-9 / 6.0
    heading = turn * np.arange(cycles) + 0.5 * math.pi
    poses = np.stack((6.0 * np.sin(heading), -6.0 * np.cos(heading), heading), axis=1)
    step = 12.0 * math.sin(0.5 * turn)
    displacements = np.tile([step * math.cos(0.5 * turn), step * math.sin(0.5 * turn), turn], (cycles, 1))
    displacements[0] = 0.0
    displacements[1:] += rng.normal(size=(cycles - 1, 3)) * [1e-3, 3e-4, 6e-4]
    centers = setup.reflectors.centers
    nearest = np.argsort(np.hypot(*(centers[np.newaxis] - poses[:: cycles // 64 or 1, np.newaxis, :2]).T).T, axis=1)
    seen = centers[nearest[np.minimum(np.arange(cycles) // (cycles // 64 or 1), len(nearest) - 1), :DETECTIONS]]
    delta = seen - poses[:, np.newaxis, :2]
    ranges = np.hypot(delta[..., 0], delta[..., 1]) + rng.normal(0.0, 0.02, delta.shape[:2])
    bearings = np.arctan2(delta[..., 1], delta[..., 0]) - poses[:, np.newaxis, 2]
    bearings += rng.normal(0.0, 0.004, bearings.shape)
    detections = np.stack((ranges, np.remainder(bearings + math.pi, 2.0 * math.pi) - math.pi), axis=-1)
    stamps = PERIOD_NS * np.arange(cycles, dtype=np.int64)
    offsets = DETECTIONS * np.arange(cycles + 1, dtype=np.int64)
    log = RecordLog(
        odometry_stamps_ns=stamps,
        displacements=displacements,
        detection_stamps_ns=stamps,
        detection_offsets=offsets,
        range_bearing=detections.reshape(-1, 2),
    )
    return log, Belief(0, poses[0], np.diag([1e-4, 1e-4, 1e-4]))


def peer_seconds(log: RecordLog, setup: LocalizerSetup, initial: Belief, cycles: int) -> tuple[float, FloatArray]:
    """Seconds and final mean of a loop over filterpy's EKF, its association written with numpy over the whole map."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        from filterpy.kalman import ExtendedKalmanFilter
    model, noise, gate = setup.observations[0], odometry_noise(setup.parameters.odometry), setup.filter.gate.d2
    centers, mounting = setup.reflectors.centers, setup.scanners[0].mounting
    R = np.diag([model.range_variance, model.bearing_variance])
    ekf = ExtendedKalmanFilter(dim_x=3, dim_z=2)
    ekf.x, ekf.P, ekf.R = np.array(initial.mean), np.array(initial.covariance), R

    def residual(a: FloatArray, b: FloatArray) -> FloatArray:
        d = a - b
        d[1] = math.remainder(d[1], 2.0 * math.pi)
        return d

    start = time.process_time()
    for k in range(cycles):
        dx, dy, dt = log.displacements[k]
        c, s = math.cos(ekf.x[2]), math.sin(ekf.x[2])
        mx, my, distance = c * dx - s * dy, s * dx + c * dy, math.hypot(dx, dy)
        ekf.F = np.array([[1.0, 0.0, -my], [0.0, 1.0, mx], [0.0, 0.0, 1.0]])
        heading = noise.heading_per_m * distance + noise.heading_per_rad * abs(dt)
        along = noise.forward_per_m * distance
        ekf.Q = np.diag([along, along, heading])
        ekf.x += [mx, my, dt]
        ekf.P = ekf.F @ ekf.P @ ekf.F.T + ekf.Q
        expected = range_bearing(ekf.x, mounting, centers)
        H = jacobians(ekf.x, mounting, centers)
        S = H @ ekf.P @ H.transpose(0, 2, 1) + R
        S_inverse, log_det = np.linalg.inv(S), np.log(np.linalg.det(S))
        chosen = []
        for z in log.range_bearing[log.detection_offsets[k] : log.detection_offsets[k + 1]]:
            d = z - expected
            d[:, 1] -= 2.0 * math.pi * np.round(d[:, 1] / (2.0 * math.pi))
            d2 = np.einsum("ni,nij,nj->n", d, S_inverse, d)
            best = int(np.argmin(d2 + log_det))
            if d2[best] <= gate:
                chosen.append((z, best))
        for z, best in chosen:
            place = centers[best : best + 1]
            ekf.update(
                z,
                lambda x, place=place: jacobians(x, mounting, place)[0],
                lambda x, place=place: range_bearing(x, mounting, place)[0],
                residual=residual,
            )
    return time.process_time() - start, ekf.x


def project_seconds(log: RecordLog, setup: LocalizerSetup, initial: Belief) -> tuple[float, RunColumns]:
    """Best of three: seconds of the filter over kept detections."""
    detected = extract_detections(log, setup)
    best, arrays = math.inf, None
    for _ in range(3):
        start = time.process_time()
        arrays = whole_run.run(log, setup, initial, detected=detected)
        best = min(best, time.process_time() - start)
    assert arrays is not None
    return best, arrays


def main(cycles: int = CYCLES) -> None:
    """Print one line per map."""
    whole_run.warm_up()
    times: dict[int, float] = {}
    for count in (20, 200, 2000):
        setup = hall(count)
        log, initial = drive(setup, cycles)
        seconds, arrays = project_seconds(log, setup, initial)
        times[count] = seconds / cycles
        peer, mean = peer_seconds(log, setup, initial, PEER_CYCLES)
        gap = float(np.hypot(*(arrays.means[PEER_CYCLES - 1, :2] - mean[:2])))
        inliers = float((arrays.status == 0).mean())
        print(
            f"{count:5d} reflectors: {seconds / cycles * 1e6:6.3f} us/cycle ({seconds:.3f} s in all), "
            f"filterpy {peer / PEER_CYCLES * 1e6:7.0f} us/cycle, ratio {peer / PEER_CYCLES / (seconds / cycles):6.0f}; "
            f"{100 * inliers:.1f} % inliers, means {1000 * gap:.2f} mm apart"
        )
    print(f"2000 reflectors against 20: {times[2000] / times[20]:.2f} times")
    compare_kinds(cycles // 10)


def compare_kinds(cycles: int) -> None:
    """Print how long each kind of filter and each way to associate takes, against what is usual, in turns."""
    usual = hall(200)
    log, initial = drive(usual, cycles)
    others = {f"filter.kind={kind}": with_field(usual.parameters, "filter.kind", kind) for kind in FILTER_KINDS}
    for method in ASSOCIATION_METHODS:
        others[f"association.method={method}"] = with_field(usual.parameters, "association.method", method)
    times = {name: math.inf for name in others}
    for _ in range(3):
        for name, parameters in others.items():
            times[name] = min(times[name], project_seconds(log, replace(usual, parameters=parameters), initial)[0])
    first = next(iter(times.values()))
    for name, seconds in times.items():
        print(f"{name}: {seconds / cycles * 1e6:6.3f} us/cycle, {seconds / first:.2f} times ekf")


if __name__ == "__main__":
    main(*(int(argument) for argument in sys.argv[1:2]))

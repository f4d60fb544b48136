"""The least squares of a calibration against finite differences and a plain solver; values accepted one by one."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from commission.geometry import se2
from commission.geometry.angles import wrap
from commission.site.project import Project
from commission.site.quantity import DEGREES
from commission.site.reflectors import Reflector, ReflectorMap
from commission.site.scanner import Scanner
from commission.studies.calibration import CalibrationVerdict, Value, accepted
from commission.studies.calibration_fit import CalibrationProblem, fit
from commission.studies.calibration_model import (
    MeasuredDrive,
    Point,
    constant_columns,
    moments,
    move,
    see,
    track,
    velocities,
)
from commission.studies.calibration_track import twists_at

MOUNTING = np.array([0.3, 0.1, 0.2])
PLACES = np.array([[4.0, 3.0], [-3.0, 4.0], [-4.0, -3.0], [5.0, -4.0], [0.5, 6.0]])
NOISE = np.square([0.01, 0.004, 0.01, 0.002, 0.004, 0.01, 0.01, 0.002])
PRIOR = np.concatenate(([0.01, 0.01, 0.01, 0.01, 0.01, 0.003], [0.02, 0.02, 0.01], np.full(10, 0.003)))


LOUD = np.where(np.arange(8) == 7, 0.02**2 / 0.2, NOISE)


def small_drive(
    scans: int = 25, *, straight: bool = False, seed: int = 3, noisy_turns: float = 0.004
) -> tuple[CalibrationProblem, np.ndarray]:
    """A drive with noise among five reflectors and the poses that it truly had; nothing is wrong with its constants."""
    rng = np.random.default_rng(seed)
    turn = 0.0 if straight else 0.08
    twists = np.column_stack((np.full(scans, 0.1), np.zeros(scans), turn * np.sign(np.sin(np.arange(scans) / 4.0))))
    poses = [np.array([-1.0, 0.0, 0.1])]
    for twist in twists[1:]:
        poses.append(se2.compose(poses[-1], se2.exp(twist)))
    true = np.array(poses)
    reported = se2.exp(twists + rng.normal(0.0, 1.0, twists.shape) * (0.003, 0.001, noisy_turns))
    reported[0] = 0.0
    ray = PLACES[None] - se2.compose(true, MOUNTING)[:, None, :2]
    ranges = np.hypot(ray[..., 0], ray[..., 1])
    bearings = wrap(np.arctan2(ray[..., 1], ray[..., 0]) - true[:, None, 2] - MOUNTING[2])
    measured = np.stack((ranges, bearings), axis=2).reshape(-1, 2) + rng.normal(0.0, 1.0, (5 * scans, 2)) * (
        0.01,
        0.004,
    )
    stamps = 200_000_000 * np.arange(scans)
    drive = MeasuredDrive(
        odometry_ns=stamps,
        displacements=reported,
        missing=np.zeros(scans),
        stamps_ns=stamps,
        scanners=np.zeros(scans, dtype=np.int64),
        middles=np.zeros(1),
        mountings=MOUNTING[np.newaxis],
        places=PLACES,
        cycle=np.repeat(np.arange(scans), 5),
        measured=measured,
        delays=np.tile(np.linspace(0.0, 0.04, 5), scans) * 0.0,
    )
    start = Point(true + rng.normal(0.0, 0.005, true.shape), np.zeros(drive.layout.size))
    reflector = np.tile(np.arange(5), scans)
    return CalibrationProblem(
        drive=drive, start=start, reflector=reflector, prior=PRIOR, noise=NOISE, fixed_noise=True
    ), true


def shifted(point: Point, *, pose: int | None = None, constant: int | None = None, axis: int = 0, by: float) -> Point:
    poses, constants = point.poses.copy(), point.constants.copy()
    if pose is not None:
        poses[pose, axis] += by
    if constant is not None:
        constants[constant] += by
    return Point(poses, constants)


def test_jacobians_of_detections_are_their_finite_differences() -> None:
    problem, _ = small_drive()
    drive = replace(problem.drive, delays=np.tile(np.linspace(-0.02, 0.04, 5), 25))
    rng = np.random.default_rng(1)
    point = Point(problem.start.poses, rng.normal(0.0, 0.01, drive.layout.size))
    twists = rng.normal(0.0, 0.5, (25, 3))
    seen, columns = see(drive, point, problem.reflector, twists), constant_columns(drive, problem.reflector)
    step = 1e-6
    for axis in range(3):
        moved = Point(point.poses + step * np.eye(3)[axis], point.constants)
        slope = -wrap(see(drive, moved, problem.reflector, twists).residuals - seen.residuals) / step
        assert seen.by_pose[:, :, axis] == pytest.approx(slope, abs=2e-5)
    for constant in range(drive.layout.size):
        if constant == drive.layout.clock(0) or constant in range(drive.layout.wheels, drive.layout.places):
            continue
        other = see(drive, shifted(point, constant=constant, by=step), problem.reflector, twists)
        slope = -wrap(other.residuals - seen.residuals) / step
        expected = np.where((columns == constant)[:, np.newaxis], seen.by_constants, 0.0).sum(axis=2)
        assert expected == pytest.approx(slope, abs=2e-5), constant
    # A clock that is late: what is seen was measured earlier, along the velocity, by the same beams.
    twists = velocities(point.poses, moments(drive, point.constants))
    seen = see(drive, point, problem.reflector, twists)
    earlier = replace(drive, delays=drive.delays - step)
    slope = -wrap(see(earlier, point, problem.reflector, twists).residuals - seen.residuals) / step
    assert seen.by_constants[:, :, 3] == pytest.approx(slope, abs=2e-5)


def test_jacobians_of_odometry_are_their_finite_differences() -> None:
    problem, _ = small_drive()
    drive, step = problem.drive, 1e-6
    constants = np.zeros(drive.layout.size)
    constants[drive.layout.wheels : drive.layout.wheels + 3] = 0.01, -0.02, 0.005
    point = Point(problem.start.poses, constants)
    times = drive.stamps_ns.astype(np.float64)
    rows = move(drive, point, track(drive, constants), times)
    for axis in range(3):
        moved = move(drive, shifted(point, pose=7, axis=axis, by=step), track(drive, constants), times)
        slope = -(moved.residuals - rows.residuals) / step
        assert rows.by_before[7, :, axis] == pytest.approx(slope[7], abs=2e-5)
        assert rows.by_after[6, :, axis] == pytest.approx(slope[6], abs=2e-5)


def test_motion_by_wheels_is_its_finite_difference_where_odometry_has_no_noise() -> None:
    problem, step, stamps = small_drive(40)[0], 1e-6, 200_000_000 * np.arange(40)
    constants = np.zeros(problem.drive.layout.size)
    constants[problem.drive.layout.wheels : problem.drive.layout.wheels + 3] = 0.01, -0.02, 0.005
    # One velocity from end to end: what is averaged over longer is what happens between two scans.
    drive = replace(problem.drive, displacements=np.tile(se2.exp(np.array([0.1, 0.0, 0.03])), (40, 1)))
    way = track(drive, constants)
    point = Point(way.poses, constants)
    rows = move(drive, point, way, stamps.astype(np.float64))
    assert rows.residuals == pytest.approx(np.zeros((39, 3)), abs=1e-9)
    for index in range(3):
        other = shifted(point, constant=drive.layout.wheels + index, by=step)
        moved = move(drive, other, track(drive, other.constants), stamps.astype(np.float64))
        slope = -(moved.residuals - rows.residuals) / step
        assert rows.by_wheels[:, :, index] == pytest.approx(slope, abs=2e-5)


def test_noise_of_odometry_does_not_shrink_the_scale_of_turns() -> None:
    """Turns by 0.08 rad, reported with 0.02 rad of noise: by what is reported, they are 4.6 % smaller on the mean."""
    found: list[float] = []
    row = small_drive()[0].drive.layout.wheels + 1
    for seed in range(4):
        problem, _ = small_drive(400, seed=seed, noisy_turns=0.02)
        wide = replace(problem, prior=np.where(np.arange(len(PRIOR)) == 7, 1.0, PRIOR), noise=LOUD)
        found.append(float(fit(wide).point.constants[row]))
    # Three 1-sigma of the mean of four drives, each to 1.7 %.
    assert abs(float(np.mean(found))) < 0.026


def plain_residuals(problem: CalibrationProblem, x: np.ndarray) -> np.ndarray:
    """All whitened residuals of a small drive, number by number, with nothing of what is judged."""
    drive, k = problem.drive, len(problem.drive.stamps_ns)
    poses, c = x[: 3 * k].reshape(k, 3), x[3 * k :]
    out: list[float] = []
    mx, my, mh = MOUNTING + c[0:3]
    for row, (distance, bearing) in enumerate(drive.measured):
        px, py, heading = poses[drive.cycle[row]]
        j = problem.reflector[row]
        lx, ly = PLACES[j] + c[9 + 2 * j : 11 + 2 * j]
        sx, sy = (
            px + math.cos(heading) * mx - math.sin(heading) * my,
            py + math.sin(heading) * mx + math.cos(heading) * my,
        )
        far = math.hypot(lx - sx, ly - sy)
        off = bearing - (math.atan2(ly - sy, lx - sx) - heading - mh)
        out.append((distance - far - c[4] - c[5] * far) / 0.01)
        out.append(math.remainder(off, 2.0 * math.pi) / 0.004)
    for i in range(k - 1):
        forward, left, turn = se2.log(drive.displacements[i + 1])
        dx, dy, dt = se2.exp([(1 + c[6]) * forward, (1 + c[6]) * left, (1 + c[7]) * turn + c[8] * forward])
        a, b = poses[i], poses[i + 1]
        ex, ey = b[:2] - a[:2]
        ax = math.cos(a[2]) * ex + math.sin(a[2]) * ey
        ay = math.cos(a[2]) * ey - math.sin(a[2]) * ex
        error = np.array([dx - ax, dy - ay, math.remainder(dt - (b[2] - a[2]), 2.0 * math.pi)])
        length, way = math.hypot(dx, dy), math.hypot(forward, left) * (1 + c[6])
        u = np.array([dx, dy]) / length
        n = np.array([-u[1], u[0]])
        heading_variance = NOISE[5] * way + NOISE[6] * abs((1 + c[7]) * turn + c[8] * forward) + NOISE[7] * 0.2
        covariance = np.zeros((3, 3))
        covariance[:2, :2] += (NOISE[2] * way + NOISE[3] * 0.2) * np.outer(u, u) + NOISE[4] * way * np.outer(n, n)
        lever = np.array([*(0.5 * length * n), 1.0])
        covariance += heading_variance * np.outer(lever, lever)
        covariance[:2, :2] += heading_variance * length**2 / 12.0 * np.outer(n, n)
        out += np.linalg.solve(np.linalg.cholesky(covariance), error).tolist()
    out += (c / PRIOR)[np.arange(len(PRIOR)) != 3].tolist()
    return np.array(out)


def test_the_sparse_solution_is_that_of_a_plain_dense_one() -> None:
    problem, _ = small_drive()
    # The plain one knows no clock, and no heavy tail of a prior: nothing here is far from it. Wheels are no plain least
    # squares (noise of odometry would shrink their scales): drives with a known truth judge them.
    known = np.isin(np.arange(len(PRIOR)), (3, 6, 7, 8))
    exact = replace(problem, prior=np.where(known, 0.0, PRIOR))
    found = fit(exact)
    x = np.concatenate((problem.start.poses.ravel(), problem.start.constants))
    for _ in range(6):
        r = plain_residuals(problem, x)
        J = np.stack([(plain_residuals(problem, x + 1e-6 * e) - r) / 1e-6 for e in np.eye(len(x))], axis=1)
        free = np.concatenate((np.ones(75, dtype=np.bool_), ~known))
        x[free] -= np.linalg.lstsq(J[:, free], r, rcond=None)[0]
    plain = x[75:]
    # The tail of the priors pulls a little less: a tenth of a 1-sigma.
    assert np.abs(found.point.constants - plain)[PRIOR > 0.0] == pytest.approx(0.0 * plain, abs=0.1 * PRIOR.max())
    assert (np.abs(found.point.constants - plain) < 0.1 * np.maximum(found.sigmas, 1e-6) + 1e-4).all()
    assert found.point.poses[:, :2] == pytest.approx(x[:75].reshape(25, 3)[:, :2], abs=1e-3)


def test_a_straight_drive_does_not_show_the_scale_of_turns() -> None:
    straight, turning = (fit(small_drive(60, straight=kind)[0]) for kind in (True, False))
    layout = small_drive()[0].drive.layout
    row = layout.wheels + 1
    assert straight.sigmas[row] > 0.95 * PRIOR[row]
    assert turning.sigmas[row] < 0.8 * PRIOR[row]


def test_values_are_accepted_one_by_one() -> None:
    project = Project(
        reflectors=ReflectorMap((Reflector(id="R.1", x=1.0, y=2.0),)), scanners=(Scanner(name="front left"),)
    )

    def value(key: str, proposed: float) -> Value:
        verdict = CalibrationVerdict.PROPOSED
        return Value(key=key, before=0.0, proposed=proposed, sigma=0.01, verdict=verdict, shown=DEGREES)

    turned = value("scanners.front left.mounting.heading", 0.1)
    late = value("scanners.front left.clock_offset", 0.02)
    bias = value("observation.range_bias", 0.03)
    place = value("reflectors.R.1.y", 2.5)
    one = accepted(project, (turned,))
    assert one.scanners[0].mounting.tolist() == [0.0, 0.0, 0.1]
    assert (one.scanners[0].clock_offset, one.parameters, one.reflectors) == (
        0.0,
        project.parameters,
        project.reflectors,
    )
    every = accepted(one, (late, bias, place))
    assert every.scanners[0].clock_offset == 0.02
    assert every.parameters.observation.range_bias == 0.03
    assert (every.reflectors.reflectors[0].x, every.reflectors.reflectors[0].y) == (1.0, 2.5)


def test_moments_are_earlier_by_what_a_clock_shows_more() -> None:
    drive = small_drive()[0].drive
    constants = np.zeros(drive.layout.size)
    constants[drive.layout.clock(0)] = 0.05
    assert moments(drive, constants) == pytest.approx(drive.stamps_ns - 5e7)
    assert twists_at(track(drive, constants), moments(drive, constants)).shape == (25, 3)

"""Noise that a drive shows is proposed only where each half of the drive agrees with what the other half says."""

from __future__ import annotations

import math

import numpy as np
import pytest

from commission.localization import whole_run
from commission.localization.detection_log import extract_detections
from commission.localization.estimate import Belief
from commission.localization.setup import LocalizerSetup
from commission.site.parameters import ObservationParameters, OdometryParameters, Parameters
from commission.site.record_log import RecordLog
from commission.site.reflectors import Reflector, ReflectorMap
from commission.site.scanner import Scanner
from commission.studies.calibration_judging import agreements
from commission.studies.calibration_noise import noisy
from commission.studies.calibration_noise_verdicts import NoiseJudge
from commission.studies.calibration_values import NoiseVerdict

CYCLES, PERIOD_S, SPEED, RADIUS = 900, 0.1, 0.5, 6.0
SIGMAS = np.array([0.02, 0.004])
GROWTH = np.square([0.01, 0.002, 0.005, 0.006, 0.006, 0.001])


def circle(noise: tuple[float, float]) -> tuple[RecordLog, Belief, LocalizerSetup]:
    """A circle among eight reflectors; what is seen is so many times as noisy in each half as `SIGMAS`."""
    rng = np.random.default_rng(4)
    turn, angles = SPEED * PERIOD_S / RADIUS, np.arange(8) * math.pi / 4.0 + 0.2
    places = rng.uniform(7.5, 10.5, 8)[:, np.newaxis] * np.column_stack((np.cos(angles), np.sin(angles)))
    heading = turn * np.arange(CYCLES)
    poses = np.column_stack((RADIUS * np.sin(heading), RADIUS - RADIUS * np.cos(heading), heading))
    moved = np.tile([RADIUS * math.sin(turn), RADIUS - RADIUS * math.cos(turn), turn], (CYCLES, 1))
    moved += rng.normal(size=(CYCLES, 3)) * [0.0025, 0.0011, 0.0015]
    moved[0] = 0.0
    rays = places + np.array([0.0, RADIUS]) - poses[:, np.newaxis, :2]
    seen = np.stack((np.hypot(*rays.T).T, np.arctan2(rays[..., 1], rays[..., 0]) - heading[:, np.newaxis]), axis=2)
    louder = np.where(np.arange(CYCLES) < CYCLES // 2, *noise)
    seen += rng.normal(size=seen.shape) * SIGMAS * louder[:, np.newaxis, np.newaxis]
    seen[..., 1] = np.remainder(seen[..., 1] + math.pi, 2.0 * math.pi) - math.pi
    stamps = (1e9 * PERIOD_S * np.arange(CYCLES)).astype(np.int64)
    log = RecordLog(
        odometry_stamps_ns=stamps,
        displacements=moved,
        detection_stamps_ns=stamps,
        detection_offsets=8 * np.arange(CYCLES + 1),
        range_bearing=seen.reshape(-1, 2),
    )
    reflectors = tuple(Reflector(id=f"R{i}", x=float(x), y=float(y) + RADIUS) for i, (x, y) in enumerate(places))
    setup = LocalizerSetup(
        reflectors=ReflectorMap(reflectors),
        scanners=(Scanner(),),
        parameters=Parameters(
            observation=ObservationParameters(range_sigma=0.05, bearing_sigma=0.01),
            odometry=OdometryParameters(forward_per_sqrt_m=0.03, lateral_per_sqrt_m=0.02, heading_per_sqrt_m=0.02),
        ),
    )
    return log, Belief(0, poses[0], np.diag([1e-4, 1e-4, 1e-4])), setup


def verdicts(noise: tuple[float, float], first: float = 1.0) -> tuple[NoiseVerdict, NoiseVerdict]:
    """Judge the noise of such a drive; that of odometry is so many times too small by its first half."""
    log, start, setup = circle(noise)
    detected = extract_detections(log, setup)
    reflector = whole_run.run(log, setup, start, detected=detected).reflector
    spread = SIGMAS * math.sqrt((noise[0] ** 2 + noise[1] ** 2) / 2.0)
    judge = NoiseJudge(
        log=log,
        start=start,
        detected=detected,
        reflector=reflector,
        setup=setup,
        spread=spread,
        spreads=(SIGMAS * noise[0], SIGMAS * noise[1]),
        odometry=(GROWTH / first**2, GROWTH),
    )
    return judge.both(agreements(log, noisy(setup, spread, GROWTH), start, detected, reflector), GROWTH)


def test_noise_that_is_the_same_in_both_halves_is_not_worse() -> None:
    seen, driven = verdicts((1.0, 1.0))
    assert not seen.is_worse
    assert not driven.is_worse


@pytest.mark.parametrize("noise", [(1.0, 4.0), (4.0, 1.0)])
def test_noise_of_a_quiet_half_is_worse_for_a_loud_one(noise: tuple[float, float]) -> None:
    seen, driven = verdicts(noise)
    assert seen.is_worse
    assert driven.is_worse
    assert driven.reason == "estimated beside that of detections"


def test_odometry_that_one_half_takes_for_perfect_is_worse_for_the_other() -> None:
    seen, driven = verdicts((1.0, 1.0), first=100.0)
    assert not seen.is_worse
    assert driven.is_worse

"""Displacements of wheels that are not what the vehicle takes them for."""

from __future__ import annotations

import numpy as np
import pytest

from commission.geometry import se2
from commission.localization.estimate import Belief
from commission.localization.localizer import Localizer
from commission.localization.setup import LocalizerSetup
from commission.localization.wheel_scale import as_driven
from commission.localization.whole_run import run
from commission.site.parameters import OdometryParameters, Parameters
from commission.site.record_log import RecordLog
from commission.site.records import Detections, Odometry
from commission.site.reflectors import Reflector, ReflectorMap
from commission.site.scanner import Scanner

WRONG = OdometryParameters(forward_scale=0.02, turn_scale=-0.05, turn_per_m=0.01)


def test_displacements_stay_as_they_are_where_nothing_is_known_to_be_wrong() -> None:
    reported = np.array([[0.1, 0.0, 0.02]])
    assert as_driven(reported, OdometryParameters()) is reported


def test_a_way_and_a_turn_are_longer_by_their_shares() -> None:
    straight = as_driven(np.array([[0.5, 0.0, 0.0]]), OdometryParameters(forward_scale=0.02))
    assert straight[0] == pytest.approx([0.51, 0.0, 0.0], abs=1e-15)
    turn = as_driven(np.array([[0.0, 0.0, 0.4]]), OdometryParameters(turn_scale=-0.05))
    assert turn[0] == pytest.approx([0.0, 0.0, 0.38], abs=1e-15)


def test_a_course_that_is_off_turns_with_the_way_and_back_in_reverse() -> None:
    parameters = OdometryParameters(turn_per_m=0.1)
    ahead, back = as_driven(np.array([[2.0, 0.0, 0.0], [-2.0, 0.0, 0.0]]), parameters)
    # An arc of 2 m that turns by 0.2 rad: chord and sagitta of a circle of 10 m.
    assert ahead == pytest.approx([10.0 * np.sin(0.2), 10.0 * (1.0 - np.cos(0.2)), 0.2], abs=1e-12)
    assert se2.compose(ahead, back) == pytest.approx([0.0, 0.0, 0.0], abs=1e-12)


def test_a_live_vehicle_and_a_whole_run_correct_their_wheels_to_the_last_bit_alike() -> None:
    rng = np.random.default_rng(4)
    reflectors = ReflectorMap(tuple(Reflector(id=f"R{i}", x=3.0 * i, y=2.0 * (-1) ** i) for i in range(4)))
    setup = LocalizerSetup(
        reflectors=reflectors, scanners=(Scanner(sweep_duration=0.02),), parameters=Parameters(odometry=WRONG)
    )
    records = []
    for step in range(60):
        records.append(Odometry(20_000_000 * step, np.array([0.02, 0.0, 0.01]) + rng.normal(0.0, 1e-3, 3)))
        if step % 3 == 1:
            seen = np.array([[rng.uniform(2.0, 6.0), rng.uniform(-1.5, 1.5)]])
            records.append(Detections(20_000_000 * step + 7_000_000, seen))
    start = Belief(0, np.zeros(3), 1e-4 * np.eye(3))
    localizer = Localizer(setup, start)
    live = [estimate for record in records for estimate in localizer.feed(record)]
    live += localizer.flush()
    whole = run(RecordLog.collect(records), setup, start)
    assert np.array_equal(whole.means, [estimate.posterior.mean for estimate in live])
    plain = run(
        RecordLog.collect(records),
        LocalizerSetup(reflectors=reflectors, scanners=setup.scanners, parameters=Parameters()),
        start,
    )
    assert np.abs(plain.means[-1] - whole.means[-1]).max() > 1e-3

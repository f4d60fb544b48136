"""One scan under the glass, against numbers counted here and the true pose of a virtual drive."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from commission.app.live.sensor_picture import height, upper_end
from commission.localization.estimate import Status
from commission.localization.setup import LocalizerSetup
from commission.simulation import scenario
from commission.studies.run import RunInput, RunResult, judged_run
from commission.studies.sensor_view import SensorInput, SensorView, sensor_view
from commission.studies.start import Start, StartOrigin, belief_at
from tests.app.sites import room


@pytest.fixture(scope="module")
def run() -> RunResult:
    project = room()
    light = replace(project.disturbances.intensity, enabled=True)
    project = replace(project, disturbances=replace(project.disturbances, intensity=light))
    start = scenario.start_of(project, project.routes[0].name)
    log = scenario.virtual_drive(project, project.routes[0].name, 1)
    belief = belief_at(log.first_ns, start.pose, start.sigmas.tolist())
    return judged_run(RunInput.of(project, log, Start(belief, StartOrigin.DRIVE)))


def seen(run: RunResult, seconds: float, threshold: float = 0.5) -> SensorView:
    project = room()
    detector = replace(project.parameters.detector, intensity_threshold=threshold)
    setup = LocalizerSetup(
        reflectors=project.reflectors,
        scanners=project.scanners,
        parameters=replace(project.parameters, detector=detector),
    )
    log = run.inputs.log
    found = sensor_view(
        SensorInput(log=log, columns=run.columns, setup=setup, stamp_ns=log.first_ns + round(seconds * 1e9))
    )
    assert found is not None
    return found


def test_beams_are_reflective_from_the_threshold_on_that_is_set_now(run: RunResult) -> None:
    low, high = seen(run, 5.0, 0.02), seen(run, 5.0, 0.8)
    assert low.scan.intensities is not None
    assert low.reflective.sum() == sum(value >= 0.02 for value in low.scan.intensities.tolist())
    assert high.reflective.sum() == sum(value >= 0.8 for value in low.scan.intensities.tolist())
    assert 0 < high.reflective.sum() < low.reflective.sum()
    assert low.time == pytest.approx(5.0, abs=0.1)


def test_clusters_are_those_of_the_localizer_and_accepted_ones_lie_within_their_window(run: RunResult) -> None:
    view = seen(run, 5.0)
    assert len(view.clusters) >= 2
    for each in view.clusters:
        if each.status is Status.INLIER:
            assert each.window is not None
            assert each.window[0] <= each.beams <= each.window[1]
            assert each.reflector.startswith("R")
        assert each.peak >= 0.5
    assert [each.bearing for each in view.clusters] == sorted(each.bearing for each in view.clusters)


def test_reflectors_are_expected_where_the_true_pose_sees_them(run: RunResult) -> None:
    view, log = seen(run, 5.0), run.inputs.log
    row = int(np.argmin(np.abs(log.reference_stamps_ns - view.scan.stamp_ns)))
    x, y, theta = log.reference_poses[row].tolist()
    places = {each.id: (each.x, each.y) for each in room().reflectors.reflectors}
    mounting = room().scanners[0].mounting.tolist()
    x += math.cos(theta) * mounting[0] - math.sin(theta) * mounting[1]
    y += math.sin(theta) * mounting[0] + math.cos(theta) * mounting[1]
    assert {name for name, _, _ in view.expected} <= set(places)
    for name, distance, bearing in view.expected:
        dx, dy = places[name][0] - x, places[name][1] - y
        assert distance == pytest.approx(math.hypot(dx, dy), abs=0.1)
        off = math.atan2(dy, dx) - theta - mounting[2] - bearing
        assert math.remainder(off, 2.0 * math.pi) == pytest.approx(0.0, abs=0.03)


def test_the_drive_so_far_is_held_against_the_window(run: RunResult) -> None:
    early, late = seen(run, 2.0), seen(run, 8.0)
    assert 0 < len(early.widths) < len(late.widths)
    near, far = late.window[0], late.window[-1]
    assert near[0] < far[0]
    assert near[2] > far[2], "a reflector near by shows more beams"
    assert (late.window[:, 1] <= late.window[:, 2]).all()


def test_there_is_nothing_to_see_before_the_first_scan(run: RunResult) -> None:
    log = run.inputs.log
    setup = run.columns.segments[0].setup
    assert sensor_view(SensorInput(log=log, columns=run.columns, setup=setup, stamp_ns=log.first_ns - 1)) is None


@pytest.mark.parametrize(("largest", "end"), [(0.9, 1.0), (0.93, 1.2), (1.0, 1.2), (230.0, 250.0), (65535.0, 80000.0)])
def test_an_axis_ends_at_a_round_number_above_what_is_largest(largest: float, end: float) -> None:
    assert upper_end(largest) == pytest.approx(end)
    assert upper_end(math.nan) == upper_end(0.0) == 1.0
    assert float(height(np.array(0.25), 1.0)) == 0.5

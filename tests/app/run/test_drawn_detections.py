"""Inside means inside: an inlier is drawn within the gate of its reflector, and an outlier outside, at any size."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from commission.app.run.detection_layer import drawn_detections
from commission.app.run.drives import Drive
from commission.app.run.gate_layer import drawn_gates
from commission.app.run.playback import Playback
from commission.app.run.view import RunView
from commission.localization.estimate import Status
from commission.site.fields import with_field
from commission.site.project import Project
from commission.studies.run import RunInput, RunResult, judged_run

BENT = 0.04
"""Share of its size by which polar coordinates bend an outline of a gate (see test_observation.py)."""


@pytest.fixture(scope="module")
def strict(project: Project, drive: Drive) -> RunResult:
    """A run whose gate takes 20 % of the detections, so that many are outside."""
    parameters = with_field(project.parameters, "association.gate_probability", 0.2)
    return judged_run(RunInput.of(replace(project, parameters=parameters), drive.log, drive.start))


def is_inside(point: np.ndarray, outline: np.ndarray) -> bool:
    """Whether a ray from the point to the right crosses the outline an odd number of times."""
    x, y = point
    ahead = np.roll(outline, -1, axis=0)
    crosses = (outline[:, 1] > y) != (ahead[:, 1] > y)
    with np.errstate(divide="ignore", invalid="ignore"):
        at = outline[:, 0] + (y - outline[:, 1]) * (ahead[:, 0] - outline[:, 0]) / (ahead[:, 1] - outline[:, 1])
    return bool(np.count_nonzero(crosses & (at > x)) % 2)


def gate_of(run: RunView, center: np.ndarray, magnify: float) -> np.ndarray | None:
    """The drawn outline around a reflector; none where it is not in view."""
    gates = drawn_gates(run, magnify)
    middles = gates.mean(axis=1)
    nearest = int(np.argmin(np.hypot(*(middles - center).T)))
    return gates[nearest] if np.hypot(*(middles[nearest] - center)) < 1e-3 else None


@pytest.mark.parametrize("magnify", [1.0, 3.0, 10.0, 30.0])
def test_an_inlier_is_drawn_inside_its_gate_and_an_outlier_outside(strict: RunResult, magnify: float) -> None:
    playback = Playback(strict)
    seen = {Status.INLIER: 0, Status.OUTLIER_ASSOCIATION: 0}
    for cycle in range(1, len(strict.columns), 3):
        playback.seek(float(strict.times[cycle]))
        run = playback.view(covered=False)
        estimate = run.estimate
        assert estimate is not None
        places, _ = drawn_detections(run, magnify)
        for place, status, reflector, d2 in zip(places, estimate.status, estimate.reflector, estimate.d2, strict=True):
            if reflector < 0 or abs(np.sqrt(d2 / estimate.gate) - 1.0) < BENT:
                continue
            gate = gate_of(run, run.segment.setup.reflectors.centers[reflector], magnify)
            if gate is None or status == Status.OUTLIER_DETECTOR:
                continue
            assert is_inside(place, gate) == (status == Status.INLIER), (cycle, status, d2)
            seen[Status(status)] += 1
    assert seen[Status.INLIER] > 60
    assert seen[Status.OUTLIER_ASSOCIATION] > 30


def test_an_offset_is_as_many_times_as_long_as_the_gate_is_large(result: RunResult) -> None:
    playback = Playback(result)
    playback.seek(float(result.times[-1]) / 2)
    run = playback.view(covered=False)
    true_places, true_lines = drawn_detections(run, 1.0)
    places, lines = drawn_detections(run, 10.0)
    assert len(true_lines) == len(lines) > 0
    lengths, true_lengths = (np.hypot(*(each[:, 1] - each[:, 0]).T) for each in (lines, true_lines))
    np.testing.assert_allclose(lengths, 10.0 * true_lengths, rtol=1e-9)
    np.testing.assert_allclose(lines[:, 0], true_lines[:, 0])
    assert len(places) == len(true_places)


def test_a_detection_far_from_every_reflector_stays_where_it_is(result: RunResult) -> None:
    playback = Playback(result)
    playback.seek(float(result.times[5]))
    run = playback.view(covered=False)
    assert run.estimate is not None
    far = run.estimate.d2.copy()
    far[0] = 1e6
    places, lines = drawn_detections(replace(run, estimate=replace(run.estimate, d2=far)), 10.0)
    np.testing.assert_allclose(places[0], run.judged_map[0])
    assert len(lines) == len(places) - 1

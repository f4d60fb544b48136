"""Real robots, switched on at random times: found where they are, or not at all."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from commission.geometry.angles import wrap
from commission.io.project_file import apply_settings, load_project
from commission.io.recordings.base import load_log
from commission.localization.estimate import Mode
from commission.localization.setup import LocalizerSetup
from commission.localization.whole_run import run
from commission.studies.run import references_of
from commission.studies.start import start_of, unknown_start
from tests.tools.lost_in_the_woods import convert

TUBES = ("observation.range_sigma=0.06", "observation.bearing_sigma=0.052")
"""What the tubes show; the file says half of it."""
FILE = ("observation.range_sigma=0.03", "observation.bearing_sigma=0.026")
SECOND = 1_000_000_000


@pytest.fixture(scope="module")
def woods(shared_data, tmp_path_factory):
    folders = convert(shared_data / "lost_in_the_woods" / "dataset2.mat", tmp_path_factory.mktemp("woods"))
    return load_project(folders[0]), load_log(folders[1])


def part(log, first_ns, last_ns):
    """The records of some time, of a sensor that detects by itself."""
    moved = slice(*np.searchsorted(log.odometry_stamps_ns, (first_ns, last_ns)))
    first, last = np.searchsorted(log.detection_stamps_ns, (first_ns, last_ns))
    known = slice(*np.searchsorted(log.reference_stamps_ns, (first_ns, last_ns)))
    rows = slice(int(log.detection_offsets[first]), int(log.detection_offsets[last]))
    return dataclasses.replace(
        log,
        odometry_stamps_ns=log.odometry_stamps_ns[moved],
        displacements=log.displacements[moved],
        detection_stamps_ns=log.detection_stamps_ns[first:last],
        detection_offsets=log.detection_offsets[first : last + 1] - log.detection_offsets[first],
        range_bearing=log.range_bearing[rows],
        detection_scanners=log.detection_scanners[first:last],
        reference_stamps_ns=log.reference_stamps_ns[known],
        reference_poses=log.reference_poses[known],
    )


def off(log, columns):
    """Distance to the reference [m] and difference of the heading [rad] in every cycle; NaN where there is none."""
    reference = references_of(log, columns)
    distance = np.hypot(*(columns.means[:, :2] - reference[:, :2]).T)
    return distance, np.abs(wrap(columns.means[:, 2] - reference[:, 2]))


@pytest.mark.parametrize("sensor", [TUBES, FILE], ids=["as the tubes show", "as the file says"])
def test_a_robot_switched_on_at_any_time_is_found_within_ten_seconds_and_never_elsewhere(woods, seeds, sensor):
    project, log = woods
    setup = LocalizerSetup.of(dataclasses.replace(project, parameters=apply_settings(project.parameters, sensor)))
    rng = np.random.default_rng(0)
    starts = rng.integers(log.first_ns, log.last_ns - 30 * SECOND, 200)[: len(seeds(40, 200))]
    soon = 0
    for start in starts.tolist():
        drive = part(log, start, start + 30 * SECOND)
        columns = run(drive, setup, unknown_start(project, drive).state())
        distance, turn = off(drive, columns)
        located = np.flatnonzero(columns.modes != Mode.INITIALIZING)
        soon += len(located) > 0 and columns.stamps_ns[located[0]] - start <= 10 * SECOND
        if len(located):
            assert not distance[located[0]] > 0.5
            assert not turn[located[0]] > 0.3
        assert not (distance[columns.modes == Mode.OPERATIONAL] > 0.5).any()
    assert soon >= 0.95 * len(starts)


@pytest.mark.parametrize("seconds", [2, 5, 10])
def test_a_robot_whose_odometry_is_missing_is_found_again(woods, seconds):
    project, log = woods
    setup = LocalizerSetup.of(dataclasses.replace(project, parameters=apply_settings(project.parameters, TUBES)))
    begin = log.first_ns + 300 * SECOND
    whole = part(log, log.first_ns, begin + 60 * SECOND)
    there = (whole.odometry_stamps_ns < begin) | (whole.odometry_stamps_ns >= begin + seconds * SECOND)
    drive = dataclasses.replace(
        whole, odometry_stamps_ns=whole.odometry_stamps_ns[there], displacements=whole.displacements[there]
    )
    columns = run(drive, setup, start_of(project, drive).state())
    distance, _ = off(drive, columns)
    assert not (distance[columns.modes == Mode.OPERATIONAL] > 0.5).any()
    late = columns.stamps_ns >= begin + (seconds + 20) * SECOND
    assert (columns.modes[late] == Mode.OPERATIONAL).mean() > 0.9


@pytest.mark.parametrize("name", ["robot_in_clutter"])
def test_a_robot_among_others_that_look_like_landmarks_is_never_found_elsewhere(shared_data, seeds, name):
    project, log = load_project(shared_data / name), load_log(shared_data / name / "recording")
    setup = LocalizerSetup.of(project)
    rng = np.random.default_rng(0)
    for start in rng.integers(log.first_ns, log.last_ns - 60 * SECOND, len(seeds(4, 60))).tolist():
        drive = part(log, start, start + 60 * SECOND)
        columns = run(drive, setup, unknown_start(project, drive).state())
        distance, _ = off(drive, columns)
        located = np.flatnonzero(columns.modes != Mode.INITIALIZING)
        assert not len(located) or not distance[located[0]] > 0.6
        assert not (distance[columns.modes == Mode.OPERATIONAL] > 0.6).any()

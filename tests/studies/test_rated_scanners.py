"""Detection rates of a drive become the scanner's table: those that a virtual drive was made with come back."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from commission.io.project_file import load_project
from commission.io.recordings.base import load_log
from commission.localization.run_columns import RunColumns
from commission.simulation.scenario import virtual_drive
from commission.site.detection_rates import detection_rate
from commission.site.project import Project
from commission.site.record_log import RecordLog
from commission.site.reflectors import Reflector, ReflectorMap
from commission.site.scanner import Scanner
from commission.studies.detection_rates import DetectionRate, detection_rates
from commission.studies.rated_scanners import rated_scanners, rated_told
from commission.studies.run import RunInput, judged_run
from commission.studies.start import start_of
from tests.planning.driven import undisturbed
from tests.studies.test_detection_rates import PLACES, SHARES, standing


def run(project: Project, log: RecordLog) -> RunColumns:
    return judged_run(RunInput.of(project, log, start_of(project, log))).columns


@pytest.mark.parametrize("model", ["beam_width", "equation_3"])
def test_the_table_that_a_drive_was_made_with_comes_back_from_it(model: str) -> None:
    made_with = ((2.0, 0.9), (12.0, 0.3))
    site = undisturbed("laboratory")
    detector = replace(site.parameters.detector, expected_beams=model)
    site = replace(site, parameters=replace(site.parameters, detector=detector))
    (scanner,) = site.scanners
    driven = replace(site, scanners=(replace(scanner, detection_rates=made_with),))
    columns = run(driven, virtual_drive(driven, driven.routes[0].name, 4))
    (found,) = rated_scanners(site, columns, detection_rates(site, columns))
    assert len(found.detection_rates) >= 3
    for distance, share in found.detection_rates:
        expected = float(detection_rate(made_with, distance))  # pyright: ignore[reportArgumentType]
        # Walls hide parts of some reflectors, and beams met by the edge: neither is in the detector's share.
        assert share == pytest.approx(expected, abs=0.06)


def test_what_a_sensor_detects_by_itself_passes_no_window(tmp_path: Path) -> None:
    scanner = Scanner(field_of_view_deg=(-180.0, 180.0), range=(0.05, 30.0), reflector_range=7.0)
    reflectors = ReflectorMap(tuple(Reflector(id=f"R{i}", x=x, y=y) for i, (x, y) in enumerate(PLACES)))
    recording, _ = standing(tmp_path)
    project, log = Project(reflectors=reflectors, scanners=(scanner,)), load_log(recording)
    columns = judged_run(RunInput.of(project, log, start_of(project, log, (0.0, 0.0, 0.0), None))).columns
    rates = detection_rates(project, columns, (0.0, 5.0, 10.0, 15.0, 20.0))
    (rated,) = rated_scanners(project, columns, rates)
    assert [share for _, share in rated.detection_rates] == [pytest.approx(each.share, abs=5e-4) for each in rates]
    # Mean distances by hand: of 2.236, 2.828 and 3.041 m; of 6.708, 8.062 and 9.055 m; of 12 m.
    assert [distance for distance, _ in rated.detection_rates] == pytest.approx([2.70, 7.94, 12.0], abs=0.006)
    assert rated.reflector_range == 15.0
    assert rated_told(scanner, rated).startswith("Rates        none -> 2.7 0.8")
    assert "reflectors to 7 -> 15 m, scanner scanner" in rated_told(scanner, rated)
    assert list(SHARES) == [5.0, 10.0, 15.0]


def test_of_little_that_was_expected_nothing_is_said(tmp_path: Path) -> None:
    project, log = Project(scanners=(Scanner(),)), load_log(standing(tmp_path)[0])
    columns = judged_run(RunInput.of(project, log, start_of(project, log, (0.0, 0.0, 0.0), None))).columns
    few, enough = (
        DetectionRate(scanner="scanner", nearest=0.0, farthest=5.0, distance=3.0, expected=count, seen=10)
        for count in (29, 30)
    )
    assert rated_scanners(project, columns, [few]) == project.scanners
    assert rated_scanners(project, columns, [])[0] == project.scanners[0]
    (rated,) = rated_scanners(project, columns, [enough])
    assert rated.detection_rates == ((3.0, 0.333),)


def test_real_poles_give_the_scanner_a_table_that_falls(shared_data: Path) -> None:
    folder = shared_data / "car_park"
    project, log = load_project(folder), load_log(folder / "recording")
    given = [float(word) for word in (folder / "initial_pose").read_text(encoding="utf-8").split(",")]
    start = start_of(project, log, (given[0], given[1], given[2]), (given[3], given[4], given[5]))
    columns = judged_run(RunInput.of(project, log, start)).columns
    (rated,) = rated_scanners(project, columns, detection_rates(project, columns))
    near, far = detection_rate(rated.detection_rates, [4.0, 12.5])  # pyright: ignore[reportArgumentType]
    assert near > 0.75
    assert far < 0.25
    assert rated.reflector_range < project.scanners[0].range[1]

"""A reflector that the map does not know is a shiny thing, where it really stands; those of the map are none."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from commission.cli.inspect import Inspect
from commission.errors import UsageError
from commission.io.project_file import save_project
from commission.io.recordings.csv_writer import write_recording
from commission.localization.setup import LocalizerSetup
from commission.simulation import scenario
from commission.site.project import Project
from commission.site.record_log import RecordLog
from commission.site.reflectors import ReflectorMap
from commission.studies.run import RunInput, judged_run
from commission.studies.shiny import ShinyInput, ShinyThing, shiny_things
from commission.studies.start import Start, StartOrigin, belief_at
from tests.app.sites import room


@pytest.fixture(scope="module")
def log() -> RecordLog:
    project = room()
    light = replace(project.disturbances.intensity, enabled=True)
    return scenario.virtual_drive(
        replace(project, disturbances=replace(project.disturbances, intensity=light)), project.routes[0].name, 1
    )


def without(project: Project, name: str) -> Project:
    return replace(
        project, reflectors=ReflectorMap(tuple(each for each in project.reflectors.reflectors if each.id != name))
    )


def things(project: Project, log: RecordLog, until_s: float | None = None) -> tuple[ShinyThing, ...]:
    start = scenario.start_of(project, project.routes[0].name)
    belief = belief_at(log.first_ns, start.pose, start.sigmas.tolist())
    columns = judged_run(RunInput.of(project, log, Start(belief, StartOrigin.DRIVE))).columns
    stamp_ns = None if until_s is None else log.first_ns + round(until_s * 1e9)
    return shiny_things(ShinyInput(log=log, columns=columns, setup=LocalizerSetup.of(project), stamp_ns=stamp_ns))


def test_a_reflector_that_the_map_lacks_is_listed_where_it_stands_with_its_brightness(log: RecordLog) -> None:
    project = room()
    lacking = project.reflectors.reflectors[1]
    found = things(without(project, lacking.id), log)
    thing = found[0]
    assert (thing.x, thing.y) == pytest.approx((lacking.x, lacking.y), abs=0.05)
    assert thing.scans > 20
    assert thing.passed > 0.5
    assert thing.intensity > thing.threshold == project.parameters.detector.intensity_threshold
    distances = [
        np.hypot(pose[0] - lacking.x, pose[1] - lacking.y) for pose in log.reference_poses[:: len(log.reference_poses)]
    ]
    assert thing.nearest - 0.5 < min(distances) < thing.farthest + 0.5
    assert f"at {thing.x:.2f}, {thing.y:.2f} m: seen in {thing.scans} scans" in thing.text
    # Up to a moment there are fewer.
    before = things(without(project, lacking.id), log, until_s=3.0)
    assert sum(each.scans for each in before) < sum(each.scans for each in found)


def test_of_a_complete_map_nothing_is_listed_that_passes_as_a_reflector(log: RecordLog) -> None:
    project = room()
    for thing in things(project, log):
        assert thing.passed < 0.5, thing.text


def test_the_command_lists_them(log: RecordLog, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    project = room()
    lacking = project.reflectors.reflectors[1]
    save_project(without(project, lacking.id), tmp_path / "site")
    write_recording(tmp_path / "drive", log.records(), scanners=log.scanners)
    Inspect(recording=tmp_path / "drive", project=tmp_path / "site", shiny=True).run()
    lines = [line for line in capsys.readouterr().out.splitlines() if line.startswith("Shiny")]
    assert f"at {lacking.x:.1f}" in lines[0]
    with pytest.raises(UsageError, match="expected --project"):
        Inspect(recording=tmp_path / "drive", shiny=True).run()

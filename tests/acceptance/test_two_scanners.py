"""A vehicle with two scanners, front left and rear right: everything uses both, and figures say which one is off."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import numpy as np
import pytest

from commission import cli
from commission.io.project_file import load_project, save_project
from commission.simulation.scenario import virtual_drive
from commission.site.disturbances import ConstantErrors, Disturbances, ScannerError
from commission.site.scanner import Scanner
from commission.studies.run import RunInput, RunResult, judged_run
from commission.studies.start import start_of
from tests.planning.driven import AXES, compare, driven_along, planned_route, undisturbed
from tests.two_scanners import NAMES, with_two


@pytest.fixture
def commission(capsys):
    """Run a command line in this process: (exit code, stdout, stderr)."""

    def run(*words) -> tuple[object, str, str]:
        with pytest.raises(SystemExit) as finished:
            cli.main([str(word) for word in words])
        shown = capsys.readouterr()
        return finished.value.code, shown.out, shown.err

    return run


@pytest.fixture(scope="module", params=["shop_floor", "warehouse"])
def site(request, repository):
    """Without people, so that what is left of an error is that of scanners and wheels."""
    project = load_project(repository / "maps" / request.param)
    return with_two(project, disturbances=replace(project.disturbances, people=0))


@pytest.fixture(scope="module")
def shop_floor(repository):
    return with_two(load_project(repository / "maps" / "shop_floor"), disturbances=Disturbances())


def driven(project, seed: int = 1) -> RunResult:
    log = virtual_drive(project, project.routes[0].name, seed)
    return judged_run(RunInput.of(project, log, start_of(project, log)))


def test_both_scanners_correct_a_virtual_drive(site):
    both = driven(site)
    assert [scans.scanner for scans in both.inputs.log.scans] == [0, 1]
    assert both.statistics.position_rmse < 0.01
    for figures in both.scanners:
        assert figures.scans == pytest.approx(both.cycles / 2, abs=1)
        assert figures.accepted > 0.8 * figures.seen > 0
        assert abs(figures.reference_bearing_residual) < math.radians(0.05)
    alone = driven(replace(site, scanners=site.scanners[:1]))
    assert both.statistics.position_rmse < alone.statistics.position_rmse


def test_what_the_first_scanner_measures_does_not_depend_on_the_second(shop_floor):
    both = virtual_drive(shop_floor, shop_floor.routes[0].name, 3)
    alone = virtual_drive(replace(shop_floor, scanners=shop_floor.scanners[:1]), shop_floor.routes[0].name, 3)
    assert np.array_equal(both.scans[0].ranges, alone.scans[0].ranges, equal_nan=True)
    assert np.array_equal(both.displacements, alone.displacements)


@pytest.mark.parametrize("name", NAMES)
def test_residuals_say_which_scanner_is_turned_by_one_degree(shop_floor, name):
    turned = ScannerError(scanner=name, mounting=(0.0, 0.0, math.radians(1.0)))
    errors = ConstantErrors(scanners=(turned,))
    result = driven(replace(shop_floor, disturbances=Disturbances(constants=errors)))
    for figures in result.scanners:
        # What is truly turned counter-clockwise sees everything as much further clockwise.
        expected = -1.0 if figures.name == name else 0.0
        assert math.degrees(figures.reference_bearing_residual) == pytest.approx(expected, abs=0.1), figures.name


def test_commands_carry_both_scanners_from_project_to_summary(shop_floor, tmp_path, commission):
    save_project(replace(shop_floor, floor_map=None), tmp_path / "site")
    drive, out = tmp_path / "drive", tmp_path / "out"
    assert commission("simulate", tmp_path / "site", "--out", drive)[0] == 0
    assert sorted(path.name for path in drive.glob("scans*")) == [f"scans_{name}.npz" for name in NAMES]
    code, told, _ = commission("localize", tmp_path / "site", drive, "--out", out)
    assert code == 0
    assert all(f"Scanner      {name}: " in told for name in NAMES)
    summary = json.loads((out / "summary.json").read_text(encoding="utf-8"))
    assert [each["name"] for each in summary["scanners"]] == list(NAMES)
    assert sum(each["accepted"] for each in summary["scanners"]) == summary["inliers"]
    rows = (out / "detections.csv").read_text(encoding="utf-8").splitlines()
    assert {row.rsplit(",", 1)[1] for row in rows[1:]} == set(NAMES)


def test_a_recording_of_a_scanner_that_the_project_lacks_is_refused_by_name(shop_floor, tmp_path, commission):
    save_project(replace(shop_floor, floor_map=None), tmp_path / "site")
    assert commission("simulate", tmp_path / "site", "--out", tmp_path / "drive")[0] == 0
    save_project(replace(shop_floor, floor_map=None, scanners=(Scanner(name="top"),)), tmp_path / "site")
    code, _, err = commission("localize", tmp_path / "site", tmp_path / "drive", "--out", tmp_path / "out")
    assert code == 2
    assert "scanner 'front left' is none of the project's; expected top" in err


def test_a_drive_with_two_scanners_errs_as_predicted():
    project = with_two(undisturbed("shop_floor"))
    name = project.routes[0].name
    planned = planned_route(project, name)
    length = planned.drive.length
    found = compare(planned, (driven_along(project, name, length, seed) for seed in range(8)))
    for of in AXES:
        assert 0.9 < float(np.median(found.ratio(of))) < 1.1
        assert found.inside(of) >= 0.9
    assert found.agreement == 1.0

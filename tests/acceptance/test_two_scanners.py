"""A vehicle with two scanners, front left and rear right: everything uses both, and figures say which one is off."""

from __future__ import annotations

import csv
import json
import math
from dataclasses import replace

import numpy as np
import pytest

from commission import cli
from commission.app.run.now_panel import rows
from commission.app.run.playback import Playback
from commission.io.project_file import load_project, save_project
from commission.localization.estimate import Status
from commission.planning.dilution import Heading
from commission.planning.route_prediction import restricted
from commission.planning.vehicle_visibility import vehicle_visibility
from commission.simulation.scenario import virtual_drive
from commission.site.disturbances import ConstantErrors, Disturbances, ScannerError
from commission.site.project import Project
from commission.site.reflectors import ReflectorMap
from commission.site.scanner import Scanner
from commission.studies.coverage import CoverageInput, CoverageOptions, coverage
from commission.studies.drives import DrivesInput
from commission.studies.failures import FailuresInput, failures
from commission.studies.run import RunInput, RunResult, judged_run
from commission.studies.start import start_of
from tests.acceptance.placed import blocked_drive, demands_met_by, suggested, verdict
from tests.conftest import Seeds, few_of
from tests.planning.driven import AXES, compare, driven_along, planned_route, predicted_along, undisturbed
from tests.two_scanners import NAMES, with_two

SITES = ("shop_floor", "warehouse", "loading_bay")
"""The vehicle of the last one has two scanners anyway."""
ROUTES = (("shop_floor", 0), ("warehouse", 0), ("loading_bay", 1))
"""Site and number of the route."""
FEW_DRIVES, DRIVES = 6, 50
TWO_SIGMA = 0.954
"""Share of the errors within 2-sigma."""


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


def undisturbed_with_two(name: str) -> Project:
    """A bundled site without people, with a vehicle that has two scanners."""
    project = undisturbed(name)
    return project if len(project.scanners) == 2 else with_two(project)


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


def with_turned(project: Project, name: str) -> Project:
    """A virtual world in which a scanner is mounted one degree further counter-clockwise than the project says."""
    turned = ScannerError(scanner=name, mounting=(0.0, 0.0, math.radians(1.0)))
    return replace(project, disturbances=Disturbances(constants=ConstantErrors(scanners=(turned,))))


# What is truly turned counter-clockwise sees everything as much further clockwise.
def bearing_off(name: str, turned: str) -> object:
    """Mean residual of the bearings of a scanner that is to be expected [deg]."""
    return pytest.approx(-1.0 if name == turned else 0.0, abs=0.1)


@pytest.mark.parametrize("name", NAMES)
def test_residuals_and_the_page_say_which_scanner_is_turned_by_one_degree(shop_floor, name):
    result = driven(with_turned(shop_floor, name))
    for figures in result.scanners:
        assert math.degrees(figures.reference_bearing_residual) == bearing_off(figures.name, name)
    playback = Playback(result)
    playback.seek(math.inf)
    shown = dict(rows(playback.view(covered=False)))
    for each in NAMES:
        # Such as: +0.4 mm, -1.00°
        bearing = shown[f"{each}, to reference"].split(", ")[1].removesuffix("°")
        assert float(bearing) == bearing_off(each, name)
    # Both cannot be right: what the filter believed first rejects the other one.
    assert {shown[f"{each.name}, accepted"] for each in result.scanners} == {
        f"{each.accepted} of {each.seen}" for each in result.scanners
    }


@pytest.mark.parametrize("name", NAMES)
def test_the_summary_of_localize_says_which_scanner_is_turned_by_one_degree(shop_floor, name, tmp_path, commission):
    save_project(with_turned(replace(shop_floor, floor_map=None), name), tmp_path / "site")
    drive, out = tmp_path / "drive", tmp_path / "out"
    assert commission("simulate", tmp_path / "site", "--out", drive)[0] == 0
    code, told, _ = commission("localize", tmp_path / "site", drive, "--out", out)
    assert code == 0
    summary = json.loads((out / "summary.json").read_text(encoding="utf-8"))
    for figures in summary["scanners"]:
        assert math.degrees(figures["reference_bearing_residual_rad"]) == bearing_off(figures["name"], name)
        (line,) = (line for line in told.splitlines() if line.startswith(f"Scanner      {figures['name']}: "))
        assert float(line.split(", ")[-1].removesuffix("° against the reference")) == bearing_off(figures["name"], name)


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
    written = csv.DictReader((out / "detections.csv").read_text(encoding="utf-8").splitlines())
    assert {row["scanner"] for row in written} == set(NAMES)


def test_a_recording_of_a_scanner_that_the_project_lacks_is_refused_by_name(shop_floor, tmp_path, commission):
    save_project(replace(shop_floor, floor_map=None), tmp_path / "site")
    assert commission("simulate", tmp_path / "site", "--out", tmp_path / "drive")[0] == 0
    save_project(replace(shop_floor, floor_map=None, scanners=(Scanner(name="top"),)), tmp_path / "site")
    code, _, err = commission("localize", tmp_path / "site", tmp_path / "drive", "--out", tmp_path / "out")
    assert code == 2
    assert "scanner 'front left' is none of the project's; expected top" in err


@pytest.mark.slow
@pytest.mark.parametrize(("name", "number"), few_of(ROUTES, (("loading_bay", 1),)))
def test_drives_with_two_scanners_err_as_predicted(name, number, seeds: Seeds):
    project = undisturbed_with_two(name)
    route = project.routes[number].name
    planned = planned_route(project, route)
    drives = (driven_along(project, route, planned.drive.length, seed) for seed in seeds(FEW_DRIVES, DRIVES))
    found = compare(planned, drives)
    # Few drives know the RMS error of a metre to some 15 %, its median over the metres far better.
    margin = 0.0 if seeds.all else 0.05
    for of in AXES:
        assert 0.95 - margin < float(np.median(found.ratio(of))) < 1.05 + margin
        assert found.inside(of) >= (0.9 if seeds.all else 0.8)
    assert found.agreement == 1.0


@pytest.mark.slow
@pytest.mark.parametrize(("name", "number"), few_of(ROUTES, (("loading_bay", 1),)))
def test_without_the_reflector_that_counts_most_drives_err_as_the_what_if_says(name, number, seeds: Seeds):
    project = undisturbed_with_two(name)
    route = project.routes[number].name
    gone = failures(FailuresInput(drives=DrivesInput.of(project, (route,)))).ranking[0].reflector
    kept = np.arange(len(project.reflectors)) != gone
    planned = planned_route(project, route)
    without = ReflectorMap(project.reflectors.reflectors[:gone] + project.reflectors.reflectors[gone + 1 :])
    hall = replace(project, reflectors=without)
    drives = (driven_along(hall, route, planned.drive.length, seed) for seed in seeds(FEW_DRIVES, DRIVES))
    found = compare(restricted(planned, kept), drives)
    margin = 0.0 if seeds.all else 0.05
    for of in AXES:
        assert 0.95 - margin < float(np.median(found.ratio(of))) < 1.05 + margin
    # And it counts: without it the error is predicted to be larger.
    assert found.predicted.squares.sum() > 1.01 * predicted_along(planned).squares.sum()


@pytest.mark.parametrize("name", SITES)
def test_a_drive_detects_what_the_coverage_of_both_scanners_promises(name):
    project = undisturbed_with_two(name)
    result = driven(project, 2)
    run = result.columns
    visible = vehicle_visibility(project).visible_from_poses(run.means)
    shares: list[float] = []
    for cycle in range(50, len(run), 25):
        # A scan of each scanner, one right after the other.
        rows = slice(int(run.offsets[cycle - 1]), int(run.offsets[cycle + 1]))
        detected = set(run.reflector[rows][run.status[rows] == Status.INLIER].tolist())
        promised = set(visible.of(cycle).tolist())
        shares.append(len(detected & promised) / max(1, len(detected | promised)))
    assert float(np.mean(shares)) > 0.9


@pytest.mark.parametrize("name", SITES)
def test_coverage_with_two_scanners_is_never_worse_than_with_one_of_them(name):
    project = undisturbed_with_two(name)
    options = CoverageOptions(heading=Heading.GIVEN, given_heading=0.3, spacing=1.0)
    both, front, rear = (
        coverage(CoverageInput.of(replace(project, scanners=scanners), options)).coverage.fixes
        for scanners in (project.scanners, project.scanners[:1], project.scanners[1:])
    )
    # Where the vehicle can stand so: a scanner in a wall sees nothing.
    stands = both.visible > 0
    for alone in (front, rear):
        assert (both.visible >= alone.visible)[stands].all()
        assert (both.position_sigma <= alone.position_sigma * (1.0 + 1e-9))[stands].all()
    assert (both.visible[stands] <= front.visible[stands] + rear.visible[stands]).all()
    assert both.visible[stands].mean() > 1.2 * max(front.visible[stands].mean(), rear.visible[stands].mean())


@pytest.mark.slow
@pytest.mark.parametrize("name", few_of(("shop_floor", "warehouse"), ("shop_floor",)))
def test_a_layout_that_is_suggested_for_two_scanners_holds_in_drives(name, seeds: Seeds):
    project = undisturbed_with_two(name)
    project = project if seeds.all else replace(project, routes=project.routes[:1])
    demands = replace(demands_met_by(project), position_limit=None, heading_limit=None)
    placed, found = suggested(project, demands, spacing=1.0 if seeds.all else 2.0)
    assert found.unmet == ()
    assert found.at_least <= found.added < len(project.reflectors)
    for route in placed.routes:
        drives = [blocked_drive(placed, route.name, seed) for seed in seeds(2, DRIVES)]
        shown = verdict(placed, demands, drives)
        assert shown.operational == len(drives)
        assert shown.within >= TWO_SIGMA
        assert shown.visible >= demands.visible

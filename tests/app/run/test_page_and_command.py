"""What the page shows of a recording equals what `localize` writes of it, on the bundled sites and a real robot."""

import csv
import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from commission.app.base.actions import PROGRAM
from commission.app.base.state import AppState
from commission.app.run.actions import RecordedDrive
from commission.app.run.charts import CHARTS
from commission.app.run.effects import LoadSource
from commission.app.run.now_panel import rows
from commission.app.run.service import RunService
from commission.app.run.view import RunView
from commission.cli.localize import Localize
from commission.cli.simulate import Simulate
from commission.io.bundled import bundled_folder
from commission.io.project_file import load_project, save_project
from tests.app.owning import Owner
from tests.tools.lost_in_the_woods import convert

SITES = ("laboratory", "shop_floor", "warehouse", "lost_in_the_woods")


@pytest.fixture(scope="module", params=SITES)
def folders(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """Folders of a project and of a recording."""
    out = tmp_path_factory.mktemp(request.param)
    if request.param == "lost_in_the_woods":
        shared = request.getfixturevalue("shared_data")
        folders = convert(shared / "lost_in_the_woods" / "dataset2.mat", out)
        # What its tubes show: with the figures of the file the search for a lost robot takes most of the time.
        woods = load_project(folders[0])
        sigmas = replace(woods.parameters.observation, range_sigma=0.06, bearing_sigma=0.052)
        save_project(replace(woods, parameters=replace(woods.parameters, observation=sigmas)), folders[0])
        return folders
    project = bundled_folder("maps") / request.param
    Simulate(project=project, out=out / "drive").run()
    return project, out / "drive"


@pytest.fixture(scope="module")
def written(folders: tuple[Path, Path], tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("out") / "result"
    Localize(project=folders[0], recording=folders[1], out=out).run()
    return out


@pytest.fixture(scope="module")
def shown(folders: tuple[Path, Path]) -> RunView:
    """The page at the end of the same recording."""
    project = load_project(folders[0])
    state = AppState(project=project, saved=project)
    source = RecordedDrive(folders[1])
    owner = Owner(lambda context: RunService(context, compile_all=lambda _progress: None), state)
    owner.service.carry_out(LoadSource(source), state, PROGRAM)
    owner.settle(state)
    assert owner.service.playback is not None
    owner.service.playback.seek(math.inf)
    view = owner.service.view()
    owner.close()
    assert view is not None
    return view


def test_every_figure_is_the_same(shown: RunView, written: Path) -> None:
    summary = json.loads((written / "summary.json").read_text())
    with (written / "estimates.csv").open(newline="") as file:
        table = list(csv.DictReader(file))
    curves = {(chart.title, line.label): line.values(shown.result) for chart in CHARTS for line in chart.lines}
    assert shown.lived == summary["cycles"] == len(table)
    assert shown.duration == summary["duration_s"]
    assert dict(rows(shown))["Fail episodes so far"] == str(summary["fail_episodes"])
    assert curves["Inliers, outliers per scan", "inliers"].tolist() == [float(row["inliers"]) for row in table]
    assert curves["Inliers, outliers per scan", "outliers"].tolist() == [float(row["outliers"]) for row in table]
    for title, label, variance in (
        ("2σ of position [mm]", "x", "var_x"),
        ("2σ of position [mm]", "y", "var_y"),
    ):
        sigmas = [2000.0 * math.sqrt(float(row[variance])) for row in table]
        np.testing.assert_allclose(curves[title, label], sigmas, rtol=1e-12)
    assert [(float(row["x"]), float(row["y"])) for row in table] == [
        tuple(mean) for mean in shown.result.columns.means[:, :2].tolist()
    ]
    error = curves["Position error [mm]", "to reference"]
    error = error[np.isfinite(error)]
    assert math.sqrt(np.mean(error**2)) == pytest.approx(1000.0 * summary["position_rmse_m"], rel=1e-9)
    assert error.max() == pytest.approx(1000.0 * summary["position_max_m"], rel=1e-9)

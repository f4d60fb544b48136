"""The command `triangulate`, with a goniometer on a simulated drive of the bundled laboratory."""

import json

import numpy as np
import pytest

from commission.cli import main
from commission.geometry import se2
from commission.io.project_file import load_project
from commission.io.recordings.bearing_file import read_bearings, write_bearings
from commission.simulation.goniometer import Goniometer, reflexes
from tests.conftest import REPOSITORY

SITE = REPOSITORY / "maps" / "laboratory"
SIGMA = 0.5e-3


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    folder = tmp_path_factory.mktemp("goniometer") / "drive"
    with pytest.raises(SystemExit) as finished:
        main(["simulate", str(SITE), "--route", "P0-P1-P2-P3-P0", "--seed", "1", "--out", str(folder)])
    assert finished.value.code == 0
    rows = np.loadtxt(folder / "reference.csv", delimiter=",", skiprows=1)
    project = load_project(SITE)
    poses = se2.compose(rows[:, 1:], project.scanners[0].mounting)
    goniometer, rng = Goniometer(bearing_sigma=SIGMA), np.random.default_rng(3)
    log = reflexes(rows[:, 0].astype(np.int64), poses, project.reflectors, goniometer, rng)
    write_bearings(folder / "bearings.csv", log)
    assert read_bearings(folder).bearings.tolist() == log.bearings.tolist()
    return folder


@pytest.mark.parametrize("named", [True, False])
def test_a_drive_is_localized_by_bearings_with_names_and_without(commission, recording, tmp_path, named):
    table = tmp_path / "bearings.csv"
    text = (recording / "bearings.csv").read_text(encoding="utf-8")
    if not named:
        text = "\n".join(",".join(line.split(",")[:2]) for line in text.splitlines()) + "\n"
    table.write_text(text, encoding="utf-8")
    words = ("--bearings", table, "--bearing-sigma", str(SIGMA))
    code, told, err = commission("triangulate", SITE, recording, "--out", tmp_path / "out", *words)
    assert (code, err) == (0, "")
    assert "by three bearings each" in told
    found = json.loads((tmp_path / "out" / "summary.json").read_text(encoding="utf-8"))
    assert found["of_nobody"] < 0.02 * found["reflexes"]
    assert found["filter_position_rmse_m"] < 0.015
    assert found["fix_position_rmse_m"] < 0.05
    header = (tmp_path / "out" / "triangulation.csv").read_text(encoding="utf-8").splitlines()[0]
    assert header.startswith("stamp_ns,reflector,nis,chosen,x,y,theta")


def test_what_is_wrong_is_said_where_it_is(commission, recording, tmp_path):
    table = tmp_path / "bearings.csv"
    for text, reason in (
        ("stamp_ns,bearing\n", "has no rows"),
        ("stamp_ns,bearing\n1,west\n", "line 2, column bearing"),
        ("stamp_ns,angle\n1,0\n", "bearing"),
        ("stamp_ns,bearing,reflector\n1,0.1,nowhere\n", "'nowhere', which the map lacks"),
    ):
        table.write_text(text, encoding="utf-8")
        code, _, err = commission("triangulate", SITE, recording, "--out", tmp_path / "out", "--bearings", table)
        assert code == 2
        assert reason in err
        assert not (tmp_path / "out").exists()
    words = ("--bearing-sigma", "0")
    assert "--bearing-sigma is 0" in commission("triangulate", SITE, recording, "--out", tmp_path / "out", *words)[2]

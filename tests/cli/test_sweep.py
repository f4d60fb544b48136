"""The command `sweep`: its files hold what `localize` says of the same values, and its picture marks the project's."""

from __future__ import annotations

import csv
import json

import numpy as np
import pytest
from PIL import Image


def rows_of(folder):
    with (folder / "sweep.csv").open(newline="") as file:
        return list(csv.DictReader(file))


def test_a_curve_holds_what_localize_says(commission, project, recording, tmp_path):
    out = tmp_path / "sweep"
    code, told, err = commission(
        "sweep", project, recording, "--over", "association.gate_probability=0.5..0.9:3", "--figure",
        "position_rmse_m", "--out", out,
    )  # fmt: skip
    assert code == 0, err
    assert "3 runs over association.gate_probability" in told
    rows = rows_of(out)
    assert [float(row["association.gate_probability"]) for row in rows] == [0.5, 0.7, 0.9]
    code, _, _ = commission(
        "localize", project, recording, "--out", tmp_path / "one", "--set", "association.gate_probability=0.7"
    )
    assert code == 0
    alone = json.loads((tmp_path / "one" / "summary.json").read_text())
    assert float(rows[1]["position_rmse_m"]) == pytest.approx(alone["position_rmse_m"], rel=1e-8)
    swept = json.loads((out / "summary.json").read_text())
    assert swept["parameters"] == [
        {"key": "association.gate_probability", "from": 0.5, "to": 0.9, "count": 3, "project": 0.99}
    ]
    with Image.open(out / "sweep.png") as picture:
        assert picture.size == (960, 600)


def test_a_heatmap_has_a_cell_for_each_value_and_a_mark_at_the_project(commission, project, recording, tmp_path):
    out = tmp_path / "sweep"
    words = ("--over", "association.gate_probability=0.98..0.999:2", "--over", "observation.range_sigma=0.01..0.04:3")
    code, _, err = commission("sweep", project, recording, *words, "--out", out)
    assert code == 0, err
    rows = rows_of(out)
    assert len(rows) == 6
    values = np.array([float(row["nis_before_gate_mean"]) for row in rows]).reshape(2, 3)
    with Image.open(out / "sweep.png") as file:
        picture = np.asarray(file.convert("RGB")).astype(int)
    # Middles of the cells: the first parameter to the right, the second up; dark is large.
    xs, ys = 110 + (820 - 110) * np.array([0.25, 0.75]), 530 - (530 - 50) * np.array([1.0, 3.0, 5.0]) / 6.0
    dark = np.array([[-picture[int(y), int(x)].sum() for y in ys] for x in xs])
    assert (np.argsort(values.ravel())[[0, -1]] == np.argsort(dark.ravel(), kind="stable")[[0, -1]]).all()
    assert ((picture == (209, 36, 47)).all(axis=2)).sum() > 20


def test_a_range_that_is_none_is_refused_on_one_line(refused, project, recording, tmp_path):
    line = refused("sweep", project, recording, "--over", "association.gate_probability=1", "--out", tmp_path / "x")
    assert "expected group.key=FROM..TO:N" in line
    assert not (tmp_path / "x").exists()

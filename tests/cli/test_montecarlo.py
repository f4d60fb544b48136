"""The command `montecarlo`: its files agree with each other; a picture; what is wrong is said on one line."""

from __future__ import annotations

import csv
import json
from collections.abc import Callable
from pathlib import Path

import pytest
from PIL import Image


def test_its_files_agree_with_each_other(
    commission: Callable[..., tuple[int, str, str]], project: Path, tmp_path: Path
) -> None:
    out = tmp_path / "many"
    words = ("montecarlo", project, "--runs", "3", "--people", "0", "--glints", "0", "--kidnapping", "20", "--out", out)
    code, told, err = commission(*words)
    assert code == 0, err
    assert "hazardously misleading" in told
    with (out / "drives.csv").open(newline="") as file:
        drives = list(csv.DictReader(file))
    entries = json.loads((out / "summary.json").read_text())
    assert entries["runs"] == len(drives) == 3
    assert entries["detections"] == "shadows"
    assert entries["faults"]["kidnapping"] == 20.0
    cycles = sum(int(row["cycles"]) for row in drives)
    assert entries["cycles"] == cycles
    weighted = sum(int(row["cycles"]) * float(row["operational_fraction"]) for row in drives)
    assert entries["operational_fraction"] == pytest.approx(weighted / cycles)
    hazardous = sum(int(row["wrong_while_operational"]) for row in drives)
    assert entries["supervisor"]["hazardous"] == hazardous
    with (out / "stanford.csv").open(newline="") as file:
        cells = list(csv.DictReader(file))
    counted = sum(int(cell["cycles"]) for cell in cells)
    assert counted == sum(entries["stanford"].values()) == sum(entries["supervisor"].values())
    assert entries["position_quantiles_m"]["1"] >= max(float(row["position_max_m"]) for row in drives)
    with Image.open(out / "stanford.png") as picture:
        assert picture.size == (960, 720)


@pytest.mark.parametrize(
    ("words", "problem"),
    [
        (("--runs", "0"), "--runs is 0; expected 1 to 100000"),
        (("--no-faults", "--moved", "0.1", "--people", "2"), "--people, --moved with --no-faults"),
        (("--moved", "2"), "--moved is 2; expected a share of 0 to 1"),
        (("--route", "Nowhere"), "Nowhere"),
        (("--people", "2", "--detections", "shadows"), "which show no people"),
    ],
)
def test_what_cannot_be_done_is_refused_on_one_line(
    refused: Callable[..., str], project: Path, tmp_path: Path, words: tuple[str, ...], problem: str
) -> None:
    assert problem in refused("montecarlo", project, *words, "--out", tmp_path / "x")
    assert not (tmp_path / "x").exists()

"""The command `tune`: what it writes can be read by what it is for, and says what it is of."""

from __future__ import annotations

import csv
import dataclasses
import hashlib
import json
from collections.abc import Callable
from pathlib import Path

import pytest
import yaml

from commission.io.project_file import load_project
from commission.site.fields import get_field


@pytest.fixture
def tuned(
    commission: Callable[..., tuple[int, str, str]], project: Path, recording: Path, tmp_path: Path
) -> tuple[Path, str]:
    """Folder that `tune` has written, and what it told."""
    code, told, err = commission("tune", project, recording, "--out", tmp_path / "tuned")
    assert code == 0, err
    return tmp_path / "tuned", told


def test_the_exported_parameters_are_the_project_with_what_is_proposed(tuned: tuple[Path, str], project: Path) -> None:
    folder, _ = tuned
    summary = json.loads((folder / "summary.json").read_text())
    exported = yaml.safe_load((folder / "parameters.yaml").read_text())["parameters"]
    node = yaml.safe_load((folder / "ros_parameters.yaml").read_text())["/**"]["ros__parameters"]
    before = load_project(project)
    for key, proposed in summary["proposed"].items():
        if key.startswith(("scanners.", "reflectors.")):
            continue
        group, name = key.split(".")
        assert exported[group][name] == pytest.approx(proposed["value"], rel=1e-8)
        assert node[group][name] == exported[group][name]
        assert get_field(before.parameters, key) == proposed["before"]
    assert exported["association"]["gate_probability"] == 0.99
    assert isinstance(node["scanners"]["scanner"]["clock_offset"], float)
    # The file of the project takes it as it is.
    text = (project / "project.yaml").read_text()
    (project / "project.yaml").write_text(text[: text.index("parameters:")] + (folder / "parameters.yaml").read_text())
    read = load_project(project).parameters
    for key, proposed in summary["proposed"].items():
        if not key.startswith(("scanners.", "reflectors.")):
            assert get_field(read, key) == pytest.approx(proposed["value"], rel=1e-8)
    assert dataclasses.replace(read.association) == before.parameters.association


def test_each_file_names_project_recording_and_variant(tuned: tuple[Path, str], recording: Path) -> None:
    folder, told = tuned
    summary = json.loads((folder / "summary.json").read_text())
    files = sorted(recording.iterdir())
    named = [(each.name, hashlib.sha256(each.read_bytes()).hexdigest()) for each in files]
    assert summary["recording"] == hashlib.sha256(repr(named).encode()).hexdigest()
    for name in ("parameters.yaml", "ros_parameters.yaml", "parameters.csv"):
        text = (folder / name).read_text()
        assert all(summary[part] in text for part in ("project", "recording", "variant"))
    assert "Compared " in told


def test_the_table_for_a_controller_has_units_and_the_reasons(tuned: tuple[Path, str]) -> None:
    folder, _ = tuned
    with (folder / "parameters.csv").open(newline="") as file:
        rows = {row["key"]: row for row in csv.DictReader(file)}
    assert rows["observation.range_sigma"]["unit"] == "m"
    assert float(rows["scanners.scanner.mounting.x"]["value"]) == pytest.approx(0.2, abs=0.02)
    assert rows["scanners.scanner.mounting.heading"]["unit"] == "rad"
    assert float(rows["observation.range_bias"]["sigma"]) > 0.0
    with (folder / "reflectors.csv").open(newline="") as file:
        assert [row["id"] for row in csv.DictReader(file)] == ["R0", "R1", "R2", "R3", "R4"]
    with (folder / "comparison.csv").open(newline="") as file:
        assert {"figure", "project", "calibrated", "verdict"} == set(next(csv.DictReader(file)))


def test_files_of_others_stay_unless_it_is_asked_for(
    refused: Callable[..., str], project: Path, recording: Path, tmp_path: Path
) -> None:
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "parameters.yaml").write_text("mine")
    said = refused("tune", project, recording, "--out", tmp_path / "out")
    assert "holds parameters.yaml, which tune did not write" in said
    assert (tmp_path / "out" / "parameters.yaml").read_text() == "mine"


def test_residuals_are_said_and_drawn(tuned: tuple[Path, str]) -> None:
    folder, told = tuned
    lines = json.loads((folder / "summary.json").read_text())["residuals"]
    assert any(line.startswith("your range sigma") for line in lines)
    page = (folder / "residuals.html").read_text()
    for line in lines:
        assert f"Residuals    {line}" in told
        assert line in page
    assert "chi-square" in page
    assert page.count("<svg") > 4

"""Nothing is overwritten unasked: what each command does when something lies where it is to write."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path

import pytest

from commission.io.journal import Journal
from commission.io.journal_place import FILE_NAME as JOURNAL
from commission.io.project_file import load_project
from commission.io.project_lock import ProjectLock

RESULTS = {
    "localize": ("estimates.csv", "detections.csv", "protection.csv", "summary.json"),
    "coverage": ("coverage.npz", "coverage.csv", "coverage.png", "summary.json", "ellipses.csv"),
    "predict": ("prediction.csv", "summary.json", "dependents.csv", "failures.csv"),
    "ambiguity": ("ambiguity.npz", "ambiguous_pairs.csv", "neighbors.csv", "summary.json"),
    "montecarlo": ("drives.csv", "stanford.csv", "stanford.png", "summary.json"),
}
USUAL = {
    "coverage": ("--spacing", "1"),
    "ambiguity": ("--spacing", "2", "--headings", "2"),
    "montecarlo": ("--runs", "1", "--people", "0", "--glints", "0"),
}


def contents(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def words(name, project, recording) -> tuple[object, ...]:
    return (name, project, *((recording,) if name == "localize" else ()), *USUAL.get(name, ()))


@pytest.mark.parametrize("name", RESULTS)
def test_a_command_makes_its_own_results_again(commission, project, recording, tmp_path, name):
    for _ in range(2):
        code, _, err = commission(*words(name, project, recording), "--out", tmp_path / "out")
        assert (code, err) == (0, "")
    made = json.loads((tmp_path / "out" / ".commission.result").read_text(encoding="utf-8"))
    assert made["command"] == name
    assert set(made["files"]) == set(contents(tmp_path / "out")) - {".commission.result"}


@pytest.mark.parametrize(("name", "file"), [(name, file) for name, files in RESULTS.items() for file in files])
def test_files_that_a_command_did_not_write_are_overwritten_only_when_asked(
    refused, commission, project, recording, tmp_path, name, file
):
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / file).write_text("mine")
    said = refused(*words(name, project, recording), "--out", tmp_path / "out")
    assert f"out holds {file}, which {name} did not write; expected another folder, or --force to overwrite" in said
    assert contents(tmp_path / "out") == {file: b"mine"}
    if file == "summary.json":
        assert commission(*words(name, project, recording), "--out", tmp_path / "out", "--force")[0] == 0
        assert (tmp_path / "out" / file).read_bytes() != b"mine"


@pytest.mark.parametrize("file", ["parameters.yaml", "comparison.csv", "summary.json"])
def test_what_tune_did_not_write_is_refused_before_it_calibrates(refused, project, recording, tmp_path, file):
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / file).write_text("mine")
    said = refused("tune", project, recording, "--out", tmp_path / "out")
    assert f"out holds {file}, which tune did not write; expected another folder, or --force to overwrite" in said
    assert contents(tmp_path / "out") == {file: b"mine"}


def test_a_comparison_of_layouts_writes_nothing(commission, project, tmp_path):
    before = {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()}
    assert commission("layouts", project, project)[0] == 0
    assert {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()} == before


def test_results_of_another_command_are_named_as_such(refused, commission, project, tmp_path):
    assert commission("predict", project, "--out", tmp_path / "out")[0] == 0
    before = contents(tmp_path / "out")
    said = refused("coverage", project, "--out", tmp_path / "out")
    assert "holds summary.json of the command predict, which coverage did not write" in said
    assert contents(tmp_path / "out") == before


def test_a_result_of_an_earlier_run_that_is_not_made_now_does_not_stay(commission, project, tmp_path):
    assert commission("coverage", project, "--out", tmp_path / "out", "--spacing", "1", "--ellipses", "2")[0] == 0
    (tmp_path / "out" / "notes.txt").write_text("mine")
    assert commission("coverage", project, "--out", tmp_path / "out", "--spacing", "1")[0] == 0
    assert "ellipses.csv" not in contents(tmp_path / "out")
    assert "notes.txt" in contents(tmp_path / "out")


def test_a_manifest_of_somebody_else_removes_nothing_outside(commission, project, tmp_path):
    (tmp_path / "out").mkdir()
    (tmp_path / "precious.txt").write_text("mine")
    manifest = {"command": "coverage", "files": ["../precious.txt", "/etc/hostname", "", "."]}
    (tmp_path / "out" / ".commission.result").write_text(json.dumps(manifest))
    assert commission("coverage", project, "--out", tmp_path / "out", "--spacing", "1")[0] == 0
    assert (tmp_path / "precious.txt").read_text() == "mine"


@pytest.mark.parametrize("force", [(), ("--force",)])
def test_a_recording_is_never_the_place_of_its_own_results(refused, project, recording, force):
    before = contents(recording)
    said = refused("localize", project, recording, "--out", recording.parent / "hall" / ".." / "drive", *force)
    assert "--out is what is read" in said
    assert contents(recording) == before


def test_results_that_cannot_be_written_to_their_end_leave_nothing(refused, project, tmp_path, monkeypatch):
    def full(*_arguments: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("commission.io.coverage_files.write_text", full)
    assert "No space left on device" in refused(
        "coverage", project, "--out", tmp_path / "new" / "out", "--spacing", "1"
    )
    assert not (tmp_path / "new").exists()


def test_a_recording_is_replaced_by_a_simulation_only_when_asked(refused, commission, project, recording):
    before = contents(recording)
    said = refused("simulate", project, "--out", recording)
    assert "holds a recording or a part of one (detections.csv, odometry.csv, reference.csv)" in said
    assert "expected another folder, or --force to overwrite" in said
    assert contents(recording) == before
    assert commission("simulate", project, "--out", recording, "--force")[0] == 0
    assert sorted(contents(recording)) == ["odometry.csv", "reference.csv", "scans.npz", "truth.json"]
    (recording / "odometry.csv").unlink()
    (recording / "reference.csv").unlink()
    (recording / "truth.json").unlink()
    (recording / "scans.npz").rename(recording / "scans_left.npz")
    assert "scans_left.npz" in refused("simulate", project, "--out", recording)


def test_a_project_is_replaced_by_a_suggestion_only_when_asked(refused, commission, project, tmp_path):
    out = tmp_path / "placed"
    assert commission("place", project, "--out", out)[0] == 0
    before = contents(out)
    assert "holds the project 'Small hall'; expected another folder, or --force" in refused(
        "place", project, "--out", out
    )
    assert contents(out) == before
    assert commission("place", project, "--out", out, "--force")[0] == 0
    assert load_project(out).name == "Small hall"


def test_unsaved_edits_of_a_project_that_is_replaced_are_kept_and_not_made_over_the_new_one(
    refused, commission, project, tmp_path
):
    out = tmp_path / "placed"
    out.mkdir()
    journal = Journal(out, load_project(project))
    journal.append(dataclasses.replace(load_project(project), name="Another"), "rename")
    journal.close()
    written = journal.path.read_bytes()
    said = refused("place", project, "--out", out)
    assert "holds unsaved edits of a session that crashed or still runs (.commission.journal)" in said
    code, told, _ = commission("place", project, "--out", out, "--force")
    assert code == 0
    (kept,) = out.glob(f"{JOURNAL}.replaced-*")
    assert f"unsaved edits of the project that was there are kept in {kept}" in told
    assert kept.read_bytes() == written
    assert not (out / JOURNAL).exists()


def test_a_project_that_somebody_edits_is_not_replaced_even_when_asked(refused, commission, project, tmp_path):
    assert commission("place", project, "--out", tmp_path / "placed")[0] == 0
    lock = ProjectLock(tmp_path / "placed")
    lock.look()
    said = refused("place", project, "--out", tmp_path / "placed", "--force")
    assert "edited by process" in said
    lock.release()
    assert commission("place", project, "--out", tmp_path / "placed", "--force")[0] == 0


@pytest.mark.parametrize("target", ["table.csv", "layout.imk", "routes.lif"])
def test_a_file_is_replaced_by_a_conversion_only_when_asked(refused, commission, project, tmp_path, target):
    (tmp_path / target).write_text("mine")
    said = refused("convert", project, tmp_path / target)
    assert f"{target} exists; expected another name, or --force to overwrite" in said
    assert (tmp_path / target).read_text() == "mine"
    assert commission("convert", project, tmp_path / target, "--force")[0] == 0
    assert (tmp_path / target).read_text() != "mine"


def test_a_recording_or_a_project_is_replaced_by_a_conversion_only_when_asked(
    refused, commission, project, recording, tmp_path
):
    other = tmp_path / "other"
    assert commission("convert", recording, other)[0] == 0
    assert "other holds a recording or a part of one" in refused("convert", recording, other)
    assert commission("convert", recording, other, "--force")[0] == 0
    (tmp_path / "few.csv").write_text("id,x,y,radius\nR0,1,1,0.04\n", encoding="utf-8")
    before = contents(project)
    assert "holds the project 'Small hall'" in refused("convert", tmp_path / "few.csv", project)
    assert contents(project) == before
    assert commission("convert", tmp_path / "few.csv", project, "--force")[0] == 0
    assert len(load_project(project).reflectors) == 1


def test_a_map_is_not_put_over_the_picture_of_another_one(refused, commission, tmp_path):
    (tmp_path / "plan.dxf").write_text(
        "0\nSECTION\n2\nENTITIES\n0\nLINE\n8\nWALL\n10\n0\n20\n0\n11\n9\n21\n0\n0\nENDSEC\n0\nEOF\n"
    )
    (tmp_path / "plan.png").write_text("mine")
    said = refused("convert", tmp_path / "plan.dxf", tmp_path / "plan.yaml", "--unit", "m")
    assert "plan.png exists; expected another name" in said
    assert commission("convert", tmp_path / "plan.dxf", tmp_path / "plan.yaml", "--unit", "m", "--force")[0] == 0


@pytest.mark.parametrize(
    ("line", "said"),
    [
        (("coverage", "PROJECT", "--out", ""), "--out is empty; expected a value"),
        (("coverage", "PROJECT", "--out", " "), "--out is empty; expected a value"),
        (("coverage", "PROJECT", "--out="), "--out is empty; expected a value"),
        (("coverage", "", "--out", "x"), "argument 2 is empty; expected a value"),
        (("simulate", "PROJECT", "--out", "x", "--route", ""), "--route is empty; expected a value"),
    ],
)
def test_an_empty_value_is_an_error_and_not_the_folder_one_stands_in(
    refused, project, tmp_path, monkeypatch, line, said
):
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    assert said in refused(*(project if word == "PROJECT" else word for word in line))
    assert list((tmp_path / "here").iterdir()) == []

import json
import math

import numpy as np
import pytest


def flags(recording):
    with np.load(recording / "scans.npz") as arrays:
        return arrays["stamp_ns"], arrays["reflector"]


def test_a_virtual_drive_is_a_recording_that_localize_takes(commission, project, tmp_path):
    code, told, err = commission("simulate", project, "--route", "Straight", "--out", tmp_path / "rec", "--seed", "3")
    assert (code, err) == (0, "")
    assert "route 'Straight'" in told
    code, told, err = commission("localize", project, tmp_path / "rec", "--out", tmp_path / "out")
    assert (code, err) == (0, "")
    summary = json.loads((tmp_path / "out" / "summary.json").read_text(encoding="utf-8"))
    # 6 m at 0.5 m/s with rests: well over ten seconds, and five reflectors in sight.
    assert summary["duration_s"] > 12.0
    assert summary["inliers"] > 3 * summary["cycles"]
    assert summary["position_rmse_m"] < 0.02


def test_the_same_seed_gives_the_same_files_and_another_seed_does_not(commission, project, tmp_path):
    for name, seed in (("a", 5), ("b", 5), ("c", 6)):
        assert commission("simulate", project, "--out", tmp_path / name, "--seed", seed)[0] == 0
    names = sorted(path.name for path in (tmp_path / "a").iterdir())
    assert names == ["odometry.csv", "reference.csv", "scans.npz", "truth.json"]
    truths = [(tmp_path / name / "truth.json").read_bytes() for name in "abc"]
    assert truths[0] == truths[1] != truths[2]
    odometry = [(tmp_path / name / "odometry.csv").read_bytes() for name in "abc"]
    assert odometry[0] == odometry[1] != odometry[2]
    ranges = [np.load(tmp_path / name / "scans.npz")["ranges"] for name in "ab"]
    assert np.array_equal(*ranges, equal_nan=True)


def test_covered_reflectors_are_not_seen_for_that_time(commission, project, tmp_path):
    assert commission("simulate", project, "--out", tmp_path / "rec", "--cover", "4,3")[0] == 0
    stamps, seen = flags(tmp_path / "rec")
    covered = (stamps >= 4e9) & (stamps < 7e9)
    assert not seen[covered].any()
    assert seen[~covered].any(axis=1).all()


@pytest.mark.parametrize(("start", "is_told"), [("1000", True), ("4", False)])
def test_a_time_behind_the_end_of_the_drive_covers_nothing_and_that_is_told(
    commission, project, tmp_path, start, is_told
):
    told = commission("simulate", project, "--out", tmp_path / "rec", "--cover", f"{start},3")[1]
    assert (f"--cover {start},3 begins after the end of the drive of" in told) == is_told


def test_without_faults_the_disturbances_of_the_project_do_not_act(commission, project, tmp_path):
    with (project / "project.yaml").open("a", encoding="utf-8") as file:
        file.write("disturbances: {dropped_scans: 1.0}\n")
    assert "0 scans" in commission("simulate", project, "--out", tmp_path / "a")[1]
    assert " 0 scans" not in commission("simulate", project, "--out", tmp_path / "b", "--no-faults")[1]


def test_what_is_true_is_told_and_written_and_told_again_by_those_who_read_the_recording(commission, project, tmp_path):
    constants = "{scanners: [{scanner: scanner, mounting: [0.0, 0.003, 0.0], range_bias: 0.02}], survey_sigma: 0.01}"
    with (project / "project.yaml").open("a", encoding="utf-8") as file:
        file.write(f"disturbances: {{constants: {constants}}}\n")
    told = commission("simulate", project, "--out", tmp_path / "rec")[1]
    written = json.loads((tmp_path / "rec" / "truth.json").read_text(encoding="utf-8"))
    assert (written["schema"], written["seed"], written["route"]) == (1, 1, "Straight")
    assert written["scanners"][0]["range_bias"] == 0.02
    assert len(written["reflectors"]) == 5
    line = "True         scanner: mounting y off by 3.0 mm, range bias 20.0 mm\n"
    localized = commission("localize", project, tmp_path / "rec", "--out", tmp_path / "out")[1]
    inspected = commission("inspect", tmp_path / "rec")[1]
    for text in (told, localized, inspected):
        assert line in text
        assert "True         reflectors: 5 off, " in text
    commission("simulate", project, "--out", tmp_path / "right", "--no-faults")
    right = json.loads((tmp_path / "right" / "truth.json").read_text(encoding="utf-8"))
    assert (right["scanners"][0]["range_bias"], right["reflectors"]) == (0.0, [])
    assert right["wheels"] == written["wheels"]


def test_people_are_as_many_as_asked_for(commission, project, tmp_path):
    for name, people in (("none", 0), ("many", 30)):
        assert commission("simulate", project, "--out", tmp_path / name, "--people", people)[0] == 0
    empty, crowded = (np.load(tmp_path / name / "scans.npz")["ranges"] for name in ("none", "many"))
    # In an open field only reflectors and people return the beams.
    assert np.isfinite(crowded).sum() > 2 * np.isfinite(empty).sum()
    assert math.isfinite(float(np.nanmin(crowded)))


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--route", "Loop"], "no route is called 'Loop'; the project has: 'Straight'"),
        (["--seed", "-1"], "--seed is -1"),
        (["--seed", "x"], "--seed"),
        (["--people", "-3"], "disturbances.people is -3"),
        (["--cover", "3"], "--cover is '3'; expected START,DURATION (seconds)"),
        (["--cover", "a,b"], "--cover is 'a,b'"),
        (["--cover", "-1,5"], "covered period's start is -1"),
        (["--cover", "1,nan"], "covered period's duration is nan"),
    ],
)
def test_a_bad_option_is_refused_by_name(words, said, refused, project, tmp_path):
    assert said in refused("simulate", project, "--out", tmp_path / "rec", *words)
    assert not (tmp_path / "rec").exists()


def test_a_project_without_a_route_cannot_be_driven(refused, project, tmp_path):
    (project / "project.yaml").write_text("schema: 1\n", encoding="utf-8")
    assert "no route" in refused("simulate", project, "--out", tmp_path / "rec")


def test_a_recording_that_cannot_be_written_is_refused(refused, project, tmp_path):
    (tmp_path / "rec").write_text("a file", encoding="utf-8")
    assert "rec" in refused("simulate", project, "--out", tmp_path / "rec")

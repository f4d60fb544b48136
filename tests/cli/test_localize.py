import csv
import json
import random
from dataclasses import replace

import pytest

from commission.cli.localize import _seconds
from commission.io.project_file import load_project
from tests.conftest import few_of

KEYS = [
    *("cycles", "duration_s", "inliers", "outliers_detector", "outliers_association", "operational_fraction"),
    *("lost_fraction", "fail_episodes", "nis_mean", "nis_expected", "nis_before_gate_mean"),
    *("rejected_fraction", "unseen_fraction", "longest_unseen_s", "microseconds_per_cycle"),
]
KEYS_WITH_REFERENCE = [
    *(
        "reference_cycles",
        "outside_reference_cycles",
        "reference_gap_cycles",
        "position_rmse_m",
        "position_median_m",
        "position_p95_m",
        "position_max_m",
        "heading_rmse_rad",
    ),
    *("anees", "anees_position", "wrong_while_operational"),
]
PROTECTION_KEYS = [
    "integrity_risk",
    "protection_position_median_m",
    "protection_position_p95_m",
    "protection_heading_p95_rad",
    "protected_fraction",
]
PROTECTION_KEYS_WITH_REFERENCE = ["stanford", "beyond_protection", "beyond_heading_protection"]
ESTIMATES = "stamp_ns,x,y,theta,var_x,cov_xy,cov_xtheta,var_y,cov_ytheta,var_theta,mode,inliers,outliers"
DETECTIONS = "stamp_ns,range,bearing,x,y,status,reflector_id,d2,scanner,beams,expected_beams"


def rows(path):
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def test_the_results_are_those_of_the_recording(commission, project, recording, tmp_path):
    out = tmp_path / "deep" / "result"
    code, told, err = commission("localize", project, recording, "--out", out)
    assert (code, err) == (0, "")
    summary = json.loads((out / "summary.json").read_text(encoding="utf-8"))
    assert list(summary) == [
        *KEYS,
        *KEYS_WITH_REFERENCE,
        *PROTECTION_KEYS,
        *PROTECTION_KEYS_WITH_REFERENCE,
        *("scanners", "sections", "findings"),
    ]
    assert sum(summary["stanford"].values()) == summary["reference_cycles"]
    assert summary["beyond_protection"] == summary["beyond_heading_protection"] == 0
    assert summary["position_max_m"] < summary["protection_position_median_m"] < 0.1
    assert summary["cycles"] == 61
    assert summary["duration_s"] == pytest.approx(12.0)
    assert summary["inliers"] + summary["outliers_association"] == 61 * 5
    assert summary["operational_fraction"] == 1.0
    assert summary["fail_episodes"] == summary["wrong_while_operational"] == 0
    # Five reflectors at 2 cm and 4 mrad locate to about 1 cm.
    assert summary["position_rmse_m"] < 0.02
    assert summary["microseconds_per_cycle"] > 0.0
    assert "61 cycles in 12.0 s" in told
    assert "first reference pose" in told
    assert "mm RMS" in told

    assert (out / "estimates.csv").read_text(encoding="utf-8").splitlines()[0] == ESTIMATES
    estimates = rows(out / "estimates.csv")
    assert len(estimates) == 61
    assert {row["mode"] for row in estimates} == {"operational"}
    assert float(estimates[-1]["x"]) == pytest.approx(6.0, abs=0.05)
    assert (out / "detections.csv").read_text(encoding="utf-8").splitlines()[0] == DETECTIONS
    detections = rows(out / "detections.csv")
    assert len(detections) == 61 * 5
    inliers = [row for row in detections if row["status"] == "inlier"]
    assert len(inliers) == summary["inliers"]
    assert {row["reflector_id"] for row in inliers} == {"R0", "R1", "R2", "R3", "R4"}
    assert sum(float(row["d2"]) for row in inliers) / len(inliers) == pytest.approx(summary["nis_mean"], rel=1e-6)


def test_without_a_reference_the_errors_are_left_out_and_the_route_says_where_it_starts(
    commission, project, recording, tmp_path
):
    (recording / "reference.csv").unlink()
    code, told, _ = commission("localize", project, recording, "--out", tmp_path / "out")
    assert code == 0
    assert "start of the first route" in told
    assert "errors are unknown" in told
    assert list(json.loads((tmp_path / "out" / "summary.json").read_text(encoding="utf-8"))) == [
        *KEYS,
        *PROTECTION_KEYS,
        "scanners",
        "sections",
        "findings",
    ]
    assert not (tmp_path / "out" / "stanford.png").exists()


@pytest.mark.parametrize("form", [["--initial-pose", "-0.1,0.1,-0.01"], ["--initial-pose=-0.1,0.1,-0.01,0.2,0.2,0.1"]])
def test_an_initial_pose_may_begin_with_a_minus(form, commission, project, recording, tmp_path):
    code, told, err = commission("localize", project, recording, "--out", tmp_path / "out", *form)
    assert (code, err) == (0, "")
    assert "x -0.100 m, y 0.100 m, heading -0.6 deg (as given)" in told


def test_settings_are_repeatable_and_the_last_one_counts(commission, project, recording, tmp_path):
    settings = ["association.gate_probability=0.001", "association.gate_probability=0.9", "observation.range_bias=-0.0"]
    words = [word for setting in settings for word in ("--set", setting)]
    assert commission("localize", project, recording, "--out", tmp_path / "out", *words)[0] == 0
    inliers = json.loads((tmp_path / "out" / "summary.json").read_text(encoding="utf-8"))["inliers"]
    # A gate of 90 % passes about 90 %: 275 of 305, within six standard deviations.
    assert 245 <= inliers <= 305


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--set", "association.gate_probability"], "association.gate_probability"),
        (["--set", "association.gate_probability=2"], "association.gate_probability is 2"),
        (["--set", "association.gate_probability=much"], "association.gate_probability"),
        (["--set", "association.no_such=1"], "association.gate_probability"),
        (["--set", "no_such.gate=1"], "association"),
        (["--set", "=1"], "'=1'"),
        (["--set", "observation.range_sigma=-0.1"], "observation.range_sigma is -0.1"),
        (["--set", "observation.range_sigma=nan"], "observation.range_sigma is 'nan'"),
        (["--initial-pose", "1,2"], "has 2 numbers"),
        (["--initial-pose", "-1,x,2"], "'-1,x,2'"),
        (["--speed", "3"], "--speed"),
    ],
)
def test_a_bad_option_is_refused_by_name(words, said, refused, project, recording, tmp_path):
    assert said in refused("localize", project, recording, "--out", tmp_path / "out", *words)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("file", "text", "said"),
    [
        ("hall/project.yaml", None, "project.yaml"),
        ("hall/project.yaml", "", "schema"),
        ("hall/project.yaml", "schema: 3\n", "schema"),
        ("hall/project.yaml", "schema: 1\nscaner: {}\n", "scaner"),
        ("hall/project.yaml", "schema: 1\nreflectors: ../../etc/passwd\n", "reflectors"),
        ("hall/project.yaml", "schema: [1\n", "project.yaml"),
        ("hall/project.yaml", "schema: 1\nfloor_map: none.yaml\n", "none.yaml"),
        ("hall/reflectors.csv", "id,x,radius\nA,1,0.1\n", "y"),
        ("hall/reflectors.csv", "id,x,y,radius\nA,nan,1,0.1\n", "x"),
        ("hall/reflectors.csv", "id,x,y,radius\nA,1,1,0.1\nA,2,2,0.1\n", "'A'"),
        ("hall/reflectors.csv", "id,x,y,radius\nA,left,1,0.1\n", "left"),
        ("drive/odometry.csv", None, "odometry.csv"),
        ("drive/odometry.csv", "", "odometry.csv"),
        ("drive/odometry.csv", "stamp_ns,dx,dy,dtheta\n", "odometry.csv"),
        ("drive/odometry.csv", "stamp_ns,dx,dtheta\n0,0,0\n", "dy"),
        ("drive/odometry.csv", "stamp_ns,dx,dy,dtheta\n0,0,0,nan\n", "dtheta"),
        ("drive/detections.csv", "stamp_ns,range,bearing\n0,1,\n", "detections.csv"),
        ("drive/scans.npz", "PK", "scans.npz"),
        ("drive/reference.csv", "stamp_ns,x\n0,1\n", "reference.csv"),
    ],
)
def test_a_broken_file_is_refused_by_name(file, text, said, refused, project, recording, tmp_path):
    path = tmp_path / file
    if text is None:
        path.unlink()
    else:
        path.write_text(text, encoding="utf-8")
    assert said in refused("localize", project, recording, "--out", tmp_path / "out")


@pytest.mark.parametrize("which", ["project", "recording"])
def test_a_path_that_does_not_exist_is_refused_by_name(which, refused, project, recording, tmp_path):
    paths = {"project": project, "recording": recording} | {which: tmp_path / "nowhere"}
    assert "nowhere" in refused("localize", paths["project"], paths["recording"], "--out", tmp_path / "out")


def test_results_that_cannot_be_written_are_refused(refused, project, recording, tmp_path):
    (tmp_path / "out").write_text("a file", encoding="utf-8")
    assert "out" in refused("localize", project, recording, "--out", tmp_path / "out")


def test_a_recording_of_odometry_alone_says_that_nothing_was_seen(refused, project, recording, tmp_path):
    (recording / "detections.csv").unlink()
    assert "no scan" in refused("localize", project, recording, "--out", tmp_path / "out")


def test_a_recording_of_one_row_each_gives_one_cycle(commission, project, recording, tmp_path):
    for name in ("odometry", "detections", "reference"):
        path = recording / f"{name}.csv"
        path.write_text("\n".join(path.read_text(encoding="utf-8").splitlines()[:2]) + "\n", encoding="utf-8")
    assert commission("localize", project, recording, "--out", tmp_path / "out")[0] == 0
    assert json.loads((tmp_path / "out" / "summary.json").read_text(encoding="utf-8"))["cycles"] == 1


def mutated(content, rng):
    """Bytes of a file after a mishap: cut off, overwritten, repeated, emptied of its line ends."""
    position, length = rng.randrange(len(content)), rng.randrange(1, 30)
    cut = content[:position], content[position + length :]
    return rng.choice(
        [
            content[:position],
            cut[0] + rng.randbytes(length) + cut[1],
            cut[0]
            + rng.choice([b"nan", b"1e999", b"-", b",,", b";", b"\n", b'"', b"\x00", b"[", b"{", b": &a *a"])
            + cut[1],
            cut[0] + cut[1],
            content + content[position : position + 200],
            cut[0] + str(rng.choice([-1, 2**63, 10**40, 1e-300])).encode() + cut[1],
        ]
    )


@pytest.mark.parametrize(
    "file",
    few_of(
        [
            "hall/project.yaml",
            "hall/reflectors.csv",
            "drive/odometry.csv",
            "drive/detections.csv",
            "drive/reference.csv",
        ],
        ["hall/project.yaml", "drive/detections.csv"],
    ),
)
def test_whatever_happens_to_a_file_the_command_ends_well_or_with_one_line(
    file, commission, project, recording, tmp_path
):
    path = tmp_path / file
    content = path.read_bytes()
    for seed in range(40):
        path.write_bytes(mutated(content, random.Random(f"{file} {seed}")))
        code, _, err = commission("localize", project, recording, "--out", tmp_path / "out")
        assert (code, err.count("\n")) in ((0, 0), (2, 1)), (seed, err)
        assert "commission: unexpected" not in err, (seed, err)


@pytest.mark.parametrize(
    ("file", "text", "words"),
    [
        ("drive/odometry.csv", "stamp_ns,dx,dy,dtheta\n0,0,0,0\n100,1e300,0,0\n", []),
        ("drive/odometry.csv", "stamp_ns,dx,dy,dtheta\n-9223372036854775808,0,0,0\n9223372036854775807,0,0,0\n", []),
        ("drive/detections.csv", "stamp_ns,range,bearing\n0,1e308,1e300\n", []),
        ("drive/reference.csv", "stamp_ns,x,y,theta\n0,1e300,1e308,0\n100000000,-1e308,-1e308,0\n", []),
        ("hall/reflectors.csv", "id,x,y,radius\nA,1e300,1e300,0.1\nB,-1e300,0,0.1\n", []),
        (None, "", ["--set", "observation.range_sigma=1e300"]),
        (None, "", ["--set", "odometry.forward_per_sqrt_m=1e300"]),
        (None, "", ["--set", "supervisor.position_limit=1e300"]),
        (None, "", ["--set", "detector.min_model_error=99999999999999999999"]),
        (None, "", ["--initial-pose", "1e308,1e308,1e308"]),
        (None, "", ["--initial-pose", "0,0,0,1e200,1e200,1e200"]),
    ],
)
def test_a_number_too_large_to_calculate_with_is_refused(file, text, words, refused, project, recording, tmp_path):
    if file is not None:
        (tmp_path / file).write_text(text, encoding="utf-8")
    refused("localize", project, recording, "--out", tmp_path / "out", *words)


@pytest.mark.parametrize(
    ("file", "text", "words"),
    [
        ("drive/odometry.csv", "stamp_ns,dx,dy,dtheta\n0,0,0,0\n100,1e9,-1e9,1e9\n200,1e9,1e9,-1e9\n", []),
        ("drive/detections.csv", "stamp_ns,range,bearing\n0,1e9,1e9\n100000000,1e-9,0\n", []),
        ("hall/reflectors.csv", "id,x,y,radius\n", []),
        ("hall/reflectors.csv", "id,x,y,radius\nA,1e7,1e7,0.1\nB,-1e7,0,0.1\nC,0,0,0.1\n", []),
        (None, "", ["--set", "observation.range_sigma=1e-300", "--set", "observation.bearing_sigma=1e-300"]),
        (None, "", ["--set", "observation.range_sigma=1e9", "--set", "observation.bearing_sigma=1e9"]),
        (None, "", ["--set", "odometry.forward_per_sqrt_m=1e9", "--set", "odometry.heading_per_sqrt_s=1e9"]),
        (None, "", ["--initial-pose", "1e9,-1e9,1e9,1e9,1e9,1e9"]),
        (None, "", ["--initial-pose", "0,0,0,1e-200,1e-200,1e-200"]),
        (None, "", ["--set", "association.gate_probability=0.9999999999999999"]),
        (None, "", ["--set", "association.enabled=false"]),
    ],
)
def test_numbers_at_the_edge_of_sense_are_calculated_with(file, text, words, commission, project, recording, tmp_path):
    if file is not None:
        (tmp_path / file).write_text(text, encoding="utf-8")
    code, told, err = commission("localize", project, recording, "--out", tmp_path / "out", *words)
    assert (code, err) == (0, "")
    assert "Supervisor" in told
    json.loads((tmp_path / "out" / "summary.json").read_text(encoding="utf-8"))


def test_figures_of_detections_are_unknown_where_there_are_none(commission, project, recording, tmp_path):
    stamps = [row["stamp_ns"] for row in rows(recording / "detections.csv")]
    nothing = ["stamp_ns,range,bearing", *(f"{stamp},," for stamp in dict.fromkeys(stamps))]
    (recording / "detections.csv").write_text("\n".join(nothing) + "\n", encoding="utf-8")
    code, told, _ = commission("localize", project, recording, "--out", tmp_path / "result")
    assert code == 0
    assert "NIS          none: no detection lies near a reflector\n" in told
    assert "nan" not in told
    summary = json.loads((tmp_path / "result" / "summary.json").read_text(encoding="utf-8"))
    assert summary["nis_mean"] is None
    assert summary["unseen_fraction"] == 1.0


def test_a_reference_of_an_antenna_is_told_by_the_recording_or_by_options(
    commission, refused, project, recording, tmp_path
):
    def errors(*words):
        line = ("localize", project, recording, "--out", tmp_path / "out", "--force", "--initial-pose", "0,0,0")
        code, told, _ = commission(*line, *words)
        assert code == 0
        return json.loads((tmp_path / "out" / "summary.json").read_text(encoding="utf-8"))["position_rmse_m"], told

    at_base, told = errors()
    assert "antenna at" not in told
    # The vehicle drives along x at a heading of 0: what lies 2 m to the left of base is at y = 2.
    (recording / "reference.json").write_text('{"antenna": [0.0, 2.0]}', encoding="utf-8")
    text = (recording / "reference.csv").read_text(encoding="utf-8")
    (recording / "reference.csv").write_text(text.replace(",0,0\n", ",2.0,0\n"), encoding="utf-8")
    described, told = errors()
    # The last row ends without a line break.
    assert described == pytest.approx(at_base, rel=0.05)
    assert "antenna at 0, 2 m in the base frame, clock 0 s late" in told
    assert errors("--reference-antenna", "0,0")[0] == pytest.approx(2.0, rel=0.05)
    (recording / "reference.json").unlink()
    assert errors("--reference-antenna", "0,2,1.5")[0] == pytest.approx(described)
    late, _ = errors("--reference-antenna", "0,2", "--reference-clock", "0.5")
    assert late > described
    line = ("localize", project, recording, "--out", tmp_path / "out")
    assert "--reference-antenna '1' has 1 numbers" in refused(*line, "--reference-antenna", "1")
    assert "--reference-clock: reference.clock_offset is 1e+06" in refused(*line, "--reference-clock", "1e6")
    assert "--reference-antenna: reference.antenna" in refused(*line, "--reference-antenna", "1e12,0")


@pytest.mark.parametrize(
    ("seconds", "told"), [(0.0, "0.0 s"), (0.04, "0.04 s"), (0.996, "1.00 s"), (1.0, "1.0 s"), (12.34, "12.3 s")]
)
def test_a_time_of_one_scan_is_not_told_as_none(seconds, told):
    assert _seconds(seconds) == told


def test_how_often_reflectors_are_seen_is_told_where_it_is_asked_for(commission, project, recording, tmp_path):
    code, told, _ = commission("localize", project, recording, "--out", tmp_path / "out", "--detection-rates")
    assert code == 0
    (near, *_) = entries = json.loads((tmp_path / "out" / "summary.json").read_text())["detection_rates"]
    assert near["from_m"] < near["to_m"]
    assert near["probability_low"] < near["probability"] <= near["probability_high"] <= 1.0
    # Each reflector of that recording is seen in every scan.
    assert all(entry["seen"] == entry["expected"] > 0 for entry in entries)
    assert f"Seen         100 % ({100.0 * near['probability_low']:.0f} to 100) of {near['expected']} from" in told
    assert commission("localize", project, recording, "--out", tmp_path / "plain")[0] == 0
    assert "detection_rates" not in json.loads((tmp_path / "plain" / "summary.json").read_text())


def test_what_a_drive_sees_goes_into_another_project_and_no_setting_of_the_command_does(
    commission, refused, project, recording, tmp_path
):
    out, rated = tmp_path / "out", tmp_path / "rated"
    line = ("localize", project, recording, "--out", out, "--rated-project")
    code, told, _ = commission(*line, rated, "--set", "observation.range_sigma=0.05")
    assert code == 0
    before, after = load_project(project), load_project(rated)
    # Each reflector of that recording is seen in every scan.
    assert {share for _, share in after.scanners[0].detection_rates} == {1.0}
    assert "Rates        none -> " in told
    assert f"Rated        {rated}" in told
    kept = replace(after.scanners[0], detection_rates=(), reflector_range=before.scanners[0].reflector_range)
    assert replace(after, scanners=(kept,)) == before
    assert "Seen " in told
    assert "another folder" in refused(*line, project)
    assert "--force to overwrite" in refused(*line, rated)

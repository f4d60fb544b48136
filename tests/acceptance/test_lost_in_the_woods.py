"""A real robot among 17 identical tubes for 21 minutes (Barfoot, AER1513, dataset 2), through the real command.

The reference figures in the comments are those of an independent plain EKF (numpy, brute-force association). Most of
what is left of the error is systematic: 55 mm to the left and 1.3 deg, in the base frame.
"""

from __future__ import annotations

import csv
import json
import math
import subprocess
import sys

import pytest

from tests.tools.lost_in_the_woods import convert

ODOMETRY_NOISE = (
    "odometry.forward_per_sqrt_s=0.021",
    "odometry.heading_per_sqrt_s=0.0286",
    "odometry.forward_per_sqrt_m=0",
    "odometry.lateral_per_sqrt_m=0",
    "odometry.heading_per_sqrt_m=0",
    "odometry.heading_per_sqrt_rad=0",
)


@pytest.fixture(scope="module")
def woods(shared_data, tmp_path_factory):
    """Folders of the project and of the recording."""
    return convert(shared_data / "lost_in_the_woods" / "dataset2.mat", tmp_path_factory.mktemp("woods"))


def localize(woods, out, *settings):
    """Run the command as a user does, from the pose in the file's first row; returns the summary."""
    project, recording = woods
    first = (recording / "reference.csv").read_text(encoding="utf-8").splitlines()[1].split(",")
    words = [word for setting in (*ODOMETRY_NOISE, *settings) for word in ("--set", setting)]
    done = subprocess.run(
        [
            *(sys.executable, "-m", "commission", "localize", str(project), str(recording), "--out", str(out)),
            *("--initial-pose", ",".join([*first[1:], "0.01", "0.01", "0.01"]), *words),
        ],
        capture_output=True,
        text=True,
        timeout=240,
        check=False,
    )
    assert (done.returncode, done.stderr) == (0, "")
    return json.loads((out / "summary.json").read_text(encoding="utf-8"))


def columns(path):
    """Rows of a table by their stamp."""
    with path.open(encoding="utf-8", newline="") as file:
        return {int(row["stamp_ns"]): row for row in csv.DictReader(file)}


def position_errors(woods, out):
    """Distance to the reference [m] and mode of every cycle that has one, in order of their stamps."""
    estimates, reference = columns(out / "estimates.csv"), columns(woods[1] / "reference.csv")
    for stamp, truth in reference.items():
        estimate = estimates[stamp]
        distance = math.hypot(float(estimate["x"]) - float(truth["x"]), float(estimate["y"]) - float(truth["y"]))
        yield distance, estimate["mode"]


def test_a_real_robot_is_followed_to_seven_centimetres(woods, tmp_path):
    summary = localize(
        woods,
        tmp_path,
        "observation.range_sigma=0.06",
        "observation.bearing_sigma=0.052",
        "association.gate_probability=0.95",
    )
    assert summary["cycles"] == 12_609
    # The independent filter: 0.0667 m RMS, 0.143 m at most.
    assert summary["position_rmse_m"] <= 0.070
    assert summary["position_max_m"] <= 0.20
    errors = [distance for distance, _ in position_errors(woods, tmp_path)]
    assert len(errors) == 12_278
    # The summary and the table tell the same.
    assert summary["position_max_m"] == pytest.approx(max(errors), rel=1e-9)
    assert summary["position_rmse_m"] == pytest.approx(math.sqrt(sum(e * e for e in errors) / len(errors)), rel=1e-9)


def test_with_the_sigmas_of_the_file_the_robot_is_lost_and_says_so(woods, tmp_path):
    """The covariance cannot see a wrong association; that the filter rejects what is there, the supervisor can.

    The file's noise figures are half of what the tubes show. Detections fall out of the gate; what is left of them fits
    wrong tubes, and the covariance shrinks about a wrong pose. The paper's supervisor, which reads nothing else, calls
    the robot operational ten metres off.
    """
    optimistic = (
        "observation.range_sigma=0.03",
        "observation.bearing_sigma=0.026",
        "association.gate_probability=0.95",
    )
    summary = localize(woods, tmp_path / "paper", *optimistic, "supervisor.rejection_enabled=false")
    assert summary["position_max_m"] > 1.0
    assert summary["anees_position"] > 100.0
    assert summary["outliers_association"] > summary["inliers"]
    assert summary["wrong_while_operational"] > 1000
    assert max(error for error, mode in position_errors(woods, tmp_path / "paper") if mode == "operational") > 5.0

    summary = localize(woods, tmp_path / "both", *optimistic)
    assert summary["lost_fraction"] > 0.9
    assert summary["wrong_while_operational"] <= 15
    assert max(error for error, mode in position_errors(woods, tmp_path / "both") if mode == "operational") < 0.2
    assert any("lost" in finding for finding in summary["findings"])


def test_with_default_noise_figures_the_robot_is_lost_and_says_so(woods, tmp_path):
    summary = localize(woods, tmp_path)
    assert summary["wrong_while_operational"] == 0
    assert summary["lost_fraction"] > 0.9
    assert any("lost" in finding for finding in summary["findings"])

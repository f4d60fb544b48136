"""What a command tells a person is what its summary file holds, in the unit that stands beside the number."""

from __future__ import annotations

import json
import math
import re

import numpy as np
import pytest

from commission.cli.ambiguity import _pose as pose_text
from commission.cli.place import Place
from commission.site.layout_brief import Demands

MM, DEG, PERCENT, ONE = 1e3, 180.0 / math.pi, 100.0, 1.0


def assert_told(told: str, entries: dict, table: list[tuple[str, str, float]]) -> None:
    """Each number in its place: a pattern with one group, the summary's key, and what the unit multiplies it by."""
    for pattern, key, factor in table:
        found = re.search(pattern, told)
        assert found, (pattern, told)
        decimals = len(found[1].partition(".")[2])
        assert found[1] == f"{factor * entries[key]:.{decimals}f}", (pattern, key)


@pytest.fixture
def turning(recording):
    """The recording with a reference that is turned by 0.02 rad and aside, so that no error is nothing."""
    path = recording / "reference.csv"
    header, *rows = path.read_text(encoding="utf-8").splitlines()
    shifted = [f"{stamp},{x},0.03,0.02" for stamp, x, *_ in (row.split(",") for row in rows)]
    path.write_text("\n".join([header, *shifted]) + "\n", encoding="utf-8")
    return recording


def test_localize_tells_millimetres_degrees_and_percent(commission, project, turning, tmp_path):
    words = ("--initial-pose", "0,0,0.02,0.005,0.005,0.01", "--set", "supervisor.position_limit=0.028")
    code, told, _ = commission("localize", project, turning, "--out", tmp_path / "out", *words)
    assert code == 0
    entries = json.loads((tmp_path / "out" / "summary.json").read_text(encoding="utf-8"))
    assert_told(
        told,
        entries,
        [
            (r"in ([\d.]+) s\n", "duration_s", ONE),
            (r"position ([\d.]+) mm RMS", "position_rmse_m", MM),
            (r"RMS, ([\d.]+) median", "position_median_m", MM),
            (r"median, ([\d.]+) at 95 %", "position_p95_m", MM),
            (r"at 95 %, ([\d.]+) at most", "position_max_m", MM),
            (r"heading ([\d.]+) deg RMS", "heading_rmse_rad", DEG),
            (r"operational ([\d.]+) %", "operational_fraction", PERCENT),
            (r"ANEES ([\d.]+), of the", "anees", ONE),
            (r"of the position ([\d.]+) \(1", "anees_position", ONE),
            (r"Danger +(\d+) of", "wrong_while_operational", ONE),
        ],
    )
    # 0.02 rad is 1.1 degrees.
    assert "heading 1.1 deg" in told
    assert "beyond 28 mm" in told
    assert entries["wrong_while_operational"] > 0


def test_predict_tells_millimetres_and_degrees(commission, project, tmp_path):
    with (project / "project.yaml").open("a", encoding="utf-8") as file:
        file.write("  supervisor: {position_limit: 0.123, heading_limit: 0.04}\n")
    code, told, _ = commission("predict", project, "--route", "Straight", "--out", tmp_path / "out")
    assert code == 0
    entries = json.loads((tmp_path / "out" / "summary.json").read_text(encoding="utf-8"))
    assert_told(
        told,
        entries,
        [
            (r"Straight', ([\d.]+) m in", "length_m", ONE),
            (r" m in ([\d.]+) s", "duration_s", ONE),
            (r"2-sigma +position ([\d.]+) mm \(", "two_sigma_position_max_m", MM),
            (r"2-sigma.*\), x ([\d.]+) mm", "two_sigma_x_max_m", MM),
            (r"2-sigma.*\), x [\d.]+ mm, y ([\d.]+) mm", "two_sigma_y_max_m", MM),
            (r"heading ([\d.]+) deg \(limit", "two_sigma_theta_max_rad", DEG),
            (r"Error +2-sigma position ([\d.]+) mm", "error_two_sigma_position_max_m", MM),
            (r"Error +2-sigma .*x ([\d.]+) mm", "error_two_sigma_x_max_m", MM),
            (r"Error +2-sigma .*y ([\d.]+) mm", "error_two_sigma_y_max_m", MM),
            (r"alone: noise ([\d.]+),", "noise_two_sigma_position_max_m", MM),
            (r"alone: .*, map ([\d.]+),", "map_two_sigma_position_max_m", MM),
            (r"alone: .*, mounting ([\d.]+),", "mounting_two_sigma_position_max_m", MM),
            (r"alone: .*, range ([\d.]+),", "range_two_sigma_position_max_m", MM),
            (r"alone: .*, clock ([\d.]+) mm", "clock_two_sigma_position_max_m", MM),
            (r"Error .*\n?.*heading ([\d.]+) deg at most", "error_two_sigma_theta_max_rad", DEG),
            (r"(\d+) seen at least", "visible_min", ONE),
            (r"at least, ([\d.]+) on average", "visible_mean", ONE),
            (r"at most ([\d.]+) m on odometry", "on_odometry_max_m", ONE),
        ],
    )
    # 0.04 rad is 2.29 degrees.
    assert "(limit 123)" in told
    assert "(limit 2.29)" in told


def test_coverage_tells_millimetres_degrees_and_percent(commission, project, tmp_path):
    code, told, _ = commission("coverage", project, "--out", tmp_path / "out", "--spacing", "0.5")
    assert code == 0
    entries = json.loads((tmp_path / "out" / "summary.json").read_text(encoding="utf-8"))
    assert_told(
        told,
        entries,
        [
            (r"Floor +(\d+) m2", "area_m2", ONE),
            (r"1 or more on ([\d.]+) %", "share_1_visible", PERCENT),
            (r", 2 on ([\d.]+) %", "share_2_visible", PERCENT),
            (r", 3 on ([\d.]+) %", "share_3_visible", PERCENT),
            (r"possible on ([\d.]+) %", "share_with_fix", PERCENT),
            (r"supervisor's limits on ([\d.]+) %", "share_within_limits", PERCENT),
            (r"position ([\d.]+) mm median", "position_sigma_median_m", MM),
            (r"median, ([\d.]+) mm at 95 %", "position_sigma_p95_m", MM),
            (r"heading ([\d.]+) deg and", "heading_sigma_median_rad", DEG),
            (r"deg and ([\d.]+) deg", "heading_sigma_p95_rad", DEG),
        ],
    )


def test_heading_of_a_coverage_is_given_in_degrees(commission, project, tmp_path):
    text = (project / "project.yaml").read_text(encoding="utf-8")
    sharp = text.replace("[-180.0, 180.0]", "[-45.0, 45.0]").replace("rate: 5.0", "resolution_deg: 0.1")
    (project / "project.yaml").write_text(sharp, encoding="utf-8")
    words = ("--spacing", "0.5", "--heading", "90")
    assert commission("coverage", project, "--out", tmp_path / "out", *words)[0] == 0
    places = np.array([(2.0, 3.0), (6.0, -3.0), (9.0, 3.5), (12.0, -2.5), (15.0, 3.0)])
    with np.load(tmp_path / "out" / "coverage.npz") as found:
        visible, xs, ys = found["visible"], found["x"], found["y"]
    # Looking to the north the scanner, 0.2 m ahead of the base, sees what lies within 45 degrees of north.
    for row in range(0, len(ys), 3):
        for column in range(0, len(xs), 3):
            d = places - (xs[column], ys[row] + 0.2)
            bearing = np.degrees(np.arctan2(d[:, 1], d[:, 0])) - 90.0
            off = np.abs((bearing + 180.0) % 360.0 - 180.0)
            distance = np.hypot(*d.T)
            # Near an edge of the field of view, or of the range of 20 m, rounding decides.
            if np.abs(off - 45.0).min() > 0.1 and np.abs(distance - 20.0).min() > 0.1:
                assert visible[row, column] == np.count_nonzero((off < 45.0) & (distance < 20.0))


def test_headings_of_what_is_demanded_of_a_layout_are_given_in_degrees(tmp_path):
    given = Place(
        project=tmp_path, out=tmp_path / "out", heading_limit=3.0, unambiguous=("1,2,90", "3,4"), position_limit=0.05
    )
    demands = given._demands(Demands())
    assert demands.heading_limit == pytest.approx(0.0523598775598, rel=1e-9)
    assert demands.position_limit == 0.05
    assert demands.unambiguous_spots == ((1.0, 2.0, pytest.approx(1.57079632679, rel=1e-9)), (3.0, 4.0))


def test_a_pose_is_told_in_metres_and_degrees():
    assert pose_text((1.0, -2.0, math.pi / 3)) == "1.00, -2.00 m, 60 deg"

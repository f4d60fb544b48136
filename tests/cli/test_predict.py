import csv
import json
from dataclasses import replace

import pytest

from commission.io.project_copy import save_copy
from commission.io.project_file import load_project
from commission.site.zones import ObservationKind, Zone


def test_a_route_is_predicted_metre_by_metre(commission, project, tmp_path):
    code, told, err = commission("predict", project, "--route", "Straight", "--out", tmp_path / "out")
    assert (code, err) == (0, "")
    assert "route" in told.lower()
    with (tmp_path / "out" / "prediction.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    # Six metres, and the row of the very end.
    assert [row["metre"] for row in rows] == ["0", "1", "2", "3", "4", "5", "6"]
    assert {row["mode"] for row in rows} == {"operational"}
    summary = json.loads((tmp_path / "out" / "summary.json").read_text(encoding="utf-8"))
    # A sum of steps.
    assert summary["length_m"] == pytest.approx(6.0, abs=1e-9)
    # At first the fifth is 15.3 m away, where it may lie between two beams.
    assert summary["visible_min"] == 4
    assert summary["trips_m"] == []
    # What each source of error contributes: alone, and as a share of the square.
    for row in rows:
        shares = [float(row[f"{source}_share"]) for source in ("noise", "map", "mounting", "range", "clock")]
        assert sum(shares) == pytest.approx(1.0, abs=1e-5)
    clock = max(float(row["clock_two_sigma_position"]) for row in rows)
    assert clock == pytest.approx(summary["clock_two_sigma_position_max_m"], rel=5.001e-6, abs=0.0)
    assert f"clock {1e3 * clock:.1f} mm" in told
    # Six digits in the table.
    two_sigma_x, error_y = (max(float(row[name]) for row in rows) for name in ("two_sigma_x", "error_two_sigma_y"))
    assert two_sigma_x == pytest.approx(summary["two_sigma_x_max_m"], rel=5.001e-6, abs=0.0)
    assert error_y == pytest.approx(summary["error_two_sigma_y_max_m"], rel=5.001e-6, abs=0.0)
    assert f"Error        2-sigma position {1e3 * summary['error_two_sigma_position_max_m']:.1f} mm" in told


def test_an_unknown_route_and_an_impossible_crowd_are_refused(refused, project, tmp_path):
    assert "no route is called 'Loop'" in refused("predict", project, "--route", "Loop", "--out", tmp_path / "out")
    assert "--blocked-per-m is 2" in refused("predict", project, "--blocked-per-m", "2", "--out", tmp_path / "out")


def test_a_project_without_a_route_cannot_be_predicted(refused, project, tmp_path):
    (project / "project.yaml").write_text("schema: 1\n", encoding="utf-8")
    assert "no route" in refused("predict", project, "--out", tmp_path / "out")


def test_what_if_ranks_the_reflectors(commission, project, tmp_path):
    code, told, err = commission("predict", project, "--what-if", "blocked", "--out", tmp_path / "out")
    assert (code, err) == (0, "")
    assert "What if" in told
    with (tmp_path / "out" / "dependents.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert sorted(row["reflector_id"] for row in rows) == ["R0", "R1", "R2", "R3", "R4"]
    shares = [float(row["load"]) for row in rows]
    assert shares == sorted(shares, reverse=True)


def test_a_station_is_reached_when_both_the_filter_and_its_error_keep_to_what_it_requires(
    commission, project, tmp_path
):
    def at_the_dock(required, observation):
        text = f"stations:\n  - {{name: Dock, x: 5.9, y: 0.0, required_accuracy: {required}}}\n"
        before = (project / "project.yaml").read_text(encoding="utf-8")
        (project / "project.yaml").write_text(before + observation + text, encoding="utf-8")
        assert commission("predict", project, "--out", tmp_path / "out")[0] == 0
        (project / "project.yaml").write_text(before, encoding="utf-8")
        return json.loads((tmp_path / "out" / "summary.json").read_text(encoding="utf-8"))["stations"][0]

    # A filter that is told of far better detections than the scanner makes believes to stand better than it does.
    said = "\n  observation: {range_sigma: 0.001, bearing_sigma: 0.0001}\n"
    vain = at_the_dock(1.0, said)
    assert vain["two_sigma_m"] < 0.8 * vain["error_two_sigma_m"]
    assert vain["met"]
    squares = (vain[f"{source}_two_sigma_m"] ** 2 for source in ("noise", "map", "mounting", "range", "clock"))
    assert sum(squares) == pytest.approx(vain["error_two_sigma_m"] ** 2, rel=1e-9)
    between = 0.5 * (vain["two_sigma_m"] + vain["error_two_sigma_m"])
    assert not at_the_dock(between, said)["met"]


CARELESS = "\n  odometry: {heading_per_sqrt_m: 0.5, forward_per_sqrt_m: 0.3, lateral_per_sqrt_m: 0.3}\n"
"""Odometry so poor that a few metres on it alone pass the limits."""


def test_the_reflectors_that_hurt_most_together_are_blocked_one_after_the_other(commission, project, tmp_path):
    with (project / "project.yaml").open("a", encoding="utf-8") as file:
        file.write(CARELESS)
    code, told, err = commission("predict", project, "--failures", "9", "--out", tmp_path / "out")
    assert (code, err) == (0, "")
    with (tmp_path / "out" / "failures.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    # There are five; with the last one everything fails that did not fail before.
    assert [row["blocked"] for row in rows] == ["1", "2", "3", "4", "5"]
    assert sorted(row["reflector_id"] for row in rows) == ["R0", "R1", "R2", "R3", "R4"]
    failing = [{int(metre) for metre in row["metres"].split()} for row in rows]
    assert sum(map(len, failing)) == len(set.union(*failing))
    assert f"Failures     {sum(map(len, failing))} m fail with all 5 blocked: {rows[0]['reflector_id']} (" in told
    assert len(set.union(*failing)) >= 5
    # The first one is the one on which most depends alone.
    assert commission("predict", project, "--what-if", "blocked", "--out", tmp_path / "single")[0] == 0
    with (tmp_path / "single" / "dependents.csv").open(encoding="utf-8") as file:
        assert next(csv.DictReader(file))["reflector_id"] == rows[0]["reflector_id"]


def test_where_the_vehicle_stops_and_drives_on_is_told(commission, project, tmp_path):
    # Reflectors at both ends, and three metres between them from which none is seen.
    text = (project / "project.yaml").read_text(encoding="utf-8")
    (project / "project.yaml").write_text(text.replace("rate: 5.0", "rate: 5.0\n  reflector_range: 1.5") + CARELESS)
    rows = ["id,x,y,radius", "A,0.6,1,0.04", "B,0.6,-1,0.04", "C,5.4,1,0.04", "D,5.4,-1,0.04"]
    (project / "reflectors.csv").write_text("\n".join(rows) + "\n", encoding="utf-8")
    code, told, err = commission("predict", project, "--out", tmp_path / "out")
    assert (code, err) == (0, "")
    summary = json.loads((tmp_path / "out" / "summary.json").read_text(encoding="utf-8"))
    (stop,), (start,) = summary["trips_m"], summary["recoveries_m"]
    assert 1.0 < stop < 3.0 < start < 5.5
    assert f"stops at: {stop:.1f} m; drives on at: {start:.1f} m" in told


def test_failures_may_count_on_every_route(commission, project, tmp_path):
    text = (project / "project.yaml").read_text(encoding="utf-8")
    back = "  - {name: Back, segments: [{direction: forward, degree: 1, control_points: [[6, 0], [0, 0]]}]}\n"
    (project / "project.yaml").write_text(text.replace("parameters:", back + "parameters:"), encoding="utf-8")
    words = ("--what-if", "blocked", "--failures", "2", "--every-route", "--out", tmp_path / "out")
    code, _, err = commission("predict", project, *words)
    assert (code, err) == (0, "")
    for name in ("dependents.csv", "failures.csv"):
        with (tmp_path / "out" / name).open(encoding="utf-8") as file:
            assert {row["route"] for row in csv.DictReader(file)} == {"Straight", "Back"}


def test_a_negative_number_of_failures_is_refused(refused, project, tmp_path):
    assert "--failures is -1" in refused("predict", project, "--failures", "-1", "--out", tmp_path / "out")


def test_stations_on_the_route_are_met_or_named(commission, project, tmp_path):
    with (project / "project.yaml").open("a", encoding="utf-8") as file:
        file.write(
            "stations:\n"
            "  - {name: Dock, x: 6.0, y: 0.0, required_accuracy: 0.001}\n"
            "  - {name: Gate, x: 3.0, y: 0.1, required_accuracy: 0.1}\n"
            "  - {name: Elsewhere, x: 3.0, y: 5.0}\n"
            "  - {name: Other way round, x: 3.0, y: 0.0, heading: 3.1}\n"
        )
    code, told, err = commission("predict", project, "--out", tmp_path / "out")
    assert (code, err) == (0, "")
    assert "too uncertain at Dock" in told
    summary = json.loads((tmp_path / "out" / "summary.json").read_text(encoding="utf-8"))
    assert [(each["station"], each["met"]) for each in summary["stations"]] == [("Dock", False), ("Gate", True)]


def test_what_a_prediction_does_not_know_is_told(commission, project, tmp_path):
    site = load_project(project)
    box = ((-9.0, -9.0), (99.0, -9.0), (99.0, 99.0), (-9.0, 99.0))
    held = replace(site.parameters.supervisor, held="protection_level")
    zones = (Zone(name="Hall", outline=box, kinds=(ObservationKind.CONTOURS,)),)
    changed = replace(site, zones=zones, parameters=replace(site.parameters, supervisor=held))
    save_copy(changed, tmp_path / "zoned", force=False)
    code, told, err = commission("predict", tmp_path / "zoned", "--route", "Straight", "--out", tmp_path / "out")
    assert (code, err) == (0, "")
    assert "Zones        reflectors correct nothing on 6.0 m of the way: predicted there by odometry alone" in told
    assert "by 2-sigma: the project's supervisor holds the protection level" in told
    assert "Reflectors   0 seen at least, 0.0 on average" in told

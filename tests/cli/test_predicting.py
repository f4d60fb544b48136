import csv
import json


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
    assert summary["length_m"] == 6.0
    assert summary["visible_min"] == 5
    assert summary["trips_m"] == []
    assert max(float(row["two_sigma_x"]) for row in rows) == summary["two_sigma_x_max_m"]


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
    loads = [float(row["load"]) for row in rows]
    assert loads == sorted(loads, reverse=True)


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

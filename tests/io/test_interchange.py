from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh

from commission.errors import CommissionError, FileFormatError, UsageError
from commission.io.imk import write_imk
from commission.io.interchange import ConvertOptions, Kind, convert_file, kind_of_source
from commission.io.map_server import read_floor_map
from commission.io.project_file import load_project, save_project
from commission.io.recordings.csv_writer import write_recording
from commission.io.reflector_tables import read_reflectors, write_reflectors
from commission.site.project import Project
from commission.site.records import Odometry
from commission.site.reflectors import Reflector, ReflectorMap
from commission.site.routes import Route, Segment

USUAL = ConvertOptions()
REFLECTORS = ReflectorMap(tuple(Reflector(id=str(i), x=float(i), y=2.0) for i in range(1, 5)))
ROUTE = Route("Loop", (Segment(control_points=np.array([[0.0, 0.0], [2.0, 0.0], [4.0, 1.0], [6.0, 1.0]])),))
ORDER = {
    "version": "2.0.0",
    "orderId": "order-7",
    "nodes": [
        {"nodeId": n, "sequenceId": s, "nodePosition": {"x": x, "y": 0.0}} for n, s, x in (("a", 0, 0.0), ("b", 2, 3.0))
    ],
    "edges": [{"edgeId": "e", "sequenceId": 1, "startNodeId": "a", "endNodeId": "b"}],
}


def test_reflectors_go_from_table_to_layout_and_back(tmp_path: Path) -> None:
    table, layout, again = tmp_path / "a.csv", tmp_path / "b.imk", tmp_path / "c.csv"
    write_reflectors(REFLECTORS, table)
    assert convert_file(table, layout, USUAL) == ()
    assert convert_file(layout, again, USUAL) == ()
    # The height is the usual one, so the layout loses nothing.
    assert read_reflectors(again) == REFLECTORS


def test_project_gives_and_takes_reflectors_and_routes(tmp_path: Path) -> None:
    save_project(Project(name="Hall", reflectors=REFLECTORS, routes=(ROUTE,)), tmp_path / "hall")
    losses = convert_file(tmp_path / "hall", tmp_path / "hall.lif", USUAL)
    assert any("4 reflectors are not carried" in line for line in losses)
    convert_file(tmp_path / "hall", tmp_path / "hall.imk", USUAL)
    convert_file(tmp_path / "hall.lif", tmp_path / "copy", USUAL)
    (report,) = convert_file(tmp_path / "hall.imk", tmp_path / "copy", USUAL, force=True)
    assert report == "reflectors: 4 added, 0 changed, 0 removed, 0 as before"
    copy = load_project(tmp_path / "copy")
    assert copy.reflectors == REFLECTORS
    assert [route.name for route in copy.routes] == ["Loop"]
    np.testing.assert_array_equal(copy.routes[0].segments[0].control_points, ROUTE.segments[0].control_points)


def test_layout_leaves_alone_what_it_cannot_say_about_the_reflectors_of_a_project(tmp_path: Path) -> None:
    first, *rest = REFLECTORS.reflectors
    noted = replace(first, height=1.8, note="pillar 7")
    save_project(Project(reflectors=ReflectorMap((noted, *rest))), tmp_path / "hall")
    write_imk(ReflectorMap((replace(first, x=9.0), *rest[:-1])), tmp_path / "hall.imk")
    assert convert_file(tmp_path / "hall.imk", tmp_path / "hall", USUAL, force=True) == (
        "reflectors: 0 added, 1 changed, 1 removed, 2 as before",
    )
    assert load_project(tmp_path / "hall").reflectors.reflectors == (replace(noted, x=9.0), *rest[:-1])


def test_order_is_added_to_the_routes_of_a_project(tmp_path: Path) -> None:
    save_project(Project(name="Hall", routes=(ROUTE,)), tmp_path / "hall")
    (tmp_path / "order.json").write_text(json.dumps(ORDER))
    assert kind_of_source(tmp_path / "order.json") is Kind.ORDER
    assert "1 route and 0 stations read, 1 other route kept" in convert_file(
        tmp_path / "order.json", tmp_path / "hall", USUAL, force=True
    )
    assert [route.name for route in load_project(tmp_path / "hall").routes] == ["Loop", "order-7"]


def test_model_and_drawing_become_floor_maps(tmp_path: Path) -> None:
    trimesh.creation.box((4, 2, 3)).export(tmp_path / "hall.stl")
    convert_file(tmp_path / "hall.stl", tmp_path / "model.yaml", ConvertOptions(heights=(0.5,), resolution=0.1))
    (tmp_path / "plan.dxf").write_text(
        "0\nSECTION\n2\nENTITIES\n0\nLINE\n8\nWALL\n10\n0\n20\n0\n11\n9\n21\n0\n0\nENDSEC\n0\nEOF\n"
    )
    options = ConvertOptions(unit="m", layers=("WALL",), resolution=0.1)
    convert_file(tmp_path / "plan.dxf", tmp_path / "drawing.yaml", options)
    for name in ("model", "drawing"):
        assert (read_floor_map(tmp_path / f"{name}.yaml").cells == 100).any()
    convert_file(tmp_path / "plan.dxf", tmp_path / "hall", options)
    assert load_project(tmp_path / "hall").floor_map == read_floor_map(tmp_path / "drawing.yaml")


def test_recording_is_copied_into_a_csv_folder(tmp_path: Path) -> None:
    write_recording(tmp_path / "drive", [Odometry(0, np.zeros(3)), Odometry(100_000_000, np.array([0.1, 0.0, 0.01]))])
    convert_file(tmp_path / "drive", tmp_path / "copy", USUAL)
    assert (tmp_path / "copy/odometry.csv").read_bytes() == (tmp_path / "drive/odometry.csv").read_bytes()


@pytest.mark.parametrize(
    ("source", "target", "error", "message"),
    [
        ("absent.csv", "b.imk", FileFormatError, "does not exist; expected a file or folder to convert"),
        ("a.csv", "b.lif", UsageError, r"a reflector table \(.csv, .tsv\) is not converted into a VDMA LIF"),
        ("a.csv", "a.csv", UsageError, "is the source itself"),
        ("map.yaml", "b.csv", UsageError, "a floor map .* is not converted into a reflector table"),
        ("notes.doc", "out", FileFormatError, "ends in '.doc', which is not read; expected a folder, or a file that"),
        ("broken.json", "out", FileFormatError, "is no JSON"),
        (
            "plan.dxf",
            "b.csv",
            UsageError,
            "is not converted into a reflector table .*; expected one that ends with .yaml",
        ),
        (
            "drive",
            "b.csv",
            UsageError,
            r"recording is not converted into a .* \(.csv, .tsv\); expected a folder for the tables of a recor",
        ),
        (
            "hall",
            "b",
            UsageError,
            "hall is a project already; expected a name that ends with .csv for a reflector table",
        ),
    ],
)
def test_what_cannot_be_converted_is_one_line(
    tmp_path: Path, source: str, target: str, error: type[CommissionError], message: str
) -> None:
    write_reflectors(REFLECTORS, tmp_path / "a.csv")
    write_recording(tmp_path / "drive", [Odometry(0, np.zeros(3))])
    save_project(Project(), tmp_path / "hall")
    for name in ("map.yaml", "notes.doc", "broken.json", "plan.dxf"):
        (tmp_path / name).write_text("{")
    with pytest.raises(error, match=message) as caught:
        convert_file(tmp_path / source, tmp_path / target, USUAL)
    assert "\n" not in str(caught.value)


def test_table_of_a_spreadsheet_goes_into_a_project_and_leaves_alone_what_it_has_no_column_for(tmp_path: Path) -> None:
    first, *rest = REFLECTORS.reflectors
    noted = replace(first, note="pillar 7")
    save_project(Project(reflectors=ReflectorMap((noted, *rest))), tmp_path / "hall")
    (tmp_path / "survey.csv").write_text(f"Nr;X [mm];Y [mm]\n{first.id};9000,5;{1000 * first.y:.0f}\n")
    report = convert_file(tmp_path / "survey.csv", tmp_path / "hall", USUAL, force=True)
    assert "the table has no radius; that of its reflectors is unknown" in report
    (kept,) = load_project(tmp_path / "hall").reflectors.reflectors
    assert kept == replace(noted, x=9.0005)

"""Maps of SEER robots: what is left out is zero, bright points are no reflectors, curves keep their shape."""

from __future__ import annotations

import json
import math
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from commission.errors import CommissionError, FileFormatError
from commission.geometry.splines import Spline
from commission.io.imports import read_named
from commission.io.interchange import ConvertOptions, convert_file
from commission.io.project_file import load_project
from commission.io.smap import SmapImport, read_smap
from commission.site.floor_map import OCCUPIED
from commission.site.reflectors import ReflectorKind
from commission.site.routes import Direction

S_CURVE = ((0.0, 0.0), (4.0, 0.0), (0.0, 3.0), (4.0, 3.0))


def point(x: float, y: float) -> dict[str, float]:
    """Write a place as the robot does: without its zeros."""
    return {key: value for key, value in (("x", x), ("y", y)) if value != 0.0}


def curve(kind: str, name: str, places: tuple[tuple[float, float], ...], **properties: Any) -> dict[str, Any]:
    start, end = name.split("-")
    written = {
        "className": kind,
        "instanceName": name,
        "startPos": {"instanceName": start, "pos": point(*places[0])},
        "endPos": {"instanceName": end, "pos": point(*places[-1])},
        "property": [
            {"key": key, "type": "double", "value": "MA==", f"{type(value).__name__}Value": value}
            for key, value in properties.items()
        ],
    }
    for number, place in enumerate(places[1:-1], start=1):
        written[f"controlPos{number}"] = point(*place)
    return written


def plant() -> dict[str, Any]:
    walls = [point(x, y) for x in np.arange(-1.0, 6.05, 0.02).tolist() for y in (-2.0, 5.0)]
    square = [point(-1.0, -1.0), point(1.0, -1.0), point(1.0, 1.0), point(-1.0, 1.0)]
    return {
        "header": {"mapType": "2D-Map", "mapName": "plant", "resolution": 0.02},
        "normalPosList": walls,
        "normalLineList": [{"startPos": point(-1.0, -2.0), "endPos": point(-1.0, 5.0)}],
        "rssiPosList": [point(float(i), 1.0) for i in range(7)],
        "reflectorPosList": [
            {"type": "cylinder", "width": 0.08, **point(0.0, 2.5)},
            {"type": "plane", "width": 0.1, **point(5.0, 0.0)},
            {"type": "cylinder", **point(3.0, 4.0)},
        ],
        "advancedPointList": [
            {"className": "LocationMark", "instanceName": "LM1", "pos": point(0.0, 0.0)},
            {"className": "ActionPoint", "instanceName": "AP2", "pos": point(4.0, 3.0), "dir": math.pi / 2},
            {"className": "ChargePoint", "instanceName": "CP3", "pos": point(0.0, 3.0), "ignoreDir": True},
        ],
        "advancedCurveList": [curve("DegenerateBezier", "LM1-AP2", S_CURVE, double=0.8)],
        "advancedAreaList": [
            {"className": "ReflectorArea", "instanceName": "08", "posGroup": square},
            {"className": "LocConfigArea", "instanceName": "09", "posGroup": square},
        ],
    }


def read(tmp_path: Path, content: dict[str, Any]) -> SmapImport:
    path = tmp_path / "plant.smap"
    path.write_text(json.dumps(content), encoding="utf-8")
    return read_smap(path)


def bezier(points: list[tuple[float, float]], t: float) -> tuple[float, float]:
    """De Casteljau: the mean of neighbors, again and again."""
    while len(points) > 1:
        points = [((1 - t) * a[0] + t * b[0], (1 - t) * a[1] + t * b[1]) for a, b in pairwise(points)]
    return points[0]


def test_reflectors_are_those_of_their_own_list_and_what_is_not_said_is_unknown(tmp_path: Path) -> None:
    found = read(tmp_path, plant())
    one, plate, bare = found.reflectors.reflectors
    assert (one.id, one.x, one.y, one.radius, one.kind) == ("R1", 0.0, 2.5, 0.04, ReflectorKind.CYLINDER)
    assert (plate.x, plate.y, plate.radius, plate.kind) == (5.0, 0.0, 0.05, ReflectorKind.FLAT)
    assert plate.heading is None
    assert bare.radius is None
    told = "\n".join(found.warnings)
    assert "rssiPosList holds 7 bright points of scans; they are no reflectors" in told
    assert "which way a plate faces; its direction is unknown" in told
    assert "reflector 3: has no width; its radius is unknown" in told


def test_an_area_for_reflectors_without_any_is_told(tmp_path: Path) -> None:
    told = "\n".join(read(tmp_path, plant()).warnings)
    assert "areas are not read (1 ReflectorArea, 1 LocConfigArea)" in told
    assert "area '08': is for localization by reflectors and has fewer than 3 inside" in told
    assert "'09'" not in told
    full = plant()
    full["reflectorPosList"] = [{"type": "cylinder", "width": 0.08, **point(0.1 * i, 0.5)} for i in range(3)]
    assert "'08'" not in "\n".join(read(tmp_path, full).warnings)


@pytest.mark.parametrize(
    ("kind", "polygon"),
    [
        ("StraightPath", [S_CURVE[0], S_CURVE[3]]),
        ("BezierPath", list(S_CURVE)),
        ("DegenerateBezier", [S_CURVE[0], S_CURVE[1], S_CURVE[1], S_CURVE[2], S_CURVE[2], S_CURVE[3]]),
    ],
)
def test_a_curve_has_the_shape_of_its_class(tmp_path: Path, kind: str, polygon: list[tuple[float, float]]) -> None:
    content = plant()
    content["advancedCurveList"] = [curve(kind, "LM1-AP2", S_CURVE)]
    (route,) = read(tmp_path, content).routes
    (segment,) = route.segments
    assert segment.degree == len(polygon) - 1
    spline = Spline(segment.degree, segment.control_points)
    for t in (0.0, 0.2, 0.5, 0.9, 1.0):
        np.testing.assert_allclose(spline.point(t), bezier(polygon, t), atol=1e-12)


def test_properties_say_speed_and_direction(tmp_path: Path) -> None:
    content = plant()
    content["advancedCurveList"] = [
        {**curve("StraightPath", "A-B", ((0.0, 0.0), (1.0, 0.0))), "property": properties}
        for properties in (
            [{"key": "maxspeed", "doubleValue": 0.8}, {"key": "direction", "int32Value": 1}],
            [{"key": "direction", "int32Value": 0}, {"key": "maxspeed", "doubleValue": 999.0}],
        )
    ]
    content["advancedCurveList"][1]["instanceName"] = "B-C"
    back, forward = (route.segments[0] for route in read(tmp_path, content).routes)
    assert (back.direction, forward.direction) == (Direction.REVERSE, Direction.FORWARD)
    assert next(route.speed for route in read(tmp_path, content).routes) == pytest.approx(0.8)
    assert any("the speed is 999" in line for line in read(tmp_path, content).warnings)


def test_curves_that_can_only_follow_one_another_are_one_route(tmp_path: Path) -> None:
    content = plant()
    content["advancedCurveList"] = [
        curve("StraightPath", "A-B", ((0.0, 0.0), (1.0, 0.0))),
        curve("StraightPath", "B-C", ((1.0, 0.0), (2.0, 0.0))),
        curve("StraightPath", "C-B", ((2.0, 0.0), (1.0, 0.0))),
    ]
    lengths = sorted(len(route.segments) for route in read(tmp_path, content).routes)
    assert lengths == [1, 2]


def test_points_at_which_a_vehicle_serves_are_stations(tmp_path: Path) -> None:
    found = read(tmp_path, plant())
    assert [(s.name, s.x, s.y) for s in found.stations] == [("AP2", 4.0, 3.0), ("CP3", 0.0, 3.0)]
    assert [s.heading for s in found.stations] == pytest.approx([math.pi / 2, 0.0])
    assert any("'CP3': any heading will do" in line for line in found.warnings)


def test_points_and_lines_become_walls(tmp_path: Path) -> None:
    floor_map = read(tmp_path, plant()).floor_map(0.05)
    occupied = floor_map.cells == OCCUPIED

    def is_wall(x: float, y: float) -> bool:
        column, row = (np.array([x, y]) - floor_map.origin[:2]) // floor_map.resolution
        return bool(occupied[int(row), int(column)])

    assert is_wall(2.01, -1.99)
    assert is_wall(2.01, 5.01)
    assert is_wall(-0.99, 1.0)
    assert not is_wall(2.0, 1.0)


def test_it_becomes_a_project_a_table_a_layout_and_a_map(tmp_path: Path) -> None:
    source = tmp_path / "plant.smap"
    source.write_text(json.dumps(plant()), encoding="utf-8")
    told = convert_file(source, tmp_path / "site", ConvertOptions())
    project = load_project(tmp_path / "site")
    assert (len(project.reflectors), len(project.routes), len(project.stations)) == (3, 1, 2)
    assert project.floor_map is not None
    assert any("reflectors: 3 added" in line for line in told)
    # Once more into the same project: nothing is doubled, and what the map does not hold stays.
    convert_file(source, tmp_path / "site", ConvertOptions(), force=True)
    assert load_project(tmp_path / "site") == project
    for name in ("map.csv", "layout.imk", "layout.lif", "hall.yaml"):
        convert_file(source, tmp_path / name, ConvertOptions())
        assert (tmp_path / name).is_file()


def test_the_page_says_how_to_bring_it(tmp_path: Path) -> None:
    path = tmp_path / "plant.smap"
    path.write_text(json.dumps(plant()), encoding="utf-8")
    with pytest.raises(FileFormatError, match=r"commission convert plant\.smap FOLDER"):
        read_named(path)


def test_odd_content_is_passed_over_and_told(tmp_path: Path) -> None:
    content = plant()
    content["normalPosList"] += [{"x": "a"}, 3, {"x": 1e300}, {"y": True}]
    content["reflectorPosList"].append({"type": "cube", "width": 5.0})
    content["advancedCurveList"] += [
        {"instanceName": "X-Y", "className": "ArcPath", "startPos": {}, "endPos": {"pos": {"x": 1.0}}},
        {"instanceName": "Y-Z", "className": "BezierPath", "startPos": {}, "endPos": {"pos": {"x": 1.0}}},
        {"instanceName": "Z-Z", "className": "StraightPath", "startPos": {}, "endPos": {}},
        {"instanceName": "nowhere"},
    ]
    found = read(tmp_path, content)
    told = "\n".join(found.warnings)
    assert "4 points of normalPosList have no usable place" in told
    assert "type is 'cube'" in told
    assert "width is 5 m" in told
    assert "className 'ArcPath' is not known; a straight line is taken" in told
    assert "has no two control points; a straight line is taken" in told
    assert "begins and ends at one place" in told
    assert "has no start or no end" in told
    assert found.reflectors.reflectors[-1].radius is None


@pytest.mark.parametrize("content", ["", "[]", "{}", '{"header": {}}', '{"normalPosList": 3}'])
def test_what_is_no_map_is_refused_with_what_is_expected(tmp_path: Path, content: str) -> None:
    path = tmp_path / "plant.smap"
    path.write_text(content, encoding="utf-8")
    with pytest.raises(FileFormatError, match="expected"):
        read_smap(path)


@given(data=st.data())
def test_a_damaged_map_is_read_or_refused_in_words(
    tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
) -> None:
    text = json.dumps(plant())
    start = data.draw(st.integers(0, len(text)))
    stuff = data.draw(st.sampled_from(["", "null", "1e999", '"x"', "[", "}", "-1", "true", "{}"]))
    path = tmp_path_factory.mktemp("damaged") / "plant.smap"
    path.write_text(text[:start] + stuff + text[start + data.draw(st.integers(0, 40)) :], encoding="utf-8")
    try:
        read_smap(path)
    except CommissionError as error:
        assert "expected" in str(error)


def test_headings_in_degrees_are_taken_for_degrees_and_told(tmp_path: Path) -> None:
    content = plant()
    content["advancedPointList"] = [
        {"className": "ActionPoint", "instanceName": f"AP{number}", "pos": {"x": 1.0, "y": 2.0}, "dir": heading}
        for number, heading in enumerate((90.0, -45.0))
    ]
    found = read(tmp_path, content)
    assert [each.heading for each in found.stations] == pytest.approx([math.pi / 2, -math.pi / 4])
    assert "dir reaches 90, beyond a turn in radians: all are taken for degrees" in "\n".join(found.warnings)

from __future__ import annotations

import copy
import json
import math
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from commission.errors import CommissionError, FileFormatError, UsageError
from commission.geometry.splines import clamped_uniform_knots
from commission.io.lif import read_lif
from commission.io.lif_writer import write_lif
from commission.site.fields import in_file
from commission.site.floor_map import FloorMap
from commission.site.project import Project
from commission.site.reflectors import Reflector, ReflectorMap
from commission.site.routes import Direction, Route, Segment
from commission.site.stations import Station
from tests.io.projects import NAME, SPEED, segments

EXAMPLES = [f"{number:02}.json" for number in range(20)]
ARC = {
    "degree": 2,
    "knotVector": [0, 0, 0, 1, 1, 1],
    "controlPoints": [{"x": 2, "y": 0}, {"x": 4, "y": 0, "weight": math.sqrt(0.5)}, {"x": 4, "y": 2}],
}


def document(trajectory: Any = None, **properties: Any) -> dict[str, Any]:
    """Two nodes, an edge from A (0, 0) to B (2, 0), one from B to C (4, 2) with the given trajectory."""
    edges = [("E1", "A", "B", {}), ("E2", "B", "C", {"trajectory": trajectory} if trajectory else {})]
    return {
        "metaInformation": {},
        "layouts": [
            {
                "layoutId": "hall",
                "nodes": [
                    {"nodeId": name, "nodePosition": {"x": x, "y": y}}
                    for name, x, y in (("A", 0.0, 0.0), ("B", 2.0, 0.0), ("C", 4.0, 2.0))
                ],
                "edges": [
                    {
                        "edgeId": name,
                        "startNodeId": start,
                        "endNodeId": end,
                        "vehicleTypeEdgeProperties": [{"vehicleTypeId": "V", **properties, **extra}],
                    }
                    for name, start, end, extra in edges
                ],
                "stations": [],
            }
        ],
    }


def written(folder: Path, content: Any) -> Path:
    path = folder / "layout.lif"
    path.write_text(json.dumps(content))
    return path


def spelled_out(route: Route) -> tuple[str, list[Segment]]:
    """Route with what may be left out written down, so that equal routes compare equal."""

    def full(segment: Segment) -> Segment:
        n = len(segment.control_points)
        knots = clamped_uniform_knots(segment.degree, n) if segment.knots is None else segment.knots
        weights = np.ones(n) if segment.weights is None else segment.weights
        return replace(segment, knots=np.round(knots, 9), weights=weights, speed=route.speed_of(segment))

    return route.name, [full(segment) for segment in route.segments]


@st.composite
def routes(draw: st.DrawFn) -> Route:
    """Up to three segments, each beginning exactly where the one before ends."""
    chain = [draw(segments())]
    for _ in range(draw(st.integers(0, 2))):
        following = draw(segments())
        points = following.control_points.copy()
        points[0] = chain[-1].control_points[-1]
        if (points != points[0]).any():
            chain.append(replace(following, control_points=points))
    return Route(draw(NAME.filter(lambda name: name == name.strip())), tuple(chain), draw(SPEED))


@given(several=st.lists(routes().map(in_file), max_size=3, unique_by=lambda route: route.name))
def test_routes_that_are_written_and_read_again_are_equal(
    tmp_path_factory: pytest.TempPathFactory, several: list[Route]
) -> None:
    path = tmp_path_factory.mktemp("layout") / "layout.lif"
    write_lif(Project(routes=tuple(several)), path)
    again = read_lif(path)
    assert [spelled_out(route) for route in again.routes] == [spelled_out(route) for route in several]


@given(route=routes())
def test_a_layout_is_written_in_tenths_of_a_millimetre_and_does_not_drift(
    tmp_path_factory: pytest.TempPathFactory, route: Route
) -> None:
    path = tmp_path_factory.mktemp("layout") / "layout.lif"
    exported = datetime(2026, 1, 1, tzinfo=UTC)
    write_lif(Project(name="hall", routes=(route,)), path, exported_at=exported)
    first, text = read_lif(path).routes[0], path.read_text(encoding="utf-8")
    for new, old in zip(first.segments, route.segments, strict=True):
        assert np.abs(new.control_points - old.control_points).max() <= 0.5001e-4
    write_lif(Project(name="hall", routes=(first,)), path, exported_at=exported)
    assert path.read_text(encoding="utf-8") == text


def test_stations_are_written_and_read_again(tmp_path: Path) -> None:
    stations = (
        Station(name="Dock 1", x=2.0, y=0.0, heading=math.pi / 2, required_accuracy=0.01),
        Station(name="Wait", x=7.5, y=-3.0, heading=4.0),
    )
    route = Route("Loop", (Segment(control_points=np.array([[0.0, 0.0], [2.0, 0.0]]), degree=1),))
    losses = write_lif(Project(routes=(route,), stations=stations), tmp_path / "out.lif")
    assert "the required accuracy of 2 stations is not carried" in losses
    # Headings beyond a half turn come back as the same direction.
    expected = (
        Station(name="Dock 1", x=2.0, y=0.0, heading=math.pi / 2),
        Station(name="Wait", x=7.5, y=-3.0, heading=4.0 - 2 * math.pi),
    )
    again = read_lif(tmp_path / "out.lif").stations
    assert [(s.name, s.x, s.y) for s in again] == [(s.name, s.x, s.y) for s in expected]
    assert [s.heading for s in again] == pytest.approx([s.heading for s in expected])


@pytest.mark.parametrize("heading", [math.pi, -math.pi, 3.1415926, 3.0 * math.pi, 100.0, -3.2])
def test_a_heading_is_within_half_a_turn_however_it_is_rounded(tmp_path: Path, heading: float) -> None:
    station = Station(name="Dock", x=2.0, y=0.0, heading=heading)
    write_lif(Project(stations=(station,)), tmp_path / "out.lif")
    written = json.loads((tmp_path / "out.lif").read_text(encoding="utf-8"))["layouts"][0]["stations"][0]
    theta = written["stationPosition"]["theta"]
    assert abs(theta) <= math.pi
    assert abs(math.remainder(theta - heading, 2.0 * math.pi)) < 2e-6
    assert theta == round(theta, 6)


def test_what_lif_cannot_carry_is_said(tmp_path: Path) -> None:
    curve = Segment(
        control_points=np.array([[0.0, 0.0], [2.0, 0.0], [4.0, 2.0]]),
        direction=Direction.REVERSE,
        degree=2,
        knots=np.array([0, 0, 0, 5, 5, 5.0]),
    )
    gap = Segment(control_points=np.array([[4.005, 2.0], [6.0, 2.0]]), degree=1, speed=0.3)
    project = Project(
        floor_map=FloorMap(np.zeros((2, 2), dtype=np.int8), 0.05),
        reflectors=ReflectorMap((Reflector(id="A", x=0.0, y=0.0),)),
        routes=(Route("Loop", (curve, gap)),),
    )
    losses = "\n".join(write_lif(project, tmp_path / "out.lif"))
    for said in (
        "1 reflector is not carried: LIF knows no localization",
        "the floor map is not carried",
        "vehicle, scanner, parameters, disturbances and demands on the layout are not carried",
        "route 'Loop': knots are scaled to 0 to 1",
        "edge Loop/2: its trajectory starts 5 mm from its node",
        "each edge carries its speed",
    ):
        assert said in losses
    (route,) = read_lif(tmp_path / "out.lif").routes
    assert [segment.direction for segment in route.segments] == [Direction.REVERSE, Direction.FORWARD]
    u = np.linspace(0.0, 1.0, 50)
    np.testing.assert_allclose(route.segments[0].spline().point(u), curve.spline().point(5.0 * u), atol=1e-12)


def test_written_layout_obeys_the_official_schema(tmp_path: Path, shared_data: Path) -> None:
    schema = json.loads((shared_data / "layouts/lif/json_schemas/LIF.schema").read_text(encoding="utf-8"))
    route = Route("Loop", (Segment(control_points=np.array([[0.0, 0.0], [2.0, 0.0]]), degree=1),))
    write_lif(Project(routes=(route,)), tmp_path / "out.lif", exported_at=datetime(2024, 5, 1, 12, 0, tzinfo=UTC))
    content = json.loads((tmp_path / "out.lif").read_text())
    assert content["metaInformation"]["exportTimestamp"] == "2024-05-01T12:00:00.00Z"
    assert violations(content, schema, schema) == []


def violations(value: Any, rule: dict[str, Any], schema: dict[str, Any]) -> list[str]:
    """Breaches of the parts of JSON schema that LIF's schema uses: $ref, type, required, enum, properties, items."""
    if "$ref" in rule:
        rule = schema["definitions"][rule["$ref"].rsplit("/", 1)[1]]
    kinds = {"object": dict, "array": list, "string": str, "number": int | float, "boolean": bool}
    if "type" in rule and not isinstance(value, kinds[rule["type"]]):
        return [f"{value!r} is no {rule['type']}"]
    found = [f"{key} is missing" for key in rule.get("required", ()) if key not in value]
    if "enum" in rule and value not in rule["enum"]:
        found.append(f"{value!r} is none of {rule['enum']}")
    for key, part in rule.get("properties", {}).items():
        if isinstance(value, dict) and key in value:
            found += violations(value[key], part, schema)
    for part in value if isinstance(value, list) else ():
        found += violations(part, rule.get("items", {}), schema)
    return found


@pytest.mark.parametrize("name", EXAMPLES)
def test_official_example_is_read_with_warnings_instead_of_failure(shared_data: Path, name: str) -> None:
    imported = read_lif(shared_data / "layouts" / "lif" / "examples" / name)
    # Example 00 is a template with words in place of numbers: everything in it is passed over, and named.
    assert imported.routes or name == "00.json"
    assert all("\n" not in warning for warning in imported.warnings)


def test_official_example_whose_curves_miss_their_nodes_says_so(shared_data: Path) -> None:
    imported = read_lif(shared_data / "layouts" / "lif" / "examples" / "17.json")
    assert "edge 'N1-N2': the trajectory starts 5.000 m from its node; the trajectory is used" in imported.warnings
    assert len(imported.routes) == 2


def test_edges_that_can_only_be_driven_one_after_the_other_become_one_route(tmp_path: Path) -> None:
    (route,) = read_lif(written(tmp_path, document(ARC, maxSpeed=1.5))).routes
    assert (route.name, len(route.segments), route.speed) == ("A to C", 2, 1.5)
    assert route.segments[0].speed is None


def test_edges_at_a_corner_stay_apart(tmp_path: Path) -> None:
    # Without its trajectory the second edge leaves at 45 degrees.
    assert [route.name for route in read_lif(written(tmp_path, document())).routes] == ["E1", "E2"]


@pytest.mark.parametrize(
    ("properties", "direction", "said"),
    [
        ({}, "forward", ""),
        ({"vehicleOrientation": math.pi}, "reverse", ""),
        ({"vehicleOrientation": "3.14159265"}, "reverse", "vehicleOrientation is a number written as text"),
        ({"vehicleOrientation": 180}, "reverse", "reaches 180, beyond a turn in radians: all are taken for degrees"),
        ({"vehicleOrientation": 6.2}, "forward", "reaches 6.2; expected radians from -pi to pi"),
        ({"vehicleOrientation": 1.57}, "forward", "drives at 90 deg to its path"),
        ({"vehicleOrientation": math.pi, "orientationType": "GLOBAL"}, "reverse", "heading is fixed in the map"),
    ],
)
def test_orientation_becomes_a_direction_and_what_is_doubtful_is_said(
    tmp_path: Path, properties: dict[str, Any], direction: str, said: str
) -> None:
    imported = read_lif(written(tmp_path, document(**properties)))
    assert imported.routes[0].segments[0].direction == direction
    assert said in "\n".join(imported.warnings)
    assert bool(said) == bool(imported.warnings)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"knotVector": [0, 0, 0, 1, 1]}, "5 knots; expected 6 (3 control points + degree 2 + 1)"),
        ({"knotVector": [0, 0, 0.5, 1, 1, 1]}, "expected equal ones (clamped end)"),
        ({"knotVector": [0, 0, 0, 1, 0.5, 1]}, "expected nondecreasing knots"),
        ({"knotVector": ["zero"]}, "knotVector is not a list of numbers"),
        ({"knotVector": [0, 0, 0, 7, 7, 7]}, "knots run from 0 to 7; expected 0 to 1"),
        ({"knotVector": []}, "0 knots; expected 6"),
        ({"degree": 0}, "degree is 0; expected 1 to 10"),
        ({"degree": 2.5}, "degree is 2.5; expected 1 to 10"),
        ({"degree": 1e9}, "degree is"),
        ({"controlPoints": []}, "0 control points; expected 2 to"),
        ({"controlPoints": {"x": 1}}, "controlPoints is a mapping; expected a list"),
        ({"controlPoints": [{"x": 2, "y": 0}, {"x": 4}, {"x": 4, "y": 2}]}, "a control point has no place"),
        (
            {"controlPoints": [{"x": 2, "y": 0}, {"x": 4, "y": 0, "weight": 0}, {"x": 4, "y": 2}]},
            "weights[1] is 0",
        ),
        ({"controlPoints": [{"x": 3, "y": 0}, {"x": 4, "y": 0}, {"x": 4, "y": 3}]}, "starts 1.000 m from its node"),
    ],
)
def test_fault_of_a_trajectory_is_named_and_the_layout_still_loads(
    tmp_path: Path, change: dict[str, Any], said: str
) -> None:
    imported = read_lif(written(tmp_path, document({**ARC, **change})))
    assert said in "\n".join(imported.warnings)
    assert sum(len(route.segments) for route in imported.routes) == 2


def test_vehicle_type_and_layout_can_be_chosen(tmp_path: Path) -> None:
    content = document(ARC)
    content["layouts"].append(copy.deepcopy(content["layouts"][0]))
    content["layouts"][1]["layoutId"] = "attic"
    path = written(tmp_path, content)
    assert len(read_lif(path, layout="hall", vehicle_type="V").routes) == 1
    assert "2 layouts ('hall', 'attic') are laid over one another" in read_lif(path).warnings
    with pytest.raises(UsageError, match="no layout is called 'cellar'; the file has: 'hall', 'attic'"):
        read_lif(path, layout="cellar")
    with pytest.raises(UsageError, match="no vehicle type is called 'W'; the file has: 'V'"):
        read_lif(path, vehicle_type="W")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "is no JSON"),
        ("[1, 2]", "holds a list; expected a JSON object"),
        ("{}", "layouts: is missing; expected a list"),
        ('{"layouts": 1}', "layouts: is 1; expected a list"),
        ('{"layouts": [', "is no JSON"),
        ('{"layouts": NaN}', "is no JSON"),
        ('{"layouts": 1e999}', "is no JSON"),
        ('{"a":' * 100_000, "nested too deep"),
        ('{"layouts": ' + "9" * 5000 + "}", "is no JSON"),
    ],
)
def test_file_of_another_format_is_one_line(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "layout.lif"
    path.write_text(text)
    with pytest.raises(FileFormatError) as caught:
        read_lif(path)
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


def places(value: Any, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """Paths of all values in a document."""
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    return [path, *(place for key, part in items for place in places(part, (*path, key)))]


GARBAGE = st.sampled_from(
    [None, True, "", "x", "\u202e<b>", "1e400", -1, 0, 1e-5, 5000, 1e300, 10**400, [], [[]], {}, [{"x": {}}]]
)


@given(data=st.data())
def test_wrong_types_anywhere_are_warnings_or_one_line(
    tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
) -> None:
    content = copy.deepcopy(document(ARC, vehicleOrientation=0.0, maxSpeed=1.0))
    for _ in range(data.draw(st.integers(1, 3))):
        place = data.draw(st.sampled_from(places(content)[1:]))
        part = content
        for key in place[:-1]:
            part = part[key]
        part[place[-1]] = copy.deepcopy(data.draw(GARBAGE))
    try:
        imported = read_lif(written(tmp_path_factory.mktemp("layout"), content))
    except CommissionError as error:
        assert "\n" not in str(error)
    else:
        assert all("\n" not in warning for warning in imported.warnings)

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import BSpline

from commission.errors import FileFormatError
from commission.io.vda5050 import read_order
from commission.site.routes import Direction

QUARTER = {
    "degree": 2,
    "knotVector": [0, 0, 0, 1, 1, 1],
    "controlPoints": [{"x": 2, "y": 0}, {"x": 4, "y": 0, "weight": math.sqrt(0.5)}, {"x": 4, "y": 2, "weight": 1}],
}
"""A quarter of the circle around (2, 2) with radius 2: the textbook's NURBS."""


def order(version: str, *trajectories: Any, **edge: Any) -> dict[str, Any]:
    """Order from (0, 0) over (2, 0) to (4, 2), written as the version demands."""
    speed = "maximumSpeed" if version.startswith("3") else "maxSpeed"
    points = [(0.0, 0.0), (2.0, 0.0), (4.0, 2.0)]
    return {
        "version": version,
        "orderId": "order-7",
        "nodes": [
            {"nodeId": f"n{i}", "sequenceId": 2 * i, "released": True, "nodePosition": {"x": x, "y": y, "mapId": "m"}}
            for i, (x, y) in enumerate(points)
        ],
        "edges": [
            {
                "edgeId": f"e{i}",
                "sequenceId": 2 * i + 1,
                "released": True,
                "startNodeId": f"n{i}",
                "endNodeId": f"n{i + 1}",
                speed: 0.8,
                **({"trajectory": trajectory} if trajectory else {}),
                **edge,
            }
            for i, trajectory in enumerate(trajectories)
        ],
    }


def read(folder: Path, content: Any):
    path = folder / "order.json"
    path.write_text(json.dumps(content))
    return read_order(path)


@pytest.mark.parametrize("version", ["2.0.0", "2.1.0", "3.0.0"])
def test_order_of_each_version_becomes_a_route(tmp_path: Path, version: str) -> None:
    imported = read(tmp_path, order(version, None, QUARTER))
    (route,) = imported.routes
    assert imported.warnings == ()
    assert (route.name, route.speed, len(route.segments)) == ("order-7", 0.8, 2)


def test_rational_curve_is_the_exact_circle(tmp_path: Path) -> None:
    (route,) = read(tmp_path, order("2.0.0", None, QUARTER)).routes
    points = route.segments[1].spline().point(np.linspace(0.0, 1.0, 100))
    # A quarter circle is an exact NURBS; what remains is rounding.
    np.testing.assert_allclose(np.hypot(points[:, 0] - 2.0, points[:, 1] - 2.0), 2.0, atol=1e-12)


@st.composite
def trajectories(draw: st.DrawFn) -> dict[str, Any]:
    """A valid NURBS with inner knots of any allowed multiplicity and weights over four decades."""
    degree = draw(st.integers(1, 5))
    inner: list[float] = []
    for knot in draw(st.lists(st.floats(0.01, 0.99), max_size=4, unique=True)):
        inner += [knot] * draw(st.integers(1, degree))
    n = degree + 1 + len(inner)
    coordinate = st.floats(-100.0, 100.0)
    points = draw(st.lists(st.tuples(coordinate, coordinate), min_size=n, max_size=n, unique=True))
    weights = draw(st.lists(st.floats(0.01, 100.0), min_size=n, max_size=n))
    return {
        "degree": degree,
        "knotVector": [0.0] * (degree + 1) + sorted(inner) + [1.0] * (degree + 1),
        "controlPoints": [{"x": x, "y": y, "weight": w} for (x, y), w in zip(points, weights, strict=True)],
    }


@given(trajectory=trajectories())
def test_imported_curve_is_the_same_as_an_independent_evaluation_of_it(
    tmp_path_factory: pytest.TempPathFactory, trajectory: dict[str, Any]
) -> None:
    (route,) = read(tmp_path_factory.mktemp("order"), order("2.1.0", trajectory)).routes
    points = np.array([(p["x"], p["y"]) for p in trajectory["controlPoints"]])
    weights = np.array([p["weight"] for p in trajectory["controlPoints"]])
    # Independent: scipy evaluates the homogeneous B-spline; dividing by the weight gives the rational curve.
    homogeneous = BSpline(
        trajectory["knotVector"], np.column_stack((points * weights[:, None], weights)), trajectory["degree"]
    )
    u = np.linspace(0.0, 1.0, 200)
    expected = homogeneous(u)
    actual = route.segments[0].spline().point(u)
    # The limit is the requirement: 1e-9 m.
    np.testing.assert_allclose(actual, expected[:, :2] / expected[:, 2:], rtol=0.0, atol=1e-9)


def test_version_3_may_leave_out_degree_knots_and_weights(tmp_path: Path) -> None:
    line = {"controlPoints": [{"x": 0, "y": 0}, {"x": 1, "y": 1}, {"x": 2, "y": 0}]}
    (route,) = read(tmp_path, order("3.0.0", line)).routes
    (segment,) = route.segments
    assert (segment.degree, segment.knots, segment.weights) == (1, None, None)
    np.testing.assert_allclose(segment.spline().point(0.5), [1.0, 1.0])


def test_edges_are_driven_in_their_sequence_and_nodes_found_by_it(tmp_path: Path) -> None:
    content = order("3.0.0", None, QUARTER)
    content["edges"].reverse()
    for part in content["edges"]:
        del part["startNodeId"], part["endNodeId"]
    # Version 3 allows one name for several nodes of an order.
    for node in content["nodes"]:
        node["nodeId"] = "same"
    (route,) = read(tmp_path, content).routes
    np.testing.assert_allclose(route.segments[0].control_points, [[0.0, 0.0], [2.0, 0.0]])
    assert len(route.segments) == 2


def test_orientation_pi_is_reverse(tmp_path: Path) -> None:
    (route,) = read(tmp_path, order("2.0.0", None, orientation=math.pi)).routes
    assert route.segments[0].direction is Direction.REVERSE


def test_what_is_not_read_and_what_is_doubtful_is_said(tmp_path: Path) -> None:
    content = order("1.1", None, None, corridor={}, actions=[{"actionType": "pick"}], released=False)
    warnings = "\n".join(read(tmp_path, content).warnings)
    for said in (
        "version is '1.1'; known are 2.0, 2.1, 3.0",
        "2 edges are not released yet",
        "2 actions are not read",
        "corridors are not read",
        "route 'order-7', node 'n1': the vehicle must turn by 45 deg on the spot",
    ):
        assert said in warnings


def test_edges_with_a_gap_become_two_routes(tmp_path: Path) -> None:
    far = {"controlPoints": [{"x": 9, "y": 9}, {"x": 10, "y": 10}]}
    imported = read(tmp_path, order("3.0.0", None, far))
    assert [route.name for route in imported.routes] == ["order-7", "order-7 (2)"]
    assert "edges do not follow one another; the order becomes 2 routes" in imported.warnings


@pytest.mark.parametrize(
    "text", ["{}", '{"nodes": []}', '{"nodes": {}, "edges": []}', "null", '{"nodes": [], "edges": 3}']
)
def test_file_of_another_format_is_one_line(tmp_path: Path, text: str) -> None:
    path = tmp_path / "order.json"
    path.write_text(text)
    with pytest.raises(FileFormatError) as caught:
        read_order(path)
    assert "\n" not in str(caught.value)

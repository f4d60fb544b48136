from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import ezdxf
import numpy as np
import pytest
from ezdxf.layouts import Modelspace
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import BSpline
from scipy.spatial import KDTree

from commission.errors import CommissionError, FileFormatError, JobCancelled, UsageError
from commission.io import dxf
from commission.io.dxf import TOLERANCE, Drawing, read_drawing
from commission.site.floor_map import FREE, OCCUPIED


def drawing(folder: Path, draw: Any, units: int = 6, version: str = "R2010") -> Drawing:
    """What is read of a drawing that ezdxf wrote: an implementation of the format that is not ours."""
    document = ezdxf.new(version, units=units)
    draw(document.modelspace())
    path = folder / "plan.dxf"
    document.saveas(path)
    return read_drawing(path)


def points(read: Drawing) -> np.ndarray:
    return read.segments.reshape(-1, 2)


def middles(read: Drawing) -> np.ndarray:
    return read.segments.mean(axis=1)


@pytest.mark.parametrize(("units", "metres"), [(6, 1.0), (4, 0.001), (5, 0.01), (1, 0.0254), (2, 0.3048)])
def test_lines_are_in_metres_whatever_unit_they_were_drawn_in(tmp_path: Path, units: int, metres: float) -> None:
    read = drawing(tmp_path, lambda space: space.add_line((1, 2), (30, 4)), units)
    np.testing.assert_allclose(read.segments, [[[metres, 2 * metres], [30 * metres, 4 * metres]]], rtol=1e-15)


def test_circle_and_its_chords_agree_within_the_tolerance(tmp_path: Path) -> None:
    read = drawing(tmp_path, lambda space: space.add_circle((3, -2), 7.0))
    # The corners lie on the circle, to rounding; the chords' middles within the tolerance, inside.
    np.testing.assert_allclose(np.hypot(*(points(read) - (3, -2)).T), 7.0, atol=1e-12)
    depth = 7.0 - np.hypot(*(middles(read) - (3, -2)).T)
    assert 0.0 < depth.max() <= TOLERANCE
    np.testing.assert_allclose(read.segments[0, 0], read.segments[-1, 1], atol=1e-12)


def test_arc_runs_counterclockwise_between_its_angles(tmp_path: Path) -> None:
    read = drawing(tmp_path, lambda space: space.add_arc((0, 0), 2.0, 350.0, 80.0))
    np.testing.assert_allclose(read.segments[0, 0], [2 * math.cos(math.radians(350)), 2 * math.sin(math.radians(350))])
    np.testing.assert_allclose(read.segments[-1, 1], [2 * math.cos(math.radians(80)), 2 * math.sin(math.radians(80))])
    length = np.linalg.norm(np.diff(read.segments, axis=1), axis=-1).sum()
    # The arc's length is 2 m times 90 degrees; chords within 1 mm of it are shorter by far less than 5 mm.
    assert length == pytest.approx(math.pi, abs=0.005)


def test_polyline_with_bulges_has_its_arcs(tmp_path: Path) -> None:
    # A stadium: straight, half circle to the left (bulge 1), straight back, half circle.
    outline = [(0, 0, 0), (10, 0, 1), (10, 4, 0), (0, 4, 1)]
    read = drawing(tmp_path, lambda space: space.add_lwpolyline(outline, format="xyb", close=True))
    x, y = points(read).T
    right, left = x > 10.0, x < 0.0
    assert right.any()
    assert left.any()
    np.testing.assert_allclose(np.hypot(x[right] - 10, y[right] - 2), 2.0, atol=1e-12)
    np.testing.assert_allclose(np.hypot(x[left], y[left] - 2), 2.0, atol=1e-12)
    (x1, y1), (x2, y2) = read.segments[:, 0].T, read.segments[:, 1].T
    area = 0.5 * np.sum(x1 * y2 - x2 * y1)
    # Chords up to 1 mm inside two half circles of 6.28 m each.
    assert area == pytest.approx(40.0 + math.pi * 4.0, abs=2 * 6.28 * TOLERANCE)


@pytest.mark.parametrize("version", ["R12", "R2010"])
def test_old_polyline_with_its_vertices_apart_is_read_alike(tmp_path: Path, version: str) -> None:
    def draw(space: Modelspace) -> None:
        space.add_polyline2d([(0, 0, 0.5), (2, 0, 0), (2, 2, 0)], format="xyb")
        space.add_line((5, 5), (6, 6))

    document = ezdxf.new(version, units=6)
    draw(document.modelspace())
    path = tmp_path / "plan.dxf"
    document.saveas(path)
    read = read_drawing(path, unit="m")
    arc = read.segments[:-2].reshape(-1, 2)
    # Bulge 0.5 over a chord of 2 m: radius (1 + 0.25) / (4 x 0.5) x 2 = 1.25 m, center 0.75 m to the left.
    np.testing.assert_allclose(np.hypot(arc[:, 0] - 1.0, arc[:, 1] - 0.75), 1.25, atol=1e-12)
    np.testing.assert_allclose(read.segments[-2:], [[[2, 0], [2, 2]], [[5, 5], [6, 6]]])


def test_ellipse_lies_on_its_equation(tmp_path: Path) -> None:
    read = drawing(tmp_path, lambda space: space.add_ellipse((1, 1), (0, 4), 0.5, 0.0, math.pi))
    x, y = (points(read) - 1).T
    np.testing.assert_allclose((x / 2) ** 2 + (y / 4) ** 2, 1.0, atol=1e-12)
    # Half of it, counterclockwise from the major axis: to the left.
    assert (x <= 1e-12).all()


@settings(max_examples=30)  # each writes a file through another library, 50 ms
@given(
    controls=st.lists(st.tuples(st.floats(-20, 20), st.floats(-20, 20)), min_size=4, max_size=8, unique=True),
    rational=st.booleans(),
)
def test_spline_agrees_with_an_independent_evaluation(
    tmp_path_factory: pytest.TempPathFactory, controls: list[tuple[float, float]], rational: bool
) -> None:
    weights = [1.0 + i % 3 for i in range(len(controls))]

    def draw(space: Modelspace) -> None:
        if rational:
            space.add_rational_spline([(x, y, 0) for x, y in controls], weights)
        else:
            space.add_open_spline([(x, y, 0) for x, y in controls])

    read = drawing(tmp_path_factory.mktemp("plan"), draw)
    n = len(controls)
    knots = np.concatenate((np.zeros(3), np.linspace(0, 1, n - 2), np.ones(3)))
    w = np.array(weights if rational else [1.0] * n)[:, np.newaxis]
    values = BSpline(knots, np.hstack((np.array(controls) * w, w)), 3)(np.linspace(0, 1, 20_000))
    curve = values[:, :2] / values[:, 2:]
    # The tolerance, and half the distance between samples of the reference.
    limit = TOLERANCE + 0.5 * np.linalg.norm(np.diff(curve, axis=0), axis=1).max()
    assert KDTree(curve).query(middles(read))[0].max() <= limit


def test_block_is_scaled_turned_mirrored_repeated_and_nested(tmp_path: Path) -> None:
    def draw(space: Modelspace) -> None:
        blocks = space.doc.blocks
        pillar = blocks.new("PILLAR", base_point=(1, 1))
        pillar.add_line((1, 1), (2, 1))
        pillar.add_line((1, 1), (1, 3), dxfattribs={"layer": "SIDE"})
        nested = blocks.new("ROW")
        nested.add_blockref("PILLAR", (5, 0), dxfattribs={"rotation": 90})
        space.add_blockref(
            "PILLAR", (10, 20), dxfattribs={"xscale": 2, "yscale": -3, "rotation": 90, "layer": "COLUMNS"}
        )
        space.add_blockref("ROW", (0, 100), dxfattribs={"xscale": 2, "yscale": 2})
        space.add_blockref(
            "PILLAR", (0, 0), dxfattribs={"row_count": 2, "column_count": 3, "row_spacing": 50, "column_spacing": 40}
        )

    read = drawing(tmp_path, draw)
    expected = [
        [[10, 20], [10, 22]],
        [[10, 20], [16, 20]],
        [[10, 100], [10, 102]],
        [[10, 100], [6, 100]],
        *([[x, y], end] for y in (0, 50) for x in (0, 40, 80) for end in ([x + 1, y], [x, y + 2])),
    ]
    np.testing.assert_allclose(read.segments, expected, atol=1e-9)
    # What is on layer 0 inside a block takes the layer of its insert.
    assert [read.layers[i].name for i in read.layer_of[:3]] == ["COLUMNS", "SIDE", "0"]


def test_circle_drawn_from_below_is_mirrored(tmp_path: Path) -> None:
    read = drawing(tmp_path, lambda space: space.add_circle((3, 2), 1.0, dxfattribs={"extrusion": (0, 0, -1)}))
    np.testing.assert_allclose(points(read).mean(axis=0), [-3, 2], atol=0.1)


def test_unevenly_scaled_circle_becomes_an_ellipse(tmp_path: Path) -> None:
    def draw(space: Modelspace) -> None:
        space.doc.blocks.new("TANK").add_circle((0, 0), 1.0)
        space.add_blockref("TANK", (1, 2), dxfattribs={"xscale": 5, "yscale": 2})

    x, y = (points(drawing(tmp_path, draw)) - (1, 2)).T
    np.testing.assert_allclose((x / 5) ** 2 + (y / 2) ** 2, 1.0, atol=1e-12)


def test_layers_can_be_chosen_and_those_switched_off_are_not_drawn(tmp_path: Path) -> None:
    def draw(space: Modelspace) -> None:
        space.doc.layers.add("WALL")
        space.doc.layers.add("GRID").off()
        space.doc.layers.add("OLD").freeze()
        for i, name in enumerate(("WALL", "GRID", "OLD")):
            space.add_line((0, i), (10, i), dxfattribs={"layer": name})
        space.add_text("<script>alert(1)</script>")

    read = drawing(tmp_path, draw)
    assert [(layer.name, layer.is_visible, layer.segments) for layer in read.layers] == [
        ("WALL", True, 1),
        ("GRID", False, 1),
        ("OLD", False, 1),
    ]
    assert len(read.on()) == 1
    np.testing.assert_allclose(read.on(["GRID"]), [[[0, 1], [10, 1]]])
    assert read.warnings == ("left out as no walls, or not understood: 1 entity of kind 'TEXT'",)
    with pytest.raises(UsageError, match="no layer is called 'ROOF'; the drawing has: 'WALL', 'GRID', 'OLD'"):
        read.on(["ROOF"])


@pytest.mark.parametrize(("size", "unit"), [(20_000.0, "mm"), (20.0, "m")])
def test_drawing_without_a_unit_is_judged_by_its_size_and_that_is_said(tmp_path: Path, size: float, unit: str) -> None:
    read = drawing(tmp_path, lambda space: space.add_line((0, 0), (size, 0)), units=0)
    assert read.unit == unit
    assert read.segments[0, 1, 0] == pytest.approx(20.0)
    assert "names no unit" in read.warnings[0]


def test_floor_map_has_walls_where_the_lines_are(tmp_path: Path) -> None:
    read = drawing(tmp_path, lambda space: space.add_lwpolyline([(0, 0), (6, 0), (6, 4), (0, 4)], close=True))
    grid = read.floor_map(0.05)
    occupancy = grid.occupancy()
    along = np.linspace(0.01, 5.99, 200)
    for wall in (np.column_stack((along, 0 * along + 1e-6)), np.column_stack((along, 0 * along + 4 + 1e-6))):
        assert occupancy.is_occupied(wall).all()
    assert not occupancy.is_occupied([[3.0, 2.0], [-0.5, 2.0], [3.0, 4.2]]).any()
    assert set(np.unique(grid.cells)) == {FREE, OCCUPIED}
    # Two walls of 6 m and two of 4 m, one cell thick.
    assert abs(int((grid.cells == OCCUPIED).sum()) - 400) <= 8


def test_drawing_with_a_stray_line_far_away_says_how_large_it_is(tmp_path: Path) -> None:
    read = drawing(tmp_path, lambda space: space.add_line((0, 0), (1e6, 1e6)))
    with pytest.raises(FileFormatError, match=r"measures 1e\+06 x 1e\+06 m, .* layers without stray lines"):
        read.floor_map(0.05)
    with pytest.raises(FileFormatError, match="holds no lines to draw"):
        drawing(tmp_path, lambda space: space.add_text("empty")).floor_map(0.05)


def test_binary_drawing_is_read_alike(tmp_path: Path) -> None:
    document = ezdxf.new("R2010", units=6)
    document.modelspace().add_circle((3, -2), 7.0)
    document.saveas(tmp_path / "text.dxf")
    document.saveas(tmp_path / "binary.dxf", fmt="bin")
    text, binary = read_drawing(tmp_path / "text.dxf"), read_drawing(tmp_path / "binary.dxf")
    np.testing.assert_array_equal(text.segments, binary.segments)
    (tmp_path / "cut.dxf").write_bytes((tmp_path / "binary.dxf").read_bytes()[:-2000])
    with pytest.raises(FileFormatError, match="DXF"):
        read_drawing(tmp_path / "cut.dxf")


def test_reading_reports_progress_and_can_be_cancelled(tmp_path: Path) -> None:
    path = tmp_path / "plan.dxf"
    lines = "".join(f"0\nLINE\n8\nWALL\n10\n{i}\n20\n0\n11\n{i}\n21\n9\n" for i in range(20_000))
    path.write_text(f"0\nSECTION\n2\nENTITIES\n{lines}0\nENDSEC\n0\nEOF\n")
    told: list[float] = []
    read_drawing(path, progress=lambda fraction, _: told.append(fraction))
    assert len(told) >= 3
    assert told == sorted(told)

    def stop(fraction: float, _: str) -> None:
        if fraction > 0.3:
            raise JobCancelled("stopped")

    with pytest.raises(JobCancelled):
        read_drawing(path, progress=stop)


BOMB = "".join(
    f"0\nBLOCK\n2\nB{i}\n10\n0\n20\n0\n" + f"0\nINSERT\n2\nB{i + 1}\n10\n0\n20\n0\n" * 10 + "0\nENDBLK\n"
    for i in range(20)
)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "ends before its entities do"),
        ("hello\nworld\n", "line 1: is 'hello'; expected a group code"),
        ("5\n7\n0\nEOF\n", "line 1: begins with group code 5"),
        ("99999\n7\n", "line 1: group code is 99999"),
        ("0\nSECTION\n2\nENTITIES\n0\nLINE\n", "ends before its entities do"),
        ("0\n" + "A" * 100_000 + "\n", "line 2: is longer than 65536 bytes"),
        (
            f"0\nSECTION\n2\nBLOCKS\n{BOMB}0\nENDSEC\n0\nSECTION\n2\nENTITIES\n0\nINSERT\n2\nB0\n10\n0\n20\n0\n0\nEOF\n",
            "inserts blocks over 2000 times",
        ),
        (
            "0\nSECTION\n2\nBLOCKS\n0\nBLOCK\n2\nB\n0\nENDBLK\n0\nENDSEC\n0\nSECTION\n2\nENTITIES\n"
            "0\nINSERT\n2\nB\n70\n30000\n71\n30000\n0\nENDSEC\n0\nEOF\n",
            "inserts blocks over 2000 times",
        ),
    ],
)
def test_hostile_file_is_one_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, text: str, message: str) -> None:
    monkeypatch.setattr(dxf, "INSERT_LIMIT", 2000)
    path = tmp_path / "plan.dxf"
    path.write_text(text)
    with pytest.raises(FileFormatError) as caught:
        read_drawing(path)
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


def test_entities_that_make_no_sense_are_passed_over_and_said(tmp_path: Path) -> None:
    path = tmp_path / "plan.dxf"
    path.write_text(
        "0\nSECTION\n2\nBLOCKS\n0\nBLOCK\n2\nSELF\n10\n0\n20\n0\n0\nINSERT\n2\nSELF\n0\nENDBLK\n0\nENDSEC\n"
        "0\nSECTION\n2\nENTITIES\n"
        "0\nLINE\n10\nnan\n20\n0\n11\n1\n21\n1\n"
        "0\nLINE\n10\nabc\n20\n0\n11\n1\n21\n1\n"
        "0\nLINE\n10\n1e300\n20\n0\n11\n1\n21\n1\n"
        "0\nCIRCLE\n10\n1\n20\n0\n40\n-1\n"
        "0\nSPLINE\n71\n3\n10\n0\n20\n0\n40\n0\n"
        "0\nINSERT\n2\nSELF\n0\nINSERT\n2\nNOWHERE\n"
        "0\nLINE\n10\n0\n20\n0\n11\n1\n21\n1\n0\nENDSEC\n0\nEOF\n"
    )
    read = read_drawing(path)
    warnings = "\n".join(read.warnings)
    for said in ("CIRCLE cannot be read", "SPLINE cannot be read", "in itself", "block 'NOWHERE': does not exist"):
        assert said in warnings
    assert len(read.segments) == 1


@given(text=st.text(st.sampled_from("0128\nEOFLINESCT.-"), max_size=120))
def test_garbage_is_one_line_or_a_drawing(tmp_path_factory: pytest.TempPathFactory, text: str) -> None:
    path = tmp_path_factory.mktemp("plan") / "plan.dxf"
    path.write_text("0\nSECTION\n2\nENTITIES\n" + text + "\n0\nEOF\n")
    try:
        read_drawing(path)
    except CommissionError as error:
        assert "\n" not in str(error)

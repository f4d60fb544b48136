"""Walls that are drawn as bodies, and entities whose layer, name or end is not what it seems."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import ezdxf
import numpy as np
import pytest
from ezdxf.document import Drawing as Document
from ezdxf.layouts import Modelspace

from commission.errors import FileFormatError
from commission.io.dxf import TOLERANCE, Drawing, read_drawing


def read(folder: Path, draw: Any, version: str = "R2000") -> Drawing:
    document = ezdxf.new(version, units=6)
    draw(document.modelspace())
    document.saveas(folder / "plan.dxf")
    return read_drawing(folder / "plan.dxf")


def drawn(found: Drawing) -> set[tuple[tuple[float, float], ...]]:
    """Segments without their direction, to the micrometre."""
    return {tuple(sorted((round(float(x), 6), round(float(y), 6)) for x, y in segment)) for segment in found.on()}


def ring(*corners: tuple[float, float]) -> set[tuple[tuple[float, float], ...]]:
    return {tuple(sorted(pair)) for pair in zip(corners, (*corners[1:], corners[0]), strict=True)}


def test_multiline_is_a_wall_with_both_faces_and_its_ends(tmp_path: Path) -> None:
    def draw(space: Modelspace) -> None:
        # Justified to the middle, 0.2 m wide: the standard style's elements lie at +-0.5 times the scale.
        space.add_mline([(0, 0), (20, 0), (20, 10)], dxfattribs={"scale_factor": 0.2, "justification": 1})

    found = read(tmp_path, draw)
    assert drawn(found) == {
        ((0.0, 0.1), (19.9, 0.1)),
        ((19.9, 0.1), (19.9, 10.0)),
        ((0.0, -0.1), (20.1, -0.1)),
        ((20.1, -0.1), (20.1, 10.0)),
        ((0.0, -0.1), (0.0, 0.1)),
        ((19.9, 10.0), (20.1, 10.0)),
    }
    assert found.warnings == ()


def test_closed_multiline_has_two_rings_and_no_ends(tmp_path: Path) -> None:
    def draw(space: Modelspace) -> None:
        corners = [(0, 0), (20, 0), (20, 10), (0, 10)]
        space.add_mline(corners, close=True, dxfattribs={"scale_factor": 0.2, "justification": 1})

    inner = ring((0.1, 0.1), (19.9, 0.1), (19.9, 9.9), (0.1, 9.9))
    outer = ring((-0.1, -0.1), (20.1, -0.1), (20.1, 10.1), (-0.1, 10.1))
    assert drawn(read(tmp_path, draw)) == inner | outer


@pytest.mark.parametrize("kind", ["add_solid", "add_trace"])
def test_solid_is_drawn_by_its_outline_although_its_corners_come_crosswise(tmp_path: Path, kind: str) -> None:
    corners = [(0, 0), (6, 0), (0, 4), (6, 4)]
    found = read(tmp_path, lambda space: getattr(space, kind)(corners))
    assert drawn(found) == ring((0.0, 0.0), (6.0, 0.0), (6.0, 4.0), (0.0, 4.0))


def test_face_is_drawn_but_for_its_hidden_edges(tmp_path: Path) -> None:
    def draw(space: Modelspace) -> None:
        face = space.add_3dface([(0, 0), (6, 0), (6, 4), (0, 4)])
        face.set_edge_visibility(1, False)

    assert drawn(read(tmp_path, draw)) == ring((0.0, 0.0), (6.0, 0.0), (6.0, 4.0), (0.0, 4.0)) - {
        ((6.0, 0.0), (6.0, 4.0))
    }


def test_triangle_has_three_edges(tmp_path: Path) -> None:
    found = read(tmp_path, lambda space: space.add_3dface([(0, 0), (6, 0), (6, 4)]))
    assert drawn(found) == ring((0.0, 0.0), (6.0, 0.0), (6.0, 4.0))


def test_hatch_is_drawn_by_its_boundaries_straight_and_round(tmp_path: Path) -> None:
    def draw(space: Modelspace) -> None:
        hatch = space.add_hatch()
        hatch.paths.add_polyline_path([(0, 0), (10, 0), (10, 8), (0, 8)], is_closed=True)
        hole = hatch.paths.add_edge_path()
        hole.add_arc((5, 4), 2.0, 0, 360)

    found = read(tmp_path, draw)
    square = ring((0.0, 0.0), (10.0, 0.0), (10.0, 8.0), (0.0, 8.0))
    assert square <= drawn(found)
    round_part = np.array([segment for segment in found.on() if np.hypot(*(segment[0] - (5, 4))) < 2.5])
    radii = np.hypot(*(round_part.reshape(-1, 2) - (5, 4)).T)
    # Bezier curves replace the circle: 0.03 % of the radius, by their usual error.
    np.testing.assert_allclose(radii, 2.0, atol=6e-4 + TOLERANCE)
    assert np.linalg.norm(np.diff(round_part, axis=1), axis=-1).sum() == pytest.approx(4.0 * math.pi, rel=2e-3)


@pytest.mark.parametrize("light", [True, False])
def test_wide_polyline_is_a_wall_with_two_faces(tmp_path: Path, light: bool) -> None:
    def draw(space: Modelspace) -> None:
        if light:
            space.add_lwpolyline([(0, 0), (10, 0)], dxfattribs={"const_width": 0.4})
        else:
            space.add_polyline2d([(0, 0), (10, 0)], dxfattribs={"default_start_width": 0.4, "default_end_width": 0.4})

    assert drawn(read(tmp_path, draw)) == ring((0.0, -0.2), (10.0, -0.2), (10.0, 0.2), (0.0, 0.2))


def test_width_may_change_along_a_polyline(tmp_path: Path) -> None:
    found = read(tmp_path, lambda space: space.add_lwpolyline([(0, 0, 0.2, 0.6), (10, 0, 0, 0)], format="xyse"))
    assert drawn(found) == ring((0.0, -0.1), (10.0, -0.3), (10.0, 0.3), (0.0, 0.1))


def test_wide_arc_has_two_concentric_faces(tmp_path: Path) -> None:
    # A half circle of radius 5 about (5, 0), 1 m wide.
    found = read(tmp_path, lambda space: space.add_lwpolyline([(0, 0, 1, 1, 1), (10, 0, 1, 1, 0)], format="xyseb"))
    ends = found.on().reshape(-1, 2)
    radii = np.hypot(*(ends - (5, 0)).T)
    assert set(np.round(radii, 3)) == {4.5, 5.5}


def hidden_block(document: Document, state: str) -> None:
    block = document.blocks.new("SHELF")
    block.add_line((0, 0), (3, 0), dxfattribs={"layer": "WALLS"})
    block.add_line((0, 1), (3, 1), dxfattribs={"layer": "0"})
    inner = document.blocks.new("INNER")
    inner.add_line((0, 2), (3, 2), dxfattribs={"layer": "WALLS"})
    block.add_blockref("INNER", (0, 0), dxfattribs={"layer": "OTHER"})
    layer = document.layers.add("Old")
    layer.freeze() if state == "frozen" else layer.off()


@pytest.mark.parametrize(("state", "seen"), [("frozen", 0), ("off", 2)])
def test_insert_on_a_frozen_layer_is_hidden_as_a_whole_but_not_on_one_that_is_off(
    tmp_path: Path, state: str, seen: int
) -> None:
    def draw(space: Modelspace) -> None:
        hidden_block(space.doc, state)
        space.add_line((0, 0), (20, 10), dxfattribs={"layer": "WALLS"})
        # Layers are told apart without regard to case.
        space.add_blockref("SHELF", (5, 5), dxfattribs={"layer": "OLD"})

    found = read(tmp_path, draw)
    assert len(found.on()) == 1 + seen
    # Whoever names the frozen layer gets what was inserted on it.
    assert len(found.on(["OLD"])) == (3 if state == "frozen" else 1)


@pytest.mark.parametrize(
    ("raw", "name"),
    [
        (b"\\U+5899\\U+4F53", "\u5899\u4f53"),
        ("\u5899".encode("gbk"), "\u5899"),
        (b"\\M+5C7BD", "\u5899"),
        (b"W\\U+00E4nde", "W\u00e4nde"),
    ],
)
def test_layer_names_of_old_drawings_are_read_by_their_code_page_and_escapes(
    tmp_path: Path, raw: bytes, name: str
) -> None:
    document = ezdxf.new("R2000", units=6)
    document.modelspace().add_line((0, 0), (20, 10), dxfattribs={"layer": "LAYERNAME"})
    document.saveas(tmp_path / "plan.dxf")
    content = (tmp_path / "plan.dxf").read_bytes()
    content = content.replace(b"ANSI_1252", b"ANSI_936").replace(b"LAYERNAME", raw)
    (tmp_path / "plan.dxf").write_bytes(content)
    assert [layer.name for layer in read_drawing(tmp_path / "plan.dxf").layers] == [name]


@pytest.mark.parametrize(
    ("version", "raw"), [("R2000", b"W\xe4nde"), ("R2000", b"W\xc3\xa4nde"), ("R2010", b"W\xc3\xa4nde")]
)
def test_western_names_are_read_whether_they_are_in_windows_1252_or_utf_8(
    tmp_path: Path, version: str, raw: bytes
) -> None:
    document = ezdxf.new(version, units=6)
    document.modelspace().add_line((0, 0), (20, 10), dxfattribs={"layer": "LAYERNAME"})
    document.saveas(tmp_path / "plan.dxf")
    content = (tmp_path / "plan.dxf").read_bytes().replace(b"LAYERNAME", raw)
    (tmp_path / "plan.dxf").write_bytes(content)
    assert [layer.name for layer in read_drawing(tmp_path / "plan.dxf").layers] == ["W\u00e4nde"]


def test_drawing_whose_end_mark_is_missing_is_read_and_that_is_said(tmp_path: Path) -> None:
    document = ezdxf.new("R12", units=6)
    document.modelspace().add_line((0, 0), (20, 10))
    path = tmp_path / "plan.dxf"
    document.saveas(path)
    whole = path.read_bytes()
    path.write_bytes(whole[: whole.rindex(b"EOF")].rstrip().removesuffix(b"0").rstrip() + b"\n")
    found = read_drawing(path)
    assert len(found.segments) == 1
    assert "the end mark EOF is missing; what comes before it was read" in found.warnings


def test_drawing_that_ends_among_its_entities_is_refused(tmp_path: Path) -> None:
    document = ezdxf.new("R12", units=6)
    for i in range(20):
        document.modelspace().add_line((0, i), (20, i))
    path = tmp_path / "plan.dxf"
    document.saveas(path)
    whole = path.read_bytes()
    path.write_bytes(whole[: whole.rindex(b"LINE")])
    with pytest.raises(FileFormatError, match="ends before its entities do"):
        read_drawing(path)


def test_what_is_in_another_file_is_told_and_said_where_nothing_else_is_drawn(tmp_path: Path) -> None:
    def draw(space: Modelspace) -> None:
        space.doc.add_xref_def("hall.dwg", "HALL")
        space.add_blockref("HALL", (0, 0))

    found = read(tmp_path, draw)
    assert "block 'HALL': is in another file, 'hall.dwg', which is not read: bind it" in found.warnings[0]
    with pytest.raises(FileFormatError, match=r"holds no lines to draw .*'hall\.dwg'"):
        found.floor_map(0.05)


def test_a_dwg_that_is_called_dxf_is_named_as_such(tmp_path: Path) -> None:
    (tmp_path / "plan.dxf").write_bytes(b"AC1032" + bytes(200))
    with pytest.raises(FileFormatError, match="is a DWG drawing"):
        read_drawing(tmp_path / "plan.dxf")

from __future__ import annotations

import json
import math
import struct
import tracemalloc
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st

from commission.errors import CommissionError, FileFormatError, JobCancelled, UsageError
from commission.io import mesh
from commission.io.mesh import Model, read_model

Z_TO_Y = np.array([[1.0, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]])
"""Turns a model with z up into one with y up, as GLB has it."""


def saved(folder: Path, model: trimesh.Trimesh | trimesh.Scene, kind: str) -> Path:
    path = folder / f"hall.{kind}"
    model.export(path)
    return path


def box(x: float, y: float, z: float, at: tuple[float, float, float] = (0, 0, 0)) -> trimesh.Trimesh:
    """A box standing with its lower corner at a point."""
    return trimesh.creation.box(
        (x, y, z), trimesh.transformations.translation_matrix((at[0] + x / 2, at[1] + y / 2, at[2] + z / 2))
    )


def lengths(segments: np.ndarray) -> np.ndarray:
    return np.linalg.norm(segments[:, 1] - segments[:, 0], axis=1)


@pytest.mark.parametrize("kind", ["stl", "obj", "ply", "glb"])
def test_section_of_a_box_is_its_rectangle_in_every_format(tmp_path: Path, kind: str) -> None:
    model = box(4, 2, 3, at=(1, 5, 0))
    if kind == "glb":
        model.apply_transform(Z_TO_Y)
    segments = read_model(saved(tmp_path, model, kind)).section(0.2)
    # Single precision in the files: 1e-6 of 10 m.
    assert lengths(segments).sum() == pytest.approx(12.0, abs=1e-4)
    points = segments.reshape(-1, 2)
    np.testing.assert_allclose(points.min(axis=0), [1, 5], atol=1e-5)
    np.testing.assert_allclose(points.max(axis=0), [5, 7], atol=1e-5)


def test_section_of_a_sphere_is_the_circle_at_that_height() -> None:
    sphere = trimesh.creation.icosphere(subdivisions=5, radius=2.0)
    segments = Model(Path("ball.stl"), np.asarray(sphere.triangles)).section(0.7)
    expected = math.sqrt(2.0**2 - 0.7**2)
    # Facets of 5 subdivisions lie up to R (1 - cos(half their edge's angle)) inside: about 1 mm here.
    np.testing.assert_allclose(np.hypot(*segments.reshape(-1, 2).T), expected, atol=0.002)
    assert lengths(segments).sum() == pytest.approx(2 * math.pi * expected, rel=0.002)


@given(height=st.sampled_from([0.0, 0.5, 1.0]) | st.floats(-0.5, 1.5))
def test_outline_of_a_closed_body_is_closed_at_every_height_even_in_its_faces(height: float) -> None:
    body = trimesh.util.concatenate([box(1, 1, 1), box(1, 1, 0.5, at=(3, 0, 0)), box(1, 1, 0.5, at=(5, 0, 0.5))])
    segments = Model(Path("body.stl"), np.asarray(body.triangles)).section(height)
    # Each point of a closed outline is the end of two segments.
    _, counts = np.unique(np.round(segments.reshape(-1, 2), 9), axis=0, return_counts=True)
    assert (counts % 2 == 0).all()
    bodies = (0 < height <= 1) + (0 < height <= 0.5) + (0.5 < height <= 1)
    assert lengths(segments).sum() == pytest.approx(4.0 * bodies)


def test_scanner_and_reflector_heights_see_different_things(tmp_path: Path) -> None:
    hall = trimesh.util.concatenate([box(1, 1, 0.5), box(1, 1, 1.5, at=(4, 0, 1))])
    model = read_model(saved(tmp_path, hall, "stl"))
    low, high = model.floor_map((0.2,), 0.05), model.floor_map((2.0,), 0.05)
    both = model.floor_map((0.2, 2.0), 0.05)
    table, shelf = [[0.5, 1e-6]], [[4.5, 1e-6]]
    assert [bool(m.occupancy().is_occupied(table)[0]) for m in (low, high, both)] == [True, False, True]
    assert [bool(m.occupancy().is_occupied(shelf)[0]) for m in (low, high, both)] == [False, True, True]
    with pytest.raises(
        FileFormatError, match=r"reaches from z = 0 to 2\.5 m; a section at 9 m meets none of it; expected a height"
    ):
        model.floor_map((9.0,), 0.05)


def test_unit_and_axis_can_be_said(tmp_path: Path) -> None:
    path = saved(tmp_path, box(4000, 3000, 2000), "stl")
    np.testing.assert_allclose(read_model(path, unit="mm").bounds, [[0, 0, 0], [4, 3, 2]], atol=1e-6)
    np.testing.assert_allclose(read_model(path, unit="mm", y_up=True).bounds, [[0, -2, 0], [4, 0, 3]], atol=1e-6)
    with pytest.raises(UsageError, match="unit is 'ell'; expected one of: mm"):
        read_model(path, unit="ell")


def test_part_that_a_scene_shows_twice_is_there_twice(tmp_path: Path) -> None:
    scene = trimesh.Scene()
    part = box(1, 1, 1).apply_transform(Z_TO_Y)
    for x in (0.0, 5.0):
        scene.add_geometry(part, geom_name="part", transform=trimesh.transformations.translation_matrix((x, 0, 0)))
    model = read_model(saved(tmp_path, scene, "glb"))
    assert len(model.triangles) == 24
    np.testing.assert_allclose(model.bounds, [[0, 0, 0], [6, 1, 1]], atol=1e-6)


def test_reading_and_cutting_can_be_cancelled(tmp_path: Path) -> None:
    path = saved(tmp_path, box(1, 1, 1), "stl")
    model = read_model(path)

    def stop(_: float, __: str) -> None:
        raise JobCancelled("stopped")

    with pytest.raises(JobCancelled):
        read_model(path, progress=stop)
    with pytest.raises(JobCancelled):
        model.section(0.5, stop)


def test_model_over_the_limit_is_refused_with_its_size(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = saved(tmp_path, box(1, 1, 1), "stl")
    monkeypatch.setattr(mesh, "FACE_LIMIT", 11)
    with pytest.raises(FileFormatError, match="has 12 triangles; expected 1 to 11"):
        read_model(path)
    monkeypatch.setattr(mesh, "SIZE_LIMIT", 100)
    with pytest.raises(FileFormatError, match="has 684 bytes; expected at most 100 bytes"):
        read_model(path)


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("hall.zip", b"PK"),
        ("hall.stl", b""),
        ("hall.stl", b"\0" * 80 + (2**31).to_bytes(4, "little")),
        ("hall.stl", b"solid x\nfacet normal 0 0 0\n"),
        ("hall.stl", b"\0" * 80 + (1).to_bytes(4, "little") + np.full(12, np.nan, "<f4").tobytes() + b"\0\0"),
        ("hall.obj", b"v 0 0\nf 1 2 3\n"),
        ("hall.obj", b"mtllib /etc/passwd\nv 0 0 0\n"),
        (
            "hall.ply",
            b"ply\nformat binary_little_endian 1.0\nelement vertex 999999999999\nproperty float x\nend_header\n",
        ),
        ("hall.glb", b"glTF" + b"\xff" * 40),
    ],
)
def test_hostile_file_is_one_line(tmp_path: Path, name: str, content: bytes) -> None:
    path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises(FileFormatError) as caught:
        read_model(path)
    assert "\n" not in str(caught.value)


def glb(accessors: list[dict[str, Any]], parts: int = 1, **extra: Any) -> bytes:
    """A GLB whose parts all use these accessors for corners and triangles; 36 bytes of data."""
    part = {"attributes": {"POSITION": 0}, "indices": len(accessors) - 1}
    document = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [part] * parts}],
        "accessors": accessors,
        "bufferViews": [{"buffer": 0, "byteOffset": 0, "byteLength": 36}],
        "buffers": [{"byteLength": 36}],
        **extra,
    }
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    chunks = b"".join(struct.pack("<II", len(c), k) + c for c, k in ((text, 0x4E4F534A), (bytes(36), 0x004E4942)))
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


CORNERS = {"componentType": 5126, "count": 3, "type": "VEC3", "bufferView": 0}
TRIANGLES = {"componentType": 5125, "count": 9, "type": "SCALAR", "bufferView": 0}


@pytest.mark.parametrize(
    ("content", "message"),
    [
        # Zeros without data: 400 bytes that would take 3 GB.
        (
            glb([{"componentType": 5126, "count": 30_000_000, "type": "VEC3"}, TRIANGLES]),
            "accessor of POSITION: has no data",
        ),
        (glb([CORNERS, {**TRIANGLES, "count": 10**9}]), "accessors of indices: announces 1000000000 entries"),
        # The same array for ever more parts.
        (
            glb([CORNERS, {**TRIANGLES, "count": 30_000}], parts=1001),
            "accessors of indices: announces 30030000 entries",
        ),
        (glb([CORNERS, TRIANGLES], bufferViews=None), "is no readable GLB"),
        (b"glTF" + bytes(16), "is no readable GLB"),
    ],
)
def test_model_that_announces_more_than_it_holds_is_refused_before_it_is_read(
    tmp_path: Path, content: bytes, message: str
) -> None:
    path = tmp_path / "hall.glb"
    path.write_bytes(content)
    tracemalloc.start()
    with pytest.raises(FileFormatError) as caught:
        read_model(path)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert message in str(caught.value)
    assert peak < 5_000_000


@given(kind=st.sampled_from(["stl", "obj", "ply", "glb"]), data=st.data())
def test_damaged_model_is_one_line_or_a_model(
    tmp_path_factory: pytest.TempPathFactory, kind: str, data: st.DataObject
) -> None:
    path = saved(tmp_path_factory.mktemp("model"), box(1, 1, 1), kind)
    content = bytearray(path.read_bytes())
    for _ in range(data.draw(st.integers(1, 4))):
        content[data.draw(st.integers(0, len(content) - 1))] = data.draw(st.integers(0, 255))
    path.write_bytes(content[: data.draw(st.integers(0, len(content)))])
    try:
        read_model(path)
    except CommissionError as error:
        assert "\n" not in str(error)

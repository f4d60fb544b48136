from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from PIL import Image

from commission.errors import CommissionError, FileFormatError
from commission.io.map_server import read_floor_map, write_floor_map
from commission.site.floor_map import FREE, OCCUPIED, UNKNOWN, FloorMap

GRAYS = np.array([[0, 89, 90, 205, 206, 254]], dtype=np.uint8)
"""occupancy 1, 0.651, 0.647, 0.1961, 0.192, 0.004: both sides of the usual thresholds 0.65 and 0.196."""


def write_map(folder: Path, pixels: np.ndarray, **keys: object) -> Path:
    Image.fromarray(pixels).save(folder / "map.png")
    return write_yaml(folder, image="map.png", **keys)


def write_yaml(folder: Path, **keys: object) -> Path:
    described = {"image": "map.png", "resolution": 0.05, "origin": "[0, 0, 0]", **keys}
    path = folder / "map.yaml"
    path.write_text("".join(f"{key}: {value}\n" for key, value in described.items() if value is not None))
    return path


def test_trinary_map_is_split_at_the_thresholds(tmp_path: Path) -> None:
    floor_map = read_floor_map(write_map(tmp_path, GRAYS))
    assert floor_map.cells.tolist() == [[OCCUPIED, OCCUPIED, UNKNOWN, UNKNOWN, FREE, FREE]]


def test_negated_map_takes_white_for_walls(tmp_path: Path) -> None:
    floor_map = read_floor_map(write_map(tmp_path, 255 - GRAYS, negate=1))
    assert floor_map.cells.tolist() == [[OCCUPIED, OCCUPIED, UNKNOWN, UNKNOWN, FREE, FREE]]


def test_raw_map_holds_percent_and_everything_beyond_is_unknown(tmp_path: Path) -> None:
    pixels = np.array([[0, 19, 50, 66, 100, 101, 205, 255]], dtype=np.uint8)
    floor_map = read_floor_map(write_map(tmp_path, pixels, mode="raw"))
    assert floor_map.cells.tolist() == [[FREE, FREE, UNKNOWN, OCCUPIED, OCCUPIED, UNKNOWN, UNKNOWN, UNKNOWN]]


def test_cell_exactly_at_a_threshold_is_unknown(tmp_path: Path) -> None:
    # Percent of 64, 65 and 66 about 0.65, of 19, 20 and 21 about 0.2.
    pixels = np.array([[64, 65, 66, 19, 20, 21]], dtype=np.uint8)
    floor_map = read_floor_map(write_map(tmp_path, pixels, mode="raw", occupied_thresh=0.65, free_thresh=0.2))
    assert floor_map.cells.tolist() == [[UNKNOWN, UNKNOWN, OCCUPIED, FREE, UNKNOWN, UNKNOWN]]


def test_scale_map_takes_transparent_pixels_for_unknown(tmp_path: Path) -> None:
    pixels = np.array([[[0, 255], [0, 254], [254, 255], [128, 255]]], dtype=np.uint8)
    floor_map = read_floor_map(write_map(tmp_path, pixels, mode="scale"))
    assert floor_map.cells.tolist() == [[OCCUPIED, UNKNOWN, FREE, UNKNOWN]]


def test_first_row_of_the_image_is_the_far_side_of_the_floor(tmp_path: Path) -> None:
    floor_map = read_floor_map(write_map(tmp_path, np.array([[0], [254]], dtype=np.uint8)))
    assert floor_map.cells.tolist() == [[FREE], [OCCUPIED]]


def test_colors_are_averaged(tmp_path: Path) -> None:
    pixels = np.array([[[255, 0, 0], [0, 0, 0], [250, 255, 255]]], dtype=np.uint8)
    floor_map = read_floor_map(write_map(tmp_path, pixels))
    assert floor_map.cells.tolist() == [[OCCUPIED, OCCUPIED, FREE]]


@pytest.mark.parametrize(
    "image",
    [
        b"P2\n# a comment\n3 2\n255\n0 254 205\n254 254 0\n",
        b"P5\n# a comment\n3 2\n255\n" + bytes([0, 254, 205, 254, 254, 0]),
        b"P5\n3 2\n65535\n" + np.array([0, 65000, 52685, 65000, 65000, 0], dtype=">u2").tobytes(),
    ],
    ids=["P2", "P5", "P5 16 bit"],
)
def test_pgm_is_read_as_text_and_as_bytes(tmp_path: Path, image: bytes) -> None:
    (tmp_path / "map.pgm").write_bytes(image)
    floor_map = read_floor_map(write_yaml(tmp_path, image="map.pgm"))
    assert floor_map.cells.tolist() == [[FREE, FREE, OCCUPIED], [OCCUPIED, FREE, UNKNOWN]]


@given(
    cells=hnp.arrays(
        np.int8, st.tuples(st.integers(1, 12), st.integers(1, 12)), elements=st.sampled_from([FREE, OCCUPIED, UNKNOWN])
    ),
    resolution=st.floats(1e-3, 10.0),
    origin=st.tuples(st.floats(-1e4, 1e4), st.floats(-1e4, 1e4), st.floats(-math.pi, math.pi)),
)
def test_map_that_is_written_and_read_again_is_equal_to_a_tenth_of_a_millimetre(
    tmp_path_factory: pytest.TempPathFactory, cells: np.ndarray, resolution: float, origin: tuple[float, float, float]
) -> None:
    path = tmp_path_factory.mktemp("map") / "hall.yaml"
    floor_map = FloorMap(cells, resolution, np.array(origin))
    write_floor_map(floor_map, path)
    read = read_floor_map(path)
    np.testing.assert_array_equal(read.cells, cells)
    # Across the largest map that may be read, 64,000,000 cells in a row, still a fraction of a cell.
    assert abs(read.resolution - resolution) <= 0.5001e-9
    np.testing.assert_array_less(np.abs(read.origin - origin), [0.5001e-4, 0.5001e-4, 0.5001e-6])
    text = path.read_text(encoding="utf-8")
    write_floor_map(read, path)
    assert path.read_text(encoding="utf-8") == text


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({"resolution": 0}, "resolution: is 0; expected more than 0 metres per pixel"),
        ({"resolution": "fine"}, "resolution: is 'fine'; expected a number"),
        ({"resolution": None}, "resolution: is missing"),
        ({"origin": "[0, .nan, 0]"}, "is .nan; expected a finite number"),
        ({"origin": "[0, 0]"}, "origin: is [0, 0]; expected a list of length 3"),
        ({"mode": "colorful"}, "expected one of: trinary, scale, raw"),
        ({"negate": 2}, "negate: is 2; expected 0 to 1"),
        ({"occupied_thresh": 1.5}, "occupied_thresh: is 1.5; expected 0 to 1"),
        ({"free_thresh": 0.9}, "expected at most occupied_thresh"),
        (
            {"image": "other.png"},
            "'other.png' does not exist; expected an existing image; beside it there are: map.png",
        ),
        ({"image": "../map.png"}, "leads out of the folder"),
        ({"image": "/etc/passwd"}, "leads out of the folder"),
        ({"image": '"a\\0b"'}, "is no path"),
    ],
)
def test_wrong_description_is_one_line_with_key_found_and_expected(
    tmp_path: Path, keys: dict[str, object], message: str
) -> None:
    write_map(tmp_path, GRAYS)
    with pytest.raises(FileFormatError) as caught:
        read_floor_map(write_yaml(tmp_path, **keys))
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


def test_image_beyond_the_limit_is_refused_by_its_header(tmp_path: Path) -> None:
    (tmp_path / "map.pgm").write_bytes(b"P5\n10000 10000\n255\n")
    with pytest.raises(FileFormatError, match="has 10000 x 10000 pixels; expected 1 to 64000000 pixels"):
        read_floor_map(write_yaml(tmp_path, image="map.pgm"))


@given(data=st.data())
def test_damaged_image_is_one_line_or_a_map(tmp_path_factory: pytest.TempPathFactory, data: st.DataObject) -> None:
    folder = tmp_path_factory.mktemp("map")
    suffix = data.draw(st.sampled_from(["png", "ppm"]))
    Image.fromarray(np.tile(GRAYS, (5, 3))).save(folder / f"map.{suffix}")
    image = bytearray((folder / f"map.{suffix}").read_bytes())
    for _ in range(data.draw(st.integers(0, 4))):
        image[data.draw(st.integers(0, len(image) - 1))] = data.draw(st.integers(0, 255))
    (folder / f"map.{suffix}").write_bytes(image[: data.draw(st.integers(0, len(image)))])
    try:
        read_floor_map(write_yaml(folder, image=f"map.{suffix}"))
    except CommissionError as error:
        assert "\n" not in str(error)


def test_map_of_a_real_building_is_read(shared_data: Path) -> None:
    floor_map = read_floor_map(shared_data / "maps/utexas_gdc_3/3.yaml")
    assert floor_map.cells.shape == (1255, 1857)
    assert floor_map.resolution == 0.05
    assert floor_map.origin.tolist() == [-60.45, -23.4, 0.0]
    assert {FREE, OCCUPIED, UNKNOWN} >= set(np.unique(floor_map.cells).tolist())
    assert (floor_map.cells == OCCUPIED).any()


def test_published_map_that_names_a_missing_image_says_what_lies_beside_it(shared_data: Path) -> None:
    with pytest.raises(FileFormatError, match=r"'map_rotated\.png' does not exist.*map\.pgm"):
        read_floor_map(shared_data / "maps/aws_small_warehouse/map.yaml")

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

from commission.errors import CommissionError, FileFormatError
from commission.geometry.se2 import transform_points
from commission.io.image_map import ImagePlacement, read_picture
from commission.site.floor_map import FREE, OCCUPIED

PIXEL = st.tuples(st.floats(0, 400), st.floats(0, 300))


def in_map(placement: ImagePlacement, pixel: tuple[float, float], height: int) -> np.ndarray:
    """Place of a pixel on the floor, through the pose that the floor map would have."""
    u, v = pixel
    grid = np.array([u, height - v]) * placement.resolution
    return transform_points(placement.origin(height), grid)


@given(
    first=PIXEL,
    second=PIXEL,
    distance=st.floats(0.1, 100.0),
    direction=st.floats(-7.0, 7.0),
    place=st.tuples(st.floats(-100, 100), st.floats(-100, 100)),
)
def test_clicked_pixels_lie_where_the_engineer_said(
    first: tuple[float, float],
    second: tuple[float, float],
    distance: float,
    direction: float,
    place: tuple[float, float],
) -> None:
    if math.dist(first, second) < 1.0:
        return
    placement = ImagePlacement(first=first, second=second, distance=distance, direction=direction, first_in_map=place)
    end = np.array(place) + distance * np.array([math.cos(direction), math.sin(direction)])
    # Rounding over images whose corner may lie 50 km away (100 m between neighboring pixels).
    np.testing.assert_allclose(in_map(placement, first, 300), place, atol=1e-8)
    np.testing.assert_allclose(in_map(placement, second, 300), end, atol=1e-8)


def test_dark_pixels_are_walls_the_right_way_up(tmp_path: Path) -> None:
    gray = np.full((30, 40), 255, dtype=np.uint8)
    gray[5, 8] = 20
    Image.fromarray(gray).save(tmp_path / "plan.png")
    # 20 pixels are 2 m; the upper left corner lies at (0, 3).
    placement = ImagePlacement(first=(0, 0), second=(20, 0), distance=2.0, first_in_map=(0.0, 3.0))
    floor_map = read_picture(tmp_path / "plan.png").floor_map(placement)
    assert floor_map.resolution == pytest.approx(0.1)
    np.testing.assert_allclose(floor_map.origin, [0, 0, 0], atol=1e-12)
    assert np.argwhere(floor_map.cells == OCCUPIED).tolist() == [[24, 8]]
    assert floor_map.occupancy().is_occupied([[0.85, 2.45]]).all()
    dark = read_picture(tmp_path / "plan.png").floor_map(placement, light_walls=True)
    assert (dark.cells == FREE).sum() == 1


def test_transparent_pixels_are_free_and_colors_and_deep_images_are_read(tmp_path: Path) -> None:
    placement = ImagePlacement(first=(0, 0), second=(2, 0), distance=1.0)
    rgba = np.zeros((2, 2, 4), dtype=np.uint8)
    rgba[0, 0, 3] = 255
    Image.fromarray(rgba).save(tmp_path / "clear.png")
    assert read_picture(tmp_path / "clear.png").floor_map(placement).cells.tolist() == [[FREE, FREE], [OCCUPIED, FREE]]
    deep = np.array([[0, 65535], [20000, 40000]], dtype=np.uint16)
    Image.fromarray(deep).save(tmp_path / "deep.png")
    assert read_picture(tmp_path / "deep.png").floor_map(placement).cells.tolist() == [
        [OCCUPIED, FREE],
        [OCCUPIED, FREE],
    ]
    Image.new("RGB", (2, 2), (250, 250, 0)).save(tmp_path / "color.jpg")
    assert (read_picture(tmp_path / "color.jpg").floor_map(placement).cells == FREE).all()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (((0, 0), (0.5, 0), 1.0), "less than a pixel apart"),
        (((0, 0), (9, 0), 0.0), "distance is 0; expected more than 0 m"),
        (((0, 0), (9, 0), math.nan), "distance is nan"),
        (((0, math.inf), (9, 0), 1.0), "not finite"),
    ],
)
def test_placement_that_makes_no_sense_is_refused(arguments: tuple, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        first, second, distance = arguments
        ImagePlacement(first=first, second=second, distance=distance)


def test_image_over_the_limit_is_refused_before_it_is_unpacked(tmp_path: Path) -> None:
    # 10,000 x 10,000 white pixels are 12 kB as a file and 100 MB unpacked.
    Image.new("1", (10_000, 10_000), 1).save(tmp_path / "bomb.png")
    with pytest.raises(FileFormatError, match="has 10000 x 10000 pixels; expected 1 to 64000000 pixels"):
        read_picture(tmp_path / "bomb.png")


@given(data=st.data(), kind=st.sampled_from(["PNG", "JPEG", "BMP", "GIF", "TIFF", "PPM"]))
def test_damaged_image_is_one_line_or_a_map(
    tmp_path_factory: pytest.TempPathFactory, data: st.DataObject, kind: str
) -> None:
    path = tmp_path_factory.mktemp("image") / "plan"
    Image.new("L", (8, 8), 128).save(path, format=kind)
    content = bytearray(path.read_bytes())
    for _ in range(data.draw(st.integers(0, 3))):
        content[data.draw(st.integers(0, len(content) - 1))] = data.draw(st.integers(0, 255))
    path.write_bytes(content[: data.draw(st.integers(0, len(content)))])
    try:
        read_picture(path)
    except CommissionError as error:
        assert "\n" not in str(error)

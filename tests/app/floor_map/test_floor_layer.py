"""The pictures of the floor lie as the map does, and an edit sends no more of them than it changed."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
import viser

from commission.app.base import theme
from commission.app.base.server import start_server
from commission.app.floor_map import floor_layer as floor
from commission.app.floor_map.floor_layer import FloorLayer
from commission.site.editing.floor_map import fill
from commission.site.floor_map import FREE, OCCUPIED, UNKNOWN, FloorMap
from commission.site.project import Project


@pytest.fixture
def server() -> Iterator[viser.ViserServer]:
    started = start_server("127.0.0.1", 0)
    yield started
    started.stop()


def test_first_row_of_the_picture_is_the_lowest_of_the_map_because_viser_begins_there() -> None:
    cells = np.array([[OCCUPIED, FREE], [FREE, FREE], [UNKNOWN, UNKNOWN]], np.int8)
    image = floor.picture(cells)
    assert tuple(image[0, 0]) == (*theme.WALL, 255)
    assert tuple(image[0, 1]) == (*theme.FREE, 255)
    assert image[2, 0, 3] == 0


def test_a_wall_of_one_cell_survives_the_thinning_of_a_huge_map() -> None:
    cells = np.zeros((40, 3 * floor.LONGEST_SIDE), np.int8)
    cells[17] = OCCUPIED
    floor_map = FloorMap(cells, 0.1)
    image = floor.picture(floor.thinned(cells, floor.step_of(floor_map)))
    assert max(image.shape) <= floor.LONGEST_SIDE
    assert (image[..., :3] == theme.WALL).all(axis=-1).any(axis=0).all()


@pytest.mark.parametrize("shape", [(1, 1), (512, 513), (513, 1025), (1300, 700)])
@pytest.mark.parametrize("step", [1, 3])
def test_tiles_cover_every_cell_and_overlap_by_a_pixel(shape: tuple[int, int], step: int) -> None:
    covered = np.zeros(shape, np.int64)
    for part in floor.tiles(shape, step):
        covered[part] += 1
        assert max(covered[part].shape) <= (floor.TILE + 1) * step
    assert covered.min() == 1
    if shape == (1300, 700) and step == 1:
        assert (covered[:, 512] == 2).sum() >= 1298


def test_an_edit_sends_only_the_tiles_that_it_changed(server: viser.ViserServer) -> None:
    layer = FloorLayer(server.scene)
    before = FloorMap(np.full((1100, 1600), FREE, np.int8), 0.05)
    layer.show_site(Project(floor_map=before))
    pictures = [image.image for image in layer._images if image is not None]
    after = fill(before, [(30.0, 10.0), (31.0, 10.0), (31.0, 11.0), (30.0, 11.0)], OCCUPIED)
    layer.show_site(Project(floor_map=after))
    now = [image.image for image in layer._images if image is not None]
    assert [a is b for a, b in zip(pictures, now, strict=True)].count(False) == 1


def test_a_turned_map_is_turned_by_its_frame_and_not_drawn_anew(server: viser.ViserServer) -> None:
    layer = FloorLayer(server.scene)
    before = FloorMap(np.zeros((100, 200), np.int8), 0.05)
    layer.show_site(Project(floor_map=before))
    (frame,), images = layer.nodes(), list(layer._images)
    layer.show_site(Project(floor_map=FloorMap(before.cells, 0.05, np.array([3.0, 4.0, np.pi / 2]))))
    assert (layer.nodes(), layer._images) == ((frame,), images)
    np.testing.assert_allclose(frame.position[:2], (3.0, 4.0))
    np.testing.assert_allclose(frame.wxyz, (np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5)))

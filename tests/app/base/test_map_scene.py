"""The scene in map coordinates: what is drawn relative to its origin, and that all of it follows when that moves."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
import viser

from commission.app.base.extent import Extent, extent_of
from commission.app.base.map_scene import NEAR, SceneOrigin, origin_for
from commission.app.base.server import start_server
from tests.app.sites import moved, room

FAR = (456_000.0, 5_712_300.0)


@pytest.fixture
def server() -> Iterator[viser.ViserServer]:
    started = start_server("127.0.0.1", 0)
    yield started
    started.stop()


def test_what_was_added_before_and_after_the_origin_moved_is_drawn_relative_to_it(server: viser.ViserServer) -> None:
    origin = SceneOrigin()
    scene = origin.scene(server.scene)
    place = np.array([[456_012.125, 5_712_345.25, 0.5]])
    before = scene.add_point_cloud("/before", points=place, colors=(1, 2, 3), precision="float32")
    label = scene.add_label("/label", "R1", position=tuple(place[0]))
    frame = scene.add_frame("/vehicle")
    frame.position = tuple(place[0])
    outline = scene.add_line_segments("/vehicle/outline", points=np.ones((1, 2, 3)), colors=(1, 2, 3))
    origin.move(FAR)
    after = scene.add_point_cloud("/after", points=place, colors=(1, 2, 3), precision="float32")
    for name in ("/before", "/after"):
        np.testing.assert_array_equal(
            server.scene._handle_from_node_name[name].points, np.array([[12.125, 45.25, 0.5]], np.float32)
        )
    for name in ("/label", "/vehicle"):
        np.testing.assert_array_equal(server.scene._handle_from_node_name[name].position, (12.125, 45.25, 0.5))
    np.testing.assert_array_equal(outline.points, np.ones((1, 2, 3)))
    np.testing.assert_array_equal(before.points, place)
    np.testing.assert_array_equal(label.position, place[0])
    after.points = place + 1.0
    np.testing.assert_array_equal(
        server.scene._handle_from_node_name["/after"].points, np.array([[13.125, 46.25, 1.5]], np.float32)
    )


def test_what_says_nowhere_where_it_is_is_refused(server: viser.ViserServer) -> None:
    with pytest.raises(AttributeError, match="add_gaussian_splats is not in map coordinates"):
        _ = SceneOrigin().scene(server.scene).add_gaussian_splats


def test_the_origin_stays_while_the_site_is_near_and_moves_to_a_round_place_when_it_is_far() -> None:
    assert origin_for(extent_of(room()), (0.0, 0.0)) == (0.0, 0.0)
    far = extent_of(moved(room(), 456_012.3, 5_712_345.6))
    assert origin_for(far, (0.0, 0.0)) == (456_000.0, 5_712_300.0)
    assert origin_for(far, (455_000.0, 5_712_000.0)) == (455_000.0, 5_712_000.0)
    without_map = extent_of(replace(moved(room(), 456_012.3, 5_712_345.6), floor_map=None))
    assert max(without_map.size) < 20.0, "the map's zero, far away, is no part of the site"
    assert origin_for(extent_of(room()), (456_000.0, 5_712_300.0)) == (0.0, 0.0)
    edge = Extent((NEAR - 10.0, 0.0), (NEAR, 5.0))
    assert origin_for(edge, (0.0, 0.0)) == (0.0, 0.0)
    beyond = Extent((NEAR + 90.0, 0.0), (NEAR + 120.0, 5.0))
    assert origin_for(beyond, (0.0, 0.0)) == (2100.0, 0.0)

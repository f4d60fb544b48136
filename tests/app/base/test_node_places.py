"""Where nodes of the scene are drawn: to the last bit, however little they moved, and in the frame that they are in."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
import viser

from commission.app.base.map_scene import SceneOrigin, set_points
from commission.app.base.server import start_server

FAR = (456_000.0, 5_712_300.0)


@pytest.fixture
def server() -> Iterator[viser.ViserServer]:
    started = start_server("127.0.0.1", 0)
    yield started
    started.stop()


def drawn(server: viser.ViserServer, name: str) -> Any:
    """A node as viser has it."""
    scene: Any = server.scene
    return scene._handle_from_node_name[name]


def test_a_node_far_from_zero_follows_every_tenth_of_a_millimetre(server: viser.ViserServer) -> None:
    frame = SceneOrigin().scene(server.scene).add_frame("/vehicle", position=(1_900.0, -1_500.0, 0.0))
    node = drawn(server, "/vehicle")
    for step in range(1, 4):
        frame.position = (1_900.0 + 1e-4 * step, -1_500.0, 0.0)

        np.testing.assert_array_equal(node.position, (1_900.0 + 1e-4 * step, -1_500.0, 0.0))


def test_points_on_a_placed_node_are_in_its_frame_and_those_of_the_map_relative_to_the_origin(
    server: viser.ViserServer,
) -> None:
    origin = SceneOrigin()
    origin.move(FAR)
    scene = origin.scene(server.scene)
    scene.add_frame("/vehicle", position=(*FAR, 0.0))
    hanging = scene.add_line_segments("/vehicle/outline", points=np.zeros((1, 2, 3)), colors=(1, 2, 3))
    lying = scene.add_line_segments("/route", points=np.zeros((1, 2, 3)), colors=(1, 2, 3))
    segments = np.arange(12.0).reshape(2, 2, 3)

    set_points(hanging, segments)
    set_points(lying, segments + np.array([*FAR, 0.0]))

    for name in ("/vehicle/outline", "/route"):
        points = drawn(server, name).points
        assert points.dtype == np.float32
        np.testing.assert_array_equal(points, segments)

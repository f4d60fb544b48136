"""The floor map as a picture: light walls on dark floor, nothing where the map knows nothing."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from viser import ImageHandle, SceneApi, SceneNodeHandle

from commission.app import theme
from commission.app.drawing import yaw_quaternion
from commission.app.layers.base import BaseLayer
from commission.geometry import se2
from commission.site.floor_map import FREE, OCCUPIED, FloorMap
from commission.site.project import Project

LONGEST_SIDE = 4000


def picture(floor_map: FloorMap) -> NDArray[np.uint8]:
    """Return the (H, W, 4) picture of a map as viser lays it on the floor; a huge map is thinned, walls survive.

    viser draws the first row of a picture at its lowest y, as the map itself begins; seen from above it is upright.
    """
    cells = floor_map.cells
    step = math.ceil(max(cells.shape) / LONGEST_SIDE)
    if step > 1:
        rows, columns = (n - n % step for n in cells.shape)
        cells = cells[:rows, :columns].reshape(rows // step, step, columns // step, step).max(axis=(1, 3))
    image = np.zeros((*cells.shape, 4), np.uint8)
    image[cells == FREE] = (*theme.FREE, 255)
    image[cells == OCCUPIED] = (*theme.WALL, 255)
    return image


class FloorLayer(BaseLayer):
    """The floor map."""

    name = "Floor map"
    reads: tuple[str, ...] = ("floor_map",)
    legend = (theme.Legend("wall", theme.WALL, theme.Mark.SQUARE),)

    def __init__(self, scene: SceneApi) -> None:
        super().__init__(scene)
        self._image: ImageHandle | None = None

    def show_site(self, project: Project) -> None:
        """Draw the map."""
        if self._image is not None:
            self._image.remove()
            self._image = None
        floor_map = project.floor_map
        if floor_map is None:
            return
        width, height = floor_map.size
        x, y = se2.transform_points(floor_map.origin, np.array([0.5 * width, 0.5 * height]))
        self._image = self.scene.add_image(
            "/floor/map",
            picture(floor_map),
            render_width=width,
            render_height=height,
            format="png",
            position=(float(x), float(y), theme.Height.FLOOR),
            wxyz=yaw_quaternion(float(floor_map.origin[2])),
            cast_shadow=False,
            receive_shadow=False,
        )

    def nodes(self) -> tuple[SceneNodeHandle, ...]:
        """Return the picture."""
        return () if self._image is None else (self._image,)

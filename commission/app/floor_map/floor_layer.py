"""The floor map as pictures: light walls on dark floor, nothing where the map knows nothing.

The map is cut into tiles, so that an edit sends the few that it changed: encoding all of a large map takes a second.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from viser import FrameHandle, ImageHandle, SceneApi, SceneNodeHandle

from commission.app.base import theme
from commission.app.base.drawing import yaw_quaternion
from commission.app.base.layer import BaseLayer, LayerGroup
from commission.site.floor_map import FREE, OCCUPIED, UNKNOWN, FloorMap
from commission.site.project import Project

LONGEST_SIDE = 4000
"""Pixels along the longer side of a map: a larger one is thinned."""
TILE = 512
"""Pixels along the side of a tile."""
FRAME = "/floor/map"


def _pixels() -> NDArray[np.uint32]:
    """Return the four bytes of a pixel for each value of a cell, taken as one number: a lookup is quick."""
    colors = np.zeros((256, 4), np.uint8)
    colors[FREE] = (*theme.FREE, 255)
    colors[OCCUPIED] = (*theme.WALL, 255)
    return colors.view(np.uint32).reshape(256)


_PIXELS = _pixels()


def picture(cells: NDArray[np.int8]) -> NDArray[np.uint8]:
    """Return the (H, W, 4) picture of cells as viser lays it on the floor.

    viser draws the first row of a picture at its lowest y, as the map itself begins; seen from above it is upright.
    """
    pixels = _PIXELS[np.ascontiguousarray(cells).view(np.uint8)]
    return pixels.view(np.uint8).reshape(*cells.shape, 4)


def thinned(cells: NDArray[np.int8], step: int) -> NDArray[np.int8]:
    """Return one cell for each square of `step` x `step`, the last ones for what is left; walls survive."""
    if step == 1:
        return cells
    rows, columns = (math.ceil(n / step) * step for n in cells.shape)
    padded = np.full((rows, columns), UNKNOWN, np.int8)
    padded[: cells.shape[0], : cells.shape[1]] = cells
    return padded.reshape(rows // step, step, columns // step, step).max(axis=(1, 3))


def step_of(floor_map: FloorMap) -> int:
    """Return how many cells along each axis become one pixel."""
    return math.ceil(max(floor_map.cells.shape) / LONGEST_SIDE)


def tiles(shape: tuple[int, int], step: int) -> list[tuple[slice, slice]]:
    """Return rows and columns of each tile; each overlaps the next by a pixel, so that no seam is seen between them."""
    edge = TILE * step
    rows, columns = (
        [slice(start, min(start + edge + step, n)) for start in range(0, max(n - step, 1), edge)] for n in shape
    )
    return [(row, column) for row in rows for column in columns]


class FloorLayer(BaseLayer):
    """The floor map."""

    name = "Floor map"
    group = LayerGroup.MAP
    rank = 10
    reads: tuple[str, ...] = ("floor_map",)
    legend = (theme.Legend("wall", theme.WALL, theme.Mark.SQUARE),)

    def __init__(self, scene: SceneApi) -> None:
        super().__init__(scene)
        self._frame: FrameHandle | None = None
        self._images: list[ImageHandle | None] = []
        self._shown: FloorMap | None = None

    def show_site(self, project: Project) -> None:
        """Draw the map, or of a map of the same size what has changed."""
        floor_map, before = project.floor_map, self._shown
        self._shown = floor_map
        is_same_size = (
            before is not None
            and floor_map is not None
            and before.cells.shape == floor_map.cells.shape
            and before.resolution == floor_map.resolution
        )
        if not is_same_size:
            before = None
            self._begin(floor_map)
        if floor_map is None or self._frame is None:
            return
        x, y, heading = (float(value) for value in floor_map.origin)
        self._frame.position, self._frame.wxyz = (x, y, theme.Height.FLOOR), yaw_quaternion(heading)
        if before is None or before.cells is not floor_map.cells:
            self._draw(floor_map, before)

    def _begin(self, floor_map: FloorMap | None) -> None:
        """Remove what is drawn and make room for another map."""
        if self._frame is not None:
            self._frame.remove()
        self._frame = None if floor_map is None else self.scene.add_frame(FRAME, show_axes=False)
        self._images = [] if floor_map is None else [None] * len(tiles(_shape(floor_map), step_of(floor_map)))

    def _draw(self, floor_map: FloorMap, before: FloorMap | None) -> None:
        """Draw the tiles whose cells have changed."""
        step = step_of(floor_map)
        for number, part in enumerate(tiles(_shape(floor_map), step)):
            cells = floor_map.cells[part]
            if before is not None and np.array_equal(cells, before.cells[part]):
                continue
            shown = thinned(cells, step)
            image = self._images[number]
            if image is not None:
                image.image = picture(shown)
            elif np.any(shown != UNKNOWN):
                low = part[1].start * floor_map.resolution, part[0].start * floor_map.resolution
                self._images[number] = self._added(number, shown, low, floor_map.resolution * step)

    def _added(self, number: int, shown: NDArray[np.int8], low: tuple[float, float], pixel: float) -> ImageHandle:
        """Add a tile with its lower left corner and the edge of its pixels [m]; it lies in the map's own frame."""
        rows, columns = shown.shape
        return self.scene.add_image(
            f"{FRAME}/{number}",
            picture(shown),
            render_width=columns * pixel,
            render_height=rows * pixel,
            format="png",
            position=(low[0] + 0.5 * columns * pixel, low[1] + 0.5 * rows * pixel, 0.0),
            cast_shadow=False,
            receive_shadow=False,
        )

    def nodes(self) -> tuple[SceneNodeHandle, ...]:
        """Return the frame that all tiles lie in."""
        return () if self._frame is None else (self._frame,)


def _shape(floor_map: FloorMap) -> tuple[int, int]:
    rows, columns = floor_map.cells.shape
    return rows, columns

"""Walls of the floor map, extruded for the 3D view: runs of occupied cells merged into boxes."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from viser import SceneApi, SceneNodeHandle

from commission.app.base import theme
from commission.app.base.drawing import yaw_quaternion
from commission.app.base.layer import BaseLayer, LayerGroup
from commission.geometry.arrays import BoolArray
from commission.geometry.stretches import stretches_of
from commission.site.floor_map import OCCUPIED
from commission.site.project import Project

WALL_HEIGHT = 1.0
LONGEST_SIDE = 800
MOST_BOXES = 20_000


def merged_boxes(occupied: BoolArray) -> NDArray[np.int64]:
    """Cover the occupied cells by rectangles: equal runs of neighboring rows become one.

    Parameters
    ----------
    occupied : (H, W) array.

    Returns
    -------
    boxes : (N, 4) array: first row, end row, first column, end column (ends excluded); disjoint, covering exactly the
        occupied cells.
    """
    open_runs: dict[tuple[int, int], int] = {}
    boxes: list[tuple[int, int, int, int]] = []
    for row in range(len(occupied) + 1):
        runs: set[tuple[int, int]] = set()
        if row < len(occupied):
            runs = {(first, end) for first, end in stretches_of(occupied[row]).tolist()}
        for run in [run for run in open_runs if run not in runs]:
            boxes.append((open_runs.pop(run), row, *run))
        for run in runs:
            open_runs.setdefault(run, row)
    return np.array(sorted(boxes), dtype=np.int64).reshape(-1, 4)


class WallLayer(BaseLayer):
    """Extruded walls."""

    name = "Walls in 3D"
    group = LayerGroup.MAP
    rank = 230
    reads: tuple[str, ...] = ("floor_map",)

    def __init__(self, scene: SceneApi) -> None:
        super().__init__(scene)
        self._project = Project()
        self._boxes: tuple[NDArray[np.int64], float] | None = None

    def show_site(self, project: Project) -> None:
        """Remember the project; boxes are made when a browser first asks for 3D."""
        self._project = project
        self._boxes = None

    def furnish(self, scene: SceneApi, *, three_d: bool) -> tuple[SceneNodeHandle, ...]:
        """Add the walls in 3D; in the plan they would hide the scan points on them."""
        floor_map = self._project.floor_map
        if not three_d or floor_map is None:
            return ()
        if self._boxes is None:
            self._boxes = _decimated_boxes(floor_map.cells == OCCUPIED)
        boxes, step = self._boxes
        if not len(boxes):
            return ()
        edge = floor_map.resolution * step
        row0, row1, column0, column1 = (boxes * edge).T
        centers = np.stack([0.5 * (column0 + column1), 0.5 * (row0 + row1), np.full(len(boxes), 0.5 * WALL_HEIGHT)], 1)
        sizes = np.stack([column1 - column0, row1 - row0, np.full(len(boxes), WALL_HEIGHT)], 1)
        import trimesh

        unit = trimesh.creation.box(extents=(1.0, 1.0, 1.0))
        x, y, heading = (float(value) for value in floor_map.origin)
        return (
            scene.add_batched_meshes_simple(
                "/floor/walls",
                np.asarray(unit.vertices, np.float32),
                np.asarray(unit.faces, np.uint32),
                batched_wxyzs=np.tile([1.0, 0.0, 0.0, 0.0], (len(boxes), 1)),
                batched_positions=centers,
                batched_scales=sizes,
                batched_colors=theme.WALL_3D,
                flat_shading=True,
                lod="off",
                cast_shadow=False,
                position=(x, y, 0.0),
                wxyz=yaw_quaternion(heading),
            ),
        )


def _decimated_boxes(occupied: BoolArray) -> tuple[NDArray[np.int64], float]:
    """Boxes and the cells per edge unit; coarser and coarser until a browser can draw them."""
    step = max(1, math.ceil(max(occupied.shape) / LONGEST_SIDE))
    while True:
        rows, columns = (math.ceil(n / step) for n in occupied.shape)
        padded = np.zeros((rows * step, columns * step), bool)
        padded[: occupied.shape[0], : occupied.shape[1]] = occupied
        boxes = merged_boxes(np.any(padded.reshape(rows, step, columns, step), axis=(1, 3)))
        if len(boxes) <= MOST_BOXES or min(rows, columns) < 2:
            return boxes, float(step)
        step *= 2

"""A metric grid over the site: how large everything is. The scale bar is the page's (`web_assets/floor_view.js`)."""

from __future__ import annotations

import numpy as np
from viser import SceneApi, SceneNodeHandle

from commission.app.base import theme
from commission.app.base.drawing import lift
from commission.app.base.extent import Extent, extent_of
from commission.app.base.layer import BaseLayer, LayerGroup
from commission.app.base.marks import add_lines
from commission.site.project import Project

STEPS = (0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0)
LINES_WANTED = 14


def grid_step(extent: Extent) -> float:
    """Return the distance between grid lines [m] that gives about `LINES_WANTED` of them along the longer side."""
    longest = max(extent.size)
    return next((step for step in STEPS if longest / step <= LINES_WANTED), STEPS[-1])


def grid_lines(extent: Extent, step: float) -> np.ndarray:
    """Return the (N, 2, 2) lines at whole multiples of `step` inside the rectangle [m]."""
    (x0, y0), (x1, y1) = extent.low, extent.high
    xs = np.arange(np.ceil(x0 / step), np.floor(x1 / step) + 1) * step
    ys = np.arange(np.ceil(y0 / step), np.floor(y1 / step) + 1) * step
    upright = [[(x, y0), (x, y1)] for x in xs]
    level = [[(x0, y), (x1, y)] for y in ys]
    return np.array(upright + level).reshape(-1, 2, 2)


class GridLayer(BaseLayer):
    """The grid."""

    name = "Grid"
    group = LayerGroup.MAP
    rank = 40
    reads: tuple[str, ...] = ("floor_map", "reflectors", "routes")

    def __init__(self, scene: SceneApi) -> None:
        super().__init__(scene)
        self._nodes: tuple[SceneNodeHandle, ...] = ()
        self._extent: Extent | None = None

    def show_site(self, project: Project) -> None:
        """Draw the grid over the site's rectangle."""
        extent = extent_of(project)
        if extent == self._extent:
            return
        self._extent = extent
        for node in self._nodes:
            node.remove()
        step = grid_step(extent)
        lines = grid_lines(extent, step)
        points = lift(lines.reshape(-1, 2), theme.Height.GRID).reshape(-1, 2, 3)
        self._nodes = (add_lines(self.scene, "/grid/lines", theme.GRID_METER, 1.0, lines=points),)

    def nodes(self) -> tuple[SceneNodeHandle, ...]:
        """Return the lines."""
        return self._nodes

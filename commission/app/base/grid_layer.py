"""A metric grid over the site with a scale bar: how large everything is."""

from __future__ import annotations

import numpy as np
from viser import SceneApi, SceneNodeHandle

from commission.app.base import theme
from commission.app.base.drawing import lift
from commission.app.base.extent import Extent, extent_of
from commission.app.base.layer import BaseLayer
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
    """Grid and scale bar."""

    name = "Grid"
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
        x, y, height = extent.low[0] + 0.1 * step, extent.low[1] + 0.35 * step, theme.Height.GRID
        bar = np.array([[(x, y), (x + step, y)], [(x, y - 0.12 * step), (x, y + 0.12 * step)]])
        bar = np.concatenate([bar, bar[1:] + np.array([step, 0.0])])
        self._nodes = (
            self._segments("/grid/lines", lines, theme.GRID_METER, 1.0),
            self._segments("/grid/scale", bar, theme.VEHICLE, 2.0),
            self.scene.add_label(
                "/grid/text",
                f"{step:g} m",
                position=(x + 0.5 * step, y + 0.05 * step, height),
                anchor="bottom-center",
                font_screen_scale=0.8,
            ),
        )

    def _segments(self, name: str, lines: np.ndarray, color: theme.Color, thickness: float) -> SceneNodeHandle:
        points = lift(lines.reshape(-1, 2), theme.Height.GRID).reshape(-1, 2, 3)
        return add_lines(self.scene, name, color, thickness, lines=points)

    def nodes(self) -> tuple[SceneNodeHandle, ...]:
        """Return grid and scale bar."""
        return self._nodes

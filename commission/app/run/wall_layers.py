"""What contours are matched with: beams on walls of the map and beside them, and the table of distances behind it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from viser import FrameHandle, ImageHandle, SceneApi, SceneNodeHandle

from commission.app.base import theme
from commission.app.base.drawing import lift, yaw_quaternion
from commission.app.base.layer import BaseLayer, LayerGroup
from commission.app.base.marks import add_cased_marks
from commission.app.base.view import PageView
from commission.app.run.view import RunView
from commission.app.run.wall_points import WallPoints
from commission.localization.contour_tables import ContourTables
from commission.localization.setup import LocalizerSetup

LONGEST_SIDE = 1600
"""Pixels along the longer side of the picture of a table: a larger one is thinned."""
STRONGEST = 110
"""Opacity on a wall [of 255]."""
FADES = 3.0
"""Lengths of the cost over which it fades: there the cost is nine tenths of its largest."""


class WallPointLayer(BaseLayer):
    """Beams of the newest scan, by whether a wall of the map explains them."""

    name = "Matched beams"
    group = LayerGroup.RUN
    rank = 165
    legend = (
        theme.Legend("beam on a wall of the map", theme.MATCHED, theme.Mark.DOT),
        theme.Legend("beam that no wall explains", theme.UNMATCHED, theme.Mark.DOT),
    )

    def __init__(self, scene: SceneApi) -> None:
        super().__init__(scene)
        self._matched = add_cased_marks(scene, "/run/matched_beams", theme.MATCHED, 4)
        self._unmatched = add_cased_marks(scene, "/run/unmatched_beams", theme.UNMATCHED, 4)
        self._shown: WallPoints | None = None

    def draw(self, view: PageView) -> None:
        """Draw the newest match."""
        run = view.part(RunView)
        walls = None if run is None else run.walls
        if walls is self._shown:
            return
        self._shown = walls
        for marks, points in (
            (self._matched, np.empty((0, 2)) if walls is None else walls.matched),
            (self._unmatched, np.empty((0, 2)) if walls is None else walls.unmatched),
        ):
            marks.points = lift(points, theme.Height.REFERENCE)

    def is_used(self, view: PageView) -> bool:
        """Whether contours are looked at."""
        return _contours(view) is not None

    def nodes(self) -> tuple[SceneNodeHandle, ...]:
        """Return all points."""
        return *self._matched.nodes, *self._unmatched.nodes


class WallTableLayer(BaseLayer):
    """The table of distances: brightest on a wall, gone where a beam costs nearly as much as it can."""

    name = "Distance from walls"
    group = LayerGroup.RUN
    rank = 148
    legend = (theme.Legend("near a wall: what a beam costs is small", theme.MATCHED, theme.Mark.SQUARE),)

    def __init__(self, scene: SceneApi) -> None:
        super().__init__(scene)
        self._frame: FrameHandle | None = None
        self._image: ImageHandle | None = None
        self._shown: tuple[object, ...] = (None,)

    def draw_slowly(self, view: PageView) -> None:
        """Draw the table that the newest cycle was matched with."""
        setup = _contours(view)
        tables = None if setup is None or setup.contour is None else setup.contour.tables
        length = 0.0 if setup is None else setup.parameters.contour.length
        shown = (None if tables is None else id(tables.distances), length)
        if shown == self._shown:
            return
        self._shown = shown
        for node in (self._image, self._frame):
            if node is not None:
                node.remove()
        self._frame = self._image = None
        if setup is None or tables is None or setup.floor is None:
            return
        x, y, heading = (float(value) for value in setup.floor.origin)
        visible = self.name not in view.state.hidden
        self._frame = self.scene.add_frame(
            "/run/wall_table", show_axes=False, position=(x, y, 0.0), wxyz=yaw_quaternion(heading), visible=visible
        )
        rows, columns = tables.distances.shape
        self._image = self.scene.add_image(
            "/run/wall_table/picture",
            table_picture(tables, length),
            render_width=columns * tables.resolution,
            render_height=rows * tables.resolution,
            format="png",
            position=(0.5 * columns * tables.resolution, 0.5 * rows * tables.resolution, theme.Height.HEAT),
            cast_shadow=False,
            receive_shadow=False,
            visible=visible,
        )

    def is_used(self, view: PageView) -> bool:
        """Whether contours are looked at."""
        return _contours(view) is not None

    def nodes(self) -> tuple[SceneNodeHandle, ...]:
        """Return the picture."""
        return () if self._image is None else (self._image,)


def table_picture(tables: ContourTables, length: float) -> NDArray[np.uint8]:
    """Return the (H, W, 4) picture of a table, its first row at the lowest y, thinned where it is large.

    Parameters
    ----------
    tables : of the map.
    length : L of the cost [m].
    """
    step = -(-max(tables.distances.shape) // LONGEST_SIDE)
    away = np.abs(tables.distances[::step, ::step]) / (FADES * max(length, tables.resolution))
    picture = np.empty((*away.shape, 4), np.uint8)
    picture[..., :3] = theme.MATCHED
    picture[..., 3] = STRONGEST * np.clip(1.0 - away, 0.0, 1.0)
    return picture


def _contours(view: PageView) -> LocalizerSetup | None:
    """Setup of the newest cycle, where it looks at contours."""
    run = view.part(RunView)
    if run is None or run.segment.setup.contour is None:
        return None
    return run.segment.setup

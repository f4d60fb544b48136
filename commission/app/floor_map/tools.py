"""The tools for the floor map: areas erased and filled, walls drawn, points clicked on an image. Pure."""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from commission.app.base.actions import ClickFloor, DragFloor, Point, Sender
from commission.app.base.effects import Tell
from commission.app.base.reducer import Outcome
from commission.app.base.state import AppState, Edit, edited
from commission.app.editing.drawing_tools import DrawingTool, area_dragged
from commission.app.editing.editor import with_tool
from commission.app.editing.tool import Tool
from commission.app.floor_map.draft import MapLoading
from commission.app.floor_map.pen import THICKNESS, MapPen
from commission.errors import UsageError
from commission.geometry.arrays import FloatArray
from commission.site.editing.floor_map import draw_obstacle, draw_wall, fill
from commission.site.floor_map import FREE, UNKNOWN, FloorMap


@dataclass(frozen=True, slots=True)
class ShapeTool(DrawingTool):
    """Changes the floor map where a shape is drawn; the tool stays, for the next shape."""

    does: ClassVar[str] = ""
    """What an edit is called."""

    def made(self, state: AppState, points: tuple[Point, ...], sender: Sender) -> Outcome:
        """Change the map: one undo step."""
        resting = with_tool(state, sender, type(self)())
        before, corners = state.project.floor_map, np.array(points, dtype=np.float64).reshape(-1, 2)
        after = self.changed(before, corners, state.of_browser(sender.browser, MapPen))
        if after is before:
            return Outcome(resting, (Tell(f"nothing to {self.does} there", failed=False),))
        return Outcome(edited(resting, replace(state.project, floor_map=after), Edit(self.does, sender)))

    def changed(self, floor_map: FloorMap | None, corners: FloatArray, pen: MapPen) -> FloorMap:
        """Return the map with the shape whose (N, 2) corners [m] these are.

        Parameters
        ----------
        floor_map : before; none: there is none yet.
        corners : (N, 2) array [m], map frame.
        pen : thickness of a wall, and what erased cells become.
        """
        raise NotImplementedError


@dataclass(frozen=True, slots=True)
class AreaTool(ShapeTool):
    """Takes a rectangle by a drag as well as a polygon by clicks."""

    fewest = 3

    def dragged(self, state: AppState, drag: DragFloor, sender: Sender) -> Outcome:
        """Draw a rectangle."""
        state, is_drawn = area_dragged(state, drag, sender)
        if not is_drawn:
            return Outcome(state)
        (x0, y0), (x1, y1) = drag.start, drag.now
        return self.made(state, ((x0, y0), (x1, y0), (x1, y1), (x0, y1)), sender)

    def hint(self, state: AppState, browser: int) -> str:  # noqa: ARG002 - the tool's
        """Say how an area is drawn."""
        return f"{self.name}: drag a rectangle, or click corners{self.so_far()} &nbsp; (Esc ends)"

    def sketch(self, state: AppState, browser: int) -> list[FloatArray]:  # noqa: ARG002 - the tool's
        """Return the closed outline."""
        return [np.array([*self.points, self.points[0]])] if len(self.points) > 1 else []


@dataclass(frozen=True, slots=True)
class EraseTool(AreaTool):
    """Erases walls."""

    name = "Erase"
    makes = "area to erase"
    does = "erase"

    def changed(self, floor_map: FloorMap | None, corners: FloatArray, pen: MapPen) -> FloorMap:
        """Return the map with the area free or unknown."""
        if floor_map is None:
            raise UsageError("the project has no floor map to erase in; expected one")
        return fill(floor_map, corners, UNKNOWN if pen.to_unknown else FREE)


@dataclass(frozen=True, slots=True)
class ObstacleTool(AreaTool):
    """Draws obstacles."""

    name = "Obstacle"
    makes = "obstacle"
    does = "draw obstacle"

    def changed(self, floor_map: FloorMap | None, corners: FloatArray, pen: MapPen) -> FloorMap:  # noqa: ARG002
        """Return the map with the area occupied."""
        return draw_obstacle(floor_map, corners)


@dataclass(frozen=True, slots=True)
class WallTool(ShapeTool):
    """Draws walls."""

    name = "Wall"
    makes = "wall"
    does = "draw wall"
    fewest = 2

    def changed(self, floor_map: FloorMap | None, corners: FloatArray, pen: MapPen) -> FloorMap:
        """Return the map with a wall along the points."""
        return draw_wall(floor_map, corners, pen.thickness)

    def hint(self, state: AppState, browser: int) -> str:
        """Say how thick the wall is, and how many points there are."""
        thickness = f"{THICKNESS.brief(state.of_browser(browser, MapPen).thickness)} thick"
        return f"Wall, {thickness}: click its points{self.so_far()} &nbsp; (Esc ends)"

    def sketch(self, state: AppState, browser: int) -> list[FloatArray]:
        """Return the middle line and both sides."""
        if len(self.points) < 2:
            return []
        points = np.array(self.points)
        return [points, *wall_sides(points, state.of_browser(browser, MapPen).thickness)]


def wall_sides(points: FloatArray, thickness: float) -> list[FloatArray]:
    """Return the outlines of the straight pieces of a wall along (N, 2) points [m]."""
    sides: list[FloatArray] = []
    for start, end in itertools.pairwise(points):
        length = float(np.hypot(*(end - start)))
        if length > 0.0:
            across = 0.5 * thickness / length * np.array([start[1] - end[1], end[0] - start[0]])
            corners = (start + across, end + across, end - across, start - across, start + across)
            sides.append(np.array(corners))
    return sides


@dataclass(frozen=True, slots=True)
class CalibrateTool(Tool):
    """Takes two points of an image whose scale is not known; it comes with such an image."""

    name = "Calibrate"

    def clicked(self, state: AppState, click: ClickFloor, sender: Sender) -> Outcome:
        """Take a point of the image; without one the tool is put away."""
        loading = state.part(MapLoading)
        if loading.draft is None:
            return Outcome(with_tool(state, sender, None))
        return Outcome(state.with_part(replace(loading, draft=loading.draft.clicked(click.place))))

    def hint(self, state: AppState, browser: int) -> str:  # noqa: ARG002 - the tool's
        """Say what is clicked."""
        return "Image: click two points of known distance, far apart; then type it on the left &nbsp; (Esc ends)"

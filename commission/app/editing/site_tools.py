"""The tools for what stands and drives on the floor: reflectors, routes, stations, tags; and a measure. Pure."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from commission.app.base.actions import ClickFloor, Point, Sender
from commission.app.base.reducer import Outcome, reduce
from commission.app.base.state import AppState, Edit
from commission.app.editing.drawing_tools import DrawingTool
from commission.app.editing.editor import ControlPoint, Editor, PosedKind, editor_of, with_tool
from commission.app.editing.gestures import marked_place, to_place
from commission.app.editing.posed_actions import PlacePosed
from commission.app.editing.reducer import with_reflectors
from commission.app.editing.route_gestures import curve
from commission.app.editing.site_reducer import with_routes
from commission.app.editing.tool import Label, Tool
from commission.geometry.arrays import FloatArray
from commission.site.editing import reflectors as edits
from commission.site.editing import routes as route_edits
from commission.site.editing.named import ROUTES
from commission.site.quantity import DEGREES


@dataclass(frozen=True, slots=True)
class PlaceTool(Tool):
    """Places reflectors."""

    name = "Place"

    def clicked(self, state: AppState, click: ClickFloor, sender: Sender) -> Outcome:
        """Place a reflector where the click is attracted to."""
        editor = editor_of(state, sender.browser)
        like = to_place(state.project, click.place, editor)
        added = edits.add(state.project.reflectors, [(like.x, like.y)], like)
        outcome = with_reflectors(state, added.reflectors, Edit(f"place {added.ids[0]}", sender))
        return replace(outcome, state=outcome.state.with_browser(sender.browser, editor.selecting(added.ids)))

    def hint(self, state: AppState, browser: int) -> str:
        """Say what a click does."""
        where = " at the nearest wall" if state.project.floor_map and editor_of(state, browser).snapping.walls else ""
        return f"Place: click on the floor for a reflector{where} &nbsp; (Esc ends)"


@dataclass(frozen=True, slots=True)
class RouteTool(DrawingTool):
    """Draws a route."""

    name = "Route"
    makes = "route"
    fewest = 2

    def made(self, state: AppState, points: tuple[Point, ...], sender: Sender) -> Outcome:
        """Make a route of the points, and select it."""
        name = ROUTES.fresh(state.project.routes)
        route = route_edits.new_route(name, points)
        routes = ROUTES.put(state.project.routes, route)
        return with_routes(with_tool(state, sender, None), routes, Edit(f"draw {name}", sender), ControlPoint(name))

    def hint(self, state: AppState, browser: int) -> str:  # noqa: ARG002 - the tool's
        """Say how many points there are."""
        ready = ", Enter makes a route of them" if len(self.points) > 1 else ""
        return f"Route: click its points, {len(self.points)} so far{ready} &nbsp; (Esc drops them)"

    def sketch(self, state: AppState, browser: int) -> list[FloatArray]:  # noqa: ARG002 - the tool's
        """Return the curve so far."""
        return [curve(route_edits.segment_of(self.points))] if len(set(self.points)) > 1 else []


@dataclass(frozen=True, slots=True)
class StationTool(Tool):
    """Places stations."""

    name = "Station"

    def clicked(self, state: AppState, click: ClickFloor, sender: Sender) -> Outcome:
        """Place a station."""
        return reduce(PlacePosed(PosedKind.STATION, click.place, click.reach), state, sender)

    def hint(self, state: AppState, browser: int) -> str:  # noqa: ARG002 - the tool's
        """Say what a click does."""
        return "Station: click where the vehicle has to stand, on a route it looks along it &nbsp; (Esc ends)"


@dataclass(frozen=True, slots=True)
class TagTool(Tool):
    """Places tags."""

    name = "Tag"

    def clicked(self, state: AppState, click: ClickFloor, sender: Sender) -> Outcome:
        """Place a tag."""
        return reduce(PlacePosed(PosedKind.TAG, click.place, click.reach), state, sender)

    def hint(self, state: AppState, browser: int) -> str:  # noqa: ARG002 - the tool's
        """Say what a click does."""
        return "Tag: click where a mark is that a camera on the vehicle reads; its arrow turns it &nbsp; (Esc ends)"


@dataclass(frozen=True, slots=True)
class MeasureTool(Tool):
    """Measures from one point to another; a third click begins anew."""

    name = "Measure"

    def clicked(self, state: AppState, click: ClickFloor, sender: Sender) -> Outcome:
        """Take a point: the center of a reflector, a station, a tag, a corner of a wall, or the place itself."""
        before = self.points if len(self.points) == 1 else ()
        place = marked_place(state.project, click.place, click.reach)
        return Outcome(with_tool(state, sender, replace(self, points=(*before, place))))

    def hint(self, state: AppState, browser: int) -> str:  # noqa: ARG002 - the tool's
        """Say which point comes next."""
        which = "second" if len(self.points) == 1 else "first"
        return f"Measure: click the {which} point &nbsp; (Esc ends)"

    def sketch(self, state: AppState, browser: int) -> list[FloatArray]:  # noqa: ARG002 - the tool's
        """Return the line that is measured."""
        return [np.array(self.points)] if len(self.points) == 2 else []

    def labels(self) -> tuple[Label, ...]:
        """Return the measurement, beside its line."""
        found = self.measurement()
        if found is None:
            return ()
        text = f"{found.distance:.3f} m, {DEGREES.text(found.bearing, '.1f')}"
        (x0, y0), (x1, y1) = self.points
        middle = (0.5 * (x0 + x1), 0.5 * (y0 + y1))
        return ((f"{text}  (dx {found.dx:.3f} m, dy {found.dy:.3f} m)", middle),)

    def measurement(self) -> MeasuredLine | None:
        """Return what was measured; none before the second click."""
        if len(self.points) < 2:
            return None
        (x0, y0), (x1, y1) = self.points
        return MeasuredLine(x1 - x0, y1 - y0)


@dataclass(frozen=True, slots=True)
class MeasuredLine:
    """From one point to another."""

    dx: float
    """Along x [m]."""
    dy: float
    """Along y [m]."""

    @property
    def distance(self) -> float:
        """Length of the straight line [m]."""
        return math.hypot(self.dx, self.dy)

    @property
    def bearing(self) -> float:
        """Direction, counterclockwise from the x axis [rad]; 0 when the points coincide."""
        return math.atan2(self.dy, self.dx)


def measurement(editor: Editor) -> MeasuredLine | None:
    """Return what a browser has measured; none when that is nothing yet."""
    return editor.tool.measurement() if isinstance(editor.tool, MeasureTool) else None


SITE_TOOLS = (PlaceTool(), RouteTool(), StationTool(), TagTool(), MeasureTool())
"""In the order of their buttons."""

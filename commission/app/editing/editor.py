"""What one browser is editing with: its tool, its selection, a gesture under way. Each browser has its own; frozen."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from enum import StrEnum

from commission.app.base.actions import Point
from commission.app.base.state import AppState


class Tool(StrEnum):
    """What a click on the floor does."""

    SELECT = "Select"
    PLACE = "Place"
    ROUTE = "Route"
    STATION = "Station"
    MEASURE = "Measure"
    KEEP_OUT = "Keep out"
    ERASE = "Erase"
    WALL = "Wall"
    OBSTACLE = "Obstacle"
    ALIGN = "Align"
    CALIBRATE = "Calibrate"


SITE_TOOLS = (Tool.SELECT, Tool.PLACE, Tool.ROUTE, Tool.STATION, Tool.MEASURE)
"""Tools for what stands and drives on the floor."""
MAP_TOOLS = (Tool.ERASE, Tool.WALL, Tool.OBSTACLE, Tool.ALIGN)
"""Tools for the floor map itself. `CALIBRATE` comes with an image that is being placed, `KEEP_OUT` with a layout."""


class Grab(StrEnum):
    """What a drag moves."""

    REFLECTORS = "reflectors"
    CONTROL_POINT = "control point"
    STATION = "station"
    HEADING = "heading"
    RECTANGLE = "rectangle"


@dataclass(frozen=True, slots=True)
class Drag:
    """A drag under way: nothing of the project has changed yet."""

    grab: Grab
    """What it moves."""
    start: Point
    """Where it began [m]."""
    now: Point
    """Where it is [m]."""
    add: bool = False
    """Whether a rectangle adds to the selection."""

    @property
    def offset(self) -> Point:
        """From start to now [m, m]."""
        return self.now[0] - self.start[0], self.now[1] - self.start[1]


@dataclass(frozen=True, slots=True)
class ControlPoint:
    """A control point of a planned route."""

    route: str
    """Name of the route."""
    segment: int = 0
    """Which of its segments."""
    index: int = 0
    """Which point of the segment."""


@dataclass(frozen=True, slots=True)
class Snapping:
    """What attracts a reflector that is placed or dragged."""

    walls: bool = True
    """The nearest wall's surface."""
    neighbors: bool = False
    """Row and column of other reflectors."""
    grid: float = 0.0
    """Multiples of this spacing [m]; 0: no grid."""

    def __post_init__(self) -> None:
        if not (math.isfinite(self.grid) and 0.0 <= self.grid <= 100.0):
            raise ValueError(f"spacing of the grid is {self.grid:g}; expected 0 (none) to 100 m")


@dataclass(frozen=True, slots=True)
class MapPen:
    """How the floor map's tools draw."""

    thickness: float = 0.1
    """Thickness of a wall [m]."""
    to_unknown: bool = False
    """Whether erased cells become unknown instead of free."""

    def __post_init__(self) -> None:
        if not 0.001 <= self.thickness <= 10.0:
            raise ValueError(f"thickness is {self.thickness:g} m; expected 0.001 to 10 m")


@dataclass(frozen=True, slots=True)
class NamedPoint:
    """A point of the map with its coordinates in the plant."""

    at: Point
    """Where it was clicked [m]."""
    plant: Point
    """Where it lies in the plant's coordinate system [m, m]; where it was clicked until somebody says otherwise."""
    name: str = ""
    """What the engineer calls it."""


@dataclass(frozen=True, slots=True)
class AlignmentDraft:
    """Points by which the map is moved onto the plant's coordinate system."""

    points: tuple[NamedPoint, ...] = ()
    """At most two: A and B."""
    everything: bool = False
    """Whether reflectors, routes and stations go with the map."""


@dataclass(frozen=True, slots=True)
class Editor:
    """How one browser edits."""

    tool: Tool = Tool.SELECT
    """What a click does."""
    selected: tuple[str, ...] = ()
    """Ids of the selected reflectors."""
    point: ControlPoint | None = None
    """The selected control point; its route is the selected one."""
    station: str = ""
    """Name of the selected station; empty: none."""
    drag: Drag | None = None
    """A drag under way."""
    draft: tuple[Point, ...] = ()
    """Points of a route, a wall or an area that is being drawn [m]."""
    measured: tuple[Point, ...] = ()
    """One or two points of a measurement [m]."""
    last_click: Point | None = None
    """Where the floor was last clicked [m]."""
    snapping: Snapping = Snapping()
    """What attracts."""
    pen: MapPen = MapPen()
    """How the floor map's tools draw."""
    alignment: AlignmentDraft = AlignmentDraft()
    """Points to align the floor map by."""
    reach: float = 0.1
    """How near a click has to be to mean something, at the zoom of the newest gesture [m]."""

    def selecting(
        self, reflectors: tuple[str, ...] = (), *, point: ControlPoint | None = None, station: str = ""
    ) -> Editor:
        """Return the editor with this selected and nothing else."""
        return replace(self, selected=reflectors, point=point, station=station)

    @property
    def has_selection(self) -> bool:
        """Whether anything is selected."""
        return bool(self.selected) or self.point is not None or bool(self.station)


def editor_of(state: AppState, browser: int | None) -> Editor:
    """Return how a browser edits; one that is not there selects."""
    return state.of_browser(browser, Editor)


def editors_of(state: AppState) -> tuple[Editor, ...]:
    """Return how each connected browser edits."""
    return tuple(editor_of(state, browser) for browser in state.browsers)


@dataclass(frozen=True, slots=True)
class Measurement:
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


def measurement(editor: Editor) -> Measurement | None:
    """Return what was measured; none before the second click."""
    if len(editor.measured) < 2:
        return None
    (x0, y0), (x1, y1) = editor.measured
    return Measurement(x1 - x0, y1 - y0)

"""What a person can ask for while editing, as frozen values; `client` is the number of the browser's connection."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias

from commission.app.editing.editor import ControlPoint, Point, Snapping, Tool
from commission.app.editing.station_actions import StationAction
from commission.site.project import Project
from commission.site.routes import Direction
from commission.site.scanner import Scanner
from commission.site.vehicle import Vehicle
from commission.studies.problems import Problem

Phase: TypeAlias = Literal["start", "update", "end"]


@dataclass(frozen=True, slots=True)
class Join:
    """A browser came."""

    client: int
    """Number of the browser's connection."""


@dataclass(frozen=True, slots=True)
class Leave:
    """A browser is gone."""

    client: int
    """Number of the browser's connection."""


@dataclass(frozen=True, slots=True)
class ChooseTool:
    """Change what a click does."""

    client: int
    """Number of the browser's connection."""
    tool: Tool
    """What a click does from now on."""


@dataclass(frozen=True, slots=True)
class ChooseSnapping:
    """Change what attracts reflectors."""

    client: int
    """Number of the browser's connection."""
    snapping: Snapping
    """What attracts from now on."""


@dataclass(frozen=True, slots=True)
class Cancel:
    """Drop what is half done: a drag, a route being drawn, a measurement; else the selection."""

    client: int
    """Number of the browser's connection."""


@dataclass(frozen=True, slots=True)
class ClickFloor:
    """The floor was clicked."""

    client: int
    """Number of the browser's connection."""
    place: Point
    """Where [m], map frame."""
    reach: float
    """How near counts as on something [m]: some pixels at the browser's zoom."""
    add: bool = False
    """Whether to add to the selection."""


@dataclass(frozen=True, slots=True)
class DragFloor:
    """The pointer is dragged over the floor."""

    client: int
    """Number of the browser's connection."""
    phase: Phase
    """Whether the drag begins, goes on or ends."""
    start: Point
    """Where the drag began [m]."""
    now: Point
    """Where it is [m]."""
    reach: float
    """How near counts as on something [m]."""
    add: bool = False
    """Whether a rectangle adds to the selection."""


@dataclass(frozen=True, slots=True)
class DragSelection:
    """The selection's handle is dragged."""

    client: int
    """Number of the browser's connection."""
    phase: Phase
    """Whether the drag begins, goes on or ends."""
    now: Point
    """Where the handle is [m]; it began at the middle of the selection."""


@dataclass(frozen=True, slots=True)
class SelectReflectors:
    """Select these reflectors and nothing else."""

    client: int
    """Number of the browser's connection."""
    ids: tuple[str, ...]
    """Their ids; unknown ones are ignored."""
    fly: bool = False
    """Whether to bring them into view."""


@dataclass(frozen=True, slots=True)
class DeleteSelected:
    """Delete what is selected: reflectors, a control point or a station."""

    client: int
    """Number of the browser's connection."""


@dataclass(frozen=True, slots=True)
class DuplicateSelected:
    """Copy the selected reflectors beside themselves and select the copies."""

    client: int
    """Number of the browser's connection."""


@dataclass(frozen=True, slots=True)
class SetSelected:
    """Set one field of every selected reflector."""

    client: int
    """Number of the browser's connection."""
    name: str
    """Field of `Reflector`."""
    value: float | str | bool
    """New value, SI and radians."""
    at: float = 0.0
    """When [s, any monotonic clock]: changes that follow quickly are one undo step."""


@dataclass(frozen=True, slots=True)
class MirrorSelected:
    """Mirror the selected reflectors about a line."""

    client: int
    """Number of the browser's connection."""
    through: Point
    """A point of the line [m]."""
    angle: float
    """Its direction, map frame [rad]."""
    copy: bool = False
    """Whether the originals stay."""


@dataclass(frozen=True, slots=True)
class RepeatSelected:
    """Copy the selected reflectors several times along a line."""

    client: int
    """Number of the browser's connection."""
    step: Point
    """From each copy to the next [m, m]."""
    count: int
    """How many copies."""


@dataclass(frozen=True, slots=True)
class SnapSelected:
    """Put the selected reflectors against their nearest walls."""

    client: int
    """Number of the browser's connection."""


@dataclass(frozen=True, slots=True)
class Finish:
    """Make what the tool in use is for of the points drawn so far."""

    client: int
    """Number of the browser's connection."""


@dataclass(frozen=True, slots=True)
class FinishRoute:
    """Make a route of the points drawn so far."""

    client: int
    """Number of the browser's connection."""


@dataclass(frozen=True, slots=True)
class SelectControlPoint:
    """Select a control point and its route."""

    client: int
    """Number of the browser's connection."""
    point: ControlPoint
    """Which one."""
    fly: bool = False
    """Whether to bring it into view."""


@dataclass(frozen=True, slots=True)
class InsertControlPoint:
    """Insert a control point where the selected segment was last clicked; its curve stays as it is."""

    client: int
    """Number of the browser's connection."""


@dataclass(frozen=True, slots=True)
class SplitSegment:
    """Cut the selected segment in two where it was last clicked, so that its parts can be driven differently."""

    client: int
    """Number of the browser's connection."""


@dataclass(frozen=True, slots=True)
class DeleteControlPoint:
    """Delete the selected control point."""

    client: int
    """Number of the browser's connection."""


@dataclass(frozen=True, slots=True)
class PlaceControlPoint:
    """Put the selected control point somewhere."""

    client: int
    """Number of the browser's connection."""
    place: Point
    """Where [m]."""
    at: float = 0.0
    """When [s, any monotonic clock]: changes that follow quickly are one undo step."""


@dataclass(frozen=True, slots=True)
class SetSegment:
    """Set how the selected control point's segment is driven."""

    client: int
    """Number of the browser's connection."""
    direction: Direction
    """`forward` or `reverse`."""
    speed: float | None
    """Speed [m/s]; none: the route's."""
    at: float = 0.0
    """When [s, any monotonic clock]: changes that follow quickly are one undo step."""


@dataclass(frozen=True, slots=True)
class RenameRoute:
    """Give the selected route another name."""

    client: int
    """Number of the browser's connection."""
    name: str
    """New name."""


@dataclass(frozen=True, slots=True)
class DeleteRoute:
    """Delete the selected route."""

    client: int
    """Number of the browser's connection."""


@dataclass(frozen=True, slots=True)
class SetVehicle:
    """Use another vehicle."""

    vehicle: Vehicle
    """The new one."""
    client: int | None = None
    """Number of the browser's connection."""
    at: float = 0.0
    """When [s, any monotonic clock]: changes that follow quickly are one undo step."""


@dataclass(frozen=True, slots=True)
class SetScanner:
    """Use another scanner, or mount it elsewhere."""

    scanner: Scanner
    """The new one."""
    client: int | None = None
    """Number of the browser's connection."""
    at: float = 0.0
    """When [s, any monotonic clock]: changes that follow quickly are one undo step."""


@dataclass(frozen=True, slots=True)
class LookAt:
    """Bring a place into view."""

    client: int
    """Number of the browser's connection."""
    place: Point
    """Where [m]."""


@dataclass(frozen=True, slots=True)
class ShowProblem:
    """Select what a problem is about and go to its place."""

    client: int
    """Number of the browser's connection."""
    problem: Problem
    """Which one."""


@dataclass(frozen=True, slots=True)
class Restored:
    """The journal held edits that were not saved."""

    project: Project
    """What they led to."""
    text: str
    """What was restored, in one line."""


EditAction: TypeAlias = (
    Join
    | Leave
    | ChooseTool
    | ChooseSnapping
    | Cancel
    | ClickFloor
    | DragFloor
    | DragSelection
    | SelectReflectors
    | DeleteSelected
    | DuplicateSelected
    | SetSelected
    | MirrorSelected
    | RepeatSelected
    | SnapSelected
    | Finish
    | FinishRoute
    | SelectControlPoint
    | InsertControlPoint
    | SplitSegment
    | PlaceControlPoint
    | DeleteControlPoint
    | SetSegment
    | RenameRoute
    | DeleteRoute
    | SetVehicle
    | SetScanner
    | StationAction
    | LookAt
    | ShowProblem
    | Restored
)

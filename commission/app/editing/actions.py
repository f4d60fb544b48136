"""What a person can ask for while editing, as frozen values."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from commission.app.base.actions import Action, Phase, Point
from commission.app.editing.editor import ControlPoint
from commission.app.editing.tool import Tool
from commission.site.editing.reflectors import MOST_COPIES
from commission.site.quantity import COORDINATE, Bounds, Quantity, X, Y
from commission.site.scanner import Scanner
from commission.site.vehicle import Vehicle


@dataclass(frozen=True, slots=True)
class ChooseTool(Action):
    """Change what a click does."""

    tool: Tool | None
    """What a click does from now on; none: it selects."""


@dataclass(frozen=True, slots=True)
class SetSnapping(Action):
    """Change one thing about what attracts reflectors."""

    name: str
    """Field of `Snapping`."""
    value: object
    """New value, SI."""


@dataclass(frozen=True, slots=True)
class Cancel(Action):
    """Drop what is half done: a drag, a route being drawn, a measurement; else the selection."""


@dataclass(frozen=True, slots=True)
class DragSelection(Action):
    """The selection's handle is dragged."""

    phase: Phase
    """Whether the drag begins, goes on or ends."""
    now: Point
    """Where the handle is [m]; it began at the middle of the selection."""

    def supersedes(self, earlier: Action) -> bool:
        """Whether the place before is passed already."""
        return isinstance(earlier, DragSelection) and (earlier.phase, self.phase) == ("update", "update")


@dataclass(frozen=True, slots=True)
class Nudge(Action):
    """Move what is selected by a little: reflectors, a control point, a station or a tag."""

    by: Point
    """How far [m], map frame."""


@dataclass(frozen=True, slots=True)
class SelectReflectors(Action):
    """Select these reflectors and nothing else."""

    ids: tuple[str, ...]
    """Their ids; unknown ones are ignored."""
    fly: bool = False
    """Whether to bring them into view."""
    toggle: bool = False
    """Whether they are selected besides the others, or, where they are selected already, no longer."""


@dataclass(frozen=True, slots=True)
class DeleteSelected(Action):
    """Delete what is selected: reflectors, a control point, a station or a tag."""


@dataclass(frozen=True, slots=True)
class DuplicateSelected(Action):
    """Copy the selected reflectors beside themselves and select the copies."""


@dataclass(frozen=True, slots=True)
class SetSelected(Action):
    """Set one field of every selected reflector."""

    name: str
    """Field of `Reflector`."""
    value: object
    """New value, SI and radians."""


@dataclass(frozen=True, slots=True)
class SetReflector(Action):
    """Set one field of a reflector, be it selected or not."""

    id: str
    """Which one."""
    name: str
    """Field of `Reflector`."""
    value: object
    """New value, SI and radians."""


@dataclass(frozen=True, slots=True)
class MirrorSelected(Action):
    """Mirror the selected reflectors about a line."""

    through: Annotated[Point, Quantity(label="Line at", unit="m", bounds=COORDINATE)]
    """A point of the line."""
    angle: float
    """Its direction, map frame [rad]."""
    copy: bool = False
    """Whether the originals stay."""


@dataclass(frozen=True, slots=True)
class RepeatSelected(Action):
    """Copy the selected reflectors several times along a line."""

    step: Annotated[
        Point,
        Quantity(label="Step x", unit="m", bounds=COORDINATE),
        Quantity(label="Step y", unit="m", bounds=COORDINATE),
    ]
    """From each copy to the next, map frame."""
    count: Annotated[int, Quantity(label="Copies", bounds=Bounds.between(1, MOST_COPIES), step=1, entry=(1, 1000))]
    """How many copies."""


@dataclass(frozen=True, slots=True)
class SnapSelected(Action):
    """Put the selected reflectors against their nearest walls."""


@dataclass(frozen=True, slots=True)
class Finish(Action):
    """Make what the tool in use is for of the points drawn so far."""


@dataclass(frozen=True, slots=True)
class SelectControlPoint(Action):
    """Select a control point and its route."""

    point: ControlPoint
    """Which one."""
    fly: bool = False
    """Whether to bring it into view."""


@dataclass(frozen=True, slots=True)
class InsertControlPoint(Action):
    """Insert a control point where the selected segment was last clicked; its curve stays as it is."""


@dataclass(frozen=True, slots=True)
class SplitSegment(Action):
    """Cut the selected segment in two where it was last clicked, so that its parts can be driven differently."""


@dataclass(frozen=True, slots=True)
class DeleteControlPoint(Action):
    """Delete the selected control point."""


@dataclass(frozen=True, slots=True)
class PlaceControlPoint(Action):
    """Put the selected control point somewhere."""

    place: Annotated[Point, X, Y]
    """Where, map frame."""
    dragged: bool = False
    """Whether a drag put it there: that is an undo step of its own."""


@dataclass(frozen=True, slots=True)
class SetCoordinate(Action):
    """Put the selected control point elsewhere along one axis."""

    name: str
    """Number of `PlaceControlPoint`: `place[0]` or `place[1]`."""
    value: object
    """New value [m]."""


@dataclass(frozen=True, slots=True)
class SetSegment(Action):
    """Set how the selected control point's segment is driven."""

    name: str
    """Field of `Segment`: `direction` or `speed`."""
    value: object
    """New value, SI."""


@dataclass(frozen=True, slots=True)
class SetRoute(Action):
    """Set one field of a route."""

    field: str
    """Field of `Route`: `name` or `speed`."""
    value: object
    """New value, SI."""
    of: str = ""
    """Name of the route; empty: the selected one."""


@dataclass(frozen=True, slots=True)
class DeleteRoute(Action):
    """Delete the selected route."""


@dataclass(frozen=True, slots=True)
class SetVehicle(Action):
    """Use another vehicle."""

    vehicle: Vehicle
    """The new one."""


@dataclass(frozen=True, slots=True)
class AddScanner(Action):
    """Add a scanner like the last one, on the opposite corner of the vehicle."""


@dataclass(frozen=True, slots=True)
class RemoveScanner(Action):
    """Remove a scanner; the last one stays."""

    name: str
    """Its name."""


@dataclass(frozen=True, slots=True)
class SetScanner(Action):
    """Use another scanner in the place of the one of the same name."""

    scanner: Scanner
    """The new one."""


@dataclass(frozen=True, slots=True)
class SetScannerField(Action):
    """Set one number, or list of them, of a scanner."""

    field: str
    """Field of `Scanner`, or `field[index]`."""
    value: object
    """New value, SI and radians."""
    of: str
    """Name of the scanner."""


@dataclass(frozen=True, slots=True)
class SetEquipment(Action):
    """Set one number, or list of them, of vehicle or scanner."""

    name: str
    """Its dotted name in the project: `vehicle.wheelbase`, `scanners[0].mounting[2]`."""
    value: object
    """New value, in the unit of code and files."""

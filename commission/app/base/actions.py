"""Everything that can happen on the page, as frozen values. Callbacks post them; nothing is done here.

An action says what was asked for, in SI and radians; an envelope says who asked and when. Each feature declares its own
actions beside the handlers that say what they mean (`reduce`); here are only those that no feature owns.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import Literal, TypeAlias

Point: TypeAlias = tuple[float, float]
"""A place on the floor [m, m], map frame."""
Phase: TypeAlias = Literal["start", "update", "end"]


class Action:
    """Something that was asked for, or has happened: the base of frozen dataclasses."""

    __slots__ = ()

    def supersedes(self, earlier: Action) -> bool:  # noqa: ARG002 - a default
        """Whether the same browser's action just before has no meaning any more: the newest place of a drag counts."""
        return False


@dataclass(frozen=True, slots=True)
class Sender:
    """Who asked for something, and when."""

    browser: int | None = None
    """Number of the browser's connection; none: the program itself."""
    at: float = 0.0
    """When [s, any monotonic clock]: edits of one thing that follow quickly are one undo step."""
    widget: str = ""
    """Identifier of the field in which it was entered: there a refusal is said. Empty: in none."""


PROGRAM = Sender()
"""The program itself."""


@dataclass(frozen=True, slots=True)
class Envelope:
    """An action on its way to the owner thread."""

    action: Action
    """What was asked for."""
    sender: Sender = PROGRAM
    """Who asked, and when."""


@dataclass(frozen=True, slots=True)
class Join(Action):
    """A browser came."""


@dataclass(frozen=True, slots=True)
class NameWindow(Action):
    """A browser says which window it is, the same after a reload as before."""

    name: str
    """Its own choice; kept by the window."""


@dataclass(frozen=True, slots=True)
class Leave(Action):
    """A browser is gone."""


@dataclass(frozen=True, slots=True)
class Undo(Action):
    """Take back the last change of the project."""


@dataclass(frozen=True, slots=True)
class Redo(Action):
    """Make the change that was taken back again."""


@dataclass(frozen=True, slots=True)
class ShowLayer(Action):
    """Show or hide one drawn thing."""

    name: str
    """Name of the layer."""
    visible: bool
    """Whether it is drawn."""


@dataclass(frozen=True, slots=True)
class Magnify(Action):
    """Draw ellipses larger than they are."""

    factor: float
    """Factor; 1 is true to scale."""


class Camera(StrEnum):
    """What one browser looks at."""

    PLAN = "2D"
    THREE_D = "3D"
    FIT = "Fit"
    FOLLOW = "Follow"


@dataclass(frozen=True, slots=True)
class SetCamera(Action):
    """Change what one browser looks at; the others keep their view."""

    camera: Camera
    """What it looks at; `Fit` keeps plan or 3D, `Follow` is switched on or off."""


@dataclass(frozen=True, slots=True)
class LookAt(Action):
    """Bring a place into view."""

    place: Point
    """Where [m], map frame."""


@dataclass(frozen=True, slots=True)
class ClickFloor(Action):
    """The floor was clicked."""

    place: Point
    """Where [m], map frame."""
    reach: float
    """How near counts as on something [m]: some pixels at the browser's zoom."""
    add: bool = False
    """Whether to add to the selection."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DragFloor(Action):
    """The pointer is dragged over the floor."""

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

    def supersedes(self, earlier: Action) -> bool:
        """Whether the place before is passed already."""
        return isinstance(earlier, DragFloor) and (earlier.phase, self.phase) == ("update", "update")


@dataclass(frozen=True, slots=True)
class StopJob(Action):
    """Stop a piece of background work; what there was before it stays."""

    number: int
    """Number of the job."""


@dataclass(frozen=True, slots=True)
class Report(Action):
    """Something was refused or went wrong, or is good to know: told to who asked, or to all where nobody did."""

    text: str
    """One line."""
    failed: bool = True
    """Whether it is a problem."""
    listed: str = ""
    """What stays listed for all browsers of a problem that one of them has; it quotes no file. Empty: nothing. What
    the program itself reports is listed as it is."""


@dataclass(frozen=True, slots=True)
class LookAgain(Action):
    """What a list is asked for stands in its widgets: a page at rest is drawn again."""


@dataclass(frozen=True, slots=True)
class HoldSlider(Action):
    """A slider is taken hold of, or let go."""

    held: bool
    """Whether it is taken hold of."""


@dataclass(frozen=True, slots=True)
class ClearFaults(Action):
    """The list of what went wrong was read."""

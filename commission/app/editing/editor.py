"""What one browser is editing with: its tool, its selection, a gesture under way. Each browser has its own; frozen."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Annotated

from commission.app.base.actions import Point, Sender
from commission.app.base.state import AppState
from commission.app.editing.tool import Tool
from commission.site.checks import check_fields
from commission.site.quantity import Bounds, Quantity, Switch


class Grab(StrEnum):
    """What a drag moves."""

    REFLECTORS = "reflectors"
    CONTROL_POINT = "control point"
    POSED = "station or tag"
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


class PosedKind(StrEnum):
    """What has a name, a place and a heading."""

    STATION = "station"
    TAG = "tag"


@dataclass(frozen=True, slots=True)
class PosedKey:
    """A station or a tag."""

    kind: PosedKind
    """Which of both."""
    name: str
    """Name of the station, id of the tag."""


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

    walls: Annotated[bool, Switch("To walls")] = True
    """Against the nearest wall, a flat plate facing away."""
    neighbors: Annotated[bool, Switch("To neighbors")] = False
    """Onto rows and columns of other reflectors."""
    grid: Annotated[float, Quantity(label="Grid", unit="m", bounds=Bounds.between(0.0, 100.0), step=0.01)] = 0.0
    """Onto multiples of this spacing; 0: no grid."""

    def __post_init__(self) -> None:
        check_fields(self, "snapping.")


@dataclass(frozen=True, slots=True, kw_only=True)
class Editor:
    """How one browser edits."""

    tool: Tool | None = None
    """What a click does; none: it selects."""
    laid_aside: Tool | None = None
    """A tool that was left with something begun, which is there when it is taken up again."""
    selected: tuple[str, ...] = ()
    """Ids of the selected reflectors."""
    point: ControlPoint | None = None
    """The selected control point; its route is the selected one."""
    posed: PosedKey | None = None
    """The selected station or tag."""
    further: tuple[str, ...] = ()
    """Names of what is selected besides the station, the tag or the route: more of its kind."""
    drag: Drag | None = None
    """A drag under way."""
    last_click: Point | None = None
    """Where the floor was last clicked [m]."""
    snapping: Snapping = Snapping()
    """What attracts."""
    reach: float = 0.1
    """How near a click has to be to mean something, at the zoom of the newest gesture [m]."""

    def selecting(
        self,
        reflectors: tuple[str, ...] = (),
        *,
        point: ControlPoint | None = None,
        posed: PosedKey | None = None,
        further: tuple[str, ...] = (),
    ) -> Editor:
        """Return the editor with this selected and nothing else.

        Parameters
        ----------
        reflectors : ids.
        point : control point of a route.
        posed : station or tag.
        further : names of more of the same kind as the station, the tag or the point's route.
        """
        return replace(self, selected=reflectors, point=point, posed=posed, further=further)

    def using(self, tool: Tool | None, state: AppState) -> Editor:
        """Return the editor with another tool: what was begun with the old one is dropped, unless that tool keeps it.

        Parameters
        ----------
        tool : fresh; none: a click selects.
        state : of the page, which may have changed since a tool was laid aside.
        """
        old = self.tool
        aside = old if old is not None and old.stays and old.is_half_done else self.laid_aside
        if tool is not None and aside is not None and type(tool) is type(aside):
            tool, aside = aside.taken_up(state), None
        return replace(self, tool=tool, laid_aside=aside, drag=None)

    def brought_back(self, state: AppState) -> Editor:
        """Return what is there again after a reload: what attracts, and a tool that keeps what was begun with it."""
        tool = self.tool if self.tool is not None and self.tool.stays and self.tool.is_half_done else None
        return Editor(
            tool=None if tool is None else tool.taken_up(state), laid_aside=self.laid_aside, snapping=self.snapping
        )

    @property
    def points(self) -> tuple[Point, ...]:
        """Points that were clicked with the tool in use [m]."""
        return () if self.tool is None else self.tool.points

    @property
    def has_selection(self) -> bool:
        """Whether anything is selected."""
        return bool(self.selected) or self.point is not None or self.posed is not None


def editor_of(state: AppState, browser: int | None) -> Editor:
    """Return how a browser edits; one that is not there selects."""
    return state.of_browser(browser, Editor)


def with_tool(state: AppState, sender: Sender, tool: Tool | None) -> AppState:
    """Return the state in which a browser uses another tool, or the same one farther on.

    Parameters
    ----------
    state : before.
    sender : whose browser it is.
    tool : with its points so far; none: a click selects.
    """
    return state.with_browser(sender.browser, replace(editor_of(state, sender.browser), tool=tool))


def editors_of(state: AppState) -> tuple[Editor, ...]:
    """Return how each connected browser edits."""
    return tuple(editor_of(state, browser) for browser in state.browsers)

"""What a feature is: its layers, panels, services and handlers, in one value that the page is put together from.

How to add one: a folder `app/NAME` with

- `actions.py`: frozen dataclasses derived from `Action`; who asked and when is in the envelope, not in them;
- `state.py`: the frozen value that it keeps in the page's state, `state.part(NameState)`; what it keeps for each
  browser is `state.of_browser(sender.browser, NameOfOne)`. Both have a default for each field;
- `reducer.py`: a named handler of each action, `@reduce.register def do_it(action, state, sender) -> Outcome`;
- `view.py`: the frozen value that its service adds to the view, `view.part(NameView)`;
- `service.py`: a `Service` that follows the state, computes in the background and carries out the feature's effects;
- layers (`BaseLayer`) and panels (`BasePanel`), which draw a view and post actions;
- `feature.py`: `FEATURE = Feature(...)`, which names all of them; and one line in the list of `app/launch.py`.

Whatever it does not need, it does not have. Features do not import each other, but may import `editing`; what two of
them share belongs into `base` where it knows no feature, else below `app`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import Enum, auto
from types import ModuleType
from typing import Any, TypeAlias

from viser import ClientHandle, GuiApi, SceneApi

from commission.app.base.layer import Layer
from commission.app.base.panel import Panel, Post
from commission.app.base.service import Context, Service
from commission.app.base.state import AppState


class Side(Enum):
    """Where around the floor a tab is docked."""

    LEFT = auto()
    RIGHT = auto()
    RIGHT_BELOW = auto()
    BOTTOM = auto()


@dataclass(frozen=True, slots=True)
class Tab:
    """A tab that panels are put into; it exists where a feature has one in it."""

    side: Side
    """Where it is docked."""
    name: str
    """Its title."""
    rank: int
    """Where it stands among the tabs of its side."""


SITE = Tab(Side.LEFT, "Site", 10)
PLAN = Tab(Side.LEFT, "Plan", 20)
RUN = Tab(Side.LEFT, "Run", 30)
TUNE = Tab(Side.LEFT, "Tune", 40)
SELECTION = Tab(Side.RIGHT, "Selection", 10)
REFLECTORS = Tab(Side.RIGHT, "Reflectors", 20)
ROUTES = Tab(Side.RIGHT, "Routes", 30)
LAYERS = Tab(Side.RIGHT_BELOW, "Layers", 10)
PROBLEMS = Tab(Side.RIGHT_BELOW, "Problems", 30)
ASSOCIATION = Tab(Side.RIGHT_BELOW, "Association", 40)
TIME = Tab(Side.BOTTOM, "Time", 10)
ROUTE = Tab(Side.BOTTOM, "Route", 20)
SENSOR = Tab(Side.BOTTOM, "Sensor", 30)


@dataclass(frozen=True, slots=True, kw_only=True)
class PanelPlace:
    """What a panel is made with. Its constructor is called where its widgets belong: they need no container."""

    gui: GuiApi
    """Where widgets are made: everybody's, or one browser's own."""
    scene: SceneApi
    """The same for nodes on the floor."""
    post: Post
    """Takes the actions of widgets."""
    state: AppState
    """What the widgets begin with."""
    container: Any
    """The tab or folder, for a panel that adds widgets later; none in the bar at the top."""
    layers: Sequence[Layer]
    """Everything that is drawn on the floor."""
    client: ClientHandle | None = None
    """The browser whose own panel it is; none: it is everybody's."""

    @property
    def browser(self) -> int:
        """Number of the browser's connection."""
        if self.client is None:
            raise ValueError("a panel for everybody asks for its browser; expected one with `own=True`")
        return self.client.client_id


@dataclass(frozen=True, slots=True, kw_only=True)
class Docked:
    """A panel and where it goes."""

    make: Callable[[PanelPlace], Panel]
    """Makes it."""
    tab: Tab | None
    """The tab that it is in; none: the bar at the top, and of a browser's own panels those without a widget."""
    rank: int = 0
    """Where it stands in its tab, from the top or from the left."""
    folder: str = ""
    """Title of the folder around it; empty: there is none."""
    is_open: bool = False
    """Whether the folder is open at first."""
    own: bool = False
    """Whether each browser has its own: what it shows depends on the selection, the tool, the file of one browser."""


MakeService: TypeAlias = Callable[[Context], Service]
MakeLayer: TypeAlias = Callable[[SceneApi], Layer]


@dataclass(frozen=True, slots=True, kw_only=True)
class Feature:
    """One feature of the page."""

    name: str
    """As its folder is called."""
    reducers: tuple[ModuleType, ...] = ()
    """Modules with the handlers of its actions: importing them registers these."""
    services: tuple[MakeService, ...] = ()
    """What it does besides drawing."""
    layers: tuple[MakeLayer, ...] = ()
    """What it draws on the floor."""
    panels: tuple[Docked, ...] = ()
    """Its widgets."""

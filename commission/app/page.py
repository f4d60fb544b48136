"""The page put together from features: layers on the floor, panels around it, cameras. It draws frozen views.

Everything here is called by the owner thread, except the callbacks of widgets, which only post. It knows no feature but
those it is given.
"""

from __future__ import annotations

from collections.abc import Generator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import viser
from viser import ClientHandle, GuiApi, GuiTabHandle, PanelHandle

from commission.app.base import theme, viser_private
from commission.app.base.actions import Sender
from commission.app.base.cameras import Cameras
from commission.app.base.effects import Effect, FlyTo, PlaceCamera, SendFile, Tell
from commission.app.base.extent import extent_of
from commission.app.base.feature import Docked, Feature, PanelPlace, Side, Tab
from commission.app.base.layer import Layer
from commission.app.base.map_scene import SceneOrigin
from commission.app.base.panel import Panel, Post
from commission.app.base.pointer import floor_drag, take_clicks
from commission.app.base.state import AppState
from commission.app.base.view import Followed, PageView
from commission.io.bundled import bundled_folder
from commission.site.project import Project

TOLD_FOR_S = 6.0


def _light(scene: viser.SceneApi) -> None:
    """Light what stands up: tops are brightest, and no side is black.

    viser's own lights throw shadows that nothing here has, and mirror the picture of a hall that is not this one:
    without them a computer without a graphics card draws twice as many frames.
    """
    scene.configure_environment_map(hdri=None)
    scene.configure_default_lights(enabled=False)
    scene.add_light_ambient("/lights/around", intensity=1.1)
    scene.add_light_directional("/lights/above", intensity=2.9, position=(0.45, -0.25, 1.0))


@dataclass(frozen=True, slots=True)
class BrowserPage:
    """What belongs to one browser alone; its nodes and widgets go with it."""

    client: ClientHandle
    """The browser."""
    panels: tuple[Panel, ...]
    """Its own panels."""


class Page:
    """What the browsers show.

    Parameters
    ----------
    server : a started server without content.
    post : takes the actions of widgets.
    state : what the widgets begin with; its project is drawn by `show_site`.
    features : what there is on the page.
    """

    def __init__(self, server: viser.ViserServer, post: Post, state: AppState, features: Sequence[Feature]) -> None:
        self._server = server
        self._post = post
        self._state = state
        self._hidden: frozenset[str] = frozenset()
        self._project: Project | None = None
        self._browsers: dict[int, BrowserPage] = {}
        self._origin = SceneOrigin()
        self._scene = self._origin.scene(server.scene)
        docked = sorted((panel for feature in features for panel in feature.panels), key=lambda panel: panel.rank)
        self._own = tuple(panel for panel in docked if panel.own)
        for script in sorted(bundled_folder("web_assets").glob("*.js")):
            viser_private.run_on_pages(server, script.read_text(encoding="utf-8"))
        with server.atomic():
            server.gui.configure_theme(
                dark_mode=True, show_logo=False, show_share_button=False, brand_color=theme.BRAND
            )
            server.gui.set_panel_label(None)
            server.scene.world_axes.visible = False
            server.scene.set_background_image(np.full((2, 2, 3), theme.BACKGROUND, np.uint8), format="png")
            _light(server.scene)
            layers = [make(self._scene) for feature in features for make in feature.layers]
            self._layers: tuple[Layer, ...] = tuple(sorted(layers, key=lambda layer: layer.rank))
            self._panels, self._tabs = self._build(docked)
            self._cameras = Cameras(
                server, self._layers, extent_of(state.project), self._origin, on_drag=floor_drag(post)
            )

    def _build(self, docked: Sequence[Docked]) -> tuple[tuple[Panel, ...], dict[Tab, GuiTabHandle]]:
        """Make the panels that everybody shares: steps on the left, what is selected on the right, time below."""
        gui = self._server.gui
        shared = [panel for panel in docked if not panel.own]
        panels = [self._made(panel, gui, None) for panel in shared if panel.tab is None]
        tabs: dict[Tab, GuiTabHandle] = {}
        sides: dict[Side, PanelHandle] = {}
        for side in Side:
            sides[side] = gui.add_panel()
            here = {panel.tab for panel in docked if panel.tab is not None and panel.tab.side is side}
            for tab in sorted(here, key=lambda tab: tab.rank):
                tabs[tab] = sides[side].add_tab(tab.name)
                panels += [self._made(panel, gui, tabs[tab]) for panel in shared if panel.tab == tab]
            _dock(side, sides)
        return tuple(panels), tabs

    def _made(self, panel: Docked, gui: GuiApi, container: Any, client: ClientHandle | None = None) -> Panel:
        """Make a panel where its widgets belong."""
        scene = self._scene if client is None else self._origin.scene(client.scene)
        with ExitStack() as inside:
            if container is not None:
                inside.enter_context(container)
            if panel.folder:
                container = inside.enter_context(gui.add_folder(panel.folder, expand_by_default=panel.is_open))
            return panel.make(
                PanelPlace(
                    gui=gui,
                    scene=scene,
                    post=self._post,
                    state=self._state,
                    container=container,
                    layers=self._layers,
                    client=client,
                )
            )

    def show_site(self, state: AppState) -> None:
        """Draw what has changed of the project since it was last drawn."""
        project, before = state.project, self._project
        changed = tuple(
            layer
            for layer in self._layers
            if before is None or any(getattr(project, part) is not getattr(before, part) for part in layer.reads)
        )
        self._project = project
        with self._server.atomic():
            for layer in changed:
                layer.show_site(project)
        names = frozenset(layer.name for layer in changed)
        self._hide(state.hidden, drawn_anew=names)
        self._cameras.refurnish(names, extent_of(project), state.hidden)

    def draw(self, view: PageView, *, slowly: bool) -> None:
        """Draw a view.

        Parameters
        ----------
        view : the newest one.
        slowly : whether also to draw what may lag behind.
        """
        hidden = view.state.hidden
        colored = any(layer.colors_floor(view) for layer in self._layers if layer.name not in hidden)
        view = replace(view, floor_is_colored=colored)
        with self._server.atomic():
            for drawn in (*self._layers, *self._panels):
                drawn.draw(view)
                if slowly:
                    drawn.draw_slowly(view)
        for number, browser in self._browsers.items():
            with self._if_there(number), browser.client.atomic():
                for panel in browser.panels:
                    panel.draw(view)
                    if slowly:
                        panel.draw_slowly(view)
        self._hide(view.state.hidden)
        followed = view.part(Followed)
        if followed is not None:
            self._cameras.follow(followed.place)

    def _hide(self, hidden: frozenset[str], *, drawn_anew: frozenset[str] = frozenset()) -> None:
        """Show and hide layers where that changed, and those whose nodes are new."""
        changed = drawn_anew | (hidden ^ self._hidden)
        self._hidden = hidden
        for layer in self._layers:
            if layer.name in changed:
                for node in layer.nodes():
                    node.visible = layer.name not in hidden
                self._cameras.show_layer(layer.name, visible=layer.name not in hidden)

    def carry_out(self, effect: Effect, sender: Sender) -> None:
        """Do one thing that only the page can do; nothing happens in a browser that has gone."""
        own = [number for number in self._browsers if number == sender.browser]
        match effect:
            case Tell(text, failed, everywhere):
                self._tell(text, None if everywhere else sender.browser, failed=failed)
                if failed and sender.browser is not None and sender.widget:
                    viser_private.say_at_field(self._server, sender.browser, sender.widget, text)
            case PlaceCamera(camera, everywhere):
                for number in self._browsers if everywhere else own:
                    with self._if_there(number), suppress(ValueError):  # it may look from where it looks at
                        self._cameras.show(number, camera)
            case FlyTo(place):
                for number in own:
                    with self._if_there(number), suppress(ValueError):
                        self._cameras.look_at(number, place)
            case SendFile(name, content):
                for number in own:
                    with self._if_there(number):
                        self._browsers[number].client.send_file_download(name, content, save_immediately=True)
            case _:
                raise TypeError(f"nobody carries out {type(effect).__name__}; expected a service that names it")

    @contextmanager
    def _if_there(self, browser: int) -> Generator[None]:
        """Do something in one browser; that it leaves meanwhile is no fault, and nobody else's business.

        viser takes down what a browser has of its own as soon as that browser has gone, which the owner thread, in the
        middle of a picture, does not know yet.
        """
        try:
            yield
        except (RuntimeError, KeyError):
            if browser in self._server.get_clients():
                raise

    def _tell(self, text: str, browser: int | None, *, failed: bool) -> None:
        """Notify one browser, or all of them; those that are leaving hear nothing, and disturb nobody."""
        for number, client in self._server.get_clients().items():
            if browser not in (None, number):
                continue
            client.add_notification(
                "Problem" if failed else "Note",
                text,
                color="red" if failed else "green",
                auto_close_seconds=TOLD_FOR_S,
            )

    def connected(self, browser: int) -> None:
        """Set up a new browser's own view and panels."""
        client = self._server.get_clients().get(browser)
        if client is None:
            return
        with self._if_there(browser), client.atomic():
            tabs = self._tabs
            panels = tuple(self._made(panel, client.gui, panel.tab and tabs[panel.tab], client) for panel in self._own)
            self._browsers[browser] = BrowserPage(client, panels)
            take_clicks(client, self._origin.scene(client.scene), self._post)
            self._cameras.connected(client)

    def disconnected(self, browser: int) -> None:
        """Forget a browser."""
        self._browsers.pop(browser, None)
        self._cameras.disconnected(browser)


def _dock(side: Side, sides: dict[Side, PanelHandle]) -> None:
    """Put the panel of a side where it belongs."""
    panel = sides[side]
    match side:
        case Side.LEFT:
            panel.dock_left()
            panel.set_width(theme.LEFT_PX)
        case Side.RIGHT:
            panel.dock_right()
            panel.set_width(theme.RIGHT_PX)
        case Side.RIGHT_BELOW:
            panel.dock_below(sides[Side.RIGHT])
        case Side.BOTTOM:
            panel.float(x=0, y=-1, width=1000, height=theme.BOTTOM_PX)

"""The page put together: layers on the floor, panels around it, cameras. It draws frozen views and posts actions.

Everything here is called by the owner thread, except the callbacks of widgets, which only post.
"""

from __future__ import annotations

import numpy as np
import viser

from commission.app.ambiguity.ambiguity_layer import AmbiguityLayer
from commission.app.base import theme
from commission.app.base.actions import View
from commission.app.base.cameras import Cameras
from commission.app.base.extent import extent_of
from commission.app.base.grid_layer import GridLayer
from commission.app.base.layer import Layer
from commission.app.base.layers_panel import LayersPanel, LegendPanel
from commission.app.base.panel import Panel, Post
from commission.app.base.state import AppState
from commission.app.base.view import PageView
from commission.app.coverage.ellipse_layer import FixEllipseLayer
from commission.app.coverage.heat_layer import HeatLayer
from commission.app.coverage.heat_legend import HeatLegend
from commission.app.coverage.pointer import read_clicks
from commission.app.editing.browser_panels import Desk, DeskTabs
from commission.app.editing.pointer import floor_drag
from commission.app.editing.reflector_layer import ReflectorLayer, ReflectorNameLayer
from commission.app.editing.route_layer import RouteLayer
from commission.app.editing.station_layer import StationLayer
from commission.app.failures.failure_layer import FailingLayer
from commission.app.floor_map.draft_layer import MapDraftLayer
from commission.app.floor_map.floor_layer import FloorLayer
from commission.app.floor_map.wall_layer import WallLayer
from commission.app.placement.suggestion_layer import SuggestionLayer
from commission.app.plan.plan_panel import PlanPanel
from commission.app.prediction.event_layer import EventLayer
from commission.app.prediction.ribbon_layer import RibbonLayer
from commission.app.problems.problems_panel import ProblemsPanel
from commission.app.problems.violation_layer import ViolationLayer
from commission.app.project.site_panel import SitePanel
from commission.app.project.top_bar import TopBar
from commission.app.run.accumulated_layer import AccumulatedLayer
from commission.app.run.detection_layer import DetectionLayer
from commission.app.run.gate_layer import GateLayer
from commission.app.run.plots import Plots
from commission.app.run.run_panel import RunPanel
from commission.app.run.scan_layer import ScanLayer
from commission.app.run.time_line import TimeLine
from commission.app.run.trail_layers import ReferenceLayer, TrailLayer
from commission.app.run.uncertainty_layer import UncertaintyLayer
from commission.app.run.vehicle_layer import VehicleLayer
from commission.app.tune.tune_panel import TunePanel
from commission.site.project import Project

LAYERS = (
    FloorLayer,
    HeatLayer,
    AmbiguityLayer,
    GridLayer,
    RouteLayer,
    FixEllipseLayer,
    ViolationLayer,
    StationLayer,
    RibbonLayer,
    EventLayer,
    FailingLayer,
    ReflectorLayer,
    SuggestionLayer,
    ReflectorNameLayer,
    GateLayer,
    ScanLayer,
    DetectionLayer,
    AccumulatedLayer,
    VehicleLayer,
    UncertaintyLayer,
    TrailLayer,
    ReferenceLayer,
    WallLayer,
    MapDraftLayer,
)
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


class Page:
    """What the browsers show.

    Parameters
    ----------
    server : a started server without content.
    post : takes the actions of widgets.
    state : what the widgets begin with; its project is drawn by `show_site`.
    """

    def __init__(self, server: viser.ViserServer, post: Post, state: AppState) -> None:
        self._server = server
        self._post = post
        self._hidden: frozenset[str] = frozenset()
        self._project: Project | None = None
        self._desks: dict[int, Desk] = {}
        with server.atomic():
            server.gui.configure_theme(
                dark_mode=True, show_logo=False, show_share_button=False, brand_color=theme.BRAND
            )
            server.gui.set_panel_label(None)
            server.scene.world_axes.visible = False
            server.scene.set_background_image(np.full((2, 2, 3), theme.BACKGROUND, np.uint8), format="png")
            _light(server.scene)
            self._layers: tuple[Layer, ...] = tuple(make(server.scene) for make in LAYERS)
            self._panels = self._build_panels(post, state)
            read_clicks(server, post)
            self._cameras = Cameras(server, self._layers, extent_of(state.project), floor_drag(post))

    def _build_panels(self, post: Post, state: AppState) -> tuple[Panel, ...]:
        """Make every panel and dock it: steps on the left, what is selected on the right, time below."""
        gui = self._server.gui
        top = TopBar(gui, post, state)
        left = gui.add_panel()
        site_tab = left.add_tab("Site")
        with site_tab:
            site = SitePanel(gui, post, state.project)
        with left.add_tab("Plan"):
            plan = PlanPanel(gui, post)
        with left.add_tab("Run"):
            run = RunPanel(gui, post, state)
        with left.add_tab("Tune"):
            tune = TunePanel(gui, post, state)
        left.dock_left()
        left.set_width(theme.LEFT_PX)
        above = gui.add_panel()
        selection, reflectors, routes = (above.add_tab(name) for name in ("Selection", "Reflectors", "Routes"))
        above.dock_right()
        above.set_width(theme.RIGHT_PX)
        below = gui.add_panel()
        with below.add_tab("Legend"):
            scales = HeatLegend(gui)
            legend = LegendPanel(gui, post, self._layers, state)
        with below.add_tab("Layers"):
            switches = LayersPanel(gui, post, self._layers, state)
        problems = ProblemsPanel(gui, post, below.add_tab("Problems"))
        below.dock_below(above)
        bottom = gui.add_panel()
        with bottom.add_tab("Time"):
            time_line = TimeLine(gui, post, state.speed)
            plots = Plots(gui)
        self._tabs = DeskTabs(selection, reflectors, routes, bottom.add_tab("Route"), site_tab)
        bottom.float(x=0, y=-1, width=1000, height=theme.BOTTOM_PX)
        return top, site, plan, scales, run, tune, legend, switches, problems, time_line, plots

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
        with self._server.atomic():
            if view.run is not None:
                for layer in self._layers:
                    layer.draw(view.run, view.state)
                    if slowly:
                        layer.draw_slowly(view.run, view.state)
            for layer in self._layers:
                layer.draw_plan(view.plan, view.state)
                layer.draw_violations(view.violations)
            for panel in self._panels:
                panel.draw(view)
                if slowly:
                    panel.draw_slowly(view)
        for desk in self._desks.values():
            desk.draw(view, slowly=slowly)
        self._hide(view.state.hidden)
        if view.run is not None:
            self._cameras.follow(view.run)

    def _hide(self, hidden: frozenset[str], *, drawn_anew: frozenset[str] = frozenset()) -> None:
        """Show and hide layers where that changed, and those whose nodes are new."""
        changed = drawn_anew | (hidden ^ self._hidden)
        self._hidden = hidden
        for layer in self._layers:
            if layer.name in changed:
                for node in layer.nodes():
                    node.visible = layer.name not in hidden
                self._cameras.show_layer(layer.name, visible=layer.name not in hidden)

    def tell(self, text: str, *, failed: bool) -> None:
        """Notify every browser."""
        for client in self._server.get_clients().values():
            client.add_notification(
                "Problem" if failed else "Done",
                text,
                color="red" if failed else "green",
                auto_close_seconds=TOLD_FOR_S,
            )

    def show_view(self, client_id: int, view: View) -> None:
        """Change what one browser looks at."""
        self._cameras.show(client_id, view)

    def look_at(self, client_id: int, place: tuple[float, float]) -> None:
        """Bring a place into one browser's view."""
        self._cameras.look_at(client_id, place)

    def send_file(self, client_id: int, name: str, content: bytes) -> None:
        """Let one browser save a file; nothing happens when it has gone."""
        client = self._server.get_clients().get(client_id)
        if client is not None:
            client.send_file_download(name, content, save_immediately=True)

    def connected(self, client_id: int) -> None:
        """Set up a new browser's own view and panels."""
        client = self._server.get_clients().get(client_id)
        if client is not None:
            self._desks[client_id] = Desk(client, self._post, self._tabs)
            self._cameras.connected(client)

    def disconnected(self, client_id: int) -> None:
        """Forget a browser."""
        self._desks.pop(client_id, None)
        self._cameras.disconnected(client_id)

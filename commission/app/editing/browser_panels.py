"""One browser's desk: its clicks, its overlay on the floor, and its widgets inside the panels that all share."""

from __future__ import annotations

from dataclasses import dataclass

from viser import ClientHandle, GuiTabHandle

from commission.app.base.panel import Panel, Post
from commission.app.base.view import PageView
from commission.app.editing.editor import Editor
from commission.app.editing.overlay import Overlay
from commission.app.editing.pointer import take_clicks
from commission.app.editing.reflector_table import ReflectorTable
from commission.app.editing.route_plots import RoutePlots
from commission.app.editing.route_table import RouteTable
from commission.app.editing.selection_panel import SelectionPanel
from commission.app.editing.tool_hint import ToolHint
from commission.app.exchange.exchange_panel import ExchangePanel


@dataclass(frozen=True, slots=True)
class DeskTabs:
    """Tabs of the shared panels that each browser fills for itself."""

    selection: GuiTabHandle
    """Tools, and the values of what is selected."""
    reflectors: GuiTabHandle
    """The table of all reflectors."""
    routes: GuiTabHandle
    """The table of all routes and stations."""
    route: GuiTabHandle
    """Plots along the selected route."""
    site: GuiTabHandle
    """Imports and exports, below what the project is about."""


class Desk:
    """What belongs to one browser alone; its nodes and widgets go with it.

    Parameters
    ----------
    client : the browser.
    post : takes its actions.
    tabs : where its widgets go.
    """

    def __init__(self, client: ClientHandle, post: Post, tabs: DeskTabs) -> None:
        self._client = client
        gui, number = client.gui, client.client_id
        with client.atomic():
            self._overlay = Overlay(client, post)
            with tabs.selection:
                selection = SelectionPanel(gui, post, number)
                hint = ToolHint(gui, number)
            table = ReflectorTable(gui, post, number, tabs.reflectors)
            routes = RouteTable(gui, post, number, tabs.routes)
            with tabs.route:
                plots = RoutePlots(gui, number)
            with tabs.site:
                exchange = ExchangePanel(gui, post, number)
        self._panels: tuple[Panel, ...] = (selection, table, hint, routes, plots, exchange)
        take_clicks(client, post)

    def draw(self, view: PageView, *, slowly: bool) -> None:
        """Show a view; a browser that has just come or is going has no editor and sees nothing of its own."""
        editor = view.state.editors.get(self._client.client_id, Editor())
        with self._client.atomic():
            self._overlay.draw(view.state.project, editor)
            for panel in self._panels:
                panel.draw(view)
                if slowly:
                    panel.draw_slowly(view)

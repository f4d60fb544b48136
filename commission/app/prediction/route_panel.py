"""The step Plan, second part: the localizer predicted along a route."""

from __future__ import annotations

from typing import Any

from viser import GuiApi, GuiDropdownHandle, GuiFolderHandle

from commission.app.base import theme
from commission.app.base.actions import Action, LookAt, Report
from commission.app.base.inputs import Inputs, Text, WorkBar
from commission.app.base.numbers import metres_text
from commission.app.base.panel import BasePanel, Post
from commission.app.base.rows import Rows
from commission.app.base.view import LivedPath, PageView
from commission.app.prediction.chart import chart
from commission.app.prediction.driven import driven
from commission.app.prediction.service import PREDICTION
from commission.app.prediction.settings import PredictionSettings, PredictRoute
from commission.app.prediction.view import RiskView, RouteView
from commission.site.quantity import PERCENT, counted_text

NO_ROUTE = "Off"
MOST_RISKS = 12
CYCLES_PER_CHART = 20
"""Scans between two drawings of a run over the chart: it is long, and nobody reads it faster."""


class RoutePanel(BasePanel):
    """Widgets of the prediction.

    Parameters
    ----------
    gui, post : where the widgets are made, what takes their actions.
    folder : the folder that holds them.
    """

    def __init__(self, gui: GuiApi, post: Post, folder: GuiFolderHandle) -> None:
        self._inputs = Inputs(
            gui,
            post,
            lambda _name, value: PredictRoute(str(value)),
            lambda state, _: state.part(PredictionSettings).route,
        )
        self._risks: tuple[RiskView, ...] = ()
        self._add(gui, post)
        self._rows = Rows(gui, folder, post, self._showing)

    def _add(self, gui: GuiApi, post: Post) -> None:
        self._route: GuiDropdownHandle[Any] = gui.add_dropdown(
            "Route", (NO_ROUTE,), hint="Route along which the localizer is predicted."
        )
        self._inputs.connect(
            "route",
            self._route,
            lambda name: "" if name == NO_ROUTE else name,
            lambda state: (
                state.part(PredictionSettings).route
                if state.part(PredictionSettings).route in self._route.options
                else NO_ROUTE
            ),
        )
        self._work = WorkBar(gui, post, PREDICTION, PredictRoute(""))
        self._chart = Text(gui)
        self._neighbors = Text(gui)

    def _showing(self, index: int) -> Action:
        """Go to where a wrong association is most probable; the list may have become shorter since it was drawn."""
        if index >= len(self._risks):
            return Report("that risk is gone: the route has been predicted anew", failed=False)
        return LookAt(self._risks[index].worst)

    def draw_slowly(self, view: PageView) -> None:
        """Follow settings, progress and result."""
        names = (NO_ROUTE, *(route.name for route in view.state.project.routes))
        if self._route.options != names:
            self._route.options = names
        self._inputs.follow(view.state)
        self._work.follow(view)
        route, lived = view.part(RouteView), view.part(LivedPath)
        self._show_risks(() if route is None else route.risks)
        self._neighbors.write((route,), lambda: "" if route is None else _risk_text(route))
        if route is None:
            is_asked = bool(view.state.part(PredictionSettings).route)
            self._chart.write(("", is_asked, len(names)), lambda: "" if is_asked else _asks(len(names) > 1))
            return
        cycles = 0 if lived is None else len(lived.poses) // CYCLES_PER_CHART
        self._chart.write(
            (route, cycles), lambda: chart(route, None if lived is None else driven(lived, route.prediction))
        )

    def _show_risks(self, risks: tuple[RiskView, ...]) -> None:
        """A line for each of the most probable mistakes."""
        if risks is self._risks:
            return
        self._risks = risks
        self._rows.show(
            [
                (
                    f"{risk.reflector} taken for {risk.neighbor}: {PERCENT.text(risk.chance)} at worst, "
                    f"{metres_text(list(risk.metres))}",
                    theme.WARNING_LINE,
                )
                for risk in risks[:MOST_RISKS]
            ]
        )


def _asks(has_routes: bool) -> str:
    """Say what comes of choosing a route, or what there is to be done first."""
    text = "the error to be expected along it, what the filter will say of it, and where the supervisor would stop."
    said = f"Choose a route: {text}" if has_routes else f"Draw a route first. Then it tells {text}"
    return f"<div class='c-note' style='padding:2px 6px'>{said}</div>"


def _risk_text(route: RouteView) -> str:
    """Say whether a wrong association is to be feared, and on how much of the way zones leave reflectors out."""
    if not route.risks:
        text = "No neighbors that a detection may be taken for: no wrong association expected."
    else:
        listed = f", the first {MOST_RISKS} listed" if len(route.risks) > MOST_RISKS else ""
        text = f"{counted_text(len(route.risks), 'neighbor')} may be taken for another{listed}; a click goes there."
    if route.by_two_sigma:
        text += (
            " Predicted is 2σ: the supervisor holds the protection level, which is larger, and may stop the vehicle "
            "where nothing is told here."
        )
    way = route.way_without_reflectors
    if way > 0.0:
        text += (
            f" Zones leave reflectors out on {way:.1f} m of the way: odometry alone is reckoned with there, "
            "but by every kind."
        )
    return f"<div class='c-note' style='padding:2px 6px'>{text}</div>"

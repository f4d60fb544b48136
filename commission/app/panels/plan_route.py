"""The step Plan, second part: the localizer predicted along a route."""

from __future__ import annotations

from typing import Any

from viser import GuiApi, GuiDropdownHandle

from commission.app.panels.base import BasePanel, Post
from commission.app.panels.inputs import Inputs, Text, WorkBar
from commission.app.panels.plan_chart import chart
from commission.app.plan.actions import SetPlan
from commission.app.plan.overlay import driven
from commission.app.plan.planner import PREDICTION
from commission.app.view import PageView

NO_ROUTE = "Off"
CYCLES_PER_CHART = 20
"""Scans between two drawings of a run over the chart: it is long, and nobody reads it faster."""


class RoutePanel(BasePanel):
    """Widgets of the prediction."""

    def __init__(self, gui: GuiApi, post: Post) -> None:
        self._inputs = Inputs(gui, post, SetPlan, lambda state, name: getattr(state.plan, name))
        self._route: GuiDropdownHandle[Any] = gui.add_dropdown(
            "Route", (NO_ROUTE,), hint="Route along which the localizer is predicted."
        )
        self._inputs.connect(
            "route",
            self._route,
            lambda name: "" if name == NO_ROUTE else name,
            lambda state: state.plan.route if state.plan.route in self._route.options else NO_ROUTE,
        )
        self._work = WorkBar(gui, post, PREDICTION, SetPlan("route", ""))
        self._chart = Text(gui)

    def draw_slowly(self, view: PageView) -> None:
        """Follow settings, progress and result."""
        names = (NO_ROUTE, *(route.name for route in view.state.project.routes))
        if self._route.options != names:
            self._route.options = names
        self._inputs.follow(view.state)
        self._work.follow(view)
        route, run = view.plan.route, view.run
        if route is None:
            self._chart.write((None,), str)
            return
        cycles = 0 if run is None else len(run.series) // CYCLES_PER_CHART
        self._chart.write(
            (route, cycles), lambda: chart(route, None if run is None else driven(run.series, route.prediction))
        )

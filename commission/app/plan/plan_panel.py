"""The step Plan: its parts in folders; what each part shows is in a module of its own."""

from __future__ import annotations

from viser import GuiApi

from commission.app.ambiguity.ambiguity_panel import ColdStartPanel
from commission.app.base.inputs import write_html
from commission.app.base.panel import BasePanel, Panel, Post, escaped
from commission.app.base.view import PageView
from commission.app.coverage.heatmap_panel import HeatmapPanel
from commission.app.failures.failure_panel import FailurePanel
from commission.app.placement.placement_panel import LayoutPanel
from commission.app.plan.planner import JOBS
from commission.app.prediction.route_panel import RoutePanel


class PlanPanel(BasePanel):
    """The folders of the step Plan."""

    def __init__(self, gui: GuiApi, post: Post) -> None:
        self._note = gui.add_html("", visible=False)
        with gui.add_folder("Heatmap of the floor"):
            heatmap = HeatmapPanel(gui, post)
        route = RoutePanel(gui, post, gui.add_folder("Along a route", expand_by_default=False))
        with gui.add_folder("What if one reflector fails", expand_by_default=False):
            failures = FailurePanel(gui, post)
        cold_start = ColdStartPanel(gui, post, gui.add_folder("Ambiguous places", expand_by_default=False))
        layout = LayoutPanel(gui, post, gui.add_folder("Suggested layout", expand_by_default=False))
        self._parts: tuple[Panel, ...] = (heatmap, route, failures, cold_start, layout)

    def draw_slowly(self, view: PageView) -> None:
        """Draw each part; say what keeps all of them waiting."""
        busy = [job for job in view.jobs if not job.name.startswith(JOBS)]
        waits = bool(busy) and view.plan.waiting
        note = f"first: {escaped(busy[0].name)} {busy[0].fraction:.0%}" if waits else ""
        write_html(self._note, note and f"<div class='c-note' style='padding:2px 6px'>{note}</div>")
        for part in self._parts:
            part.draw_slowly(view)

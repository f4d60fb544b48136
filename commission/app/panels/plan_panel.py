"""The step Plan: which heatmap, which route, which failure. Widgets post settings and follow them."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from enum import StrEnum
from typing import Any, TypeVar

from viser import GuiApi, GuiButtonHandle, GuiDropdownHandle, GuiHtmlHandle, GuiInputHandle

from commission.app.panels.base import BasePanel, Post, escaped, posting, table
from commission.app.panels.plan_chart import chart
from commission.app.plan.actions import SetPlan
from commission.app.plan.overlay import driven
from commission.app.plan.planner import COVERAGE, PREDICTION, RANKING
from commission.app.plan.settings import Figure, PlanSettings, PlanValue
from commission.app.plan.view import FailureView
from commission.app.plan.words import (
    FAILURE_NAMES,
    FIGURE_NAMES,
    HEADING_NAMES,
    MEASUREMENT_NAMES,
    number_text,
)
from commission.app.store import AppState
from commission.app.view import PageView
from commission.planning.dilution import Heading, Measurement
from commission.site.project import Project

NO_ROUTE, NO_REFLECTOR = "Off", "none"
RANKED_SHOWN = 10
CYCLES_PER_CHART = 20
"""Scans between two drawings of a run over the chart: it is long, and nobody reads it faster."""

Choice = TypeVar("Choice", bound=StrEnum)


class PlanPanel(BasePanel):
    """Widgets of the step Plan."""

    def __init__(self, gui: GuiApi, post: Post, state: AppState) -> None:
        self._gui, self._post = gui, post
        self._widgets: dict[str, tuple[GuiInputHandle[Any], Callable[[PlanSettings], Any]]] = {}
        self._progress: dict[str, tuple[Any, GuiButtonHandle]] = {}
        self._html: dict[str, GuiHtmlHandle] = {}
        self._shown: dict[str, object] = {}
        plan = state.plan
        self._html["note"] = gui.add_html("", visible=False)
        with gui.add_folder("Heatmap of the floor"):
            self._add_heatmap(plan)
        with gui.add_folder("Along a route"):
            self._add_route(plan, state.project)
        with gui.add_folder("What if one reflector fails", expand_by_default=False):
            self._add_failures(plan)

    def _add_heatmap(self, plan: PlanSettings) -> None:
        gui = self._gui
        self._choice("figure", "Show", FIGURE_NAMES, plan.figure, "What the floor is colored by.")
        self._work(COVERAGE, "figure", Figure.NONE.value)
        self._number("opacity", 100.0, gui.add_slider("Opacity [%]", 10, 100, 5, 100 * plan.opacity))
        hint = "Heading of the vehicle, where the scanner does not see all around."
        self._choice("heading", "Heading", HEADING_NAMES, plan.heading, hint)
        given = gui.add_number(
            "Given [°]",
            round(math.degrees(plan.given_heading), 1),
            min=-360,
            max=360,
            step=1,
            visible=plan.heading is Heading.GIVEN,
            hint="Direction in which the vehicle looks; 0 is along x, counterclockwise.",
        )
        self._number("given_heading", math.degrees(1.0), given)
        hint = "What one scan measures: ranges and bearings, bearings only, or both together with odometry."
        self._choice("measurement", "Measured", MEASUREMENT_NAMES, plan.measurement, hint)
        odometry = gui.add_number(
            "Odometry [m]",
            plan.on_odometry,
            min=0.1,
            max=100.0,
            step=0.1,
            visible=plan.measurement is Measurement.RANGE_BEARING_PRIOR,
            hint="Way driven on odometry since a pose that was known exactly.",
        )
        self._number("on_odometry", 1.0, odometry)
        hint = "Chance that somebody stands in a metre of the way from scanner to reflector."
        blocked = gui.add_number("People [%/m]", round(100 * plan.blocked_per_m, 2), min=0, max=50, step=0.1, hint=hint)
        self._number("blocked_per_m", 100.0, blocked)
        hint = "Beams that must hit a reflector for certain, so that it passes the detector filter (equation 3)."
        beams = gui.add_number("Beams at least", plan.min_beams, min=1, max=20, step=1, hint=hint)
        self._number("min_beams", None, beams)

    def _add_route(self, plan: PlanSettings, project: Project) -> None:
        gui = self._gui
        names = (NO_ROUTE, *(route.name for route in project.routes))
        widget = gui.add_dropdown(
            "Route", names, initial_value=plan.route or NO_ROUTE, hint="Route along which the localizer is predicted."
        )
        widget.on_update(posting(self._post, lambda event: SetPlan("route", _unless(event.target.value, NO_ROUTE))))
        self._route = widget
        self._widgets["route"] = (widget, lambda settings: settings.route or NO_ROUTE)
        self._work(PREDICTION, "route", "")
        self._html["route"] = gui.add_html("", visible=False)

    def _add_failures(self, plan: PlanSettings) -> None:
        gui = self._gui
        self._choice("failure", "Each is", FAILURE_NAMES, plan.failure, "What happens to each reflector in turn.")
        rank = gui.add_button("Rank reflectors", hint="Let each fail on every route, and rank what depends on it.")
        rank.on_click(posting(self._post, lambda _event: SetPlan("ranking", value=True)))
        self._work(RANKING, "ranking", value=False)
        self._failed: GuiDropdownHandle[Any] = gui.add_dropdown(
            "Show", (NO_REFLECTOR,), visible=False, hint="Reflector whose failing metres are drawn; or click on it."
        )
        self._failed.on_update(
            posting(self._post, lambda event: SetPlan("failed", _unless(event.target.value, NO_REFLECTOR)))
        )
        self._html["failures"] = gui.add_html("", visible=False)

    def _choice(self, name: str, label: str, names: Mapping[Choice, str], value: Choice, hint: str) -> None:
        """Add a list of choices."""
        meant = {text: choice.value for choice, text in names.items()}
        widget = self._gui.add_dropdown(label, tuple(meant), initial_value=names[value], hint=hint)
        widget.on_update(posting(self._post, lambda event: SetPlan(name, meant[event.target.value])))
        self._widgets[name] = (widget, lambda settings: names[getattr(settings, name)])

    def _number(self, name: str, scale: float | None, widget: GuiInputHandle[Any]) -> None:
        """Connect a number that is shown in another unit; without a scale it is a count."""

        def meant(event: Any) -> SetPlan:
            shown = event.target.value
            return SetPlan(name, int(shown) if scale is None else float(shown) / scale)

        widget.on_update(posting(self._post, meant))

        def shown(settings: PlanSettings) -> Any:
            value = getattr(settings, name)
            return value if scale is None else round(value * scale, 3)

        self._widgets[name] = (widget, shown)

    def _work(self, job: str, name: str, value: PlanValue) -> None:
        """Add the progress of a job, and a button that cancels it by not wanting it any more."""
        bar = self._gui.add_progress_bar(0.0, visible=False, animated=True)
        cancel = self._gui.add_button("Cancel", color="gray", visible=False)
        cancel.on_click(posting(self._post, lambda _event: SetPlan(name, value)))
        self._progress[job] = (bar, cancel)

    def draw_slowly(self, view: PageView) -> None:
        """Follow settings, progress and results."""
        plan, found = view.state.plan, view.plan
        self._follow(plan, view.state.project)
        for name, (bar, cancel) in self._progress.items():
            job = next((job for job in view.jobs if job.name.startswith(name)), None)
            for widget in (bar, cancel):
                if widget.visible is not (job is not None):
                    widget.visible = job is not None
            if job is not None:
                bar.value = 100.0 * job.fraction
        busy = [job for job in view.jobs if not job.name.startswith(tuple(self._progress))]
        note = f"first: {escaped(busy[0].name)} {busy[0].fraction:.0%}" if busy and found.waiting else ""
        self._write("note", note, lambda: note and f"<div class='c-note' style='padding:2px 6px'>{note}</div>")
        cycles = 0 if view.run is None or found.route is None else len(view.run.series) // CYCLES_PER_CHART
        self._write("route", (found.route, cycles), lambda: _route_chart(view))
        self._show_failures(found.failures, plan)

    def _follow(self, plan: PlanSettings, project: Project) -> None:
        """Set widgets to what the settings say."""
        names = (NO_ROUTE, *(route.name for route in project.routes))
        if self._route.options != names:
            self._route.options = names
        if plan is self._shown.get("plan"):
            return
        self._shown["plan"] = plan
        for widget, shown in self._widgets.values():
            wanted = shown(plan)
            if widget.value != wanted:
                widget.value = wanted
        self._widgets["given_heading"][0].visible = plan.heading is Heading.GIVEN
        self._widgets["on_odometry"][0].visible = plan.measurement is Measurement.RANGE_BEARING_PRIOR

    def _write(self, name: str, source: object, make: Callable[[], str]) -> None:
        """Write a text where what it is made from has changed."""
        before = self._shown.get(name)
        if before == source and name in self._shown:
            return
        self._shown[name] = source
        content = make()
        self._html[name].content = content
        self._html[name].visible = bool(content)

    def _show_failures(self, failures: FailureView | None, plan: PlanSettings) -> None:
        names = () if failures is None else failures.names
        options = (NO_REFLECTOR, *names)
        if self._failed.options != options:
            self._failed.options = options
            self._failed.visible = bool(names)
        wanted = plan.failed if plan.failed in names else NO_REFLECTOR
        if self._failed.value != wanted:
            self._failed.value = wanted
        self._write("failures", failures, lambda: "" if failures is None else _ranking_table(failures))


def _route_chart(view: PageView) -> str:
    """The prediction with the run that is loaded laid over it."""
    route = view.plan.route
    if route is None:
        return ""
    return chart(route, None if view.run is None else driven(view.run.series, route.prediction))


def _ranking_table(failures: FailureView) -> str:
    """The reflectors on which most depends, and what fails with the chosen one."""
    rows = [("<b>Without</b>", "<b>fails</b>; 2σ / limit")]
    rows += [
        (escaped(name), f"{each.failing_metres} m; {100 * each.load:.0f} %")
        for name, each in list(zip(failures.names, failures.ranking, strict=True))[:RANKED_SHOWN]
    ]
    chosen = failures.chosen
    note = "<div class='c-note'>The site has changed since: rank again.</div>" if failures.outdated else ""
    if chosen is not None:
        parts = [f"{escaped(part.route)}: {_metres_text(part.metres.tolist())}" for part in chosen.routes]
        note += "<div class='c-note' style='padding-top:4px'>" + "<br>".join(parts) + "</div>"
    if not any(each.failing_metres for each in failures.ranking):
        note += "<div class='c-note' style='padding-top:4px'>No metre of any route fails with any single one.</div>"
    return f"<div class='c-ranking' style='padding:2px 10px 6px 6px'>{table(rows)}{note}</div>"


def _metres_text(metres: list[int]) -> str:
    """Write metres in a row as ranges: 3-7, 12."""
    ranges: list[list[int]] = []
    for metre in metres:
        if ranges and metre == ranges[-1][1]:
            ranges[-1][1] = metre + 1
        else:
            ranges.append([metre, metre + 1])
    return ", ".join(f"{number_text(a)} to {number_text(b)} m" for a, b in ranges) or "nothing fails"


def _unless(value: str, nothing: str) -> str:
    return "" if value == nothing else value

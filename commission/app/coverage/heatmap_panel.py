"""The step Plan, first part: which heatmap of the floor, and under which conditions."""

from __future__ import annotations

from viser import GuiApi

from commission.app.base import theme, viser_private
from commission.app.base.conditions import Conditions, SetCondition
from commission.app.base.floor_picture import FloorPicture, SetOpacity
from commission.app.base.inputs import Inputs, WorkBar, enable, show
from commission.app.base.panel import BasePanel, Post, posting
from commission.app.base.state import AppState
from commission.app.base.view import PageView
from commission.app.coverage.actions import ClearEllipses, SetCoverage
from commission.app.coverage.service import COVERAGE
from commission.app.coverage.settings import CoverageSettings, Figure, shown_figure
from commission.app.coverage.words import FIGURE_NAMES, HEADING_NAMES, MEASUREMENT_NAMES
from commission.planning.dilution import Heading, Measurement
from commission.site.fields import get_field, names_of

FACTORS = (1.0, 10.0, 30.0, 100.0, 300.0, 1000.0)
"""Factors at which ellipses can be drawn."""


class HeatmapPanel(BasePanel):
    """Widgets of the heatmap."""

    def __init__(self, gui: GuiApi, post: Post) -> None:
        self._inputs = inputs = Inputs(gui, post, SetCoverage, _setting)
        self._floor = Inputs(gui, post, lambda _name, value: SetOpacity(float(value or 0.0)), _of_picture)
        self._conditions = Inputs(gui, post, SetCondition, lambda state, name: get_field(state.part(Conditions), name))
        first = CoverageSettings()
        figure = inputs.choice("figure", first, FIGURE_NAMES)
        gui.add_html(theme.whole_line(viser_private.identifier(figure)))
        self._work = WorkBar(gui, post, COVERAGE, SetCoverage("figure", Figure.NONE.value))
        self._floor.field("opacity", FloorPicture())
        inputs.choice("heading", first, HEADING_NAMES)
        self._given = inputs.field("given_heading", first)
        inputs.choice("measurement", first, MEASUREMENT_NAMES)
        self._odometry = inputs.field("on_odometry", first)
        for name in names_of(Conditions):
            self._conditions.field(name, Conditions())

        with gui.add_folder("Ellipses of a fix", expand_by_default=False):
            self._add_ellipses(gui, post)

    def _add_ellipses(self, gui: GuiApi, post: Post) -> None:
        note = "Each click on the heatmap leaves the 1σ ellipse of a fix there."
        gui.add_html(f"<div class='c-note' style='padding:2px 6px'>{note}</div>")
        self._inputs.field("ellipse_grid", CoverageSettings())
        names = {factor: f"{factor:g}x" for factor in FACTORS}
        self._inputs.choice("ellipse_factor", CoverageSettings(), names)
        self._clear = gui.add_button("Clear", color="gray", hint="Drop the ellipses of clicks.")
        self._clear.on_click(posting(post, lambda _event: ClearEllipses()))

    def draw_slowly(self, view: PageView) -> None:
        """Follow settings and progress."""
        settings = view.state.part(CoverageSettings)
        for inputs in (self._inputs, self._floor, self._conditions):
            inputs.follow(view.state)
        self._work.follow(view)
        enable(self._clear, "" if settings.spots else "no spot has been clicked")
        show(self._given, visible=settings.heading is Heading.GIVEN)
        show(self._odometry, visible=settings.measurement is Measurement.RANGE_BEARING_PRIOR)


def _setting(state: AppState, name: str) -> object:
    """Read a setting of the heatmap; it shows nothing while another feature has the floor."""
    return shown_figure(state) if name == "figure" else get_field(state.part(CoverageSettings), name)


def _of_picture(state: AppState, name: str) -> object:
    return get_field(state.part(FloorPicture), name)

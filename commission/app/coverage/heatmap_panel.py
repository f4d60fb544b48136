"""The step Plan, first part: which heatmap of the floor, and under which conditions."""

from __future__ import annotations

import math

from viser import GuiApi

from commission.app.base.conditions import Conditions, SetCondition
from commission.app.base.floor_picture import FloorPicture, SetOpacity
from commission.app.base.inputs import Inputs, WorkBar, show
from commission.app.base.panel import BasePanel, Post, posting
from commission.app.base.state import AppState
from commission.app.base.view import PageView
from commission.app.coverage.actions import ClearEllipses, SetCoverage
from commission.app.coverage.service import COVERAGE
from commission.app.coverage.settings import CoverageSettings, Figure, shown_figure
from commission.app.coverage.words import FIGURE_NAMES, HEADING_NAMES, MEASUREMENT_NAMES
from commission.planning.dilution import Heading, Measurement

FACTORS = (1.0, 10.0, 30.0, 100.0, 300.0, 1000.0)
"""Factors at which ellipses can be drawn."""


class HeatmapPanel(BasePanel):
    """Widgets of the heatmap."""

    def __init__(self, gui: GuiApi, post: Post) -> None:
        self._inputs = inputs = Inputs(gui, post, SetCoverage, _setting)
        self._floor = Inputs(gui, post, lambda _name, value: SetOpacity(float(value or 0.0)), _of_picture)
        self._conditions = Inputs(gui, post, SetCondition, lambda state, name: getattr(state.part(Conditions), name))
        inputs.choice("figure", "Show", FIGURE_NAMES, "What the floor is colored by.")
        self._work = WorkBar(gui, post, COVERAGE, SetCoverage("figure", Figure.NONE.value))
        self._floor.number("opacity", 100.0, gui.add_slider("Opacity [%]", 10.0, 100.0, 5.0, 80.0))
        hint = "Heading of the vehicle, where the scanner does not see all around."
        inputs.choice("heading", "Heading", HEADING_NAMES, hint)
        hint = "Direction in which the vehicle looks; 0 is along x, counterclockwise."
        given = gui.add_number("Given [°]", 0.0, min=-360, max=360, step=1, hint=hint)
        self._given = inputs.number("given_heading", math.degrees(1.0), given)
        hint = "What one scan measures: ranges and bearings, bearings only, or both together with odometry."
        inputs.choice("measurement", "Measured", MEASUREMENT_NAMES, hint)
        hint = "Way driven on odometry since a pose that was known exactly."
        odometry = gui.add_number("Odometry [m]", 1.0, min=0.1, max=100.0, step=0.1, hint=hint)
        self._odometry = inputs.number("on_odometry", 1.0, odometry)
        hint = "Chance that somebody stands in a metre of the way from scanner to reflector."
        people = gui.add_number("People [%/m]", 0.0, min=0, max=50, step=0.1, hint=hint)
        self._conditions.number("blocked_per_m", 100.0, people)
        hint = "Beams that must hit a reflector for certain, so that it passes the detector filter (equation 3)."
        beams = gui.add_number("Beams at least", 1, min=1, max=20, step=1, hint=hint)
        self._conditions.count("min_beams", beams)

        with gui.add_folder("Ellipses of a fix", expand_by_default=False):
            self._add_ellipses(gui, post)

    def _add_ellipses(self, gui: GuiApi, post: Post) -> None:
        note = "Each click on the heatmap leaves the 1σ ellipse of a fix there."
        gui.add_html(f"<div class='c-note' style='padding:2px 6px'>{note}</div>")
        self._inputs.switch("ellipse_grid", "On a grid", "Ellipses all over the floor, too.")
        meant = {f"{factor:g}x": factor for factor in FACTORS}
        hint = "Factor at which the ellipses are drawn; true to scale is 1x."
        drawn = gui.add_dropdown("Drawn", tuple(meant), hint=hint)
        self._inputs.connect(
            "ellipse_factor",
            drawn,
            lambda text: meant[text],
            lambda state: f"{state.part(CoverageSettings).ellipse_factor:g}x",
        )
        self._clear = gui.add_button("Clear", color="gray", hint="Drop the ellipses of clicks.")
        self._clear.on_click(posting(post, lambda _event: ClearEllipses()))

    def draw_slowly(self, view: PageView) -> None:
        """Follow settings and progress."""
        settings = view.state.part(CoverageSettings)
        for inputs in (self._inputs, self._floor, self._conditions):
            inputs.follow(view.state)
        self._work.follow(view)
        self._clear.disabled = not settings.spots
        show(self._given, visible=settings.heading is Heading.GIVEN)
        show(self._odometry, visible=settings.measurement is Measurement.RANGE_BEARING_PRIOR)


def _setting(state: AppState, name: str) -> object:
    """Read a setting of the heatmap; it shows nothing while another feature has the floor."""
    return shown_figure(state) if name == "figure" else getattr(state.part(CoverageSettings), name)


def _of_picture(state: AppState, name: str) -> object:
    return getattr(state.part(FloorPicture), name)

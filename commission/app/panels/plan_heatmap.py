"""The step Plan, first part: which heatmap of the floor, and under which conditions."""

from __future__ import annotations

import math

from viser import GuiApi

from commission.app.panels.base import BasePanel, Post
from commission.app.panels.inputs import Inputs, WorkBar, show
from commission.app.plan.actions import SetPlan
from commission.app.plan.planner import COVERAGE
from commission.app.plan.settings import Figure
from commission.app.plan.words import FIGURE_NAMES, HEADING_NAMES, MEASUREMENT_NAMES
from commission.app.view import PageView
from commission.planning.dilution import Heading, Measurement


class HeatmapPanel(BasePanel):
    """Widgets of the heatmap."""

    def __init__(self, gui: GuiApi, post: Post) -> None:
        self._inputs = inputs = Inputs(gui, post, SetPlan, lambda state, name: getattr(state.plan, name))
        inputs.choice("figure", "Show", FIGURE_NAMES, "What the floor is colored by.")
        self._work = WorkBar(gui, post, COVERAGE, SetPlan("figure", Figure.NONE.value))
        inputs.number("opacity", 100.0, gui.add_slider("Opacity [%]", 10, 100, 5, 80))
        hint = "Heading of the vehicle, where the scanner does not see all around."
        inputs.choice("heading", "Heading", HEADING_NAMES, hint)
        hint = "Direction in which the vehicle looks; 0 is along x, counterclockwise."
        given = gui.add_number("Given [°]", 0, min=-360, max=360, step=1, hint=hint)
        self._given = inputs.number("given_heading", math.degrees(1.0), given)
        hint = "What one scan measures: ranges and bearings, bearings only, or both together with odometry."
        inputs.choice("measurement", "Measured", MEASUREMENT_NAMES, hint)
        hint = "Way driven on odometry since a pose that was known exactly."
        odometry = gui.add_number("Odometry [m]", 1.0, min=0.1, max=100.0, step=0.1, hint=hint)
        self._odometry = inputs.number("on_odometry", 1.0, odometry)
        hint = "Chance that somebody stands in a metre of the way from scanner to reflector."
        inputs.number("blocked_per_m", 100.0, gui.add_number("People [%/m]", 0, min=0, max=50, step=0.1, hint=hint))
        hint = "Beams that must hit a reflector for certain, so that it passes the detector filter (equation 3)."
        inputs.count("min_beams", gui.add_number("Beams at least", 1, min=1, max=20, step=1, hint=hint))

    def draw_slowly(self, view: PageView) -> None:
        """Follow settings and progress."""
        plan = view.state.plan
        self._inputs.follow(view.state)
        self._work.follow(view)
        show(self._given, visible=plan.heading is Heading.GIVEN)
        show(self._odometry, visible=plan.measurement is Measurement.RANGE_BEARING_PRIOR)

"""Every number that can be typed on the page means what its label says, and is shown again as it was typed.

The whole page on a real server, without a browser: each number is changed as by a person, the action that is posted is
carried out, and the page is drawn from what came of it. Factors are those of the units in the labels, written here.
"""

from __future__ import annotations

import dataclasses
import math
import re
from collections.abc import Iterator
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import viser

from commission.app.base.actions import Action
from commission.app.base.server import start_server
from commission.app.base.state import AppState
from commission.app.base.view import view_of
from commission.app.editing.actions import SelectReflectors
from commission.app.editing.editor import PosedKey, PosedKind
from commission.app.editing.posed_actions import SelectPosed
from commission.app.editing.selection_panel import SelectionPanel
from commission.app.page import Page
from commission.site.parameters import Parameters
from commission.site.project import Project
from commission.site.reflectors import Reflector, ReflectorKind, ReflectorMap
from commission.site.stations import Station
from tests.app.asking import FEATURES, ME, after, joined, taking

DEGREES = 180.0 / math.pi
UNITS = {
    **{"mm": 1000.0, "mm/√m": 1000.0, "mm/√s": 1000.0, "ms": 1000.0, "m": 1.0, "m/s": 1.0, "m/s²": 1.0},
    **{
        "°": DEGREES,
        "°/√m": DEGREES,
        "°/√rad": DEGREES,
        "°/√s": DEGREES,
        "°/s": DEGREES,
        "°/s²": DEGREES,
        "°/m": DEGREES,
    },
    **{"%": 100.0, "%/m": 100.0, "": 1.0, "s": 1.0, "σ": 1.0, "detections": 1.0, "scans": 1.0},
}
"""Number on the page for one SI unit, by the unit that the label names."""
IN_DEGREES = {"First bearing", "Last bearing", "Resolution", "Beam width", "Steering to", "Camera sees"}
"""Fields whose names end with `_deg`: the project holds them in degrees, too."""
BEARING_OF_SCANNER = "Bearing 1σ"
"""Shown twice: of the scanner, whose field is in degrees, and of the localizer, whose parameter is in radians."""

PARAMETERS = {
    "association.enabled": ("Association filter", None),
    "association.gate_probability": ("Gate [%]", 100.0),
    "association.method": ("Associated by", None),
    "detector.enabled": ("Detector filter", None),
    "detector.intensity_threshold": ("Intensity from", 1.0),
    "detector.far_threshold": ("Intensity, far [%]", 100.0),
    "detector.far_distance": ("Far from [m]", 1.0),
    "detector.min_model_error": ("Beams too few", 1.0),
    "detector.max_model_error": ("Beams too many", 1.0),
    "detector.range_jump": ("Range jump [mm]", 1000.0),
    "detector.expected_beams": ("Beams expected by", None),
    "detector.center": ("Center from", None),
    "filter.kind": ("Corrected by", None),
    "filter.consider": ("Consider constant errors", None),
    "contour.enabled": ("Contours", None),
    "contour.method": ("Matched by", None),
    "contour.length": ("Cost flat from [mm]", 1000.0),
    "contour.iterations": ("Iterations", 1.0),
    "contour.smallest_step": ("Ends below [mm]", 1000.0),
    "contour.largest_error": ("Matched to [mm]", 1000.0),
    "contour.beam_sigma": ("Beam 1σ [mm]", 1000.0),
    "contour.map_sigma": ("Map 1σ [mm]", 1000.0),
    "contour.map_heading_sigma": ("Map turned 1σ [°]", DEGREES),
    "contour.map_correlation": ("Map alike over [m]", 1.0),
    "contour.depth_sigma": ("Drawn thick 1σ [mm]", 1e3),
    "contour.least_matched": ("Matched at least [%]", 100.0),
    "contour.least_share": ("Direction told by [%]", 100.0),
    "contour.gate_probability": ("Accepted to [%]", 100.0),
    "tag.enabled": ("Tags", None),
    "tag.position_sigma": ("Tag seen 1σ [mm]", 1000.0),
    "tag.heading_sigma": ("Tag turned 1σ [°]", DEGREES),
    "tag.gate_probability": ("Tag gate [%]", 100.0),
    "bearing.enabled": ("Bearings alone", None),
    "bearing.gate_probability": ("Bearing gate [%]", 100.0),
    "bearing.lasting_limit": ("Mean innovation to [σ]", 1.0),
    "bearing.lasting_window": ("Mean over [s]", 1.0),
    "temporary.enabled": ("Temporary landmarks", None),
    "temporary.most": ("Remembered at most", 1.0),
    "temporary.least_radius": ("Reel radius from [m]", 1.0),
    "temporary.largest_radius": ("Reel radius to [m]", 1.0),
    "temporary.fewest_points": ("Beams on it", 1.0),
    "temporary.least_arc": ("Arc from [°]", DEGREES),
    "temporary.largest_arc": ("Arc to [°]", DEGREES),
    "temporary.largest_residual": ("Residual to [mm]", 1000.0),
    "temporary.corners": ("Corners", None),
    "temporary.least_side": ("Sides from [m]", 1.0),
    "temporary.largest_side": ("Sides to [m]", 1.0),
    "temporary.corner_tolerance": ("Square within [°]", DEGREES),
    "temporary.gap": ("Cut at gaps of [m]", 1.0),
    "temporary.beam_sigma": ("Beam end 1σ [mm]", 1000.0),
    "temporary.position_sigma": ("Landmark 1σ [mm]", 1000.0),
    "temporary.gate_probability": ("Landmark gate [%]", 100.0),
    "temporary.confirmations": ("Born after [scans]", 1.0),
    "temporary.misses": ("Gone after [scans]", 1.0),
    "temporary.forget_after": ("Forgotten after [s]", 1.0),
    "temporary.largest_sigma": ("Forgotten from 1σ [m]", 1.0),
    "temporary.reach": ("Remembered to [m]", 1.0),
    "integrity.risk": ("Integrity risk [%]", 100.0),
    "integrity.fault_probability": ("Misleading [%]", 100.0),
    "supervisor.enabled": ("Supervisor", None),
    "supervisor.position_limit": ("2σ position [mm]", 1000.0),
    "supervisor.position_sigma": ("Position σ", None),
    "supervisor.held": ("Held against limits", None),
    "supervisor.heading_limit": ("2σ heading [°]", DEGREES),
    "supervisor.recovery_ratio": ("Recovery ratio", 1.0),
    "supervisor.rejection_enabled": ("Lost by rejections", None),
    "supervisor.rejection_window": ("Window [s]", 1.0),
    "supervisor.rejection_long_window": ("Window of all [s]", 1.0),
    "supervisor.rejection_evidence": ("Evidence [detections]", 1.0),
    "supervisor.rejection_reach": ("Near a reflector [m]", 1.0),
    "supervisor.rejection_turn": ("Near, heading [°]", DEGREES),
    "supervisor.rejection_harmless": ("Harmless up to [%]", 100.0),
    "supervisor.rejection_near_limit": ("Rejected near [%]", 100.0),
    "supervisor.rejection_limit": ("Rejected at all [%]", 100.0),
    "supervisor.rejection_scans": ("Against it [scans]", 1.0),
    "supervisor.doubt_ratio": ("Doubt from", 1.0),
    "supervisor.confirmations": ("Proven by [detections]", 1.0),
    "supervisor.find_again": ("Search when lost", None),
    "observation.range_sigma": ("Range 1σ [mm]", 1000.0),
    "observation.bearing_sigma": ("Bearing 1σ [°]", DEGREES),
    "observation.range_bias": ("Range bias [mm]", 1000.0),
    "odometry.forward_per_sqrt_m": ("Along [mm/√m]", 1000.0),
    "odometry.lateral_per_sqrt_m": ("Across [mm/√m]", 1000.0),
    "odometry.heading_per_sqrt_m": ("Heading [°/√m]", DEGREES),
    "odometry.heading_per_sqrt_rad": ("Turning [°/√rad]", DEGREES),
    "odometry.forward_per_sqrt_s": ("Along, in time [mm/√s]", 1000.0),
    "odometry.heading_per_sqrt_s": ("Heading, in time [°/√s]", DEGREES),
    "odometry.acceleration": ("Acceleration [m/s²]", 1.0),
    "odometry.turn_acceleration": ("Turning [°/s²]", DEGREES),
    "odometry.gap_speed": ("Speed in a gap [m/s]", 1.0),
    "odometry.gap_turn_rate": ("Turn in a gap [°/s]", DEGREES),
    "odometry.forward_scale": ("Distance scale [%]", 100.0),
    "odometry.turn_scale": ("Turn scale [%]", 100.0),
    "odometry.turn_per_m": ("Course off by [°/m]", DEGREES),
}
"""Label and factor of each parameter's widget; None: not a number."""


class PageBench:
    """The page of a project, and what its widgets post."""

    def __init__(self, server: viser.ViserServer, project: Project) -> None:
        self.server, self.posted, self.state = server, [], AppState(project=project, saved=project)
        self.page = Page(server, taking(self.posted), self.state, FEATURES)
        self.page.show_site(self.state)
        self.draw(self.state)

    def draw(self, state: AppState) -> None:
        """Draw a state in which nobody is just moving a slider."""
        self.page.draw(view_of(replace(state, last_edit=None)), slowly=True)

    @property
    def widgets(self) -> list[Any]:
        """Everything that can be set."""
        return list(self.server.gui._gui_input_handle_from_uuid.values())

    def change(self, widget: Any, value: Any) -> list[Action]:
        """Let a person change a widget; return what that posts. The widget itself shows what it did before."""
        self.posted.clear()
        # As viser does with what a browser sends: to the type of what the widget held.
        before = widget._impl.value
        widget._impl.value = type(before)(value)
        for callback in list(widget._impl.update_cb):
            callback(SimpleNamespace(client=SimpleNamespace(client_id=1), client_id=1, target=widget))
        widget._impl.value = before
        return list(self.posted)


@pytest.fixture
def bench(project: Project) -> Iterator[PageBench]:
    server = start_server("127.0.0.1", 0)
    # Less than a full turn, so that either end may move.
    yield PageBench(
        server, replace(project, scanners=(replace(project.scanners[0], field_of_view_deg=(-170.0, 165.0)),))
    )
    server.stop()


def numbers_in(value: Any) -> list[float]:
    """All numbers in an action."""
    if isinstance(value, bool | str) or value is None:
        return []
    if isinstance(value, int | float):
        return [float(value)]
    if dataclasses.is_dataclass(value):
        return [n for field in dataclasses.fields(value) for n in numbers_in(getattr(value, field.name))]
    return [n for each in value for n in numbers_in(each)] if isinstance(value, tuple | list | np.ndarray) else []


def is_number(widget: Any) -> bool:
    """Whether a widget holds a number with a label; the time line's slider has none."""
    return type(widget).__name__ in ("GuiNumberHandle", "GuiSliderHandle") and bool(widget.label)


def unit_of(label: str) -> str:
    """The unit between brackets at the end of a label; empty: none."""
    found = re.search(r"\[(.+)\]$", label)
    return found[1] if found else ""


def factor_of(widget: Any, hint: str) -> float:
    name = widget.label.partition(" [")[0]
    in_degrees = name in IN_DEGREES or (name == BEARING_OF_SCANNER and "(observation." not in hint)
    return 1.0 if in_degrees else UNITS[unit_of(widget.label)]


def another(widget: Any) -> float:
    """A number that the widget may hold and does not."""
    low, high = getattr(widget, "min", None), getattr(widget, "max", None)
    value = float(widget.value)
    step = float(getattr(widget, "step", None) or 1.0)
    # Downwards first: some pairs of numbers may be no farther apart than they are.
    for tried in (value - step, value + step, value + 3.0 * step):
        if (low is None or tried >= low) and (high is None or tried <= high) and tried != 0.0:
            return int(tried) if isinstance(widget.value, int) and step.is_integer() else tried + 0.0
    raise AssertionError(widget.label)


def test_every_number_posts_what_its_label_says_and_is_shown_as_it_was_typed(bench: PageBench) -> None:
    seen = set()
    for widget in filter(is_number, bench.widgets):
        if not widget.visible or not widget._impl.update_cb:
            continue
        typed = another(widget)
        posted = bench.change(widget, typed)
        assert len(posted) == 1, (widget.label, posted)
        meant = typed / factor_of(widget, widget.hint or "")
        found = numbers_in(posted[0])
        assert any(number == pytest.approx(meant, rel=1e-9) for number in found), (widget.label, typed, posted)
        bench.draw(after(bench.state, posted[0]).state)
        # Six digits.
        assert widget.value == pytest.approx(typed, rel=2e-6), (widget.label, typed, posted)
        bench.draw(bench.state)
        seen.add(widget.label)
    assert len(seen) >= 40


def test_every_parameter_has_exactly_one_widget_that_shows_it_in_its_unit(bench: PageBench) -> None:
    parameters = Parameters()
    keys = [
        f"{group.name}.{field.name}"
        for group in dataclasses.fields(Parameters)
        for field in dataclasses.fields(getattr(parameters, group.name))
    ]
    assert sorted(keys) == sorted(PARAMETERS)
    for key in keys:
        (widget,) = [each for each in bench.widgets if f"({key})" in (getattr(each, "hint", None) or "")]
        label, factor = PARAMETERS[key]
        group, _, name = key.partition(".")
        value = getattr(getattr(bench.state.project.parameters, group), name)
        assert widget.label == label
        # Six digits.
        shown = value.replace("_", " ") if isinstance(value, str) else value
        assert widget.value == (shown if factor is None else pytest.approx(factor * value, rel=5.1e-6))


POST = Reflector(id="P", x=1.25, y=2.5, radius=0.0415, height=1.8, sigma=0.0035, kind=ReflectorKind.FLAT, heading=0.5)
DOCK = Station(name="Dock", x=3.25, y=5.5, heading=-0.7, required_accuracy=0.043)
SELECTED: dict[str, tuple[Action, dict[str, tuple[str, float]]]] = {
    "reflector": (
        SelectReflectors(("P",)),
        {
            "x [m]": ("x", 1.0),
            "y [m]": ("y", 1.0),
            "Radius [mm]": ("radius", 1000.0),
            "Faces [°]": ("heading", DEGREES),
            "Height [m]": ("height", 1.0),
            "Survey 1σ [mm]": ("sigma", 1000.0),
        },
    ),
    "station": (
        SelectPosed(PosedKey(PosedKind.STATION, "Dock")),
        {
            "x [m]": ("x", 1.0),
            "y [m]": ("y", 1.0),
            "Heading [°]": ("heading", DEGREES),
            "Within [mm]": ("required_accuracy", 1000.0),
        },
    ),
}
"""Of what can be selected: how, and each number's field and factor by its label."""


@pytest.mark.parametrize("what", SELECTED)
def test_numbers_of_what_is_selected_are_shown_and_set_in_the_units_of_their_labels(
    project: Project, what: str
) -> None:
    select, fields = SELECTED[what]
    site = replace(project, reflectors=ReflectorMap((POST,)), stations=(DOCK,))
    state = after(joined(AppState(project=site, saved=site)), select).state
    posted: list[Any] = []
    server = start_server("127.0.0.1", 0)
    try:
        panel = SelectionPanel(server.gui, taking(posted), ME)
        panel.draw_slowly(view_of(state))
        inside = (panel._posed[PosedKind.STATION]._fields if what == "station" else panel._fields).values()
        # What may be unknown is typed as a text.
        typed = [each for each in inside if is_number(each) or "unknown" in (each.hint or "")]
        widgets = {each.label: each for each in typed}
        assert set(widgets) == set(fields)
        for label, (field, factor) in fields.items():
            widget, original = widgets[label], getattr(DOCK if what == "station" else POST, field)
            # Half a step of the widget.
            before, number = widget._impl.value, float(widget.value)
            assert number == pytest.approx(factor * original, abs=0.006)
            widget._impl.value = type(before)(1.0625 * number)
            for callback in list(widget._impl.update_cb):
                callback(SimpleNamespace(client=SimpleNamespace(client_id=ME), client_id=ME, target=widget))
            changed = after(state, posted[-1]).state.project
            new = changed.stations[0] if what == "station" else changed.reflectors.reflectors[0]
            assert getattr(new, field) == pytest.approx(1.0625 * number / factor, rel=1e-9)
            widget._impl.value = before
    finally:
        server.stop()

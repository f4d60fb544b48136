"""Every tunable of the localizer, in the order of its stages: made from the dataclasses of the parameters.

The page shows degrees, millimetres and percent; actions carry SI and radians. Hints are the fields' own docstrings.
"""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from typing import Any

from viser import GuiApi, GuiInputHandle

from commission.app.base.panel import BasePanel, Post, posting
from commission.app.base.state import AppState
from commission.app.base.view import PageView
from commission.app.tune.actions import ParameterValue, ResetParameters, SetParameter
from commission.app.tune.reducer import parameter
from commission.site.fields import field_hints
from commission.site.parameters import Parameters

DEG = math.degrees(1.0)


@dataclass(frozen=True, slots=True)
class Knob:
    """How one number is shown."""

    label: str
    """Text beside it."""
    unit: str
    """Unit on the page."""
    scale: float
    """Number on the page for one SI unit."""
    low: float
    """Left end of the slider, in the page's unit."""
    high: float
    """Right end of the slider, in the page's unit; a larger value moves it."""
    step: float
    """Step of the slider, in the page's unit."""


KNOBS: dict[str, Knob] = {
    "association.gate_probability": Knob("Gate", "%", 100.0, 50.0, 99.99, 0.01),
    "detector.min_model_error": Knob("Beams too few", "", 1.0, 0, 20, 1),
    "detector.max_model_error": Knob("Beams too many", "", 1.0, 0, 20, 1),
    "detector.range_jump": Knob("Range jump", "mm", 1000.0, 10.0, 1000.0, 10.0),
    "detector.intensity_threshold": Knob("Intensity from", "", 1.0, 0.0, 1.0, 0.01),
    "observation.range_sigma": Knob("Range 1σ", "mm", 1000.0, 0.5, 100.0, 0.5),
    "observation.bearing_sigma": Knob("Bearing 1σ", "°", DEG, 0.01, 3.0, 0.01),
    "observation.range_bias": Knob("Range bias", "mm", 1000.0, -100.0, 100.0, 1.0),
    "odometry.forward_per_sqrt_m": Knob("Along", "mm/√m", 1000.0, 0.0, 100.0, 0.5),
    "odometry.lateral_per_sqrt_m": Knob("Across", "mm/√m", 1000.0, 0.0, 100.0, 0.5),
    "odometry.heading_per_sqrt_m": Knob("Heading", "°/√m", DEG, 0.0, 5.0, 0.01),
    "odometry.heading_per_sqrt_rad": Knob("Heading, turning", "°/√rad", DEG, 0.0, 5.0, 0.01),
    "odometry.forward_per_sqrt_s": Knob("Along, in time", "mm/√s", 1000.0, 0.0, 50.0, 0.1),
    "odometry.heading_per_sqrt_s": Knob("Heading, in time", "°/√s", DEG, 0.0, 3.0, 0.01),
    "supervisor.position_limit": Knob("2σ position", "mm", 1000.0, 5.0, 500.0, 1.0),
    "supervisor.heading_limit": Knob("2σ heading", "°", DEG, 0.1, 15.0, 0.1),
    "supervisor.recovery_ratio": Knob("Recovery ratio", "", 1.0, 1.0, 10.0, 0.1),
}
SWITCHES = {
    "detector.enabled": "Detector filter",
    "association.enabled": "Association filter",
    "supervisor.enabled": "Supervisor",
}
CHOICES = {"detector.center": ("Center from", ("circle", "central_beam"))}
GROUPS = {
    "association": "Association",
    "detector": "Detector",
    "supervisor": "Supervisor limits",
    "observation": "Noise of a detection",
    "odometry": "Noise of odometry",
}


def shown(knob: Knob, value: float) -> float:
    """Return a parameter in the page's unit, with six digits."""
    return round(value * knob.scale) if isinstance(value, int) else float(f"{value * knob.scale:.6g}")


def meant(knob: Knob, number: float, like: float) -> float:
    """Return what a person set, in SI, of the parameter's own type."""
    return round(number) if isinstance(like, int) else number / knob.scale


class TunePanel(BasePanel):
    """Sliders of all parameters, reset and save."""

    def __init__(self, gui: GuiApi, post: Post, state: AppState) -> None:
        self._widgets: dict[str, GuiInputHandle[Any]] = {}
        self._parameters = state.project.parameters
        for name, heading in GROUPS.items():
            with gui.add_folder(heading, expand_by_default=name != "odometry"):
                self._add_group(gui, post, name)
        reset = gui.add_button("Reset to saved", color="gray", hint="Back to the parameters of project.yaml.")
        reset.on_click(posting(post, lambda _event: ResetParameters()))

    def _add_group(self, gui: GuiApi, post: Post, group: str) -> None:
        """Add a widget for each field of a group of parameters."""
        values = getattr(self._parameters, group)
        hints = field_hints(type(values))
        # Switches first: what they switch off follows.
        names = sorted((f.name for f in dataclasses.fields(values)), key=lambda name: name != "enabled")
        for name in names:
            key = f"{group}.{name}"
            widget = _widget(gui, key, getattr(values, name), hints.get(name, ""))
            if widget is None:
                continue
            widget.on_update(
                posting(
                    post,
                    lambda event, key=key: SetParameter(key, self._value(key, event.target.value)),
                )
            )
            self._widgets[key] = widget

    def _value(self, key: str, number: Any) -> ParameterValue:
        """From what the widget holds to what the parameter means."""
        knob = KNOBS.get(key)
        if knob is None:
            return number
        like = parameter(self._parameters, key)
        return meant(knob, float(number), like) if isinstance(like, int | float) else number

    def draw_slowly(self, view: PageView) -> None:
        """Follow undo, redo and reset; while somebody moves a slider, leave it alone."""
        if view.state.last_edit is None:
            self.show(view.state.project.parameters)

    def show(self, parameters: Parameters) -> None:
        """Set every widget."""
        self._parameters = parameters
        for key, widget in self._widgets.items():
            value = parameter(parameters, key)
            knob = KNOBS.get(key)
            wanted = shown(knob, value) if knob is not None and isinstance(value, int | float) else value
            if widget.value != wanted:
                widget.value = wanted


def _widget(gui: GuiApi, key: str, value: Any, hint: str) -> GuiInputHandle[Any] | None:
    """Return the widget that fits a parameter; none where the page has nothing to offer for it."""
    hint = f"{hint} ({key})"
    if key in SWITCHES:
        return gui.add_checkbox(SWITCHES[key], bool(value), hint=hint)
    if key in CHOICES:
        label, options = CHOICES[key]
        return gui.add_dropdown(label, options, initial_value=value, hint=hint)
    knob = KNOBS.get(key)
    if knob is None:
        return None
    number = shown(knob, value)
    label = f"{knob.label} [{knob.unit}]" if knob.unit else knob.label
    kind = type(number)
    return gui.add_slider(
        label, kind(min(knob.low, number)), kind(max(knob.high, number)), kind(knob.step), number, hint=hint
    )

"""Inputs of the vehicle and of its scanner; common scanners are chosen from presets that name their sources."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from typing import Any

from viser import GuiApi, GuiEvent, GuiInputHandle

from commission.app.base import actions as page_actions
from commission.app.base.panel import BasePanel, Post, escaped, posting, write
from commission.app.base.view import PageView
from commission.app.editing import actions
from commission.site.fields import field_hints
from commission.site.presets import SCANNERS, Origin, ScannerPreset, with_preset
from commission.site.project import Project
from commission.site.scanner import Scanner
from commission.site.vehicle import DifferentialVehicle, OmnidirectionalVehicle, TricycleVehicle, Vehicle

DEG = math.degrees(1.0)
KINDS: dict[str, type[Vehicle]] = {
    kind.kind: kind for kind in (DifferentialVehicle, TricycleVehicle, OmnidirectionalVehicle)
}
OWN = "as entered"


@dataclass(frozen=True, slots=True)
class Entry:
    """One number of the scanner."""

    label: str
    """Text beside it, with its unit."""
    field: str
    """Field of `Scanner`."""
    index: int | None = None
    """Which element of it; none: the field is one number."""
    scale: float = 1.0
    """Number on the page for one unit of the field."""
    step: float = 0.01
    """Step, in the page's unit."""

    def read(self, scanner: Scanner) -> float:
        """Return the number as the page shows it."""
        value = getattr(scanner, self.field)
        return round(float(value if self.index is None else value[self.index]) * self.scale, 4)

    def write(self, scanner: Scanner, number: float) -> Scanner:
        """Return the scanner with the number that a person set; raises ValueError when it is out of range."""
        value: Any = number / self.scale
        if self.index is not None:
            elements = list(getattr(scanner, self.field))
            elements[self.index] = value
            value = tuple(elements)
        changes: dict[str, Any] = {self.field: value}
        return replace(scanner, **changes)


SCANNER = (
    Entry("Mounted at x [m]", "mounting", 0, step=0.001),
    Entry("Mounted at y [m]", "mounting", 1, step=0.001),
    Entry("Faces [°]", "mounting", 2, DEG),
    Entry("First bearing [°]", "field_of_view_deg", 0, step=0.1),
    Entry("Last bearing [°]", "field_of_view_deg", 1, step=0.1),
    Entry("Resolution [°]", "resolution_deg", step=0.0001),
    Entry("Scans per s", "rate", step=0.01),
    Entry("Range from [m]", "range", 0),
    Entry("Range to [m]", "range", 1),
    Entry("Range 1σ [mm]", "range_sigma", scale=1000.0, step=0.1),
    Entry("Bearing 1σ [°]", "bearing_sigma_deg", step=0.001),
    Entry("Beam width [°]", "beam_width_deg", step=0.01),
    Entry("Reflectors to [m]", "reflector_range", step=0.1),
)
FIGURES = {
    "field_of_view_deg": "field of view",
    "resolution_deg": "resolution",
    "rate": "scans per s",
    "range": "range",
    "range_sigma": "range 1σ",
    "bearing_sigma_deg": "bearing 1σ",
    "beam_width_deg": "beam width",
    "reflector_range": "reach for reflectors",
}
"""What the fields of the scanner are called in a sentence."""
ORIGINS = {
    Origin.DOCUMENT: "Read in the document",
    Origin.QUOTED: "The maker's, as others quote it",
    Origin.ASSUMED: "Ours, without a source; measure it",
}
VEHICLE = {
    "wheel_separation": "Wheels apart [m]",
    "wheelbase": "Wheelbase [m]",
    "max_steering_deg": "Steering to [°]",
    "wheel_radius": "Wheel radius [m]",
    "center_distance": "Wheels from base [m]",
    "height": "Height [m]",
}
LISTS = {"outline": "Outline [m]", "wheel_angles_deg": "Wheel angles [°]"}
"""Fields that are typed as text: numbers with blanks between, corners with commas between."""


def list_text(value: tuple[Any, ...]) -> str:
    """Return corners or angles as they are typed."""
    if value and isinstance(value[0], tuple):
        return ", ".join(f"{x:g} {y:g}" for x, y in value)
    return " ".join(f"{angle:g}" for angle in value)


def list_value(name: str, text: str) -> tuple[Any, ...]:
    """Return what was typed; raises ValueError that says what is expected."""
    try:
        if name != "outline":
            return tuple(float(word) for word in text.split())
        corners = [tuple(float(word) for word in corner.split()) for corner in text.split(",")]
        if any(len(corner) != 2 for corner in corners):
            raise ValueError(text)
        return tuple(corners)
    except ValueError as error:
        like = "corners like 0.5 0.3, -0.5 0.3, -0.5 -0.3" if name == "outline" else "angles like 0 120 240"
        raise ValueError(f"{LISTS[name]} is {text!r}; expected {like}") from error


def of_kind(vehicle: Vehicle, kind: str) -> Vehicle:
    """Return a vehicle of another kind with the same outline and height."""
    if vehicle.kind == kind:
        return vehicle
    return KINDS[kind](outline=vehicle.outline, height=vehicle.height)


def source_html(preset: ScannerPreset | None) -> str:
    """Say where the figures of a preset come from, and which ones are nobody's but ours."""
    if preset is None:
        return ""
    origins = preset.origins()
    lines = [
        f"{text}: {', '.join(FIGURES[name] for name, its in origins.items() if its is origin)}."
        for origin, text in ORIGINS.items()
        if origin in origins.values()
    ]
    parts = "".join(f"<div style='padding-top:3px'>{escaped(line)}</div>" for line in (preset.source, *lines))
    return f"<div class='c-note' style='padding:2px 6px'>{parts}</div>"


class EquipmentFields(BasePanel):
    """The two folders."""

    def __init__(self, gui: GuiApi, post: Post, project: Project) -> None:
        self._gui, self._post, self._project = gui, post, project
        self._shown: Project | None = None
        with gui.add_folder("Vehicle", expand_by_default=False):
            self._kind = gui.add_dropdown("Kind", tuple(KINDS), initial_value=project.vehicle.kind)
            self._kind.on_update(
                self._posting(lambda event: actions.SetVehicle(of_kind(self._now, event.target.value)))
            )
            self._parts = self._add_vehicle()
        with gui.add_folder("Scanner", expand_by_default=False):
            names = (OWN, *(preset.name for preset in SCANNERS))
            self._preset = gui.add_dropdown("Preset", names, hint="Figures of a common scanner; its mounting stays.")
            self._preset.on_update(self._posting(self._from_preset))
            self._source = gui.add_html("")
            self._numbers = {entry: self._add_number(entry) for entry in SCANNER}

    @property
    def _now(self) -> Vehicle:
        return self._project.vehicle

    def _posting(self, make: Callable[[GuiEvent[Any]], page_actions.Action]) -> Callable[[GuiEvent[Any]], None]:
        """Return a callback that posts; what cannot be made of the input is reported instead."""

        def action(event: GuiEvent[Any]) -> page_actions.Action:
            try:
                return make(event)
            except ValueError as error:
                return page_actions.Report(str(error))

        return posting(self._post, action)

    def _add_vehicle(self) -> dict[str, GuiInputHandle[Any]]:
        """Add an input for each field of every kind; those of other kinds are hidden."""
        hints = {name: hint for kind in KINDS.values() for name, hint in field_hints(kind).items()}
        parts: dict[str, GuiInputHandle[Any]] = {}
        for name, label in (VEHICLE | LISTS).items():
            if name in LISTS:
                widget: Any = self._gui.add_text(label, "", hint=hints[name], visible=False)
            else:
                widget = self._gui.add_number(label, 0.0, step=0.001, hint=hints[name], visible=False)

            def changed(event: GuiEvent[Any], name: str = name) -> page_actions.Action:
                typed = event.target.value
                changes: dict[str, Any] = {name: list_value(name, typed) if name in LISTS else float(typed)}
                return actions.SetVehicle(replace(self._now, **changes))

            widget.on_update(self._posting(changed))
            parts[name] = widget
        return parts

    def _add_number(self, entry: Entry) -> GuiInputHandle[Any]:
        hint = field_hints(Scanner)[entry.field]
        widget = self._gui.add_number(entry.label, entry.read(self._project.scanner), step=entry.step, hint=hint)

        def changed(event: GuiEvent[Any]) -> page_actions.Action:
            scanner = entry.write(self._project.scanner, float(event.target.value))
            return actions.SetScanner(scanner)

        widget.on_update(self._posting(changed))
        return widget

    def _from_preset(self, event: GuiEvent[Any]) -> page_actions.Action:
        if event.target.value == OWN:
            return actions.SetScanner(self._project.scanner)
        return actions.SetScanner(with_preset(self._project.scanner, event.target.value))

    def draw_slowly(self, view: PageView) -> None:
        """Follow the project."""
        if view.state.project is not self._shown:
            self._shown = view.state.project
            self.show(view.state.project)

    def show(self, project: Project) -> None:
        """Show vehicle and scanner of a project."""
        self._project = project
        vehicle, scanner = project.vehicle, project.scanner
        write(self._kind, vehicle.kind)
        own = {field.name for field in fields(vehicle)}
        for name, part in self._parts.items():
            if part.visible is not (name in own):
                part.visible = name in own
            if name in own:
                value = getattr(vehicle, name)
                write(part, list_text(value) if name in LISTS else value)
        for entry, number in self._numbers.items():
            write(number, entry.read(scanner))
        preset = next((p for p in SCANNERS if with_preset(scanner, p.name) == scanner), None)
        write(self._preset, OWN if preset is None else preset.name)
        source = source_html(preset)
        if self._source.content != source:
            self._source.content = source

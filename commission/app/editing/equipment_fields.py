"""Inputs of the vehicle and of its scanner; common scanners are chosen from presets that name their sources."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from viser import GuiApi, GuiEvent, GuiInputHandle

from commission.app.base import actions as page_actions
from commission.app.base.inputs import Inputs, show, write_html
from commission.app.base.panel import BasePanel, Post, escaped, posting, write
from commission.app.base.state import AppState
from commission.app.base.view import PageView
from commission.app.editing import actions
from commission.site.fields import field_info, get_field, names_of
from commission.site.presets import SCANNERS, Origin, ScannerPreset, with_preset
from commission.site.project import Project
from commission.site.scanner import Scanner
from commission.site.vehicle import DifferentialVehicle, OmnidirectionalVehicle, TricycleVehicle, Vehicle

KINDS: dict[str, type[Vehicle]] = {
    kind.kind: kind for kind in (DifferentialVehicle, TricycleVehicle, OmnidirectionalVehicle)
}
OWN = "as entered"
UNSEEN = frozenset(
    {
        "name",
        "upside_down",
        "blind_sectors_deg",
        "beam_aperture",
        "sweep_duration",
        "sweep_direction",
        "stamp_of",
        "clock_offset",
    }
)
"""Fields of a scanner that nothing acts upon yet."""


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
LIKE = {"outline": "corners like 0.5 0.3, -0.5 0.3, -0.5 -0.3", "wheel_angles_deg": "angles like 0 120 240"}
"""How the lists of a vehicle are typed: numbers with blanks between, corners with commas between."""


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
        raise ValueError(f"{name} is {text!r}; expected {LIKE[name]}") from error


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
        self._inputs = Inputs(gui, post, actions.SetEquipment, value_of)
        with gui.add_folder("Vehicle", expand_by_default=False):
            self._kind = gui.add_dropdown("Kind", tuple(KINDS), initial_value=project.vehicle.kind)
            self._kind.on_update(
                posting(post, lambda event: actions.SetVehicle(of_kind(self._project.vehicle, event.target.value)))
            )
            self._parts = self._add_vehicle()
        with gui.add_folder("Scanner", expand_by_default=False):
            names = (OWN, *(preset.name for preset in SCANNERS))
            self._preset = gui.add_dropdown("Preset", names, hint="Figures of a common scanner; its mounting stays.")
            self._preset.on_update(posting(post, self._from_preset))
            self._source = gui.add_html("")
            for name in names_of(Scanner):
                if name not in UNSEEN:
                    self._inputs.field(f"scanners[0].{name}", project)

    def _add_vehicle(self) -> dict[str, GuiInputHandle[Any]]:
        """Add an input for each field of every kind, lists last; those of other kinds are hidden."""
        kinds = {name: kind for kind in KINDS.values() for name in names_of(kind)}
        parts: dict[str, GuiInputHandle[Any]] = {}
        for name in sorted(kinds, key=lambda name: name in LIKE):
            project = replace(self._project, vehicle=kinds[name]())
            parts[name] = (self._add_list if name in LIKE else self._inputs.field)(f"vehicle.{name}", project)
        return parts

    def _add_list(self, name: str, project: Project) -> GuiInputHandle[Any]:
        """Add a line of text for several numbers."""
        info = field_info(project, name)
        widget = self._gui.add_text(info.quantity.title if info.quantity else info.label, "", hint=info.hint)

        def shown(state: AppState) -> str | None:
            value = value_of(state, name)
            return None if value is None else list_text(value)

        self._inputs.connect(name, widget, lambda text: list_value(info.name, str(text)), shown)
        return widget

    def _from_preset(self, event: GuiEvent[Any]) -> page_actions.Action:
        if event.target.value == OWN:
            return actions.SetScanner(self._project.scanners[0])
        return actions.SetScanner(with_preset(self._project.scanners[0], event.target.value))

    def draw_slowly(self, view: PageView) -> None:
        """Follow the project."""
        project = view.state.project
        if project is self._shown:
            return
        self._shown = self._project = project
        write(self._kind, project.vehicle.kind)
        own = names_of(type(project.vehicle))
        for name, part in self._parts.items():
            show(part, visible=name in own)
        self._inputs.follow(view.state)
        preset = next((p for p in SCANNERS if with_preset(project.scanners[0], p.name) == project.scanners[0]), None)
        write(self._preset, OWN if preset is None else preset.name)
        write_html(self._source, source_html(preset))


def value_of(state: AppState, name: str) -> Any:
    """Return a value of the equipment by its dotted name in the project; None where another kind of vehicle has it."""
    part, _, rest = name.partition(".")
    is_there = part != "vehicle" or rest in names_of(type(state.project.vehicle))
    return get_field(state.project, name) if is_there else None

"""Inputs of the vehicle and of its scanners."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from viser import GuiApi, GuiInputHandle

from commission.app.base.inputs import Inputs, show
from commission.app.base.panel import BasePanel, Post, posting, write
from commission.app.base.state import AppState
from commission.app.base.view import PageView
from commission.app.editing import actions
from commission.app.editing.scanner_fields import ScannerFields
from commission.app.editing.typed_lists import LIKE, add_list
from commission.site.fields import get_field, names_of
from commission.site.project import Project
from commission.site.vehicle import DifferentialVehicle, OmnidirectionalVehicle, TricycleVehicle, Vehicle

KINDS: dict[str, type[Vehicle]] = {
    kind.kind: kind for kind in (DifferentialVehicle, TricycleVehicle, OmnidirectionalVehicle)
}


def of_kind(vehicle: Vehicle, kind: str) -> Vehicle:
    """Return a vehicle of another kind with the same outline and height."""
    if vehicle.kind == kind:
        return vehicle
    return KINDS[kind](outline=vehicle.outline, height=vehicle.height)


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
        self._scanners = ScannerFields(gui, post, project)

    def _add_vehicle(self) -> dict[str, GuiInputHandle[Any]]:
        """Add an input for each field of every kind, lists last; those of other kinds are hidden."""
        kinds = {name: kind for kind in KINDS.values() for name in names_of(kind)}
        parts: dict[str, GuiInputHandle[Any]] = {}
        for name in sorted(kinds, key=lambda name: name in LIKE):
            project = replace(self._project, vehicle=kinds[name]())
            dotted = f"vehicle.{name}"
            if name in LIKE:
                parts[name] = add_list(self._gui, self._inputs, dotted, (project, value_of))
            else:
                parts[name] = self._inputs.field(dotted, project)
        return parts

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
        self._scanners.follow(view.state)


def value_of(state: AppState, name: str) -> Any:
    """Return a value of the equipment by its dotted name in the project; None where another kind of vehicle has it."""
    part, _, rest = name.partition(".")
    is_there = part != "vehicle" or rest in names_of(type(state.project.vehicle))
    return get_field(state.project, name) if is_there else None

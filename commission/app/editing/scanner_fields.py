"""Inputs of the scanners of a vehicle, of each in a folder where there are several; presets name their sources."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

from viser import GuiApi, GuiEvent

from commission.app.base.actions import Action
from commission.app.base.inputs import Inputs, write_html
from commission.app.base.panel import Post, escaped, posting, write, write_label
from commission.app.base.state import AppState
from commission.app.editing import actions
from commission.app.editing.typed_lists import add_list
from commission.site.fields import get_field, names_of
from commission.site.presets import SCANNERS, Origin, ScannerPreset, with_preset
from commission.site.project import Project
from commission.site.scanner import Scanner

OWN = "as entered"
REMOVE = "Remove "
NAMES = (OWN, *(preset.name for preset in SCANNERS))
DIRECTIONS = {1: "counter-clockwise", -1: "clockwise"}
"""What the ways of a sweep are called."""
FIGURES = {
    "field_of_view_deg": "field of view",
    "resolution_deg": "resolution",
    "rate": "scans per s",
    "range": "range",
    "range_sigma": "range 1σ",
    "bearing_sigma_deg": "bearing 1σ",
    "beam_width_deg": "beam width",
    "beam_aperture": "beam aperture",
    "reflector_range": "reach for reflectors",
    "detection_rates": "detection rates",
}
"""What the fields of the scanner are called in a sentence."""
ORIGINS = {
    Origin.DOCUMENT: "Read in the document",
    Origin.QUOTED: "The maker's, as others quote it",
    Origin.ASSUMED: "Ours, without a source; measure it",
}


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


@dataclass(frozen=True, slots=True)
class _Widgets:
    """What a scanner has besides the inputs of its fields."""

    preset: Any
    source: Any
    named: tuple[tuple[Any, str], ...] = ()
    """Folder and button that are called by its name, and what stands before it."""


class ScannerFields:
    """The folder of the scanners; it is built anew when scanners come or go.

    A new name is written on what is there: whoever has entered it may be typing into the next field by then.

    Parameters
    ----------
    gui, post : where widgets are made, what takes their actions.
    project : what is shown first.
    """

    def __init__(self, gui: GuiApi, post: Post, project: Project) -> None:
        self._gui, self._post, self._project = gui, post, project
        self._folder = gui.add_folder("Scanner", expand_by_default=False)
        self._removable: list[Any] = []
        self._build(project)

    def _build(self, project: Project) -> None:
        for part in self._removable:
            part.remove()
        self._removable = []
        self._names = names_in(project)
        self._inputs = Inputs(self._gui, self._post, actions.SetEquipment, value_of)
        several = len(self._names) > 1
        with self._folder:
            self._widgets = [self._add(project, index, several=several) for index in range(len(self._names))]
            add = self._gui.add_button(
                "Add a scanner", color="gray", hint="Like the last one, on the opposite corner of the vehicle."
            )
            add.on_click(posting(self._post, lambda _event: actions.AddScanner()))
        self._removable.append(add)

    def _add(self, project: Project, index: int, *, several: bool) -> _Widgets:
        """Add the inputs of one scanner."""
        if not several:
            return self._add_inputs(project, index, several=False)
        folder = self._gui.add_folder(self._names[index], expand_by_default=False)
        self._removable.append(folder)
        with folder:
            widgets = self._add_inputs(project, index, several=True)
        return replace(widgets, named=((folder, ""), *widgets.named))

    def _add_inputs(self, project: Project, index: int, *, several: bool) -> _Widgets:
        """Add the inputs of one scanner."""
        made: list[Any] = []
        named: tuple[tuple[Any, str], ...] = ()

        def from_preset(event: GuiEvent[Any]) -> Action:
            scanner = next(each for each in self._project.scanners if each.name == self._names[index])
            chosen = event.target.value
            return actions.SetScanner(scanner if chosen == OWN else with_preset(scanner, chosen))

        preset = self._gui.add_dropdown("Preset", NAMES, hint="Figures of a common scanner; its mounting stays.")
        preset.on_update(posting(self._post, from_preset))
        source = self._gui.add_html("")
        for field in names_of(Scanner):
            # What the only scanner is called matters to nobody.
            if several or field != "name":
                made.append(self._add_field(f"scanners[{index}].{field}", project))
        if several:
            remove = self._gui.add_button(f"{REMOVE}{self._names[index]}", color="gray")
            remove.on_click(posting(self._post, lambda _event: actions.RemoveScanner(self._names[index])))
            named = ((remove, REMOVE),)
        else:
            self._removable += [preset, source, *made]
        return _Widgets(preset, source, named)

    def _rename(self, names: tuple[str, ...]) -> None:
        """Call the scanners otherwise."""
        self._names = names
        for name, widgets in zip(names, self._widgets, strict=True):
            for part, before in widgets.named:
                write_label(part, before + name)

    def _add_field(self, name: str, project: Project) -> Any:
        """Add the input of one field."""
        if name.endswith(".sweep_direction"):
            return self._inputs.choice(name, project, DIRECTIONS)
        if name.endswith((".blind_sectors_deg", ".detection_rates")):
            return add_list(self._gui, self._inputs, name, (project, value_of))
        return self._inputs.field(name, project)

    def follow(self, state: AppState) -> None:
        """Show the scanners of a state."""
        self._project = project = state.project
        names = names_in(project)
        if len(names) != len(self._names):
            self._build(project)
        elif names != self._names:
            self._rename(names)
        self._inputs.follow(state)
        for scanner, widgets in zip(project.scanners, self._widgets, strict=True):
            preset = next((p for p in SCANNERS if with_preset(scanner, p.name) == scanner), None)
            write(widgets.preset, OWN if preset is None else preset.name)
            write_html(widgets.source, source_html(preset))


def names_in(project: Project) -> tuple[str, ...]:
    """Names of the scanners."""
    return tuple(scanner.name for scanner in project.scanners)


def value_of(state: AppState, name: str) -> Any:
    """Return a value of a scanner by its dotted name in the project; None where the scanner has just gone."""
    index = int(name.partition("[")[2].partition("]")[0])
    return get_field(state.project, name) if index < len(state.project.scanners) else None

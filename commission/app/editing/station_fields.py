"""Inputs of the selected station, as part of the selection's panel."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from viser import GuiApi, GuiEvent

from commission.app.base import actions as page_actions
from commission.app.base import theme
from commission.app.base.panel import Post, posting, write
from commission.app.editing import station_actions as actions
from commission.app.editing.editor import Editor
from commission.app.editing.station_gestures import station_of
from commission.site.fields import field_hints
from commission.site.project import Project
from commission.site.stations import DOCKING, TRANSIT, Station

DEG, MM = math.degrees(1.0), 1000.0
SCALES = {"x": 1.0, "y": 1.0, "heading": DEG, "required_accuracy": MM}
"""Number on the page for one SI unit."""
DOCK, PASS = f"{DOCKING * MM:.0f} mm", f"{TRANSIT * MM:.0f} mm"
ALIGN, DELETE = "Onto route", "Delete"


class StationFields:
    """Name, pose, required accuracy, buttons."""

    def __init__(self, gui: GuiApi, post: Post, browser: int) -> None:
        self._post, self._browser = post, browser
        hints = field_hints(Station)
        self._folder = gui.add_folder("Station", visible=False)
        with self._folder:
            self._name = gui.add_text("Name", "", hint=hints["name"])
            self._name.on_update(posting(post, self._setting("name", lambda typed: str(typed).strip())))
            self._numbers: dict[str, Any] = {
                "x": gui.add_number("x [m]", 0.0, step=0.001, hint=hints["x"]),
                "y": gui.add_number("y [m]", 0.0, step=0.001, hint=hints["y"]),
                "heading": gui.add_number("Heading [°]", 0.0, step=0.01, hint=hints["heading"]),
                "required_accuracy": gui.add_number("Within [mm]", 100.0, step=0.1, hint=hints["required_accuracy"]),
            }
            for field, widget in self._numbers.items():
                widget.on_update(posting(post, self._setting(field, lambda typed, f=field: float(typed) / SCALES[f])))
            gui.add_html(theme.WIDE)
            buttons = gui.add_button_group("", (DOCK, PASS, ALIGN, DELETE))
            buttons.on_click(posting(post, self._pressed))

    def _setting(
        self, field: str, meant: Callable[[Any], float | str]
    ) -> Callable[[GuiEvent[Any]], page_actions.Action]:
        """Return what makes the action of one field's widget."""
        return lambda event: actions.SetStation(field, meant(event.target.value))

    def _pressed(self, event: GuiEvent[Any]) -> page_actions.Action:
        match event.target.value:
            case "Onto route":
                return actions.AlignStation()
            case "Delete":
                return actions.DeleteStation()
            case label:
                accuracy = DOCKING if label == DOCK else TRANSIT
                return actions.SetStation("required_accuracy", accuracy)

    def show(self, project: Project, editor: Editor) -> None:
        """Show the selected station."""
        station = station_of(project, editor)
        if self._folder.visible is not (station is not None):
            self._folder.visible = station is not None
        if station is None:
            return
        write(self._name, station.name)
        for field, widget in self._numbers.items():
            write(widget, round(float(getattr(station, field)) * SCALES[field], 3))

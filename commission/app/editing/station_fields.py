"""Inputs of the selected station, as part of the selection's panel."""

from __future__ import annotations

from typing import Any

from viser import GuiApi, GuiEvent

from commission.app.base import actions as page_actions
from commission.app.base import theme
from commission.app.base.inputs import Inputs, show
from commission.app.base.panel import Post, posting
from commission.app.base.state import AppState
from commission.app.editing import station_actions as actions
from commission.app.editing.editor import editor_of
from commission.app.editing.station_gestures import station_of
from commission.site.fields import get_field, names_of
from commission.site.stations import ACCURACY, DOCKING, TRANSIT, Station

DOCK, PASS = (ACCURACY.brief(accuracy) for accuracy in (DOCKING, TRANSIT))
ALIGN, DELETE = "Onto route", "Delete"


class StationFields:
    """Name, pose, required accuracy, buttons."""

    def __init__(self, gui: GuiApi, post: Post, browser: int) -> None:
        self._browser, self._shown = browser, ""
        self._inputs = Inputs(gui, post, actions.SetStation, self._read)
        self._folder = gui.add_folder("Station", visible=False)
        with self._folder:
            example = Station(name="S1", x=0.0, y=0.0)
            self._fields = {name: self._inputs.field(name, example) for name in names_of(Station)}
            gui.add_html(theme.WIDE)
            buttons = gui.add_button_group("", (DOCK, PASS, ALIGN, DELETE))
            buttons.on_click(posting(post, self._pressed))

    def _read(self, state: AppState, name: str) -> Any:
        """Return a value of the selected station; None without one."""
        station = station_of(state.project, editor_of(state, self._browser))
        return None if station is None else get_field(station, name)

    def _pressed(self, event: GuiEvent[Any]) -> page_actions.Action:
        match event.target.value:
            case "Onto route":
                return actions.AlignStation()
            case "Delete":
                return actions.DeleteStation()
            case label:
                accuracy = DOCKING if label == DOCK else TRANSIT
                return actions.SetStation("required_accuracy", accuracy)

    def show(self, state: AppState) -> None:
        """Show the selected station."""
        station = station_of(state.project, editor_of(state, self._browser))
        show(self._folder, visible=station is not None)
        if station is not None and station.name != self._shown:
            self._inputs.forget()
        self._shown = "" if station is None else station.name
        self._inputs.follow(state)

"""Inputs of the zones: which one, its name and corners, and what corrects the pose in it."""

from __future__ import annotations

from typing import Any

from viser import GuiApi, GuiDropdownHandle, GuiEvent

from commission.app.base import theme
from commission.app.base.actions import Action
from commission.app.base.inputs import Inputs, Text, show
from commission.app.base.panel import BasePanel, Post, posting, write
from commission.app.base.state import AppState
from commission.app.base.view import PageView
from commission.app.editing import zone_actions as actions
from commission.app.editing.actions import ChooseTool
from commission.app.editing.typed_lists import add_list
from commission.app.editing.zone_reducer import shown_zone
from commission.app.editing.zone_tool import ZoneTool
from commission.site.fields import get_field
from commission.site.project import Project
from commission.site.zones import ObservationKind, Zone

DRAW, DELETE = "Draw a zone", "Delete"
KINDS = {
    ObservationKind.REFLECTORS: ("By reflectors", "Whether reflectors correct the pose in this zone."),
    ObservationKind.CONTOURS: ("By contours", "Whether walls of the floor map do, where contours are switched on."),
    ObservationKind.TAGS: ("By tags", "Whether tags that tell place and heading do."),
}
NONE = "None: every kind of observation corrects the pose everywhere."
"""What is said of a site without zones."""
EXAMPLE = Zone(name="Zone 1", outline=((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)))


class ZoneFields(BasePanel):
    """The list of zones, and the one that is shown."""

    def __init__(self, gui: GuiApi, post: Post, browser: int) -> None:
        self._gui, self._post, self._browser = gui, post, browser
        self._says, self._shown = Text(gui), ""
        self._inputs = Inputs(gui, post, _set, self._read)
        self._list: GuiDropdownHandle[Any] = gui.add_dropdown("Which zone", (EXAMPLE.name,), visible=False)
        self._list.on_update(posting(post, lambda event: actions.ShowZone(str(event.target.value))))
        self._fields: list[Any] = [
            self._inputs.field("name", EXAMPLE),
            add_list(gui, self._inputs, "zones[0].outline", (Project(zones=(EXAMPLE,)), self._read)),
            *(self._switch(kind, *words) for kind, words in KINDS.items()),
        ]
        gui.add_html(theme.WIDE)
        gui.add_button_group("", (DRAW, DELETE)).on_click(posting(post, self._pressed))

    def _switch(self, kind: ObservationKind, label: str, hint: str) -> Any:
        """A check box for a kind; that of the last one that counts comes back."""
        widget = self._gui.add_checkbox(label, True, hint=hint)
        self._inputs.connect(kind, widget, bool, lambda state: self._counts(state, kind))
        return widget

    def _counts(self, state: AppState, kind: ObservationKind) -> bool | None:
        zone = shown_zone(state, self._browser)
        return None if zone is None else kind in zone.kinds

    def _read(self, state: AppState, name: str) -> Any:
        """Return a value of the zone that is shown; None without one."""
        zone = shown_zone(state, self._browser)
        return None if zone is None else get_field(zone, name.rpartition(".")[2])

    def _pressed(self, event: GuiEvent[Any]) -> Action:
        return ChooseTool(ZoneTool()) if event.target.value == DRAW else actions.DeleteZone()

    def draw_slowly(self, view: PageView) -> None:
        """Follow the project."""
        state = view.state
        zone, names = shown_zone(state, self._browser), tuple(each.name for each in state.project.zones)
        self._says.write(
            (not names,), lambda: "" if names else f"<div class='c-note' style='padding:2px 6px'>{NONE}</div>"
        )
        show(self._list, visible=len(names) > 1)
        if names and self._list.options != names:
            self._list.options = names
        for widget in self._fields:
            show(widget, visible=zone is not None)
        if zone is None:
            return
        write(self._list, zone.name)
        if zone.name != self._shown:
            self._inputs.forget()
        self._shown = zone.name
        self._inputs.follow(state)


def _set(name: str, value: Any) -> Action:
    """Return the action of a setting: a field of the zone, or whether a kind counts in it."""
    if name in set(ObservationKind):
        return actions.CountKind(ObservationKind(name), bool(value))
    return actions.SetZone(name.rpartition(".")[2], value)

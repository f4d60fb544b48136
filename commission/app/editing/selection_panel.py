"""What one browser has selected: its values, and what can be done with it."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from viser import GuiApi, GuiEvent, GuiInputHandle

from commission.app.base import actions as page_actions
from commission.app.base import theme
from commission.app.base.panel import BasePanel, Post, escaped, posting, table
from commission.app.base.view import PageView
from commission.app.editing import actions
from commission.app.editing.editor import Editor
from commission.app.editing.gestures import selected_of
from commission.app.editing.route_fields import RouteFields
from commission.app.editing.site_tools import measurement
from commission.app.editing.station_fields import StationFields
from commission.site.fields import field_hints
from commission.site.reflectors import Reflector, ReflectorKind

DEG = math.degrees(1.0)


@dataclass(frozen=True, slots=True)
class Field:
    """How a value of a reflector is shown."""

    label: str
    """Text beside it, with its unit."""
    scale: float
    """Number on the page for one SI unit."""
    step: float
    """Step of the number, in the page's unit; it is rounded to that."""


NUMBERS = {
    "x": Field("x [m]", 1.0, 0.001),
    "y": Field("y [m]", 1.0, 0.001),
    "radius": Field("Radius [mm]", 1000.0, 0.1),
    "heading": Field("Faces [°]", DEG, 0.01),
    "height": Field("Height [m]", 1.0, 0.001),
    "sigma": Field("Survey 1σ [mm]", 1000.0, 0.1),
}
TEXTS = {"id": "Name", "layer": "Layer", "note": "Note"}
ALONE = ("id", "x", "y")
"""Fields that several reflectors cannot share."""


def in_page_units(name: str, value: float) -> float:
    """Return a number as the page shows it."""
    field = NUMBERS[name]
    return round(value * field.scale, max(0, -math.floor(math.log10(field.step))))


class SelectionPanel(BasePanel):
    """Values of what is selected, and buttons.

    Parameters
    ----------
    gui : the browser's own.
    post : takes the actions.
    browser : number of its connection.
    """

    def __init__(self, gui: GuiApi, post: Post, browser: int) -> None:
        self._gui, self._post, self._browser = gui, post, browser
        self._reflectors: tuple[Reflector, ...] = ()
        self._drawn: tuple[object, ...] = ()
        self._head = gui.add_html("")
        self._fields: dict[str, GuiInputHandle[Any]] = {}
        self._add_fields()
        gui.add_html(theme.WIDE)
        self._buttons = gui.add_button_group("", ("Duplicate", "Delete", "To wall"), visible=False)
        self._buttons.on_click(posting(post, self._pressed))
        self._copies = gui.add_folder("Mirror, repeat", expand_by_default=False, visible=False)
        with self._copies:
            self._add_mirror()
            self._add_repeat()
        self._route = RouteFields(gui, post, browser)
        self._station = StationFields(gui, post, browser)

    def _add_fields(self) -> None:
        """Add an input for each value of a reflector, in the order in which one thinks of them."""
        hints = field_hints(Reflector)
        gui = self._gui
        for name in ("id", "x", "y", "radius", "kind", "heading", "height", "sigma", "layer", "note", "locked"):
            hint = hints[name]
            if name in NUMBERS:
                field = NUMBERS[name]
                widget: Any = gui.add_number(field.label, 0.0, step=field.step, hint=hint, visible=False)
            elif name in TEXTS:
                widget = gui.add_text(TEXTS[name], "", hint=hint, visible=False)
            elif name == "kind":
                widget = gui.add_dropdown("Kind", tuple(ReflectorKind), hint=hint, visible=False)
            else:
                widget = gui.add_checkbox("Locked", False, hint=hint, visible=False)
            widget.on_update(posting(self._post, self._setting(name)))
            self._fields[name] = widget

    def _setting(self, name: str) -> Callable[[GuiEvent[Any]], page_actions.Action]:
        """Return what makes the action of one field's widget."""

        def action(event: GuiEvent[Any]) -> page_actions.Action:
            value = event.target.value
            if name in NUMBERS:
                value = float(value) / NUMBERS[name].scale
            elif name == "kind":
                value = ReflectorKind(value)
            return actions.SetSelected(name, value)

        return action

    def _pressed(self, event: GuiEvent[Any]) -> page_actions.Action:
        """Return the action of one of the buttons."""
        match event.target.value:
            case "Duplicate":
                return actions.DuplicateSelected()
            case "Delete":
                return actions.DeleteSelected()
            case _:
                return actions.SnapSelected()

    def _add_mirror(self) -> None:
        gui = self._gui
        axis = gui.add_dropdown("About", ("x =", "y ="), hint="A line across x, or one across y.")
        at = gui.add_number("Line at [m]", 0.0, step=0.001)
        gui.add_html(theme.WIDE)
        mirror = gui.add_button_group("", ("Mirror", "Mirrored copy"))

        def mirrored(event: GuiEvent[Any]) -> page_actions.Action:
            upright = axis.value == "x ="
            through = (float(at.value), 0.0) if upright else (0.0, float(at.value))
            return actions.MirrorSelected(
                through, 0.5 * math.pi if upright else 0.0, event.target.value == "Mirrored copy"
            )

        mirror.on_click(posting(self._post, mirrored))

    def _add_repeat(self) -> None:
        gui = self._gui
        dx = gui.add_number("Step x [m]", 2.0, step=0.001)
        dy = gui.add_number("Step y [m]", 0.0, step=0.001)
        count = gui.add_number("Copies", 3, min=1, max=1000, step=1)
        repeat = gui.add_button("Repeat", color="gray", hint="Copies along a line, each one step from the one before.")
        repeat.on_click(
            posting(
                self._post,
                lambda _event: actions.RepeatSelected((float(dx.value), float(dy.value)), int(count.value)),
            )
        )

    def draw_slowly(self, view: PageView) -> None:
        """Show what is selected."""
        editor = view.state.of_browser(self._browser, Editor)
        drawn = (view.state.project, editor, len(view.state.browsers))
        if self._drawn and self._drawn[0] is drawn[0] and self._drawn[1:] == drawn[1:]:
            return
        self._drawn = drawn
        self._reflectors = selected_of(view.state.project, editor)
        self._head.content = _company(self._browser, len(view.state.browsers)) + _head(editor, self._reflectors)
        self._buttons.visible = self._copies.visible = bool(self._reflectors)
        for name, widget in self._fields.items():
            shown = bool(self._reflectors) and (len(self._reflectors) == 1 or name not in ALONE)
            if name == "heading":
                shown = shown and any(r.kind is ReflectorKind.FLAT for r in self._reflectors)
            if widget.visible is not shown:
                widget.visible = shown
            if shown:
                self._show_value(name, widget)
        self._route.show(view.state.project, editor)
        self._station.show(view.state.project, editor)

    def _show_value(self, name: str, widget: GuiInputHandle[Any]) -> None:
        """Write a value into its widget, the first one's where several are selected."""
        value: Any = getattr(self._reflectors[0], name)
        if name in NUMBERS:
            value = in_page_units(name, value)
        elif name == "kind":
            value = value.value
        if widget.value != value:
            widget.value = value


def _company(browser: int, browsers: int) -> str:
    """Say which browser this is where there are others: an undo that is another's names that one by its number."""
    if browsers < 2:
        return ""
    return f"<div class='c-note' style='padding:0 6px 4px'>This is browser {browser}; {browsers} edit this site.</div>"


def _head(editor: Editor, reflectors: tuple[Reflector, ...]) -> str:
    """Say what is selected, and what was clicked or measured."""
    rows: list[tuple[str, str]] = []
    found = measurement(editor)
    if found is not None:
        rows += [
            ("Distance", f"{found.distance:.3f} m"),
            ("Bearing", f"{math.degrees(found.bearing):.2f} °"),
            ("dx, dy", f"{found.dx:.3f}, {found.dy:.3f} m"),
        ]
    if editor.last_click is not None and not reflectors:
        rows.append(("Last click x, y", f"{editor.last_click[0]:.3f}, {editor.last_click[1]:.3f} m"))
    if len(reflectors) > 1:
        title = f"{len(reflectors)} reflectors"
    elif reflectors:
        title = f"Reflector {escaped(reflectors[0].id)}"
    elif editor.point is not None:
        title = f"Route {escaped(editor.point.route)}"
    elif editor.station:
        named = editor.station.lower().startswith("station")
        title = escaped(editor.station) if named else f"Station {escaped(editor.station)}"
    else:
        title = "Vehicle"
    return f"<div style='padding:2px 14px 2px 6px'>{table(rows)}<div class='c-selected'><b>{title}</b></div></div>"

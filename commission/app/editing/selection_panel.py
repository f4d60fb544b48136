"""What one browser has selected: its values, and what can be done with it."""

from __future__ import annotations

import math
from typing import Any

from viser import GuiApi, GuiEvent

from commission.app.base import actions as page_actions
from commission.app.base import theme
from commission.app.base.field_widget import Entry
from commission.app.base.inputs import Inputs, show
from commission.app.base.panel import BasePanel, Post, escaped, posting, table
from commission.app.base.state import AppState
from commission.app.base.view import PageView
from commission.app.editing import actions
from commission.app.editing.editor import Editor, PosedKind
from commission.app.editing.gestures import selected_of
from commission.app.editing.posed_fields import PosedFields
from commission.app.editing.posed_kinds import mark_of, marks_of
from commission.app.editing.reflector_table import ALONE
from commission.app.editing.route_fields import RouteFields
from commission.app.editing.route_gestures import route_of, routes_of
from commission.app.editing.site_tools import measurement
from commission.site.fields import get_field, names_of
from commission.site.project import Project
from commission.site.quantity import DEGREES, counted_text
from commission.site.reflectors import Reflector, ReflectorKind

NOTHING = (
    "<div class='c-note c-nothing' style='padding:4px 0'>Nothing is selected. Click a reflector, a station, a tag or a "
    "route; drag over the floor for several reflectors.</div>"
)


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
        self._inputs = Inputs(gui, post, actions.SetSelected, self._read)
        example = Reflector(id="R1", x=0.0, y=0.0)
        self._fields = {name: self._inputs.field(name, example) for name in names_of(Reflector)}
        gui.add_html(theme.WIDE)
        self._buttons = gui.add_button_group("", ("Duplicate", "Delete", "To wall"), visible=False)
        self._buttons.on_click(posting(post, self._pressed))
        self._copies = gui.add_folder("Mirror, repeat", expand_by_default=False, visible=False)
        with self._copies:
            self._add_mirror()
            self._add_repeat()
        self._route = RouteFields(gui, post, browser)
        self._posed = {kind: PosedFields(gui, post, browser, kind) for kind in PosedKind}

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
        at = Entry(gui, "through[0]", actions.MirrorSelected((0.0, 0.0), 0.0))
        gui.add_html(theme.WIDE)
        mirror = gui.add_button_group("", ("Mirror", "Mirrored copy"))

        def mirrored(event: GuiEvent[Any]) -> page_actions.Action:
            upright = axis.value == "x ="
            through = (at.read(), 0.0) if upright else (0.0, at.read())
            return actions.MirrorSelected(
                through, 0.5 * math.pi if upright else 0.0, event.target.value == "Mirrored copy"
            )

        mirror.on_click(posting(self._post, mirrored))

    def _add_repeat(self) -> None:
        gui = self._gui
        first = actions.RepeatSelected((2.0, 0.0), 3)
        dx, dy, count = (Entry(gui, name, first) for name in names_of(actions.RepeatSelected))
        repeat = gui.add_button("Repeat", color="gray", hint="Copies along a line, each one step from the one before.")
        repeat.on_click(
            posting(
                self._post,
                lambda _event: actions.RepeatSelected((dx.read(), dy.read()), count.read()),
            )
        )

    def draw_slowly(self, view: PageView) -> None:
        """Show what is selected."""
        editor = view.state.of_browser(self._browser, Editor)
        drawn = (view.state.project, editor, len(view.state.browsers))
        if self._drawn and self._drawn[0] is drawn[0] and self._drawn[1:] == drawn[1:]:
            return
        self._drawn = drawn
        selected = selected_of(view.state.project, editor)
        if [r.id for r in selected] != [r.id for r in self._reflectors]:
            self._inputs.forget()
        self._reflectors = selected
        self._inputs.follow(view.state)
        company = _company(self._browser, len(view.state.browsers))
        self._head.content = company + _head(editor, selected, view.state.project)
        self._buttons.visible = self._copies.visible = bool(self._reflectors)
        for name, widget in self._fields.items():
            shown = bool(selected) and (len(self._reflectors) == 1 or name not in ALONE)
            if name == "heading":
                shown = shown and any(r.kind is ReflectorKind.FLAT for r in self._reflectors)
            show(widget, visible=shown)
        self._route.show(view.state)
        for fields in self._posed.values():
            fields.show(view.state)

    def _read(self, _state: AppState, name: str) -> Any:
        """Return a value of the selection, the first one's where several are selected; None: of nothing."""
        return get_field(self._reflectors[0], name) if self._reflectors else None


def _called(kind: str, name: str) -> str:
    """Return what something is called, with its kind unless the name begins with that."""
    return escaped(name) if name.lower().startswith(kind.lower()) else f"{kind} {escaped(name)}"


def _company(browser: int, browsers: int) -> str:
    """Say which browser this is where there are others: an undo that is another's names that one by its number."""
    if browsers < 2:
        return ""
    return f"<div class='c-note' style='padding:0 6px 4px'>This is browser {browser}; {browsers} edit this site.</div>"


def _head(editor: Editor, reflectors: tuple[Reflector, ...], project: Project) -> str:
    """Say what is selected, and what was clicked or measured."""
    rows: list[tuple[str, str]] = []
    found = measurement(editor)
    if found is not None:
        rows += [
            ("Distance", f"{found.distance:.3f} m"),
            ("Bearing", DEGREES.text(found.bearing, ".2f")),
            ("dx, dy", f"{found.dx:.3f}, {found.dy:.3f} m"),
        ]
    if editor.last_click is not None and not reflectors:
        rows.append(("Last click x, y", f"{editor.last_click[0]:.3f}, {editor.last_click[1]:.3f} m"))
    title = _title(editor, reflectors, project)
    said = f"<div class='c-selected'><b>{title}</b></div>" if title else "" if editor.tool else NOTHING
    return f"<div style='padding:2px 14px 2px 6px'>{table(rows)}{said}</div>"


def _title(editor: Editor, reflectors: tuple[Reflector, ...], project: Project) -> str:
    """Say what is selected; empty where that is nothing, or gone: an undo brings it back selected."""
    if reflectors:
        return f"Reflector {escaped(reflectors[0].id)}" if len(reflectors) == 1 else f"{len(reflectors)} reflectors"
    several = marks_of(project, editor) if editor.posed is not None else routes_of(project, editor)
    if len(several) > 1:
        return counted_text(len(several), "route" if editor.posed is None else editor.posed.kind)
    if editor.point is not None:
        return _called("Route", editor.point.route) if route_of(project, editor) else ""
    if editor.posed is not None and mark_of(project, editor.posed) is not None:
        return _called(editor.posed.kind.capitalize(), editor.posed.name)
    return ""

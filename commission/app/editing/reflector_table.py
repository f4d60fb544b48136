"""All reflectors as a table, sorted as wished, a page of rows at a time. A row selects its reflector and goes there."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Any

from viser import GuiApi, GuiTabHandle

from commission.app.base import theme
from commission.app.base.field_widget import Entry
from commission.app.base.inputs import add_find, look_again_at, show
from commission.app.base.panel import BasePanel, Post
from commission.app.base.rows import Rows
from commission.app.base.view import PageView
from commission.app.editing import actions
from commission.app.editing.editor import Editor
from commission.site.quantity import MILLIMETRES, Bounds, Quantity
from commission.site.reflectors import Reflector

ROWS = 40
"""Rows that are shown at once."""
ORDERS: dict[str, Callable[[Reflector], Any]] = {
    "name": lambda r: (len(r.id), r.id),
    "x": lambda r: r.x,
    "y": lambda r: r.y,
    "radius": lambda r: (r.radius is None, r.radius or 0.0),
    "kind": lambda r: (r.kind.value, r.id),
    "layer": lambda r: (r.layer, r.id),
}


@dataclass(frozen=True, slots=True)
class TableView:
    """Which part of the table is shown."""

    page: Annotated[int, Quantity(label="Page", bounds=Bounds.at_least(1), step=1)] = 1
    """Page of rows, counted from 1."""


def row_text(reflector: Reflector) -> str:
    """Return a reflector on one line."""
    kind = "" if reflector.kind.value == "cylinder" else "  flat, faces ?" if reflector.lacks_direction else "  flat"
    rest = "  ".join(text for text in (reflector.layer, "locked" if reflector.locked else "") if text)
    radius = "?" if reflector.radius is None else MILLIMETRES.text(reflector.radius)
    return f"{reflector.id}   {reflector.x:.3f}  {reflector.y:.3f} m   r {radius}{kind}  {rest}"


class ReflectorTable(BasePanel):
    """The table of one browser."""

    def __init__(self, gui: GuiApi, post: Post, browser: int, tab: GuiTabHandle) -> None:
        self._browser = browser
        self._order = gui.add_dropdown("Sort by", tuple(ORDERS))
        self._find = add_find(gui, post, "Part of a name, layer or note.")
        self._page = Entry(gui, "page", TableView())
        show(self._page.widget, visible=False)
        for widget in (self._order, self._page.widget):
            look_again_at(widget, post)
        self._count = gui.add_html("")
        self._ids: tuple[str, ...] = ()
        self._rows = Rows(gui, tab, post, self._selecting)
        self._drawn: tuple[object, ...] = ()
        self._selected: tuple[str, ...] = ()

    def draw_slowly(self, view: PageView) -> None:
        """Show the reflectors in their order."""
        reflectors = view.state.project.reflectors
        editor = view.state.of_browser(self._browser, Editor)
        asked = (self._order.value, self._find.value, self._page.widget.value, editor.selected)
        if self._drawn and self._drawn[0] is reflectors and self._drawn[1] == asked:
            return
        self._drawn = (reflectors, asked)
        sought = self._find.value.strip().lower()
        found = [r for r in reflectors.reflectors if sought in f"{r.id} {r.layer} {r.note}".lower()]
        found.sort(key=ORDERS[self._order.value])
        pages = max(1, -(-len(found) // ROWS))
        self._turn_to(editor.selected, found)
        first = ROWS * (min(self._page.read(), pages) - 1)
        show(self._page.widget, visible=pages > 1)
        self._count.content = (
            f"<div class='c-note' style='padding:2px 6px'>{len(found)} of {len(reflectors)} reflectors"
            f"{f', page {first // ROWS + 1} of {pages}' if pages > 1 else ''}</div>"
        )
        shown, selected = found[first : first + ROWS], frozenset(editor.selected)
        self._ids = tuple(r.id for r in shown)
        self._rows.show([(row_text(r), theme.SELECTED_LINE if r.id in selected else theme.LINE) for r in shown])

    def _turn_to(self, selected: tuple[str, ...], found: list[Reflector]) -> None:
        """Turn to the page of what was selected on the floor just now; its row is scrolled to by the page's script."""
        if selected == self._selected:
            return
        self._selected = selected
        first = next((index for index, each in enumerate(found) if each.id in frozenset(selected)), None)
        if first is not None and selected[0] not in self._ids:
            self._page.widget.value = first // ROWS + 1

    def _selecting(self, index: int) -> actions.SelectReflectors:
        """Return the action of a row."""
        return actions.SelectReflectors(self._ids[index : index + 1], fly=True)

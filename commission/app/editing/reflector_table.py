"""All reflectors as a table, a page of rows at a time: its heads sort, its rows select, its cells are edited."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any

from viser import GuiApi

from commission.app.base.actions import Action
from commission.app.base.field_widget import Entry
from commission.app.base.inputs import add_find, look_again_at, show, write_html
from commission.app.base.panel import BasePanel, Post
from commission.app.base.view import PageView
from commission.app.editing import actions
from commission.app.editing.data_table import (
    ALL,
    DataTables,
    TableContent,
    TableRow,
    TableUse,
    between,
    columns_of,
    shared_cells,
    sorted_rows,
)
from commission.app.editing.editor import Editor
from commission.app.editing.table_reducer import TableOrder, TableOrders
from commission.site.quantity import Bounds, Quantity, counted_text
from commission.site.reflectors import Reflector, ReflectorMap

ROWS = 40
"""Rows that are shown at once."""
NAME = "reflectors"
ALONE = ("id", "x", "y")
"""Fields that several reflectors cannot share."""
COLUMNS = tuple(columns_of(Reflector, titles={"id": "Name"}))
BY_KEY = {column.key: column for column in COLUMNS}


@dataclass(frozen=True, slots=True)
class TableView:
    """Which part of the table is shown."""

    page: Annotated[int, Quantity(label="Page", bounds=Bounds.at_least(1), step=1)] = 1
    """Page of rows, counted from 1."""


class ReflectorTable(BasePanel):
    """The table of one browser."""

    def __init__(self, gui: GuiApi, post: Post, browser: int) -> None:
        self._browser = browser
        self._find = add_find(gui, post, "Part of a name, layer or note.")
        self._page = Entry(gui, "page", TableView())
        show(self._page.widget, visible=False)
        look_again_at(self._page.widget, post)
        self._count = gui.add_html("")
        use = TableUse(columns=COLUMNS, select=self._selecting, enter=_entering)
        self.tables = DataTables(gui, post, NAME, {NAME: use})
        self._keys: tuple[str, ...] = ()
        self._by_id: dict[str, Reflector] = {}
        self._listed: tuple[object, ...] = ()
        self._drawn: tuple[object, ...] = ()
        self._selected: tuple[str, ...] = ()

    def draw_slowly(self, view: PageView) -> None:
        """Show the reflectors in their order."""
        reflectors = view.state.project.reflectors
        editor = view.state.of_browser(self._browser, Editor)
        order = view.state.of_browser(self._browser, TableOrders).of(NAME)
        asked = (self._find.value, self._page.widget.value, editor.selected, order)
        if self._drawn and self._drawn[0] is reflectors and self._drawn[1] == asked:
            return
        self._drawn = (reflectors, asked)
        selected = frozenset(editor.selected)
        self._list(reflectors, order)
        pages = max(1, -(-len(self._keys) // ROWS))
        self._turn_to(editor.selected)
        first = ROWS * (min(self._page.read(), pages) - 1)
        show(self._page.widget, visible=pages > 1)
        parts = [f"{len(self._keys)} of {counted_text(len(reflectors), 'reflector')}"]
        parts += [f"page {first // ROWS + 1} of {pages}"] if pages > 1 else []
        parts += [f"{len(selected)} selected"] if len(selected) > 1 else []
        write_html(self._count, f"<div class='c-note' style='padding:2px 6px'>{', '.join(parts)}</div>")
        shown = (self._by_id[key] for key in self._keys[first : first + ROWS])
        rows = [TableRow(r.id, tuple(column.of_field(r) for column in COLUMNS), r.id in selected) for r in shown]
        every = shared_cells(self._chosen_rows(reflectors, editor), COLUMNS, ALONE)
        self.tables.show(
            [TableContent(name=NAME, columns=COLUMNS, rows=rows, order=order, every=every, chosen=len(selected))]
            if rows
            else []
        )

    def _chosen_rows(self, reflectors: ReflectorMap, editor: Editor) -> list[TableRow]:
        """Rows of all that are selected, also where another page of the table is shown."""
        if len(editor.selected) < 2:
            return []
        chosen = frozenset(editor.selected)
        found = (r for r in reflectors.reflectors if r.id in chosen)
        return [TableRow(r.id, tuple(column.of_field(r) for column in COLUMNS), is_selected=True) for r in found]

    def _list(self, reflectors: ReflectorMap, order: TableOrder) -> None:
        """Sort those that hold what is sought, where anything of that has changed; only what is shown has all cells."""
        sought = self._find.value.strip().lower()
        if self._listed and self._listed[0] is reflectors and self._listed[1:] == (sought, order):
            return
        self._listed = (reflectors, sought, order)
        found = [r for r in reflectors.reflectors if sought in f"{r.id} {r.layer} {r.note}".lower()]
        order = order if order.column in BY_KEY else TableOrder("id")
        column = BY_KEY[order.column]
        self._by_id = {r.id: r for r in found}
        rows = sorted_rows((TableRow(r.id, (column.of_field(r),)) for r in found), (column,), order)
        self._keys = tuple(row.key for row in rows)

    def _turn_to(self, selected: tuple[str, ...]) -> None:
        """Turn to the page of what was selected on the floor just now; its row is scrolled to by the page's script."""
        if selected == self._selected:
            return
        new, self._selected = [name for name in selected if name not in self._selected], selected
        shown = {row.key for table in self.tables.shown for row in table.rows}
        first = next((index for index, key in enumerate(self._keys) if key in new), None)
        if first is not None and self._keys[first] not in shown:
            self._page.widget.value = first // ROWS + 1

    def _selecting(self, key: str, how: str, begin: str) -> Action:
        """Return the action of a click on a row."""
        match how:
            case "toggle":
                return actions.SelectReflectors((key,), toggle=True)
            case "range":
                return actions.SelectReflectors(between(self._keys, begin, key))
            case _:
                return actions.SelectReflectors((key,), fly=True)


def _entering(key: str, field: str, value: Any) -> Action:
    """Return the action of an entry in a cell: of one reflector, or of all that are selected."""
    return actions.SetSelected(field, value) if key == ALL else actions.SetReflector(key, field, value)

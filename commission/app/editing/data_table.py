"""Tables of what the engineer edits: columns and cells from what is said beside the fields, and what is done in them.

A script of the page (`web_assets/site_tables.js`) draws them: heads sort, rows select, cells are edited by the rule of
all entries. It writes one line of JSON into a text field that nobody sees; whatever else is written there is refused.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Annotated, Any, Literal, TypeAlias

import msgspec
from msgspec import Meta, Struct
from viser import GuiApi

from commission.app.base import viser_private
from commission.app.base.actions import Action
from commission.app.base.carrier import Carrier
from commission.app.base.field_widget import hint_of, in_words, meant
from commission.app.base.panel import Post, posting
from commission.app.editing.table_actions import SortTable
from commission.app.editing.table_reducer import TableOrder
from commission.app.editing.typed_lists import LIKE, list_text, list_value
from commission.site.fields import FieldInfo, fields_of, get_field
from commission.site.quantity import Quantity, Switch

ALL = ""
"""Key of the row that sets all that are selected; nothing has an empty name."""
YES, NO = "yes", "no"
"""Cells of what is on and off."""
DIGITS = re.compile(r"(\d+)")

Text: TypeAlias = Annotated[str, Meta(max_length=1000)]


class CellKind(StrEnum):
    """How a cell is read and edited."""

    TEXT = "text"
    NUMBER = "number"
    CHOICE = "choice"
    SWITCH = "switch"
    FIXED = "fixed"


@dataclass(frozen=True, slots=True, kw_only=True)
class TableColumn:
    """One column of a table."""

    key: str
    """Field that it shows, or a name of its own."""
    title: str
    """Short name, with the unit of the page."""
    hint: str = ""
    """What it is, in a line."""
    kind: CellKind = CellKind.FIXED
    """How its cells are edited."""
    options: tuple[str, ...] = ()
    """What can be chosen."""
    info: FieldInfo | None = None
    """What is known about its field; none: it is of no single field."""
    is_number: bool = False
    """Whether its cells are numbers, which end below each other."""
    words: Mapping[Any, str] | None = None
    """What its values are called; none: as `info` says."""

    def of_field(self, value: object) -> str:
        """Return the cell of a value that has the field, as the page writes it."""
        info = self.info
        if info is None:
            raise ValueError(f"the column {self.key!r} is of no field; expected one that is")
        content = get_field(value, self.key)
        return cell_text(info, content) if self.words is None else self.words[content]

    def means(self, text: str) -> Any:
        """Return what is meant by a text that is entered in one of its cells, SI and radians.

        Raises
        ------
        ValueError
            it cannot be edited, it is no number, or the field's bounds do not allow it.
        """
        info = self.info
        if self.kind is CellKind.SWITCH:
            return text == YES
        if info is None or self.kind is CellKind.FIXED:
            raise ValueError(f"{self.title} cannot be entered; expected a cell that can")
        if info.name in LIKE:
            return list_value(info.name, text, info.label)
        if self.words is not None:
            return next((value for value, word in self.words.items() if word == text), text)
        if info.quantity is None or info.quantity.none:
            return meant(info, text.strip())
        try:
            number = float(text.strip().replace(",", "."))
        except ValueError:
            raise ValueError(f'found "{text.strip()}"; expected a number') from None
        return meant(info, number)


@dataclass(frozen=True, slots=True)
class TableRow:
    """One row of a table."""

    key: str
    """What its thing is told apart by."""
    cells: tuple[str, ...]
    """What each column shows."""
    is_selected: bool = False
    """Whether its thing is selected on the floor."""
    tint: Literal["", "warning", "error"] = ""
    """Whether something is wrong with it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TableContent:
    """A table as it is to be seen."""

    name: str
    """What it is called among the tables."""
    title: str = ""
    """Heading above it; empty: none."""
    columns: tuple[TableColumn, ...]
    """Its columns; the first one stays in sight."""
    rows: Sequence[TableRow]
    """Its rows, in their order."""
    order: TableOrder
    """By what they are sorted."""
    every: tuple[str | None, ...] = ()
    """Cells of the row that sets all that are selected: what they share, none where several cannot; empty: no row."""
    chosen: int = 0
    """How many are selected, also where their rows are not shown."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TableUse:
    """What can be done in a table."""

    columns: tuple[TableColumn, ...]
    """Its columns."""
    select: Callable[[str, str, str], Action]
    """From the key of a row, how it is selected (`only`, `toggle`, `range`) and the row where a range begins."""
    enter: Callable[[str, str, Any], Action]
    """From the key of a row (`ALL`: of those that are selected), that of a column and the new value (SI)."""


def columns_of(cls: type, *, fixed: Iterable[str] = (), titles: Mapping[str, str] | None = None) -> list[TableColumn]:
    """Return the columns of what stands beside the fields of a frozen value.

    Parameters
    ----------
    cls : its type.
    fixed : fields that are shown and not edited here.
    titles : what columns are called otherwise than their fields.
    """
    found: list[TableColumn] = []
    for name, info in _numbers_of(cls):
        description = info.descriptions[0]
        title = (titles or {}).get(name, info.label)
        if isinstance(description, Quantity) and description.shown_unit:
            title = f"{title} [{description.shown_unit}]"
        kind = CellKind.FIXED if name in frozenset(fixed) else _kind_of(info)
        options = tuple(map(in_words, info.options))
        found.append(
            TableColumn(
                key=name,
                title=title,
                hint=hint_of(info),
                kind=kind,
                options=options,
                info=info,
                is_number=info.quantity is not None and name not in LIKE,
            )
        )
    return found


def _numbers_of(cls: type) -> Iterator[tuple[str, FieldInfo]]:
    """Fields of a type by their names; of what is described number by number each number."""
    for name, info in fields_of(cls).items():
        if len(info.descriptions) == 1:
            yield name, info
            continue
        for index, description in enumerate(info.descriptions):
            dotted = f"{name}[{index}]"
            yield dotted, replace(info, name=dotted, kind=float, is_optional=False, descriptions=(description,))


def shared_cells(
    rows: Sequence[TableRow], columns: Sequence[TableColumn], alone: Collection[str] = ()
) -> tuple[str | None, ...]:
    """Return the cells of the row that sets all rows that are selected; empty while fewer than two are.

    Parameters
    ----------
    rows : of a table, also those that are not shown.
    columns : of the same.
    alone : keys of those that several cannot share.
    """
    chosen = [row.cells for row in rows if row.is_selected]
    if len(chosen) < 2:
        return ()
    return tuple(
        None if column.kind is CellKind.FIXED or column.key in alone else cells[0] if len(set(cells)) == 1 else ""
        for column, cells in zip(columns, zip(*chosen, strict=True), strict=True)
    )


def _kind_of(info: FieldInfo) -> CellKind:
    if isinstance(info.descriptions[0], Switch):
        return CellKind.SWITCH
    if info.options:
        return CellKind.CHOICE
    return CellKind.TEXT if info.quantity is None else CellKind.NUMBER


def cell_text(info: FieldInfo, value: Any) -> str:
    """Return a value as the page writes it where the unit stands elsewhere.

    Parameters
    ----------
    info : what is known about its field.
    value : in the unit of code and files.
    """
    if isinstance(value, bool):
        return YES if value else NO
    if info.name in LIKE:
        return list_text(value)
    if info.quantity is None:
        return in_words(value) if info.options else str(value)
    return info.quantity.none if value is None else info.quantity.digits(value)


def sorted_rows(rows: Iterable[TableRow], columns: Sequence[TableColumn], order: TableOrder) -> list[TableRow]:
    """Return rows in an order: numbers by their size, words with numbers in them by these; what is unknown comes last.

    Parameters
    ----------
    rows : of a table.
    columns : of the same.
    order : by what they are sorted.
    """
    rows = list(rows)
    index = next((index for index, column in enumerate(columns) if column.key == order.column), None)
    if index is None:
        return rows
    known = [row for row in rows if _number(row.cells[index]) is not None]
    others = [row for row in rows if _number(row.cells[index]) is None]
    known.sort(key=lambda row: _number(row.cells[index]) or 0.0, reverse=order.is_down)
    others.sort(key=lambda row: _in_parts(row.cells[index]), reverse=order.is_down)
    return [*known, *others]


def _number(text: str) -> float | None:
    try:
        return float(text)
    except ValueError:
        return None


def _in_parts(text: str) -> list[tuple[int, float, str]]:
    """R2 comes before R10."""
    parts = DIGITS.split(text.lower())
    return [(0, float(part), "") if part.isdecimal() else (1, 0.0, part) for part in parts if part]


class TableSaid(Struct, frozen=True, forbid_unknown_fields=True, tag_field="do"):
    """Base of all that the script says; the tag of a class is what it says under `do`."""

    n: int
    """Counts up: to say the same thing again is another text."""
    table: Text
    """Name of the table."""


class RowSaid(TableSaid, frozen=True, tag="row"):
    """A row was clicked on."""

    key: Text
    """Which one."""
    how: Literal["only", "toggle", "range"]
    """Alone, besides the others, or with all from `begin` on."""
    begin: Text = ""
    """Row where the range begins."""


class HeadSaid(TableSaid, frozen=True, tag="sort"):
    """A head was clicked on."""

    column: Text
    """Key of its column."""


class CellSaid(TableSaid, frozen=True, tag="cell"):
    """Something was entered in a cell."""

    key: Text
    """Which row."""
    column: Text
    """Key of the column."""
    text: Text
    """What stands in it now."""


_DECODER = msgspec.json.Decoder(RowSaid | HeadSaid | CellSaid)


class DataTables:
    """The tables of one tab of one browser.

    Parameters
    ----------
    gui, post : where the widgets are made, what takes their actions.
    name : of the tab, by which the script finds its tables.
    uses : what can be done in each, by the table's name.
    """

    def __init__(self, gui: GuiApi, post: Post, name: str, uses: Mapping[str, TableUse]) -> None:
        self._uses = uses
        inbox = gui.add_text("Table", "", visible=False)
        inbox.on_update(posting(post, lambda event: self.asked(event.target.value)))
        self.inbox = inbox
        gui.add_html(
            f"<div class='c-tables' data-kind='tables-{name}' data-inbox='{viser_private.identifier(inbox)}'></div>"
        )
        self._carrier = Carrier(gui, f"tables-{name}")
        self.shown: tuple[TableContent, ...] = ()

    def show(self, tables: Sequence[TableContent]) -> None:
        """Show these tables and no others."""
        self.shown = tuple(tables)
        self._carrier.write({"tables": [_sent(table) for table in tables]})

    def asked(self, text: str) -> Action:
        """Return what a line of the script asks for.

        Parameters
        ----------
        text : as it came from a browser.

        Raises
        ------
        ValueError
            it is none, or what was entered is refused.
        """
        try:
            said = _DECODER.decode(text)
        except msgspec.MsgspecError as error:
            raise ValueError(f"a table says {text[:60]!r}; expected what its script says ({error})") from error
        use = self._uses.get(said.table)
        if use is None:
            raise ValueError(f"no table is called {said.table!r}; expected one of: {', '.join(self._uses)}")
        match said:
            case RowSaid(key=key, how=how, begin=begin):
                return use.select(key, how, begin)
            case HeadSaid(table=table, column=column):
                return SortTable(table, column)
            case CellSaid(key=key, column=column):
                found = next((each for each in use.columns if each.key == column), None)
                if found is None:
                    raise ValueError(f"the table has no column {column!r}; expected one that it has")
                return use.enter(key, column, found.means(said.text))


def between(keys: Sequence[str], begin: str, end: str) -> tuple[str, ...]:
    """Return all keys from one to another, both included; the last alone where the first is not there.

    Parameters
    ----------
    keys : in the order of the table.
    begin, end : of the range, whichever comes first.
    """
    if begin not in keys or end not in keys:
        return (end,)
    first, last = sorted((keys.index(begin), keys.index(end)))
    return tuple(keys[first : last + 1])


def _sent(table: TableContent) -> dict[str, Any]:
    """What the script draws a table from."""
    return {
        "name": table.name,
        "title": table.title,
        "every": list(table.every),
        "chosen": table.chosen,
        "sorted": [table.order.column, table.order.is_down],
        "columns": [
            {
                "key": each.key,
                "title": each.title,
                "hint": each.hint,
                "kind": each.kind.value,
                "options": list(each.options),
                "right": each.is_number,
            }
            for each in table.columns
        ],
        "rows": [[row.key, int(row.is_selected), row.tint, list(row.cells)] for row in table.rows],
    }

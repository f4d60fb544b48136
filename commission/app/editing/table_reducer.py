"""What actions about the tables of the site mean. Pure; importing it registers them with `reduce`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from commission.app.base.actions import Sender
from commission.app.base.reducer import Outcome, reduce
from commission.app.base.state import AppState, Edit, edited
from commission.app.editing import table_actions as actions
from commission.app.editing.several import SEVERAL
from commission.errors import UsageError
from commission.site.quantity import counted_text


@dataclass(frozen=True, slots=True)
class TableOrder:
    """By what a table is sorted."""

    column: str = ""
    """Key of the column; empty: as the project has them."""
    is_down: bool = False
    """Whether the largest comes first."""


@dataclass(frozen=True, slots=True)
class TableOrders:
    """How one browser sorts its tables."""

    by_table: Mapping[str, TableOrder] = field(default_factory=dict[str, TableOrder])
    """Order of each table that was sorted, by its name."""

    def of(self, table: str) -> TableOrder:
        """Return the order of a table."""
        return self.by_table.get(table, TableOrder())


@reduce.register
def sort_table(action: actions.SortTable, state: AppState, sender: Sender) -> Outcome:
    orders = state.of_browser(sender.browser, TableOrders)
    before = orders.of(action.table)
    order = TableOrder(action.column, before.column == action.column and not before.is_down)
    return Outcome(state.with_browser(sender.browser, TableOrders({**orders.by_table, action.table: order})))


@reduce.register
def choose_rows(action: actions.ChooseRows, state: AppState, sender: Sender) -> Outcome:
    several = SEVERAL[action.table]
    before = several.chosen(state, sender.browser) if action.toggle else ()
    kept = tuple(key for key in before if key not in action.keys)
    keys = (*kept, *(key for key in action.keys if key not in before))
    return Outcome(several.choose(state, sender.browser, keys))


@reduce.register
def set_rows(action: actions.SetRows, state: AppState, sender: Sender) -> Outcome:
    several = SEVERAL[action.table]
    keys = several.chosen(state, sender.browser)
    if not keys:
        raise UsageError(f"no {several.kind} is selected; expected one")
    if action.field in several.alone:
        raise UsageError(f"several {several.kind}s cannot share {action.field!r}; expected another field")
    after = state
    for key in keys:
        after = reduce(several.setting(action.field, action.value, key), after, sender).state
    if after.project == state.project:
        return Outcome(state)
    edit = Edit(f"set {counted_text(len(keys), several.kind)}", sender, f"{keys}:{action.field}")
    return Outcome(several.choose(edited(state, after.project, edit), sender.browser, keys))

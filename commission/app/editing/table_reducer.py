"""What actions about the tables of the site mean. Pure; importing it registers them with `reduce`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from commission.app.base.actions import Sender
from commission.app.base.reducer import Outcome, reduce
from commission.app.base.state import AppState
from commission.app.editing import table_actions as actions


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

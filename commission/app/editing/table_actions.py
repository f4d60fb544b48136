"""What a person can ask for in the tables of the site, as frozen values."""

from __future__ import annotations

from dataclasses import dataclass

from commission.app.base.actions import Action


@dataclass(frozen=True, slots=True)
class SortTable(Action):
    """Sort a table by one of its columns; by the one that it is sorted by already, the other way round."""

    table: str
    """Name of the table."""
    column: str
    """Key of the column."""

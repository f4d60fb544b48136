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


@dataclass(frozen=True, slots=True)
class ChooseRows(Action):
    """Select several things of one table and nothing else."""

    table: str
    """Name of the table."""
    keys: tuple[str, ...]
    """What they are told apart by; the last one is what single values are shown of."""
    toggle: bool = False
    """Whether they are selected besides the others, or, where they are selected already, no longer."""


@dataclass(frozen=True, slots=True)
class SetRows(Action):
    """Set one field of all that are selected in a table: one undo step."""

    table: str
    """Name of the table."""
    field: str
    """Key of the column."""
    value: object
    """New value, SI and radians."""

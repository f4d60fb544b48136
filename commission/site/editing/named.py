"""Edits of what a site has by name, routes, stations, tags and zones: put, rename, remove."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Generic, TypeVar

from commission.errors import UsageError
from commission.site.editing.names import fresh_names
from commission.site.routes import Route
from commission.site.stations import Station
from commission.site.tags import Tag
from commission.site.zones import Zone

T = TypeVar("T", Route, Station, Tag, Zone)


@dataclass(frozen=True, slots=True)
class Named(Generic[T]):
    """How one kind of thing is told apart."""

    kind: str
    """What one is called."""
    key: str
    """Its field that no two share."""
    first: str
    """What the name before the first one would be: the next are numbered on from it."""

    def key_of(self, item: T) -> str:
        """Return what one is told apart by."""
        return str(getattr(item, self.key))

    def put(self, items: tuple[T, ...], item: T, name: str | None = None) -> tuple[T, ...]:
        """Add one, or replace the one called `name` (it may be renamed by that).

        Parameters
        ----------
        items : those there are.
        item : the new or changed one.
        name : the one it takes the place of; None adds it at the end.

        Raises
        ------
        UsageError
            none is called `name`, or another one has the new name already.
        """
        new = self.key_of(item)
        if new in {self.key_of(other) for other in items} - {name}:
            raise UsageError(f"{self.kind} {self.key} {new!r} is used already; expected another {self.key}")
        if name is None:
            return (*items, item)
        self._require(items, name)
        return tuple(item if self.key_of(other) == name else other for other in items)

    def remove(self, items: tuple[T, ...], name: str) -> tuple[T, ...]:
        """Remove the one of that name; raises UsageError when there is none."""
        self._require(items, name)
        return tuple(other for other in items if self.key_of(other) != name)

    def fresh(self, items: tuple[T, ...]) -> str:
        """Return a name that none has."""
        return fresh_names(map(self.key_of, items), 1, self.first)[0]

    def _require(self, items: tuple[T, ...], name: str) -> None:
        names = [self.key_of(other) for other in items]
        if name not in names:
            known = ", ".join(map(repr, names)) or "none"
            raise UsageError(f"no {self.kind} is called {name!r}; the project has: {known}")


ROUTES: Named[Route] = Named("route", "name", "Route 0")
STATIONS: Named[Station] = Named("station", "name", "Station 0")
TAGS: Named[Tag] = Named("tag", "id", "T0")
ZONES: Named[Zone] = Named("zone", "name", "Zone 0")

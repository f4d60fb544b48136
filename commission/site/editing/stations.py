"""Edits of stations: put, rename, remove, by their names."""

from __future__ import annotations

from commission.errors import UsageError
from commission.site.editing.names import fresh_names
from commission.site.stations import Station


def put(stations: tuple[Station, ...], station: Station, name: str | None = None) -> tuple[Station, ...]:
    """Add a station, or replace the one called `name` (it may be renamed by that).

    Parameters
    ----------
    stations : those there are.
    station : the new or changed one.
    name : the one it takes the place of; None adds it at the end.

    Raises
    ------
    UsageError
        no station is called `name`, or another one has the new name already.
    """
    others = {s.name for s in stations} - {name}
    if station.name in others:
        raise UsageError(f"station name {station.name!r} is used already; expected another name")
    if name is None:
        return (*stations, station)
    _require(stations, name)
    return tuple(station if s.name == name else s for s in stations)


def remove(stations: tuple[Station, ...], name: str) -> tuple[Station, ...]:
    """Remove the station of that name; raises UsageError when there is none."""
    _require(stations, name)
    return tuple(s for s in stations if s.name != name)


def fresh_name(stations: tuple[Station, ...], like: str = "Station 0") -> str:
    """Return a name that no station has."""
    return fresh_names((s.name for s in stations), 1, like)[0]


def _require(stations: tuple[Station, ...], name: str) -> None:
    known = ", ".join(repr(s.name) for s in stations) or "none"
    if name not in {s.name for s in stations}:
        raise UsageError(f"no station is called {name!r}; the project has: {known}")

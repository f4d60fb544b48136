"""Where a demand does not hold."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Unmet:
    """Where a demand does not hold, whatever is put up at the candidates."""

    route: str
    """Name of the route; of an ambiguous place the route that leads nearest to it."""
    metres: tuple[int, ...]
    """Metres of its way; of an ambiguous place the metre nearest to it."""
    reason: str
    """`visible`, `uncertainty` or `ambiguous`."""
    place: str = ""
    """Which place is ambiguous."""

"""Two layouts beside each other, as panels and layers draw them; frozen, newest wins. Nothing compared, none."""

from __future__ import annotations

from dataclasses import dataclass

from commission.app.layouts.difference import DifferenceView
from commission.app.layouts.state import KeptLayout
from commission.site.reflectors import ReflectorMap
from commission.studies.layouts import LayoutResult


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class LayoutsView:
    """The layout of now and the one that it is compared with."""

    kept: KeptLayout
    """What it is compared with."""
    now: ReflectorMap
    """How reflectors stand now."""
    before: LayoutResult | None
    """What the kept layout comes to; none before that is known."""
    after: LayoutResult | None
    """What the one of now comes to, or came to before the newest edit; none before that is known."""
    outdated: bool
    """Whether one of the two is of a site that has changed since, and is being computed anew."""
    difference: DifferenceView | None
    """What the floor shows; none where nothing is to be shown, or there is no common floor."""
    no_floor: str
    """Why there is no difference over the floor, in one line; empty: there is one, or none was asked for."""

    @property
    def is_same(self) -> bool:
        """Whether reflectors stand now just as they did."""
        return self.kept.reflectors == self.now

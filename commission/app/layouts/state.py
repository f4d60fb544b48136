"""Which layouts were kept, and what is compared: the feature's part of the page's state. Pure."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Annotated

from commission.errors import UsageError
from commission.site.quantity import Choice, counted_text
from commission.site.reflectors import ReflectorMap
from commission.studies.layouts import FloorFigure

NAME = "layouts"
"""Of the feature."""
MOST_KEPT = 4
"""Layouts that are kept: nobody keeps more apart in mind."""


class ShownDifference(StrEnum):
    """What the floor is colored by; the words are those of `FloorFigure` where there is one."""

    NONE = ""
    POSITION_SIGMA = FloorFigure.POSITION_SIGMA.value
    HEADING_SIGMA = FloorFigure.HEADING_SIGMA.value
    VISIBLE = FloorFigure.VISIBLE.value


@dataclass(frozen=True, slots=True)
class KeptLayout:
    """A layout that was kept."""

    number: int
    """What it is called: layout 1."""
    reflectors: ReflectorMap
    """How reflectors stood."""

    @property
    def title(self) -> str:
        """Its name with the number of its reflectors."""
        return f"layout {self.number} ({counted_text(len(self.reflectors), 'reflector')})"


@dataclass(frozen=True, slots=True)
class LayoutsState:
    """What was kept, and what is compared."""

    kept: tuple[KeptLayout, ...] = ()
    """In the order of their numbers."""
    against: int = 0
    """Number of the one that is compared with now; 0: none."""
    figure: Annotated[ShownDifference, Choice("Floor shows")] = ShownDifference.NONE
    """What the floor is colored by: how much better or worse a fix is now than with the kept layout."""

    def layout(self, number: int) -> KeptLayout:
        """Return the layout of a number; raises UsageError where there is none."""
        for each in self.kept:
            if each.number == number:
                return each
        known = ", ".join(str(each.number) for each in self.kept) or "none"
        raise UsageError(f"no layout {number} is kept; kept: {known}")

    def of(self, reflectors: ReflectorMap) -> KeptLayout | None:
        """Return the one in which reflectors stand just so; none where that is not kept."""
        return next((each for each in self.kept if each.reflectors == reflectors), None)

    def with_kept(self, reflectors: ReflectorMap) -> LayoutsState:
        """Return the state with one more layout, under the next free number; one that is kept already stays alone.

        Raises
        ------
        UsageError
            as many are kept as there may be.
        """
        if self.of(reflectors) is not None:
            return self
        free = [number for number in range(1, MOST_KEPT + 1) if number not in {each.number for each in self.kept}]
        if not free:
            raise UsageError(f"{MOST_KEPT} layouts are kept already; forget one of them first")
        every = sorted((*self.kept, KeptLayout(free[0], reflectors)), key=lambda each: each.number)
        return replace(self, kept=tuple(every))

    def compared(self, reflectors: ReflectorMap) -> KeptLayout | None:
        """Return the layout that those of now are compared with; none where nothing is to be compared.

        It is the chosen one, or where that is how reflectors stand now, another one that differs.

        Parameters
        ----------
        reflectors : how they stand now.
        """
        if not self.against or not self.kept:
            return None
        chosen = self.layout(self.against)
        if chosen.reflectors != reflectors:
            return chosen
        return next((each for each in self.kept if each.reflectors != reflectors), chosen)

"""What a click or a drag on the floor does while a tool is in use: the base of all tools.

A tool is a frozen value, and part of how a browser edits: what was clicked so far is in it. A feature that needs a tool
declares one of its own and lets a button choose it by `ChooseTool(ItsTool())`; nothing here knows which there are.
Without a tool a click selects.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, TypeAlias

from commission.app.base.actions import ClickFloor, DragFloor, Point, Sender
from commission.app.base.reducer import Outcome
from commission.app.base.state import AppState
from commission.geometry.arrays import FloatArray

Label: TypeAlias = tuple[str, Point]
"""A word on the floor, and where [m]."""


@dataclass(frozen=True, slots=True)
class Tool:
    """A tool that does nothing: each one overrides what it needs."""

    points: tuple[Point, ...] = ()
    """Points clicked so far [m]."""

    name: ClassVar[str] = ""
    """On its button."""
    makes: ClassVar[str] = ""
    """What Enter makes of the points; empty: nothing."""
    fewest: ClassVar[int] = 0
    """Points that this takes."""
    stays: ClassVar[bool] = False
    """Whether what was begun with it is there again when it is taken up again."""

    @property
    def is_half_done(self) -> bool:
        """Whether something was begun that Escape drops before it drops the tool."""
        return self != type(self)()

    def taken_up(self, state: AppState) -> Tool:  # noqa: ARG002 - a default
        """Return the tool with what still holds of what was begun with it, when it is taken up again."""
        return self

    def clicked(self, state: AppState, click: ClickFloor, sender: Sender) -> Outcome:  # noqa: ARG002 - a default
        """Return what follows from a click; the editor in the state has its place and its reach already.

        Parameters
        ----------
        state : before the click.
        click : the place [m], map frame, and how far a click reaches.
        sender : who clicked.
        """
        return Outcome(state)

    def dragged(self, state: AppState, drag: DragFloor, sender: Sender) -> Outcome:  # noqa: ARG002 - a default
        """Return what follows from a drag.

        Parameters
        ----------
        state : before this part of the drag.
        drag : from its start to where it is now [m], map frame.
        sender : who drags.
        """
        return Outcome(state)

    def finished(self, state: AppState, sender: Sender) -> Outcome:  # noqa: ARG002 - a default
        """Return what follows from Enter."""
        return Outcome(state)

    def hint(self, state: AppState, browser: int) -> str:  # noqa: ARG002 - a default
        """Return what it expects, in one line of html; empty when there is nothing to say."""
        return ""

    def sketch(self, state: AppState, browser: int) -> list[FloatArray]:  # noqa: ARG002 - a default
        """Return the lines that show what it is about to make, (N, 2) points each [m]."""
        return []

    def marks(self) -> tuple[Point, ...]:
        """Return the places that are marked [m]."""
        return self.points

    def labels(self) -> tuple[Label, ...]:
        """Return words on the floor."""
        return ()

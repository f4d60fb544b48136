"""What a person asks for in the instruments below the floor, as the page's script says it: from its text to an action.

The script writes one line of JSON into a text field that nobody sees; whatever else is written there is refused.
"""

from __future__ import annotations

from typing import Annotated, TypeAlias

import msgspec
from msgspec import Meta, Struct

from commission.app.base.actions import Action
from commission.app.run.actions import SaveCurves, Seek, ShowCharts, ShowSpan

Time: TypeAlias = Annotated[float, Meta(ge=0.0, le=1e9)]
Text: TypeAlias = Annotated[str, Meta(max_length=200)]


class Asked(Struct, frozen=True, forbid_unknown_fields=True, tag_field="do", tag=str.lower):
    """Base of all that can be asked; the name of a class is what the script says under `do`."""

    n: int
    """Counts up: to ask for the same thing again is another text."""

    def action(self) -> Action:
        """Return what it means."""
        raise NotImplementedError


class At(Asked, frozen=True):
    """A moment was clicked on."""

    time: Time
    """When [s]."""

    def action(self) -> Action:
        """Go there."""
        return Seek(self.time)


class Zoom(Asked, frozen=True):
    """A stretch of time was dragged over, or the whole drive is wanted again."""

    span: tuple[Time, Time] | None
    """Begin and end [s]; none: all of it."""

    def action(self) -> Action:
        """Show it."""
        return ShowSpan(self.span)


class Charts(Asked, frozen=True):
    """Other plots were chosen."""

    titles: Annotated[tuple[Text, ...], Meta(max_length=20)]
    """Which ones."""

    def action(self) -> Action:
        """Show them."""
        return ShowCharts(self.titles)


class Table(Asked, frozen=True):
    """What is shown is wanted as a table."""

    def action(self) -> Action:
        """Make it."""
        return SaveCurves()


_DECODER = msgspec.json.Decoder(At | Zoom | Charts | Table)


def action_of(text: str) -> Action:
    """Return what a line of the script asks for.

    Parameters
    ----------
    text : as it came from a browser.

    Raises
    ------
    ValueError
        it is none.
    """
    try:
        asked = _DECODER.decode(text)
    except msgspec.MsgspecError as error:
        raise ValueError(f"the plots say {text[:60]!r}; expected what their script says ({error})") from error
    return asked.action()

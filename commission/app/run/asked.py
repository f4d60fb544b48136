"""What a person asks for in the instruments below the floor, as the page's script says it: from its text to an action.

The script writes one line of JSON into a text field that nobody sees; whatever else is written there is refused.
"""

from __future__ import annotations

from typing import Annotated, TypeAlias

import msgspec
from msgspec import Meta, Struct

from commission.app.base.actions import Action
from commission.app.editing.actions import SelectReflectors
from commission.app.run.actions import ColorReflectors, SaveCurves, Seek, ShowCharts, ShowSpan
from commission.app.run.variant_actions import DropVariant, KeepVariant, UseVariant

Time: TypeAlias = Annotated[float, Meta(ge=0.0, le=1e9)]
Letter: TypeAlias = Annotated[str, Meta(max_length=1)]
Text: TypeAlias = Annotated[str, Meta(max_length=200)]


class Asked(Struct, frozen=True, forbid_unknown_fields=True, tag_field="do"):
    """Base of all that can be asked; the tag of a class is what the script says under `do`."""

    n: int
    """Counts up: to ask for the same thing again is another text."""

    def action(self) -> Action:
        """Return what it means."""
        raise NotImplementedError


class MomentAsked(Asked, frozen=True, tag="at"):
    """A moment was clicked on."""

    time: Time
    """When [s]."""

    def action(self) -> Action:
        """Go there."""
        return Seek(self.time)


class ZoomAsked(Asked, frozen=True, tag="zoom"):
    """A stretch of time was dragged over, or the whole drive is wanted again."""

    span: tuple[Time, Time] | None
    """Begin and end [s]; none: all of it."""

    def action(self) -> Action:
        """Show it."""
        return ShowSpan(self.span)


class ChartsAsked(Asked, frozen=True, tag="charts"):
    """Other plots were chosen."""

    titles: Annotated[tuple[Text, ...], Meta(max_length=20)]
    """Which ones."""

    def action(self) -> Action:
        """Show them."""
        return ShowCharts(self.titles)


class ReflectorAsked(Asked, frozen=True, tag="reflector"):
    """A reflector of the list was clicked on."""

    id: Text
    """Which one."""

    def action(self) -> Action:
        """Select it, and fly there."""
        return SelectReflectors((self.id,), fly=True)


class ColorAsked(Asked, frozen=True, tag="color"):
    """The floor is to be colored by a column of the reflectors' figures, or by none."""

    figure: Text
    """Key of the column; empty: none."""

    def action(self) -> Action:
        """Color it."""
        return ColorReflectors(self.figure)


class TableAsked(Asked, frozen=True, tag="table"):
    """What is shown is wanted as a table."""

    def action(self) -> Action:
        """Make it."""
        return SaveCurves()


class KeepAsked(Asked, frozen=True, tag="keep"):
    """The run that is shown is wanted as a variant."""

    def action(self) -> Action:
        """Keep it."""
        return KeepVariant()


class DropAsked(Asked, frozen=True, tag="drop"):
    """A variant is no longer wanted."""

    letter: Letter
    """Which one."""

    def action(self) -> Action:
        """Forget it."""
        return DropVariant(self.letter)


class UseAsked(Asked, frozen=True, tag="use"):
    """The parameters of a variant are wanted back."""

    letter: Letter
    """Which one."""

    def action(self) -> Action:
        """Take them."""
        return UseVariant(self.letter)


_DECODER = msgspec.json.Decoder(
    MomentAsked | ZoomAsked | ChartsAsked | ReflectorAsked | ColorAsked | TableAsked | KeepAsked | DropAsked | UseAsked
)


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

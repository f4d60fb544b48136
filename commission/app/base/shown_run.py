"""The run that the page shows: who shows runs says so here, and who studies one takes it."""

from __future__ import annotations

from dataclasses import dataclass

from commission.app.base.actions import Action
from commission.studies.run import RunResult


@dataclass(frozen=True, slots=True, eq=False)
class RunShown(Action):
    """A drive that is over has been localized whole, and is on the page."""

    result: RunResult | None
    """The run; none: a vehicle drives now, and its run still grows."""


@dataclass(frozen=True, slots=True)
class ShownRun:
    """The run that is on the page, in its state: for studies of it."""

    result: RunResult | None = None
    """The run; none: there is none, or a vehicle drives now."""


class LearnedFromDrive(Action):
    """An edit by which the project learns what was true in the drive on the page: the base of frozen dataclasses.

    What is believed of hall and vehicle changes, and not these: a virtual drive stays as it is.
    """

    __slots__ = ()

"""What the run has to do besides changing the state, as frozen values."""

from __future__ import annotations

from dataclasses import dataclass

from commission.app.base.effects import Effect
from commission.app.run.actions import Source


@dataclass(frozen=True, slots=True)
class LoadSource(Effect):
    """Simulate or read what drives."""

    source: Source
    """What drives."""


@dataclass(frozen=True, slots=True)
class MoveTo(Effect):
    """Bring the run to a time of the drive."""

    time: float
    """Seconds after its start [s]."""
    afresh: bool = False
    """Whether it begins again at the initial pose even when the time is ahead."""


@dataclass(frozen=True, slots=True)
class ProcessOneScan(Effect):
    """Let the localizer process one more scan."""

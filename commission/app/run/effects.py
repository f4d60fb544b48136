"""What the run has to do besides changing the state, as frozen values."""

from __future__ import annotations

from dataclasses import dataclass

from commission.app.base.effects import Effect
from commission.app.base.growing import RunGrew
from commission.app.run.actions import Source
from commission.app.run.state import PlotWindow


@dataclass(frozen=True, slots=True)
class LoadSource(Effect):
    """Simulate or read what drives."""

    source: Source
    """What drives."""


@dataclass(frozen=True, slots=True, eq=False)
class ShowGrown(Effect):
    """Show a live run as far as it has come."""

    grown: RunGrew
    """The run so far."""


@dataclass(frozen=True, slots=True)
class MoveTo(Effect):
    """Bring the cursor to a time of the drive."""

    time: float
    """Seconds after its start [s]."""


@dataclass(frozen=True, slots=True)
class MoveByScans(Effect):
    """Bring the cursor to another scan."""

    scans: int
    """How many scans ahead; back where negative."""


@dataclass(frozen=True, slots=True)
class PlayOn(Effect):
    """Begin at the other end where the drive is over in the direction in which it is to be played."""

    backward: bool
    """Whether time runs backward."""


@dataclass(frozen=True, slots=True)
class CoverFromHere(Effect):
    """Cover or uncover every reflector from the cursor on."""

    covered: bool
    """Whether no reflector can be seen."""


@dataclass(frozen=True, slots=True)
class LocateFromHere(Effect):
    """Let the vehicle look where it is from the cursor on."""


@dataclass(frozen=True, slots=True)
class RunAfresh(Effect):
    """Run the whole drive with the setup of now, nothing covered, and go to its start."""


@dataclass(frozen=True, slots=True)
class DriveAgain(Effect):
    """Simulate the virtual drive again where the hall, the vehicle or its scanners are no longer those driven."""


@dataclass(frozen=True, slots=True)
class MakeCurves(Effect):
    """Write what a browser's plots show into a table."""

    window: PlotWindow
    """What they show."""

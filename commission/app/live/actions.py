"""What can be asked of the live sources, as frozen values."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from commission.app.base.actions import Action, Point
from commission.app.base.drive_now import DriveNow
from commission.studies.arrival import ArrivalOffset
from commission.studies.clock import ClockOffset
from commission.studies.run import RunInput


@dataclass(frozen=True, slots=True)
class Connect(Action):
    """Listen to sources, in place of those that were listened to before, and localize what they say."""

    sources: tuple[str, ...]
    """Each as `NAME[@SCANNER]:HOST:PORT`; one at least."""
    start: tuple[float, float, float] | None = None
    """Pose of base now: x [m], y [m], heading [rad], map frame; none: the start of the first route,
    without one it looks where it is."""


@dataclass(frozen=True, slots=True)
class Disconnect(Action):
    """Listen no longer; the run so far stays."""


@dataclass(frozen=True, slots=True)
class LocateVehicle(Action):
    """Throw the pose of the vehicle that drives now away: it looks where it is."""


@dataclass(frozen=True, slots=True)
class Record(Action):
    """Record what the sources say, and what the localizer makes of it, from now on."""

    path: Path | None = None
    """A file that does not exist, ends in .mcap; none: one in the project's folder, called by the time of day."""


@dataclass(frozen=True, slots=True, eq=False)
class RecordDrive(Action):
    """Write the drive that is on the page, with what the localizer makes of it."""

    drive: DriveNow
    """The drive."""
    path: Path | None = None
    """As in `Record`."""


@dataclass(frozen=True, slots=True)
class StopRecording(Action):
    """Record no longer; the sources are still listened to."""


@dataclass(frozen=True, slots=True)
class SetClock(Action):
    """Say what a scanner's clock shows more than the vehicle's."""

    name: str
    """The scanner's."""
    value: object
    """The offset [s]."""


@dataclass(frozen=True, slots=True, eq=False)
class FindClocks(Action):
    """Find the offsets of the scanners' clocks by the motion of the drive that is on the page."""

    drive: RunInput
    """What has been driven."""


@dataclass(frozen=True, slots=True)
class ClocksFound(Action):
    """The offsets are found."""

    found: tuple[ClockOffset, ...]
    """One for each scanner."""


@dataclass(frozen=True, slots=True)
class UseClocks(Action):
    """Set the clocks to what motion says, where it says it: one undo step."""


@dataclass(frozen=True, slots=True)
class UseArrivalClocks(Action):
    """Set the clocks to what arrival says, where it says that they are others: one undo step."""

    found: tuple[ArrivalOffset, ...]
    """What it says."""


@dataclass(frozen=True, slots=True)
class SetThreshold(Action):
    """Choose the intensity from which a beam counts as reflective."""

    value: object
    """The intensity [sensor's unit]."""


@dataclass(frozen=True, slots=True)
class WatchSensor(Action):
    """Say whether a browser has the raw-sensor view before it: shiny things are looked for while one has."""

    seen: bool
    """Whether it has."""


@dataclass(frozen=True, slots=True, eq=False)
class FindShiny(Action):
    """Look for shiny things in what a vehicle that still drives has seen so far."""

    drive: DriveNow
    """What it has."""


@dataclass(frozen=True, slots=True)
class MarkSeen(Action):
    """Mark what a scanner has seen, in the view and on the floor, and go there."""

    place: Point
    """Where it stands [m], map frame."""
    reflector: str = ""
    """Reflector that it is taken for, which is selected; empty: none."""

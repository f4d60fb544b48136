"""What a person can ask of the run, and what drives; frozen values."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, TypeAlias

from commission.app.base.actions import Action
from commission.app.run.trail_colors import TrailBy
from commission.site.disturbances import PEOPLE
from commission.site.quantity import Bounds, Quantity

LARGEST_SEED = 2**53
"""Browsers count to here without a gap."""


@dataclass(frozen=True, slots=True)
class VirtualDrive:
    """A source: a virtual AGV drives a planned route."""

    route: str
    """Name of the route."""
    seed: Annotated[int, Quantity(label="Seed", bounds=Bounds.between(0, LARGEST_SEED), step=1)] = 1
    """Seed of everything random: the same seed gives the same drive, to the bit."""
    people: Annotated[int | None, PEOPLE] = None
    """People walking about; none: as many as the project says."""


@dataclass(frozen=True, slots=True)
class RecordedDrive:
    """A source: what a vehicle recorded."""

    path: Path
    """Folder or file of the recording."""


Source: TypeAlias = VirtualDrive | RecordedDrive


@dataclass(frozen=True, slots=True)
class ChooseSource(Action):
    """Run the localizer over another drive."""

    source: Source
    """What drives."""


@dataclass(frozen=True, slots=True)
class SourceLoaded(Action):
    """A drive that was asked for is there: it is what drives from now on."""

    source: Source
    """What drives."""


@dataclass(frozen=True, slots=True)
class ShowLive(Action):
    """A live run has begun and is on the page."""


@dataclass(frozen=True, slots=True)
class Play(Action):
    """Start or stop the play clock."""

    playing: bool | None = None
    """Whether it runs; none: the other way round."""
    backward: bool = False
    """Whether it runs backward."""


@dataclass(frozen=True, slots=True)
class StepScan(Action):
    """Pause and go on by one scan."""

    back: bool = False
    """Whether to the scan before."""


@dataclass(frozen=True, slots=True)
class SetSpeed(Action):
    """Let the play clock run faster or slower than the vehicle's."""

    factor: float
    """1 is real time."""


@dataclass(frozen=True, slots=True)
class Seek(Action):
    """Go to a time of the drive."""

    time: float
    """Seconds after its start [s]."""

    def supersedes(self, earlier: Action) -> bool:
        """Whether the time before need not be gone to: of many in a row the newest counts."""
        return isinstance(earlier, Seek)


@dataclass(frozen=True, slots=True)
class Restart(Action):
    """Run the whole drive with the setup of now, nothing covered on the way, and go to its start."""


@dataclass(frozen=True, slots=True)
class Repeat(Action):
    """Whether the drive starts again at its end."""

    repeat: bool
    """Start again."""


@dataclass(frozen=True, slots=True)
class ColorTrail(Action):
    """Color the trail on the floor by another quantity."""

    by: TrailBy
    """Which one."""


@dataclass(frozen=True, slots=True)
class EditFromHereOn(Action):
    """Whether edits act from the cursor on, and not on the whole drive."""

    from_here_on: bool
    """From the cursor on."""


@dataclass(frozen=True, slots=True)
class MoveOnlyTheMap(Action):
    """Whether an edit of the site leaves the hall of a virtual drive as it was: a survey error, as an experiment."""

    only_the_map: bool
    """The hall stays."""


@dataclass(frozen=True, slots=True)
class Cover(Action):
    """Cover or uncover every reflector of the hall, from the cursor on."""

    covered: bool
    """Whether no reflector can be seen."""


@dataclass(frozen=True, slots=True)
class Locate(Action):
    """Throw the pose away from the cursor on: the vehicle looks where it is."""


@dataclass(frozen=True, slots=True)
class SetDisturbance(Action):
    """Change one number of what a virtual drive suffers."""

    name: str
    """Its dotted name in the disturbances: `wheels.forward_per_sqrt_m`, `constants.mounting_sigma[2]`."""
    value: object
    """New value, in the unit of code and files."""


@dataclass(frozen=True, slots=True)
class ShowSpan(Action):
    """Show a stretch of the drive in this browser's plots."""

    span: tuple[float, float] | None
    """Begin and end [s]; none: the whole drive."""


@dataclass(frozen=True, slots=True)
class ShowCharts(Action):
    """Choose this browser's plots."""

    titles: tuple[str, ...]
    """Their titles, one at least."""


@dataclass(frozen=True, slots=True)
class ColorReflectors(Action):
    """Color the reflectors on the floor by one of their figures."""

    figure: str
    """Key of its column; empty: none."""


@dataclass(frozen=True, slots=True)
class SaveCurves(Action):
    """Save what this browser's plots show as a table, cycle by cycle."""


@dataclass(frozen=True, slots=True)
class CurvesMade(Action):
    """Such a table is ready."""

    name: str
    """Name of its file."""
    content: bytes
    """The file."""

"""Everything that can happen on the page, as frozen values. Callbacks post them; nothing is done here.

An action says what was asked for, in SI and radians; `reducer` decides what it means, `runtime` carries it out.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import TypeAlias

from commission.app.editing.actions import EditAction
from commission.app.exchange.actions import ExchangeAction
from commission.app.floor_map.actions import MapAction
from commission.app.plan.actions import PlanAction
from commission.site.project import Project

ParameterValue: TypeAlias = bool | int | float | str


@dataclass(frozen=True, slots=True)
class VirtualDrive:
    """A source: a virtual AGV drives a planned route."""

    route: str
    """Name of the route."""
    seed: int = 1
    """Seed of everything random: the same seed gives the same drive, to the bit."""
    people: int | None = None
    """People walking about; none: as many as the project says."""


@dataclass(frozen=True, slots=True)
class Recording:
    """A source: what a vehicle recorded."""

    path: Path
    """Folder or file of the recording."""


Source: TypeAlias = VirtualDrive | Recording


@dataclass(frozen=True, slots=True)
class SetParameter:
    """Change one tunable of the localizer."""

    key: str
    """`group.name`, as in `project.yaml`."""
    value: ParameterValue
    """New value, SI and radians."""
    at: float = 0.0
    """When it was asked for [s, any monotonic clock]: changes that follow quickly are one undo step."""


@dataclass(frozen=True, slots=True)
class ResetParameters:
    """Go back to the parameters of the saved project."""


@dataclass(frozen=True, slots=True)
class Undo:
    """Take back the last change of the project."""

    client: int | None = None
    """Number of the browser that asks; none: nobody in particular."""


@dataclass(frozen=True, slots=True)
class Redo:
    """Make the change that was taken back again."""

    client: int | None = None
    """Number of the browser that asks; none: nobody in particular."""


@dataclass(frozen=True, slots=True)
class Save:
    """Write the project."""

    folder: Path | None = None
    """Where to; none: where it came from."""
    overwrite: bool = False
    """Whether files that somebody else has changed meanwhile are replaced."""


@dataclass(frozen=True, slots=True)
class ProjectSaved:
    """The project was written."""

    project: Project
    """What was written."""
    folder: Path
    """Where to."""
    time_of_day: str
    """When, as the page shows it."""


@dataclass(frozen=True, slots=True)
class ChangedOnDisk:
    """The project's files were looked at, because something has happened in their folder."""

    files: tuple[str, ...]
    """Names of those that somebody else has changed since they were read or saved; empty: none."""


@dataclass(frozen=True, slots=True)
class Reload:
    """Read the project from its files again, as an edit that can be undone."""


@dataclass(frozen=True, slots=True)
class Reloaded:
    """The project was read again."""

    project: Project
    """As its files are."""


@dataclass(frozen=True, slots=True)
class ChooseSource:
    """Run the localizer over another drive."""

    source: Source
    """What drives."""


@dataclass(frozen=True, slots=True)
class Play:
    """Start or stop the play clock."""

    playing: bool | None = None
    """Whether it runs; none: the other way round."""


@dataclass(frozen=True, slots=True)
class Step:
    """Pause and process one more scan."""


@dataclass(frozen=True, slots=True)
class SetSpeed:
    """Let the play clock run faster or slower than the vehicle's."""

    factor: float
    """1 is real time."""


@dataclass(frozen=True, slots=True)
class Seek:
    """Go to a time of the drive."""

    time: float
    """Seconds after its start [s]."""


@dataclass(frozen=True, slots=True)
class Restart:
    """Go back to the start, the initial pose and its uncertainty."""


@dataclass(frozen=True, slots=True)
class Repeat:
    """Whether the drive starts again at its end."""

    repeat: bool
    """Start again."""


@dataclass(frozen=True, slots=True)
class Cover:
    """Cover or uncover every reflector of the hall, from the next scan on."""

    covered: bool
    """Whether no reflector can be seen."""


@dataclass(frozen=True, slots=True)
class ShowLayer:
    """Show or hide one drawn thing."""

    name: str
    """Name of the layer."""
    visible: bool
    """Whether it is drawn."""


@dataclass(frozen=True, slots=True)
class Magnify:
    """Draw ellipses larger than they are."""

    factor: float
    """Factor; 1 is true to scale."""


class View(StrEnum):
    """What one browser looks at."""

    PLAN = "Plan"
    THREE_D = "3D"
    FIT = "Fit"
    FOLLOW = "Follow"


@dataclass(frozen=True, slots=True)
class SetView:
    """Change the view of one browser; the others keep theirs."""

    client: int
    """Number of the browser's connection."""
    view: View
    """What it looks at; `Fit` keeps plan or 3D, `Follow` is switched on or off."""


@dataclass(frozen=True, slots=True)
class RenameProject:
    """Call the project something else."""

    name: str
    """New name."""
    client: int | None = None
    """Number of the browser that asks; none: nobody in particular."""


@dataclass(frozen=True, slots=True)
class StopJob:
    """Stop a piece of background work; what there was before it stays."""

    number: int
    """Number of the job."""


@dataclass(frozen=True, slots=True)
class Report:
    """Something went wrong outside the owner thread, or is worth telling."""

    text: str
    """One line."""
    failed: bool = True
    """Whether it is a problem that stays listed."""


@dataclass(frozen=True, slots=True)
class ClearProblems:
    """The listed problems were read."""


Action: TypeAlias = (
    SetParameter
    | ResetParameters
    | Undo
    | Redo
    | Save
    | ProjectSaved
    | ChangedOnDisk
    | Reload
    | Reloaded
    | ChooseSource
    | Play
    | Step
    | SetSpeed
    | Seek
    | Restart
    | Repeat
    | Cover
    | ShowLayer
    | Magnify
    | SetView
    | RenameProject
    | StopJob
    | Report
    | ClearProblems
    | EditAction
    | MapAction
    | PlanAction
    | ExchangeAction
)

"""What follows from an action: the next state, and effects that the runtime carries out. The one function `reduce`.

What each action means is registered with it by `reducer` and by `editing`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import singledispatch
from pathlib import Path
from typing import TypeAlias

from commission.app.base.actions import Action, Source, View
from commission.app.base.state import AppState
from commission.app.exchange.pending import ImportSource
from commission.app.floor_map.effects import MapEffect
from commission.io.exports import Format
from commission.io.imports import LayoutChoice
from commission.site.project import Project


@dataclass(frozen=True, slots=True)
class LoadSource:
    """Simulate or read what drives."""

    source: Source
    """What drives."""


@dataclass(frozen=True, slots=True)
class ApplyParameters:
    """Hand the project's parameters to the running localizer."""


@dataclass(frozen=True, slots=True)
class WriteProject:
    """Write the project."""

    project: Project
    """What to write."""
    folder: Path
    """Where to."""
    overwrite: bool = False
    """Whether files that somebody else has changed meanwhile are replaced."""


@dataclass(frozen=True, slots=True)
class ReadProject:
    """Read the project from its files again."""

    folder: Path
    """Where from."""


@dataclass(frozen=True, slots=True)
class MoveTo:
    """Bring the run to a time of the drive."""

    time: float
    """Seconds after its start [s]."""
    afresh: bool = False
    """Whether it begins again at the initial pose even when the time is ahead."""


@dataclass(frozen=True, slots=True)
class ProcessOneScan:
    """Let the localizer process one more scan."""


@dataclass(frozen=True, slots=True)
class CancelJob:
    """Stop a piece of background work."""

    number: int
    """Number of the job."""


@dataclass(frozen=True, slots=True)
class Tell:
    """Show a notification."""

    text: str
    """One line."""
    failed: bool
    """Whether something went wrong."""


@dataclass(frozen=True, slots=True)
class PlaceCamera:
    """Change what one browser looks at."""

    client: int
    """Number of the browser's connection."""
    view: View
    """What it looks at."""


@dataclass(frozen=True, slots=True)
class FlyTo:
    """Bring a place into one browser's view."""

    client: int
    """Number of the browser's connection."""
    place: tuple[float, float]
    """Where [m], map frame."""


@dataclass(frozen=True, slots=True)
class ReadFile:
    """Read what one browser wants to import."""

    client: int
    """Number of the browser's connection."""
    number: int
    """Goes with the answer."""
    source: ImportSource
    """Which file."""
    choice: LayoutChoice
    """Which part of it."""
    project: Project
    """What it is compared with."""


@dataclass(frozen=True, slots=True)
class StopReading:
    """Stop reading what one browser wanted to import."""

    client: int
    """Number of the browser's connection."""


@dataclass(frozen=True, slots=True)
class ExportProject:
    """Make a file of a project for one browser."""

    client: int
    """Number of the browser's connection."""
    wanted: Format
    """In which format."""
    project: Project
    """Of what."""


@dataclass(frozen=True, slots=True)
class SendFile:
    """Let one browser save a file."""

    client: int
    """Number of the browser's connection."""
    name: str
    """Name of the file."""
    content: bytes
    """The file."""


ExchangeEffect: TypeAlias = ReadFile | StopReading | ExportProject
PageEffect: TypeAlias = Tell | PlaceCamera | FlyTo | SendFile
Effect: TypeAlias = (
    LoadSource
    | ApplyParameters
    | WriteProject
    | ReadProject
    | MoveTo
    | ProcessOneScan
    | CancelJob
    | PageEffect
    | ExchangeEffect
    | MapEffect
)


@dataclass(frozen=True, slots=True)
class Reduction:
    """Outcome of one action."""

    state: AppState
    """The next state."""
    effects: tuple[Effect, ...] = ()
    """What has to be done besides, in this order."""


@singledispatch
def reduce(action: Action, state: AppState) -> Reduction:
    """Return what follows from an action.

    Parameters
    ----------
    action : what was asked for.
    state : the state it was asked in.

    Raises
    ------
    CommissionError, ValueError
        the action asks for something that does not exist or is out of range; the state stays as it is.
    """
    raise TypeError(f"{type(action).__name__} is not an action; state has playing = {state.playing}")

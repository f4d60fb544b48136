"""What the live sources have to do besides changing the state, as frozen values."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from commission.app.base.drive_now import DriveNow
from commission.app.base.effects import Effect
from commission.studies.run import RunInput


@dataclass(frozen=True, slots=True)
class OpenSources(Effect):
    """Listen to sources."""

    sources: tuple[str, ...]
    """Each as `NAME[@SCANNER]:HOST:PORT`."""
    start: tuple[float, float, float] | None
    """Pose of base at the first record [m, m, rad]; none: the start of the first route."""


@dataclass(frozen=True, slots=True)
class CloseSources(Effect):
    """Listen no longer."""


@dataclass(frozen=True, slots=True)
class LocateNow(Effect):
    """Let the vehicle that drives now look where it is."""


@dataclass(frozen=True, slots=True)
class OpenRecording(Effect):
    """Record from now on."""

    path: Path | None
    """The file; none: one in the project's folder."""


@dataclass(frozen=True, slots=True)
class CloseRecording(Effect):
    """Record no longer."""


@dataclass(frozen=True, slots=True, eq=False)
class StudyClocks(Effect):
    """Find the offsets of the scanners' clocks in the background."""

    drive: RunInput
    """What has been driven."""


@dataclass(frozen=True, slots=True, eq=False)
class WriteDrive(Effect):
    """Write a drive in the background."""

    drive: DriveNow
    """The drive."""
    path: Path | None
    """The file; none: one in the project's folder."""

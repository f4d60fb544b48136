"""What the live sources are asked to do: the feature's part of the page's state."""

from __future__ import annotations

from dataclasses import dataclass

from commission.app.base.actions import Point
from commission.app.base.drive_now import DriveNow
from commission.io.live.permission import NEAR, Permission
from commission.io.vda5050_states import StateFile
from commission.studies.clock import ClockOffset


@dataclass(frozen=True, slots=True, kw_only=True)
class LiveState:
    """Which sources are listened to."""

    sources: tuple[str, ...] = ()
    """Each as `NAME[@SCANNER]:HOST:PORT`."""
    start: tuple[float, float, float] | None = None
    """Pose of base at the first record [m, m, rad]; none: the start of the first route."""
    connected: bool = False
    """Whether they are listened to."""
    states: StateFile | None = None
    """Where messages of the vehicle's state are written while it drives; none: nowhere."""
    permission: Permission = NEAR
    """Which sources a browser may name."""


@dataclass(frozen=True, slots=True)
class ClockState:
    """What the motion of a drive said of the scanners' clocks."""

    found: tuple[ClockOffset, ...] = ()
    """One for each scanner; none before it was asked for."""


@dataclass(frozen=True, slots=True)
class SensorWatch:
    """What one browser does with the raw-sensor view."""

    seen: bool = False
    """Whether it has it before it."""
    marked: Point | None = None
    """Where something stands that was clicked [m], map frame; none: nothing was."""


@dataclass(frozen=True, slots=True, eq=False)
class ShinyAsked:
    """Whose shiny things are looked for, where no drive is shown that is over."""

    drive: DriveNow | None = None
    """A live drive as far as it had come; none: nobody has asked."""

"""What can be asked of the live sources, as frozen values."""

from __future__ import annotations

from dataclasses import dataclass

from commission.app.base.actions import Action


@dataclass(frozen=True, slots=True)
class Connect(Action):
    """Listen to sources, in place of those that were listened to before, and localize what they say."""

    sources: tuple[str, ...]
    """Each as `NAME[@SCANNER]:HOST:PORT`; one at least."""
    start: tuple[float, float, float] | None = None
    """Pose of base now: x [m], y [m], heading [rad], map frame; none: the start of the first route."""


@dataclass(frozen=True, slots=True)
class Disconnect(Action):
    """Listen no longer; the run so far stays."""

"""The live sources as the panel shows them; frozen, newest wins."""

from __future__ import annotations

from dataclasses import dataclass

from commission.io.live.registry import SourceAddress
from commission.io.live.session_recorder import RecordingStatus
from commission.io.live.status import SourceStatus


@dataclass(frozen=True, slots=True)
class SourceView:
    """One source."""

    address: SourceAddress
    """Where it is listened to."""
    status: SourceStatus
    """How it is doing."""
    checks: tuple[str, ...]
    """What to look at, where it says nothing."""


@dataclass(frozen=True, slots=True, eq=False)
class LiveView:
    """All sources."""

    sources: tuple[SourceView, ...]
    """Those that are listened to."""
    told: tuple[str, ...]
    """What was left out or sorted, one line each."""
    recording: RecordingStatus | None = None
    """The recording that is made, or was made last."""

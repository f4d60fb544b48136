"""The live sources as the panel shows them; frozen, newest wins."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from commission.io.live.accounts import RecordAccount
from commission.io.live.registry import SourceAddress
from commission.io.live.session_recorder import RecordingStatus
from commission.io.live.status import SourceStatus
from commission.site.records import Record
from commission.studies.arrival import ArrivalOffset


@dataclass(frozen=True, slots=True)
class SourceView:
    """One source."""

    address: SourceAddress
    """Where it is listened to."""
    status: SourceStatus
    """How it is doing."""
    checks: tuple[str, ...]
    """What to look at, where it says nothing."""
    too_late: Mapping[type[Record], int] = field(default_factory=dict[type[Record], int])
    """Its records that came too late and are left out, by kind."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class LiveView:
    """All sources."""

    sources: tuple[SourceView, ...]
    """Those that are listened to."""
    told: tuple[str, ...]
    """What was mended, one line each."""
    recording: RecordingStatus | None = None
    """The recording that is made, or was made last."""
    account: RecordAccount = field(default_factory=RecordAccount)
    """What became of the records."""
    clocks: tuple[ArrivalOffset, ...] = ()
    """What arrival says of the scanners' clocks."""

"""How a scanner turns as a recording says it, as scans of a ROS bag do. A value."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class RecordedSweep:
    """Sweep of a scanner, as recorded."""

    scanner: str
    """Name of the scanner."""
    duration: float
    """Time from the first to the last beam of a scan [s]."""
    direction: int
    """Way in which the beam turns, scanner frame: 1 counter-clockwise, -1 clockwise."""

"""What may be wrong about the reflector map: one finding with its evidence, and the same in words.

Values and words alone; who finds them is `monitor`, what becomes of the map `map_correction`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

from commission.site.quantity import MILLIMETRES, PERCENT
from commission.studies.diagnosis import Suspicion


class MapFault(StrEnum):
    """What is wrong about the map."""

    MOVED = "moved"
    MISSING = "missing"
    DIRTY = "dirty"
    DOUBLE = "double"
    NEW = "new"


@dataclass(frozen=True, slots=True, kw_only=True)
class DriveEvidence:
    """What one drive says of a reflector, or of a thing that is none of the map."""

    drive: str
    """Its name."""
    expected: int
    """Scans in which it is in sight by the map."""
    seen: int
    """Scans with a detection within a metre of it; detections of a thing."""
    beams: float
    """Mean width of its clusters as a share of what is expected [1]; NaN where the sensor detects."""
    suspicion: Suspicion | None
    """What is suspected by this drive alone."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MapFinding:
    """One thing about the map that is no longer so."""

    fault: MapFault
    """What it is."""
    id: str
    """The reflector; of a new one the name that it would get."""
    before: tuple[float, float] | None
    """Its place by the map [m]; None of a new one."""
    after: tuple[float, float] | None
    """Where it is now [m]; None of a missing one."""
    sigma: float
    """1-sigma of that place, each axis [m], the survey of the others in it; NaN where there is none."""
    since: str
    """From when on, as far as the drives tell."""
    evidence: tuple[DriveEvidence, ...]
    """Of each drive that tells something."""
    text: str
    """In words, with figures."""


def told(
    fault: MapFault,
    name: str,
    places: tuple[tuple[float, float], tuple[float, float] | None, float],
    since: str,
    evidence: Sequence[DriveEvidence],
) -> str:
    """Say a finding about a reflector of the map in words.

    Parameters
    ----------
    fault : what it is.
    name : of the reflector.
    places : by the map and now [m], map frame, and 1-sigma of the latter [m].
    since : from when on.
    evidence : of each drive that tells something, the newest one last.
    """
    before, after, sigma = places
    newest = evidence[-1]
    share = PERCENT.text(newest.seen / max(newest.expected, 1))
    seen = f"seen in {newest.seen} of {newest.expected} scans ({share})"
    if fault is MapFault.MOVED and after is not None:
        dx, dy = _whole(after[0] - before[0]), _whole(after[1] - before[1])
        known = f" ± {MILLIMETRES.text(sigma)}" if math.isfinite(sigma) else ""
        moved = MILLIMETRES.text(math.dist(before, after))
        return (
            f"{name} has moved by {moved}{known}: {MILLIMETRES.text(dx, '+.0f')} "
            f"in x, {MILLIMETRES.text(dy, '+.0f')} in y; since {since}"
        )
    if fault is MapFault.DOUBLE:
        return f"{name} stands twice: its place and another one beside it are seen by turns; since {since}"
    if fault is MapFault.MISSING:
        return f"{name} is missing: {seen}; since {since}"
    beams = f", {PERCENT.text(newest.beams)} of the beams that are expected" if math.isfinite(newest.beams) else ""
    return f"{name} is dirty or half hidden: {seen}{beams}; since {since}"


def _whole(length: float) -> float:
    """Length in whole millimetres [m]: less than half of one is none, to neither side."""
    return round(length, 3) + 0.0

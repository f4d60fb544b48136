"""The run as panels and layers draw it: the whole result, and where in it the page is. Frozen, newest wins."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum, auto
from typing import TypeAlias

from commission.app.run.sightings import FrameTags
from commission.app.run.turn import Turn
from commission.app.run.wall_points import WallPoints
from commission.geometry.arrays import FloatArray
from commission.localization.estimate import Estimate, Mode
from commission.localization.hypotheses import Hypothesis
from commission.localization.run_columns import RunSegment
from commission.localization.temporary_memory import TemporaryLandmarks
from commission.studies.run import RunResult

Stretch: TypeAlias = tuple[float, float]
"""From when to when after the start of the drive [s]."""


class DrivenHall(Enum):
    """How the hall that was driven through stands to the project's."""

    RECORDED = auto()
    """A vehicle recorded the drive: its hall is what it is."""
    AS_DRIVEN = auto()
    """The virtual drive was made in this hall, with this vehicle and these scanners."""
    DRIVING_AGAIN = auto()
    """They have changed, and the drive is being simulated again."""
    OTHER = auto()
    """They have changed, and the drive shown is one of before."""


@dataclass(frozen=True, slots=True, eq=False)
class Accumulated:
    """Where detections lay over the drive so far (Sobreira et al. 2016, Fig. 11)."""

    inliers: FloatArray
    """(N, 2) points [m], map frame."""
    outliers: FloatArray
    """(M, 2) points [m], map frame."""


@dataclass(frozen=True, slots=True, eq=False)
class KeptRun:
    """A variant: the same drive localized with what was set earlier."""

    letter: str
    """What it is called."""
    run: RunResult
    """The whole drive."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class RunView:
    """The run as it is now: what lies before the cursor is lived, what lies behind it is computed only."""

    result: RunResult
    """The whole drive, localized and judged."""
    lived: int
    """Number of cycles up to the cursor."""
    time: float
    """The cursor: time after the start of the drive [s]."""
    pose: FloatArray
    """(3,) pose at which the vehicle is drawn: the filter's own [m, m, rad]."""
    covariance: FloatArray
    """(3, 3) its covariance."""
    mode: Mode
    """State of the supervisor."""
    estimate: Estimate | None
    """The newest cycle, or where the vehicle has a goniometer beside a laser the newest that is no reflex; none before
    the first."""
    segment: RunSegment
    """What the newest cycle was made with."""
    covered: bool
    """Whether every reflector is covered from the next cycle on, as asked for."""
    scan_map: FloatArray
    """(B, 2) end points of the beams of each scanner's newest scan [m], map frame; those of the first come first."""
    first_scan: int
    """How many of these points are the first scanner's."""
    judged_map: FloatArray
    """(N, 2) detections of the newest cycle as the gates judge them: seen from the belief before it [m], map frame."""
    areas: FloatArray
    """(N, 2, 2) where each reflector was expected to be detected, 1-sigma [m^2], map axes; none before a cycle."""
    gates: FloatArray
    """(R, n, 2) outlines of the validation areas of the reflectors in view [m], map frame."""
    accumulated: Accumulated | None
    """Every detection so far; none in views that are drawn at the full rate."""
    seen: int = -1
    """Index of that cycle; -1 before the first."""
    turn: Turn | None = None
    """Bearings of the newest turn of the goniometer; none where there is none."""
    walls: WallPoints | None = None
    """The newest match of contours; none where they are not looked at."""
    sightings: FrameTags | None = None
    """What the newest frame saw of tags; none where no camera looks."""
    hypotheses: tuple[Hypothesis, ...] = ()
    """Where it may be, the likeliest first, while it looks where it is; else none."""
    temporary: TemporaryLandmarks | None = None
    """Temporary landmarks after the newest cycle; none where they are not looked at, or none is known."""
    hall: DrivenHall = DrivenHall.RECORDED
    """Whether the drive is one in the project's hall."""
    kept: tuple[KeptRun, ...] = ()
    """Its variants."""

    @property
    def duration(self) -> float:
        """Length of the drive [s]."""
        return self.result.duration

    @property
    def at_end(self) -> bool:
        """Whether the drive is over."""
        return self.time >= self.duration

    @property
    def newest(self) -> int:
        """Index of the newest cycle; -1 before the first."""
        return self.lived - 1

    @property
    def lived_episodes(self) -> tuple[Stretch, ...]:
        """Fail episodes that have begun, up to the cursor."""
        return tuple((start, min(end, self.time)) for start, end in self.episodes if self._has_begun(start))

    @property
    def coming_episodes(self) -> tuple[Stretch, ...]:
        """What is computed of fail episodes behind the cursor: of one that has begun only its rest."""
        return tuple(
            (max(start, self.time) if self._has_begun(start) else start, end)
            for start, end in self.episodes
            if not self._has_begun(start) or end > self.time
        )

    @property
    def edits(self) -> tuple[float, ...]:
        """Times from which on another setup is used, or reflectors are covered or uncovered [s]."""
        return tuple(float(self.result.times[segment.first]) for segment in self.result.columns.segments[1:])

    @property
    def episodes(self) -> tuple[Stretch, ...]:
        """All fail episodes of the drive."""
        first_ns = self.result.inputs.log.first_ns
        return tuple(
            ((episode.start_ns - first_ns) * 1e-9, (episode.end_ns - first_ns) * 1e-9)
            for episode in self.result.episodes
        )

    def _has_begun(self, start: float) -> bool:
        """Whether a cycle at a time is lived."""
        return self.lived > 0 and start <= float(self.result.times[self.newest])

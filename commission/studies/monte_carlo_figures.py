"""What a Monte-Carlo study reads, and what it keeps: the figures of each drive, and the cycles of all, counted.

Values alone; nothing is driven in here.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np

from commission.errors import UsageError
from commission.geometry.arrays import FloatArray, IntArray, read_only
from commission.simulation.people import WalkableFloor
from commission.simulation.random_faults import FaultRates, walking
from commission.site.project import Project
from commission.studies.inputs import StudyInput
from commission.studies.run import RunResult
from commission.studies.shadow_drives import needs_beams
from commission.studies.stanford import StanfordDiagram, merged, stanford

MOST_RUNS = 100_000
ERROR_EDGES: FloatArray = read_only(np.concatenate(([0.0], np.geomspace(1e-5, 1e3, 1601))))
"""Bounds of the bins that errors are counted in [m]: each 1.2 % wider than the one before."""
QUANTILES = (0.5, 0.9, 0.95, 0.99, 0.999, 1.0)
"""Quantiles of the errors that are told."""


class Detecting(StrEnum):
    """How detections come about."""

    AUTO = "auto"
    """From shadow maps where no fault needs beams, else beam by beam."""
    SHADOWS = "shadows"
    """From shadow maps and a library of detections: no rays are cast."""
    BEAMS = "beams"
    """Beam by beam, as `simulate` does."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class MonteCarloInput(StudyInput):
    """All that the study reads."""

    project: Project
    """Site, vehicle, parameters, and how well its constants are known."""
    routes: tuple[str, ...]
    """Routes that are driven in turn."""
    runs: int
    """Number of drives."""
    seed: int = 1
    """Seed of all drives."""
    rates: FaultRates
    """How often each fault happens."""
    detecting: Detecting = Detecting.AUTO
    """How detections come about."""

    def __post_init__(self) -> None:
        if not 1 <= self.runs <= MOST_RUNS:
            raise UsageError(f"--runs is {self.runs}; expected 1 to {MOST_RUNS}")
        if self.seed < 0:
            raise UsageError(f"--seed is {self.seed}; expected 0 or more")
        if not self.routes:
            raise UsageError("the project has no route; expected one to drive along")
        if not len(self.project.reflectors):
            raise UsageError("the project has no reflector; expected one at least to localize by")
        if self.detecting is Detecting.SHADOWS and self.beams_for:
            raise UsageError(
                f"--detections is shadows, which show no {self.beams_for}; expected beams or auto, or none of them"
            )

    @property
    def beams_for(self) -> str:
        """What needs beams; empty: nothing."""
        return needs_beams(walking(self.project, self.rates))

    @property
    def by_beams(self) -> bool:
        """Whether detections are made beam by beam."""
        return self.detecting is Detecting.BEAMS or bool(self.beams_for)

    def drive_seed(self, number: int) -> int:
        """Seed of one drive: all of them are different, and so are those of other seeds.

        Parameters
        ----------
        number : of the drive, from 0.
        """
        return int(np.random.SeedSequence((self.seed, number)).generate_state(1, np.uint64)[0] >> 1)

    def route_of(self, number: int) -> str:
        """Name of the route of one drive.

        Parameters
        ----------
        number : of the drive, from 0.
        """
        return self.routes[number % len(self.routes)]


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class DriveFigures:
    """What is kept of one drive."""

    number: int
    """Which drive, from 0."""
    seed: int
    """Its seed."""
    route: str
    """Route that was driven."""
    cycles: int
    """Scans."""
    duration: float
    """How long it took [s]."""
    operational_fraction: float
    """Share of the cycles that the vehicle was allowed to drive [0..1]."""
    lost_fraction: float
    """Share of the cycles in which it was lost [0..1]."""
    fail_episodes: int
    """Times that it was not allowed to drive."""
    longest_fail: float
    """Longest of them [s]."""
    position_rmse: float
    """Root mean square of the position error [m]; NaN without any cycle."""
    position_max: float
    """Largest position error [m]."""
    heading_rmse: float
    """Root mean square of the heading error [rad]."""
    anees: float
    """Mean NEES of x, y and heading, divided by 3; 1 is consistent."""
    anees_position: float
    """Mean NEES of x and y, divided by 2; 1 is consistent."""
    hazardous: int
    """Cycles that were operational with an error beyond the alarm limit."""
    moved: int
    """Reflectors that stood elsewhere."""
    missing: int
    """Reflectors that were gone."""
    dirty: int
    """Reflectors that were dirty."""
    false: int
    """Things that were taken for reflectors."""
    covered: int
    """Times that all reflectors were covered."""
    carried: int
    """Times that the vehicle was carried away."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class CycleCounts:
    """Cycles of some drives, counted: as much to keep for a hundred thousand drives as for one."""

    stanford: StanfordDiagram | None = None
    """By error and protection level; None where no cycle has a reference."""
    errors: IntArray = field(default_factory=lambda: np.zeros(len(ERROR_EDGES) - 1, dtype=np.int64))
    """By position error, between `ERROR_EDGES`."""
    errors_operational: IntArray = field(default_factory=lambda: np.zeros(len(ERROR_EDGES) - 1, dtype=np.int64))
    """The same of the operational ones: what the vehicle was given."""

    def __add__(self, other: CycleCounts) -> CycleCounts:
        """Add up the cycles of other drives."""
        return CycleCounts(
            stanford=merged(each.stanford for each in (self, other) if each.stanford is not None),
            errors=read_only(self.errors + other.errors),
            errors_operational=read_only(self.errors_operational + other.errors_operational),
        )


def counts_of(result: RunResult) -> CycleCounts:
    """Count the cycles of a drive.

    Parameters
    ----------
    result : the drive, localized and judged.
    """
    errors, operational = result.position_errors, result.columns.modes == 0
    known = np.isfinite(errors)
    return CycleCounts(
        stanford=stanford(result),
        errors=_binned(errors[known]),
        errors_operational=_binned(errors[known & operational]),
    )


def _binned(errors: FloatArray) -> IntArray:
    """Cycles between `ERROR_EDGES`; a value on an edge belongs below it, and what is beyond the last into the last."""
    bins = np.clip(np.searchsorted(ERROR_EDGES, errors, side="left") - 1, 0, len(ERROR_EDGES) - 2)
    return read_only(np.bincount(bins, minlength=len(ERROR_EDGES) - 1))


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class MonteCarloResult:
    """All drives."""

    inputs: MonteCarloInput
    """What was asked for."""
    drives: tuple[DriveFigures, ...]
    """Each, in the order of their numbers."""
    counts: CycleCounts
    """The cycles of all."""
    notes: tuple[str, ...] = ()
    """What of the faults cannot happen in this project, in words."""

    @property
    def stanford(self) -> StanfordDiagram | None:
        """All cycles by error and protection level."""
        return self.counts.stanford

    @property
    def error_quantiles(self) -> FloatArray:
        """Position error [m] that the share `QUANTILES` of all cycles does not exceed: the upper edge of its bin."""
        return quantiles_of(self.counts.errors)

    @property
    def operational_error_quantiles(self) -> FloatArray:
        """The same of all operational cycles."""
        return quantiles_of(self.counts.errors_operational)

    def column(self, name: str) -> FloatArray:
        """(N,) one figure of all drives.

        Parameters
        ----------
        name : of the figure.
        """
        return np.array([getattr(each, name) for each in self.drives], dtype=np.float64)

    @property
    def availability(self) -> float:
        """Share of all cycles that the vehicle was allowed to drive [0..1]."""
        cycles = self.column("cycles")
        return float((cycles * self.column("operational_fraction")).sum() / cycles.sum())

    @property
    def anees(self) -> float:
        """Mean NEES of x, y and heading over all drives, divided by 3; NaN where that of one is."""
        return float((self.column("cycles") * self.column("anees")).sum() / self.column("cycles").sum())

    @property
    def anees_position(self) -> float:
        """Mean NEES of x and y over all drives, divided by 2."""
        return float((self.column("cycles") * self.column("anees_position")).sum() / self.column("cycles").sum())

    @property
    def hazardous_drives(self) -> int:
        """Drives with a hazardous cycle at least: cycles follow each other, drives do not depend on each other."""
        return int(np.count_nonzero(self.column("hazardous")))

    @property
    def hazardous_bound(self) -> float:
        """Share of hazardous drives that is not exceeded with 95 % confidence (Clopper and Pearson 1934, one-sided)."""
        from scipy.stats import beta

        found, count = self.hazardous_drives, len(self.drives)
        return 1.0 if found == count else float(beta.ppf(0.95, found + 1, count - found))


def quantiles_of(counts: IntArray) -> FloatArray:
    """Errors [m] that the shares `QUANTILES` of the cycles do not exceed; NaN without any.

    Parameters
    ----------
    counts : cycles between `ERROR_EDGES`.
    """
    total = int(counts.sum())
    if not total:
        return np.full(len(QUANTILES), math.nan)
    needed = np.ceil(np.array(QUANTILES) * total).astype(np.int64)
    return ERROR_EDGES[1:][np.searchsorted(np.cumsum(counts), np.maximum(needed, 1))]


def floor_notes(project: Project, rates: FaultRates, floor: WalkableFloor | None = None) -> tuple[str, ...]:
    """Say where people and false things would be, where that is not the free floor of a map.

    Parameters
    ----------
    project : the site.
    rates : how often each fault happens.
    floor : of the project, where it is at hand.
    """
    people = walking(project, rates).people
    what = " and ".join(name for name, wanted in (("people", people), ("false things", rates.false)) if wanted)
    if not what:
        return ()
    if project.floor_map is None:
        return (f"there is no floor map: {what} are on an open field around the site, and no wall hides anything",)
    if not len((floor or WalkableFloor.of(project)).cells):
        return (f"the floor map has no free floor that is wide enough to walk on: {what} do not occur",)
    return ()

"""Many virtual drives with faults drawn by stated rates: how far the localizer errs, how often the vehicle may drive.

Each drive is simulated, localized and judged by itself, from a seed of its own; of each only its figures are kept. The
result depends on the inputs alone, not on who did the drives, or in which order.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from commission.errors import UsageError
from commission.geometry.arrays import FloatArray, IntArray, read_only
from commission.localization import whole_run
from commission.localization.setup import LocalizerSetup
from commission.progress import Progress, silent
from commission.simulation.drive import DriveOptions
from commission.simulation.random_faults import DrawnFaults, FaultRates, carried, draw_faults, walking
from commission.simulation.scenario import start_of, virtual_drive
from commission.simulation.scenario import warm_up as scenario_warm_up
from commission.site.path import legs_of
from commission.site.project import Project
from commission.site.quantity import MILLIMETRES, PERCENT
from commission.site.record_log import RecordLog
from commission.studies.inputs import StudyInput
from commission.studies.run import RunInput, RunResult, judged_run
from commission.studies.shadow_drives import ShadowWorld, needs_beams, shadow_drive
from commission.studies.stanford import StanfordDiagram, merged, stanford
from commission.studies.start import Start, StartOrigin, belief_at
from commission.studies.workers import Threads, Workers

MOST_RUNS = 100_000
ERROR_EDGES: FloatArray = read_only(np.concatenate(([0.0], np.geomspace(1e-5, 1e3, 1601))))
"""Bounds of the bins that errors are counted in [m]: each 1.2 % wider than the one before."""
QUANTILES = (0.5, 0.9, 0.95, 0.99, 0.999, 1.0)
"""Quantiles of the errors that are told."""
PREPARING = 0.05
"""Share of the progress until the first drive."""


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
    stanford: StanfordDiagram | None
    """Its cycles by error and protection level."""
    errors: IntArray
    """Cycles by position error, counted between `ERROR_EDGES`."""
    errors_operational: IntArray
    """The same of the operational ones: what the vehicle was given."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class MonteCarloResult:
    """All drives."""

    inputs: MonteCarloInput
    """What was asked for."""
    drives: tuple[DriveFigures, ...]
    """Each, in the order of their numbers."""

    @property
    def stanford(self) -> StanfordDiagram | None:
        """All cycles by error and protection level."""
        return merged(each.stanford for each in self.drives if each.stanford is not None)

    @property
    def error_quantiles(self) -> FloatArray:
        """Position error [m] that the share `QUANTILES` of all cycles does not exceed: the upper edge of its bin."""
        return quantiles_of(np.sum([each.errors for each in self.drives], axis=0))

    @property
    def operational_error_quantiles(self) -> FloatArray:
        """The same of all operational cycles."""
        return quantiles_of(np.sum([each.errors_operational for each in self.drives], axis=0))

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


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class _Prepared:
    """What all drives read."""

    inputs: MonteCarloInput
    setup: LocalizerSetup
    world: ShadowWorld | None
    starts: dict[str, tuple[FloatArray, FloatArray]]
    durations: dict[str, float]


def monte_carlo(
    inputs: MonteCarloInput, progress: Progress = silent, *, workers: Workers | None = None
) -> MonteCarloResult:
    """Drive, localize and judge.

    Parameters
    ----------
    inputs : site, routes, faults.
    progress : told how far it is; may raise to cancel.
    workers : who does it; this machine's cores when None. The result is the same to the last bit.

    Raises
    ------
    UsageError, ProjectError
        an unknown route, or one that the vehicle cannot drive.
    """
    progress(0.0, "preparing")
    given = _prepared(inputs)
    drives: list[DriveFigures] = []
    for _, figures in (workers or Threads()).each(_one_drive, given, range(inputs.runs)):
        drives.append(figures)
        progress(PREPARING + (1.0 - PREPARING) * len(drives) / inputs.runs, f"{len(drives)} of {inputs.runs} drives")
    return MonteCarloResult(inputs=inputs, drives=tuple(sorted(drives, key=lambda each: each.number)))


def warm_up() -> None:
    """Compile what a drive needs, so that no two threads do at once."""
    scenario_warm_up()
    whole_run.warm_up()


def _prepared(inputs: MonteCarloInput) -> _Prepared:
    project, options = inputs.project, DriveOptions()
    setup = LocalizerSetup.of(project)
    starts, durations = {}, {}
    for name in dict.fromkeys(inputs.routes):
        start = start_of(project, name)
        starts[name] = (start.pose, start.sigmas)
        legs = legs_of(project.route(name), project.vehicle, options.limits)
        durations[name] = sum(float(np.sum(leg.step / np.maximum(leg.speeds, 0.01))) for leg in legs)
    world = None if inputs.by_beams else ShadowWorld.of(project, setup, tuple(starts))
    return _Prepared(inputs=inputs, setup=setup, world=world, starts=starts, durations=durations)


def _one_drive(given: _Prepared, number: int, progress: Progress) -> DriveFigures:
    """Simulate, localize and judge one drive."""
    inputs = given.inputs
    seed, route = inputs.drive_seed(number), inputs.route_of(number)
    faults = draw_faults(inputs.project, inputs.rates, seed, given.durations[route])
    if given.world is None:
        options = DriveOptions(whole_scans=False)
        log = virtual_drive(faults.project, route, seed, options=options, dirt=faults.dirt, progress=progress)
    else:
        progress(0.0, "driving")
        log = shadow_drive(given.world, faults.project, route, seed, dirt=faults.dirt)
    log, put_down = carried(log, inputs.rates, seed)
    result = _localized(given, route, log, progress)
    return _figures(result, (number, seed, route), faults, len(put_down))


def _localized(given: _Prepared, route: str, log: RecordLog, progress: Progress) -> RunResult:
    """The drive as the localizer sees it, which knows the site as it is mapped."""
    pose, sigmas = given.starts[route]
    start = Start(belief_at(log.first_ns, pose, tuple(sigmas.tolist())), StartOrigin.DRIVE)
    run = RunInput.of(given.inputs.project, log, start).with_setup(given.setup)
    return judged_run(run, progress)


def _figures(result: RunResult, which: tuple[int, int, str], faults: DrawnFaults, carried: int) -> DriveFigures:
    """What is kept of a drive."""
    errors, operational = result.position_errors, result.columns.modes == 0
    known, found = np.isfinite(errors), result.statistics
    disturbances = faults.project.disturbances
    return DriveFigures(
        number=which[0],
        seed=which[1],
        route=which[2],
        cycles=result.cycles,
        duration=result.duration,
        operational_fraction=result.operational_fraction,
        lost_fraction=result.lost_fraction,
        fail_episodes=len(result.episodes),
        longest_fail=max((1e-9 * (each.end_ns - each.start_ns) for each in result.episodes), default=0.0),
        position_rmse=math.nan if found is None else found.position_rmse,
        position_max=math.nan if found is None else found.position_max,
        heading_rmse=math.nan if found is None else found.heading_rmse,
        anees=math.nan if found is None else found.anees,
        anees_position=math.nan if found is None else found.anees_position,
        hazardous=0 if found is None else found.wrong_while_operational,
        moved=len(faults.moved),
        missing=len(faults.missing),
        dirty=len(faults.dirt),
        false=len(disturbances.shiny_objects),
        covered=len(disturbances.covered),
        carried=carried,
        stanford=stanford(result),
        errors=_binned(errors[known]),
        errors_operational=_binned(errors[known & operational]),
    )


def _binned(errors: FloatArray) -> IntArray:
    """Cycles between `ERROR_EDGES`; a value on an edge belongs below it, and what is beyond the last into the last."""
    bins = np.clip(np.searchsorted(ERROR_EDGES, errors, side="left") - 1, 0, len(ERROR_EDGES) - 2)
    return read_only(np.bincount(bins, minlength=len(ERROR_EDGES) - 1))


def told(result: MonteCarloResult) -> list[str]:
    """Lines that tell a person what was found.

    Parameters
    ----------
    result : all drives.
    """
    inputs, diagram = result.inputs, result.stanford
    availability = result.column("operational_fraction")
    means = "beam by beam" if inputs.by_beams else "from shadow maps"
    lines = [
        f"Drives       {len(result.drives)} of {result.column('duration').sum() / 3600.0:.2f} h, {means}, "
        f"seed {inputs.seed}",
        f"Available    {PERCENT.of(result.availability):.3f} {PERCENT.unit} of the cycles; worst drive "
        f"{PERCENT.of(availability.min()):.2f} {PERCENT.unit}, "
        f"{np.count_nonzero(availability == 1.0)} drives without any stop",
        f"Stops        {int(result.column('fail_episodes').sum())}, the longest of "
        f"{result.column('longest_fail').max():.1f} s; lost {np.count_nonzero(result.column('lost_fraction'))} drives",
        f"Error        {_listed(result.error_quantiles)}",
        f"Operational  {_listed(result.operational_error_quantiles)}",
        f"ANEES        {result.anees:.2f}, of the position {result.anees_position:.2f} (1 is consistent)",
    ]
    if diagram is None:
        return lines
    verdicts = diagram.verdicts
    return [
        *lines,
        f"Stanford     {_share(verdicts.nominal, verdicts.total)} nominal, "
        f"{_share(verdicts.false_alarm, verdicts.total)} false alarm, {_share(verdicts.true_alarm, verdicts.total)} "
        f"true alarm, {_share(verdicts.misleading, verdicts.total)} misleading, "
        f"{_share(verdicts.hazardous, verdicts.total)} hazardously misleading",
        f"Danger       {verdicts.hazardous} of {verdicts.total} cycles operational with an error beyond "
        f"{MILLIMETRES.text(diagram.limit)}, in {result.hazardous_drives} of {len(result.drives)} drives (with 95 % "
        f"confidence fewer than {PERCENT.of(result.hazardous_bound):.2g} {PERCENT.unit} of all drives)",
    ]


def _share(part: int, total: int) -> str:
    return f"{PERCENT.of(part / total):.3f} {PERCENT.unit}"


def _listed(quantiles: Sequence[float] | FloatArray) -> str:
    """Quantiles in millimetres."""
    names = [f"{PERCENT.of(share):g} {PERCENT.unit}" if share < 1.0 else "all" for share in QUANTILES]
    return ", ".join(
        f"{name} within {MILLIMETRES.text(value, '.1f')}"
        for name, value in zip(names, np.asarray(quantiles).tolist(), strict=True)
    )

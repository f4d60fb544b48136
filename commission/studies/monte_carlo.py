"""Many virtual drives with faults drawn by stated rates: how far the localizer errs, how often the vehicle may drive.

Each drive is simulated, localized and judged by itself, from a seed of its own; of each only its figures are kept. The
result depends on the inputs alone, not on who did the drives, or in which order.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from commission.geometry.arrays import FloatArray
from commission.localization import whole_run
from commission.localization.setup import LocalizerSetup
from commission.progress import Progress, silent
from commission.simulation.drive import DriveOptions
from commission.simulation.people import WalkableFloor
from commission.simulation.random_faults import DrawnFaults, carried, draw_faults
from commission.simulation.scenario import start_of, virtual_drive
from commission.simulation.scenario import warm_up as scenario_warm_up
from commission.site.record_log import RecordLog
from commission.studies.monte_carlo_figures import (
    CycleCounts,
    DriveFigures,
    MonteCarloInput,
    MonteCarloResult,
    counts_of,
    floor_notes,
)
from commission.studies.run import RunInput, RunResult, judged_run
from commission.studies.shadow_drives import ShadowWorld, legs_along, shadow_drive
from commission.studies.start import Start, StartOrigin, belief_at
from commission.studies.workers import Threads, Workers

PREPARING = 0.05
"""Share of the progress until the first drive."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class _Prepared:
    """What all drives read."""

    inputs: MonteCarloInput
    setup: LocalizerSetup
    world: ShadowWorld | None
    floor: WalkableFloor | None
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
    counts = CycleCounts()
    for _, (figures, counted) in (workers or Threads()).each(_one_drive, given, range(inputs.runs)):
        drives.append(figures)
        counts += counted
        progress(PREPARING + (1.0 - PREPARING) * len(drives) / inputs.runs, f"{len(drives)} of {inputs.runs} drives")
    return MonteCarloResult(
        inputs=inputs,
        drives=tuple(sorted(drives, key=lambda each: each.number)),
        counts=counts,
        notes=floor_notes(inputs.project, inputs.rates, given.floor),
    )


def warm_up() -> None:
    """Compile what a drive needs, so that no two threads do at once."""
    scenario_warm_up()
    whole_run.warm_up()


def _prepared(inputs: MonteCarloInput) -> _Prepared:
    project, setup = inputs.project, LocalizerSetup.of(inputs.project)
    legs = legs_along(project, tuple(dict.fromkeys(inputs.routes)))
    starts, durations = {}, {}
    for name, along in legs.items():
        start = start_of(project, name, legs=along)
        starts[name] = (start.pose, start.sigmas)
        durations[name] = sum(float(np.sum(leg.step / np.maximum(leg.speeds, 0.01))) for leg in along)
    world = None if inputs.by_beams else ShadowWorld.of(project, setup, tuple(legs), legs=legs)
    floor = WalkableFloor.of(project) if inputs.rates.false else None
    return _Prepared(inputs=inputs, setup=setup, world=world, floor=floor, starts=starts, durations=durations)


def _one_drive(given: _Prepared, number: int, progress: Progress) -> tuple[DriveFigures, CycleCounts]:
    """Simulate, localize and judge one drive."""
    inputs = given.inputs
    seed, route = inputs.drive_seed(number), inputs.route_of(number)
    faults = draw_faults(inputs.project, inputs.rates, seed, given.durations[route], given.floor)
    if given.world is None:
        kinds = given.setup.parameters
        options = DriveOptions(whole_scans=kinds.contour.enabled or kinds.temporary.enabled)
        log = virtual_drive(faults.project, route, seed, options=options, dirt=faults.dirt, progress=progress)
    else:
        progress(0.0, "driving")
        log = shadow_drive(given.world, faults.project, route, seed, dirt=faults.dirt)
    log, put_down = carried(log, inputs.rates, seed)
    result = _localized(given, route, log, progress)
    return _figures(result, (number, seed, route), faults, len(put_down)), counts_of(result)


def _localized(given: _Prepared, route: str, log: RecordLog, progress: Progress) -> RunResult:
    """The drive as the localizer sees it, which knows the site as it is mapped."""
    pose, sigmas = given.starts[route]
    start = Start(belief_at(log.first_ns, pose, tuple(sigmas.tolist())), StartOrigin.DRIVE)
    run = RunInput.of(given.inputs.project, log, start).with_setup(given.setup)
    return judged_run(run, progress, of_scanners=False)


def _figures(result: RunResult, which: tuple[int, int, str], faults: DrawnFaults, carried: int) -> DriveFigures:
    """What is kept of a drive."""
    found, disturbances = result.statistics, faults.project.disturbances
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
    )

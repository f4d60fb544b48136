"""What the figures of scanners and wheels are, by a recording alone: estimated, judged, and said how surely.

From frozen inputs to a frozen result. A value is proposed where the project's own localizer fits a half of the drive
better with what the other half says; nobody's truth is read.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from commission.geometry.arrays import FloatArray
from commission.localization.setup import LocalizerSetup
from commission.progress import Progress, part, silent
from commission.site.project import Project
from commission.site.quantity import MILLIMETRES, PERCENT
from commission.studies.calibration_constants import MOVED
from commission.studies.calibration_drive import first_run, part_of, problem_of
from commission.studies.calibration_fit import CalibrationFit, CalibrationProblem, fit
from commission.studies.calibration_judging import agreements, best_factor
from commission.studies.calibration_noise import noise_values, noisy, residual_spread
from commission.studies.calibration_noise_verdicts import NoiseJudge
from commission.studies.calibration_values import CalibrationInput, CalibrationVerdict, Value, with_value
from commission.studies.calibration_verdicts import ConstantsJudge

LONGEST_CORRELATION_S = 5.0
"""Residuals farther apart are taken for independent [s]."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Calibration:
    """What a recording says of a project's figures."""

    inputs: CalibrationInput
    """What it was made of."""
    values: tuple[Value, ...]
    """All figures."""
    notes: tuple[str, ...]
    """What else stands out, in words."""
    range_residual: float
    """Standard deviation of the ranges' residuals [m]."""
    bearing_residual: float
    """The same of bearings [rad]."""
    factor: float
    """Multiple of them that the localizer needs, since they are correlated in time."""
    problem: CalibrationProblem
    """What was solved."""
    fit: CalibrationFit
    """Its solution: poses, and which reflector each detection is of."""

    @property
    def proposed(self) -> tuple[Value, ...]:
        """Return the values that are proposed."""
        return tuple(value for value in self.values if value.verdict is CalibrationVerdict.PROPOSED)


def accepted(project: Project, values: Iterable[Value]) -> Project:
    """Return a project with some of the values in it: accept them one by one, or all.

    Parameters
    ----------
    project : the one that was calibrated.
    values : those that are accepted.
    """
    setup = LocalizerSetup.of(project)
    for value in values:
        setup = with_value(setup, value.key, value.proposed)
    return replace(project, reflectors=setup.reflectors, scanners=setup.scanners, parameters=setup.parameters)


def calibrate(inputs: CalibrationInput, progress: Progress = silent) -> Calibration:
    """Estimate the figures of scanners, wheels and map from a drive, and judge each on the half that did not make it.

    Parameters
    ----------
    inputs : recording, start and project.
    progress : told how far it is; may raise to cancel.

    Raises
    ------
    UsageError
        the vehicle is lost in the first run, so that nothing can be said.
    """
    log, belief = inputs.log, inputs.start.belief
    run = first_run(log, inputs.setup, belief, part(progress, 0.0, 0.05))
    # As the first run was made: a vehicle that is not lost is not searched for where a worse value loses it.
    believed = replace(
        inputs, parameters=replace(inputs.parameters, supervisor=run.segments[0].setup.parameters.supervisor)
    )
    setup = believed.setup
    problem = problem_of(log, setup, run)
    whole, noise = estimate(problem, part(progress, 0.05, 0.5))
    halves = _halves(problem, whole, part(progress, 0.5, 0.75))
    progress(0.75, "judging")
    judge = ConstantsJudge(believed, problem, (halves[0].constants, halves[1].constants), noise, run.detected)
    values, found_setup = judge.constants(whole)
    progress(0.9, "noise")
    spread = residual_spread(whole)
    # Detections that the first run had: all of them, those that were not used fit none.
    reflector = np.full(len(run.detected.range_bearing), -1, dtype=np.int64)
    reflector[:] = np.where(run.reflector >= 0, run.reflector, -1)
    # With all constants as found: what the filter considers of them is no noise.
    tried = agreements(log, noisy(found_setup, spread, noise), belief, run.detected, reflector)
    factor = best_factor(tried)
    noise_judge = NoiseJudge(
        log=log,
        start=belief,
        detected=run.detected,
        reflector=reflector,
        setup=found_setup,
        spread=spread,
        spreads=(halves[0].spread, halves[1].spread),
        odometry=(halves[0].odometry, halves[1].odometry),
    )
    verdicts = noise_judge.both(tried, noise)
    found = noise_values(inputs, whole, (spread, noise), factor, verdicts)
    progress(1.0, "")
    return Calibration(
        inputs=inputs,
        values=(*values, *found),
        notes=tuple(_notes(problem, whole, factor)),
        range_residual=float(spread[0]),
        bearing_residual=float(spread[1]),
        factor=factor,
        problem=problem,
        fit=whole,
    )


def estimate(problem: CalibrationProblem, progress: Progress) -> tuple[CalibrationFit, FloatArray]:
    """Fit a drive twice: as if residuals were independent, then with the weight that correlation leaves them.

    Parameters
    ----------
    problem : drive and prior.
    progress : told of each round; may raise to cancel.

    Returns
    -------
    fit : the second one.
    noise : (6,) variances of odometry, of the first one.
    """
    white = fit(problem, part(progress, 0.0, 0.6))
    found = white
    for turn in range(2):
        found = fit(_tempered(problem, white, found), part(progress, 0.6 + 0.2 * turn, 0.8 + 0.2 * turn))
    return replace(found, noise_sigmas=white.noise_sigmas), white.noise[2:]


def _tempered(problem: CalibrationProblem, white: CalibrationFit, found: CalibrationFit) -> CalibrationProblem:
    """Return the problem with variances of detections as large as their effective number says."""
    noise = white.noise.copy()
    noise[:2] = residual_spread(found) ** 2 * _correlation_times(problem, found)
    return replace(problem, noise=noise, fixed_noise=True, start=found.point, reflector=found.reflector)


def _correlation_times(problem: CalibrationProblem, found: CalibrationFit) -> FloatArray:
    """(2,) scans that say as much as one independent scan, of range and bearing: 1 + 2 sum rho, at least 1."""
    drive = problem.drive
    scans, places = len(drive.stamps_ns), len(drive.places)
    seen = found.reflector >= 0
    period = float(np.median(np.diff(drive.stamps_ns))) * 1e-9
    most = max(1, min(round(LONGEST_CORRELATION_S / max(period, 1e-3)), 120, scans // 4))
    times = np.ones(2)
    for column in range(2):
        series = np.zeros((scans, places))
        known = np.zeros((scans, places))
        series[drive.cycle[seen], found.reflector[seen]] = found.residuals[seen, column]
        known[drive.cycle[seen], found.reflector[seen]] = 1.0
        variance = float((series**2).sum() / max(known.sum(), 1.0))
        for lag in range(1, most):
            pairs = float((known[lag:] * known[:-lag]).sum())
            rho = float((series[lag:] * series[:-lag]).sum()) / max(pairs, 1.0) / max(variance, 1e-30)
            if rho < 0.05:
                break
            times[column] += 2.0 * rho
    return times


class _Half(NamedTuple):
    """What half of the drive says alone."""

    constants: FloatArray
    """(p,) with the noise of the whole drive."""
    spread: FloatArray
    """(2,) `residual_spread`."""
    odometry: FloatArray
    """(6,) variances of odometry."""


def _halves(problem: CalibrationProblem, whole: CalibrationFit, progress: Progress) -> tuple[_Half, _Half]:
    """Constants and noise by the first half of the drive alone, and by the second."""
    middle, count = len(problem.drive.stamps_ns) // 2, len(problem.drive.stamps_ns)
    begun = replace(problem, start=whole.point, reflector=whole.reflector, noise=whole.noise, fixed_noise=True)
    first = _half(problem, part_of(begun, 0, middle), part(progress, 0.0, 0.5))
    return first, _half(problem, part_of(begun, middle, count), part(progress, 0.5, 1.0))


def _half(problem: CalibrationProblem, begun: CalibrationProblem, progress: Progress) -> _Half:
    """Fit half of a drive, then its noise, which is believed as it is before the drive."""
    found = fit(begun, part(progress, 0.0, 0.5))
    free = replace(begun, start=found.point, reflector=found.reflector, noise=problem.noise, fixed_noise=False)
    noise = fit(free, part(progress, 0.5, 1.0)).noise[2:]
    return _Half(found.point.constants, residual_spread(found), noise)


def _notes(problem: CalibrationProblem, whole: CalibrationFit, factor: float) -> list[str]:
    """Say what else the drive shows."""
    layout, c = problem.drive.layout, whole.point.constants
    growth, sigma = float(c[layout.range_scale]), float(whole.sigmas[layout.range_scale])
    notes: list[str] = []
    if abs(growth) > MOVED * sigma > 0.0:
        notes.append(
            f"ranges are too long by {PERCENT.text(growth, '.2f')} ± {PERCENT.text(sigma, '.2f')} of the distance and "
            f"{MILLIMETRES.text(float(c[layout.bias]), '+.1f')}; a bias alone is right at "
            f"{float(np.nanmean(whole.ranges)):.1f} m only"
        )
    if factor > 1.3:
        notes.append(
            f"residuals are correlated in time: the localizer needs {factor:.1f} times their standard deviation"
        )
    notes.append(
        "the heading of base is the direction in which the wheels drive: a course error and a turned mounting are alike"
    )
    return notes

"""From a recording to what a calibration solves: scans that are used, a first guess of poses, and priors.

The first run is made with noise that loses no reflector, for the project's figures may be the ones that are wrong.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from commission.errors import UsageError
from commission.geometry import se2
from commission.geometry.angles import wrap
from commission.geometry.arrays import FloatArray, IntArray
from commission.localization import whole_run
from commission.localization.cross_covariance import survey_variance
from commission.localization.detection_log import extract_detections
from commission.localization.detector import INLIER
from commission.localization.estimate import Belief, Status
from commission.localization.odometry import GAP_INTERVALS, LEAST_GAP_NS
from commission.localization.run_columns import RunColumns
from commission.localization.setup import LocalizerSetup
from commission.localization.sweep import sweep_of
from commission.localization.wheel_scale import as_driven
from commission.progress import Progress, silent
from commission.site.record_log import RecordLog
from commission.studies.calibration_fit import CalibrationProblem
from commission.studies.calibration_model import MeasuredDrive, Point, moments, track
from commission.studies.calibration_track import twists_at

MOST_SCANS = 8000
"""Scans that are used: of a longer drive every second or third one; more of them say the same again."""
FIRST_NOISE = (1.0, 2.0, 4.0)
"""Multiples of the noise of a detection by which the first run is tried."""
LEAST_ACCEPTED = 0.5
"""Share of the detections that the first run has to accept."""
FEWEST_DETECTIONS = 200
"""With fewer accepted detections there is nothing to calibrate by."""
WHEEL_PRIOR = (0.02, 0.02, 0.01)
"""1-sigma of the wheels' scale of way and turn, and turn per metre [rad/m]: of a vehicle that drives at all."""
RANGE_SCALE_PRIOR = 0.003
"""1-sigma of the share by which ranges are too long."""


def first_run(log: RecordLog, setup: LocalizerSetup, start: Belief, progress: Progress = silent) -> RunColumns:
    """Localize with the noise of a detection that accepts most of them.

    A vehicle that is lost with too little noise is not searched for, which takes a hundred times as long, unless it is
    lost with every noise: it may have been carried.

    Parameters
    ----------
    log : the recording.
    setup : what the project says.
    start : belief before the first record.
    progress : told how far it is; may raise to cancel.

    Raises
    ------
    UsageError
        the vehicle is lost with any of them: a calibration needs to know where it is, roughly.
    """
    detected = extract_detections(log, setup)
    passed = max(int(np.count_nonzero(detected.status == INLIER)), 1)
    wanted, most = max(LEAST_ACCEPTED * passed, FEWEST_DETECTIONS), 0
    tries = (searching(setup, False), *((setup,) if setup.parameters.supervisor.find_again else ()))
    for index, tried in enumerate(tries):
        runs: list[RunColumns] = []
        for number, factor in enumerate(FIRST_NOISE):
            progress((index + number / len(FIRST_NOISE)) / len(tries), "first run")
            runs.append(whole_run.run(log, _noisier(tried, factor), start, detected=detected))
        accepted = [int(np.count_nonzero(run.status == Status.INLIER)) for run in runs]
        # More noise accepts a little more anyway: only where less of it loses the way is it needed.
        best = next(index for index, count in enumerate(accepted) if count >= 0.97 * max(accepted))
        if accepted[best] >= wanted:
            return runs[best]
        most = max(most, accepted[best])
    raise UsageError(
        f"{most} of {passed} detections fit the reflectors; expected at least half of them and "
        f"{FEWEST_DETECTIONS}: say where the drive begins, or look into the findings of `localize`"
    )


def searching(setup: LocalizerSetup, wanted: bool) -> LocalizerSetup:
    """Return the setup with or without a search where the vehicle is lost."""
    supervisor = replace(setup.parameters.supervisor, find_again=wanted)
    return replace(setup, parameters=replace(setup.parameters, supervisor=supervisor))


def _noisier(setup: LocalizerSetup, factor: float) -> LocalizerSetup:
    """Return the setup with the noise of all detections multiplied."""
    noise = setup.parameters.observation
    louder = replace(noise, range_sigma=factor * noise.range_sigma, bearing_sigma=factor * noise.bearing_sigma)
    scanners = tuple(
        replace(
            each,
            detection_range_sigma=each.detection_range_sigma and factor * each.detection_range_sigma,
            detection_bearing_sigma_deg=each.detection_bearing_sigma_deg and factor * each.detection_bearing_sigma_deg,
        )
        for each in setup.scanners
    )
    return replace(setup, scanners=scanners, parameters=replace(setup.parameters, observation=louder))


def problem_of(log: RecordLog, setup: LocalizerSetup, run: RunColumns) -> CalibrationProblem:
    """Return what is to be solved.

    Parameters
    ----------
    log : the recording.
    setup : what the project says.
    run : a first run over it.
    """
    cycles = _cycles(log, run)
    detected, layout_scanners = run.detected, setup.scanners
    sweeps = [sweep_of(each) for each in layout_scanners]
    bounds = zip(detected.offsets[cycles].tolist(), detected.offsets[cycles + 1].tolist(), strict=True)
    rows = np.concatenate([np.arange(begin, end) for begin, end in bounds])
    counts = detected.offsets[cycles + 1] - detected.offsets[cycles]
    cycle = np.repeat(np.arange(len(cycles)), counts)
    passed = detected.status[rows] == INLIER
    rows, cycle = rows[passed], cycle[passed]
    of = np.array([(sweep.upright, sweep.middle, sweep.seconds_per_rad) for sweep in sweeps])
    scanner = detected.scanners[cycles][cycle]
    reported = detected.range_bearing[rows]
    upright, middle, slope = of[scanner].T
    bias = setup.parameters.observation.range_bias
    drive = MeasuredDrive(
        odometry_ns=log.odometry_stamps_ns,
        displacements=as_driven(log.displacements, setup.parameters.odometry),
        missing=_missing(log, setup),
        stamps_ns=detected.stamps_ns[cycles],
        scanners=detected.scanners[cycles],
        middles=np.array([sweep.seconds_at_middle for sweep in sweeps]),
        mountings=np.array([each.mounting for each in layout_scanners]),
        places=np.array(setup.reflectors.centers),
        cycle=cycle,
        measured=np.stack((reported[:, 0] - bias, upright * reported[:, 1]), axis=1),
        delays=slope * wrap(reported[:, 1] - middle),
    )
    constants = np.zeros(drive.layout.size)
    times = moments(drive, constants)
    twists = twists_at(track(drive, constants), times)
    seconds = (times - drive.stamps_ns)[:, np.newaxis] * 1e-9
    order = np.argsort(times, kind="stable")
    if not np.array_equal(order, np.arange(len(order))):
        drive = _in_order(drive, order)
    poses = se2.compose(run.means[cycles], se2.exp(seconds * twists))[order]
    accepted = np.where(run.status[rows] == Status.INLIER, run.reflector[rows], -1)
    return CalibrationProblem(
        drive=drive,
        start=Point(poses, constants),
        reflector=accepted.astype(np.int64),
        prior=priors(setup, drive),
        noise=noise_of(setup),
    )


def _in_order(drive: MeasuredDrive, order: IntArray) -> MeasuredDrive:
    """Return the drive with its scans in the order in which they were measured."""
    place = np.empty(len(order), dtype=np.int64)
    place[order] = np.arange(len(order))
    return replace(drive, stamps_ns=drive.stamps_ns[order], scanners=drive.scanners[order], cycle=place[drive.cycle])


def _cycles(log: RecordLog, run: RunColumns) -> IntArray:
    """Scans that are used: those that show anything while there is odometry, at most `MOST_SCANS`."""
    first, last = log.odometry_stamps_ns[[0, -1]]
    inside = (run.stamps_ns >= first) & (run.stamps_ns <= last)
    cycles = np.flatnonzero(inside & (np.diff(run.offsets) > 0))
    every = max(1, math.ceil(len(cycles) / MOST_SCANS))
    # Of several scanners that take turns none may be left out.
    scanners = len(np.unique(run.detected.scanners))
    if every > 1 and scanners > 1 and math.gcd(every, scanners) > 1:
        every += 1
    return cycles[::every]


def _missing(log: RecordLog, setup: LocalizerSetup) -> FloatArray:
    """(M,) variance of motion that was not told before each record of odometry [m^2]."""
    periods = np.diff(log.odometry_stamps_ns, prepend=log.odometry_stamps_ns[:1])
    usual = float(np.median(periods[1:])) if len(periods) > 1 else 0.0
    is_gap = periods > max(GAP_INTERVALS * usual, LEAST_GAP_NS)
    speed = setup.parameters.odometry.gap_speed
    return np.where(is_gap, (speed * periods * 1e-9) ** 2 / 3.0, 0.0)


def priors(setup: LocalizerSetup, drive: MeasuredDrive) -> FloatArray:
    """(p,) 1-sigma of each constant, as the project's `uncertainty` has it; 0: it is known exactly."""
    known, layout = setup.uncertainty, drive.layout
    sigmas = np.zeros(layout.size)
    for scanner in range(layout.scanners):
        sigmas[layout.mounting(scanner)] = known.mounting_position, known.mounting_position, known.mounting_heading
        sigmas[layout.clock(scanner)] = known.clock
    sigmas[layout.bias], sigmas[layout.range_scale] = known.range_bias, RANGE_SCALE_PRIOR if known.range_bias else 0.0
    sigmas[layout.wheels : layout.wheels + len(WHEEL_PRIOR)] = WHEEL_PRIOR
    each = [math.sqrt(survey_variance(reflector, known)) for reflector in setup.reflectors.reflectors]
    sigmas[layout.places :] = np.repeat(each, 2)
    return sigmas


def noise_of(setup: LocalizerSetup) -> FloatArray:
    """(8,) variances by the project, in the order of `CalibrationProblem.noise`."""
    seen, driven = setup.parameters.observation, setup.parameters.odometry
    sigmas = (
        *(seen.range_sigma, seen.bearing_sigma, driven.forward_per_sqrt_m, driven.forward_per_sqrt_s),
        *(driven.lateral_per_sqrt_m, driven.heading_per_sqrt_m, driven.heading_per_sqrt_rad),
        driven.heading_per_sqrt_s,
    )
    return np.maximum(np.square(sigmas), LEAST_NOISE)


LEAST_NOISE = 1e-12
"""Variance that a noise of 0 is taken for: its logarithm is estimated."""


def part_of(problem: CalibrationProblem, first: int, last: int) -> CalibrationProblem:
    """Return the problem of some scans.

    Parameters
    ----------
    problem : of the whole drive.
    first, last : scans from `first` to before `last`.
    """
    drive = problem.drive
    rows = (drive.cycle >= first) & (drive.cycle < last)
    cut = replace(
        drive,
        stamps_ns=drive.stamps_ns[first:last],
        scanners=drive.scanners[first:last],
        cycle=drive.cycle[rows] - first,
        measured=drive.measured[rows],
        delays=drive.delays[rows],
    )
    start = Point(problem.start.poses[first:last], problem.start.constants)
    return replace(problem, drive=cut, start=start, reflector=problem.reflector[rows])

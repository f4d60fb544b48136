"""What the figures of scanners and wheels are, by a recording alone: estimated, judged, and said how surely.

From frozen inputs to a frozen result. A value is proposed where the project's own localizer fits a half of the drive
better with what the other half says; nobody's truth is read.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np

from commission.geometry.angles import wrap
from commission.geometry.arrays import FloatArray, frozen
from commission.localization.setup import LocalizerSetup
from commission.progress import Progress, part, silent
from commission.site.parameters import Parameters
from commission.site.project import Project
from commission.site.quantity import DEGREES, MILLIMETRES, MILLISECONDS, PERCENT, Shown
from commission.site.record_log import RecordLog
from commission.site.reflectors import ReflectorMap
from commission.site.scanner import Scanner
from commission.site.uncertainty import Uncertainty
from commission.studies.calibration_drive import first_run, part_of, problem_of
from commission.studies.calibration_fit import CalibrationFit, CalibrationProblem, fit
from commission.studies.calibration_judging import Score, agreements, best_factor, gain, score
from commission.studies.inputs import StudyInput
from commission.studies.start import Start

SHOWN_SHARE = 0.8
"""A constant whose 1-sigma is more than this share of its prior's is not shown by the drive."""
SURE = 2.0
"""A value that differs from the project's by less than so many 1-sigma agrees with it."""
MOVED = 3.0
"""A reflector is wrong from so many 1-sigma on, and from so many of its survey."""
CIRCLE_FIT = 0.0005
"""1-sigma of what the detector itself adds to ranges, unlike at every distance: 0.1 to 0.8 mm in virtual drives [m]."""
COARSE_S = 0.05
"""Interval of odometry from which on its rows may be stamped an interval too early without anybody noticing [s]."""
LONGEST_CORRELATION_S = 5.0
"""Residuals farther apart are taken for independent [s]."""
ODOMETRY = (
    *("forward_per_sqrt_m", "forward_per_sqrt_s", "lateral_per_sqrt_m"),
    *("heading_per_sqrt_m", "heading_per_sqrt_rad", "heading_per_sqrt_s"),
)
"""Noises of odometry, in the order of their variances."""


class CalibrationVerdict(StrEnum):
    """What becomes of a value."""

    PROPOSED = "proposed"
    AGREES = "agrees with the project"
    NOT_SHOWN = "not shown by this drive"
    WORSE = "not proposed: the other half of the drive gets worse"


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class CalibrationInput(StudyInput):
    """All that a calibration depends on."""

    log: RecordLog
    """The recording; its reference is not read."""
    start: Start
    """Belief before the first record."""
    reflectors: ReflectorMap
    """The reflector map."""
    scanners: tuple[Scanner, ...]
    """Mountings and clocks that are believed."""
    parameters: Parameters
    """Tunables that are believed."""
    uncertainty: Uncertainty
    """How well the constants are known before."""

    @staticmethod
    def of(project: Project, log: RecordLog, start: Start) -> CalibrationInput:
        """Take what a calibration reads from a project.

        Parameters
        ----------
        project : what is believed.
        log : the recording.
        start : belief before the first record, and where it comes from.
        """
        return CalibrationInput(
            log=log,
            start=start,
            reflectors=project.reflectors,
            scanners=project.scanners,
            parameters=project.parameters,
            uncertainty=project.uncertainty,
        )

    @property
    def setup(self) -> LocalizerSetup:
        """What the localizer is given today."""
        return LocalizerSetup(
            reflectors=self.reflectors, scanners=self.scanners, parameters=self.parameters, uncertainty=self.uncertainty
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Value:
    """One figure: what the project says, what the drive says, and what becomes of it."""

    key: str
    """Its name: `observation.range_sigma`, `scanners.NAME.mounting.x`, `reflectors.ID.x`."""
    before: float
    """What the project says, SI units and radians."""
    proposed: float
    """What the drive says."""
    sigma: float
    """1-sigma of that; residuals that are correlated in time are allowed for."""
    verdict: CalibrationVerdict
    """What becomes of it."""
    shown: Shown
    """Unit in which people read it."""
    reason: str = ""
    """Why, in words."""
    stretches: tuple[tuple[float, float], ...] = ()
    """Stretches of the drive that say most of it, from and to [s]."""


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
        setup = _with(setup, value.key, value.proposed)
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
    setup, log, belief = inputs.setup, inputs.log, inputs.start.belief
    progress(0.0, "first run")
    run = first_run(log, setup, belief)
    problem = problem_of(log, setup, run)
    whole, noise = _estimate(problem, part(progress, 0.05, 0.5))
    halves = _halves(problem, whole, part(progress, 0.5, 0.75))
    progress(0.75, "judging")
    judge = _Judge(inputs, problem, halves, noise)
    values, found_setup = judge.constants(whole)
    progress(0.9, "noise")
    spread = _spread(whole)
    # Detections that the first run had: all of them, those that were not used fit none.
    reflector = np.full(len(run.detected.range_bearing), -1, dtype=np.int64)
    reflector[:] = np.where(run.reflector >= 0, run.reflector, -1)
    # With all constants as found: what the filter considers of them is no noise.
    quiet = _noisy(found_setup, spread, noise)
    factor = best_factor(agreements(log, quiet, belief, run.detected, reflector))
    found = _noise_values(inputs, whole, noise, spread, factor)
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


def _spread(found: CalibrationFit) -> FloatArray:
    """(2,) standard deviation of the residuals of range [m] and bearing [rad]."""
    return np.sqrt(np.nanmean(found.residuals**2, axis=0))


def _estimate(problem: CalibrationProblem, progress: Progress) -> tuple[CalibrationFit, FloatArray]:
    """Fit a drive twice: as if residuals were independent, then with the weight that correlation leaves them.

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
    noise[:2] = _spread(found) ** 2 * _correlation_times(problem, found)
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


def _halves(problem: CalibrationProblem, whole: CalibrationFit, progress: Progress) -> tuple[FloatArray, FloatArray]:
    """Constants by the first half of the drive alone, and by the second."""
    count = len(problem.drive.stamps_ns)
    begun = replace(problem, start=whole.point, reflector=whole.reflector, noise=whole.noise, fixed_noise=True)
    first = fit(part_of(begun, 0, count // 2), part(progress, 0.0, 0.5))
    second = fit(part_of(begun, count // 2, count), part(progress, 0.5, 1.0))
    return first.point.constants, second.point.constants


class _Judge:
    """Decides value by value, each half of the drive by what the other half says."""

    def __init__(
        self,
        inputs: CalibrationInput,
        problem: CalibrationProblem,
        halves: tuple[FloatArray, FloatArray],
        noise: FloatArray,
    ) -> None:
        self._inputs, self._problem, self._halves, self._noise = inputs, problem, halves, noise
        self._detected = first_run(inputs.log, inputs.setup, inputs.start.belief).detected

    def constants(self, whole: CalibrationFit) -> tuple[list[Value], LocalizerSetup]:
        """Judge every constant, the surest first; return the values and a setup in which all of them are as found."""
        listed = _constants(self._inputs, self._problem, whole)
        order = sorted(range(len(listed)), key=lambda i: -abs(listed[i].shift) / max(listed[i].sigma, 1e-12))
        # With the noise that residuals show, twice: a judge that is lost himself says nothing.
        base = _noisy(self._inputs.setup, 2.0 * _spread(whole), self._noise)
        kept: list[_Constant] = []
        before = self._scores(base, kept)
        verdicts: dict[int, tuple[CalibrationVerdict, str]] = {}
        for index in order:
            each = listed[index]
            if each.hidden:
                verdicts[index] = CalibrationVerdict.NOT_SHOWN, each.hidden
                continue
            if abs(each.shift) < SURE * each.sigma or (each.is_place and not each.is_wrong):
                verdicts[index] = CalibrationVerdict.AGREES, ""
                continue
            after = self._scores(base, [*kept, each])
            gains = [gain(better, worse) for better, worse in zip(after, before, strict=True)]
            told = ", ".join(f"{value:+.4f}" for value, _ in gains)
            reason = f"log-likelihood of a detection in the half that did not make it: {told}"
            if sum(value for value, _ in gains) > 0.0 and all(value > -scatter for value, scatter in gains):
                kept, before = [*kept, each], after
                verdicts[index] = CalibrationVerdict.PROPOSED, "; ".join(filter(None, (each.remark, reason)))
            else:
                verdicts[index] = CalibrationVerdict.WORSE, reason
        setup = self._inputs.setup
        for each in listed:
            setup = _with(setup, each.key, each.before + each.shift)
        stretches = _stretches(self._problem, whole)
        values = [
            Value(
                key=each.key,
                before=each.before,
                proposed=each.before + each.shift,
                sigma=each.sigma,
                verdict=verdicts[index][0],
                shown=each.shown,
                reason=verdicts[index][1],
                stretches=stretches(each.row),
            )
            for index, each in enumerate(listed)
            if not each.is_place or verdicts[index][0] in {CalibrationVerdict.PROPOSED, CalibrationVerdict.WORSE}
        ]
        return values, setup

    def _scores(self, base: LocalizerSetup, chosen: list[_Constant]) -> tuple[Score, Score]:
        """Score the second half by values of the first, and the first half by values of the second."""
        found: list[Score] = []
        for of_half, constants in enumerate(self._halves):
            setup = base
            for each in chosen:
                setup = _with(setup, each.key, each.before + each.of(constants))
            scored = score(self._inputs.log, setup, self._inputs.start.belief, self._detected)
            later = np.arange(len(scored.blocks)) >= len(scored.blocks) // 2
            found.append(scored.part(later if of_half == 0 else ~later))
        return found[0], found[1]


@dataclass(frozen=True, slots=True, kw_only=True)
class _Constant:
    """One constant of the least squares as a figure of the project."""

    key: str
    """See `Value.key`."""
    row: int
    """Where it stands among the constants."""
    before: float
    """What the project says."""
    shift: float
    """What the drive says more."""
    sigma: float
    """1-sigma of that."""
    shown: Shown
    """Unit in which people read it."""
    offset: float = 0.0
    """Part of the constant that is something else."""
    scale: tuple[int, float] | None = None
    """Another constant that adds to it, and how often."""
    hidden: str = ""
    """Why the drive does not show it; empty: it does."""
    remark: str = ""
    """What else is to be said of it."""
    is_place: bool = False
    """Whether it is a coordinate of a reflector."""
    is_wrong: bool = False
    """Whether that reflector stands elsewhere."""

    def of(self, constants: FloatArray) -> float:
        """Return its shift by other constants."""
        more = 0.0 if self.scale is None else float(constants[self.scale[0]]) * self.scale[1]
        return float(constants[self.row]) + more - self.offset


NEEDS = {
    "mounting.x": "mounting x needs turning on the spot; none, or hardly any, in this drive",
    "mounting.y": "mounting y needs turning on the spot or reflectors near by; too few in this drive",
    "mounting.heading": "the heading of the mounting needs metres driven with reflectors in sight; too few here",
    "clock_offset": "a clock needs turns and changes of speed; none, or hardly any, in this drive",
    "observation.range_bias": "a range bias needs reflectors on both sides; they are all on one side of this drive",
    "odometry.forward_scale": "the scale of the way needs metres driven; too few in this drive",
    "odometry.turn_scale": "the scale of turns (wheels apart) needs turns; none, or hardly any, in this drive",
    "odometry.turn_per_m": "a course that is off needs metres driven; too few in this drive",
}
"""What it takes to show each figure."""


def _constants(inputs: CalibrationInput, problem: CalibrationProblem, whole: CalibrationFit) -> list[_Constant]:
    """All constants with their names, in the order of the table."""
    layout, c = problem.drive.layout, whole.point.constants
    odometry = inputs.parameters.odometry
    degrees_per_m = Shown("°/m", DEGREES.scale)
    mean_range = float(np.nanmean(whole.ranges))
    rows: list[tuple[str, str, int, float, Shown]] = []
    for index, scanner in enumerate(inputs.scanners):
        first = layout.mounting(index).start
        name = f"scanners.{scanner.name}"
        for axis, (of, shown) in enumerate((("x", MILLIMETRES), ("y", MILLIMETRES), ("heading", DEGREES))):
            rows.append((f"{name}.mounting.{of}", f"mounting.{of}", first + axis, float(scanner.mounting[axis]), shown))
        rows.append((f"{name}.clock_offset", "clock_offset", layout.clock(index), scanner.clock_offset, MILLISECONDS))
    bias = "observation.range_bias"
    rows.append((bias, bias, layout.bias, inputs.parameters.observation.range_bias, MILLIMETRES))
    names = ("forward_scale", "turn_scale", "turn_per_m")
    for index, (name, shown) in enumerate(zip(names, (PERCENT, PERCENT, degrees_per_m), strict=True)):
        key = f"odometry.{name}"
        rows.append((key, key, layout.wheels + index, getattr(odometry, name), shown))
    listed: list[_Constant] = []
    for key, kind, row, before, shown in rows:
        offset, remark = _early_odometry(inputs, float(c[row])) if kind == "clock_offset" else (0.0, "")
        scale = (layout.range_scale, mean_range) if kind == bias else None
        share = np.zeros(layout.size)
        share[row] = 1.0
        if scale is not None:
            share[scale[0]] = scale[1]
        each = _Constant(
            key=key,
            row=row,
            before=before,
            shift=0.0,
            sigma=math.hypot(whole.sigma_of(share), CIRCLE_FIT if kind == bias else 0.0),
            shown=shown,
            offset=offset,
            scale=scale,
            remark=remark,
            hidden=_hidden(kind, problem, whole, row),
        )
        listed.append(replace(each, shift=each.of(c)))
    return [*listed, *_places(inputs, problem, whole)]


def _hidden(kind: str, problem: CalibrationProblem, whole: CalibrationFit, row: int) -> str:
    """Say what the drive would have to hold to show a constant; empty where it shows it."""
    prior, sigma = float(problem.prior[row]), float(whole.sigmas[row])
    if prior == 0.0:
        return "the project's uncertainty takes it for exact"
    # A project that is contradicted has a wider prior.
    return NEEDS[kind] if whole.information[row] > prior * SHOWN_SHARE * 2.0 and sigma > SHOWN_SHARE * prior else ""


def _places(inputs: CalibrationInput, problem: CalibrationProblem, whole: CalibrationFit) -> list[_Constant]:
    """Places of all reflectors; wrong is one that is far off by its own and by its survey's 1-sigma."""
    layout, listed = problem.drive.layout, list[_Constant]()
    for index, reflector in enumerate(inputs.reflectors.reflectors):
        rows = [layout.places + 2 * index + axis for axis in range(2)]
        shifts, sigmas, priors = whole.point.constants[rows], whole.sigmas[rows], problem.prior[rows]
        wrong = bool(np.any(np.abs(shifts) > MOVED * np.hypot(sigmas, priors)))
        for axis, name in enumerate("xy"):
            listed.append(
                _Constant(
                    key=f"reflectors.{reflector.id}.{name}",
                    row=rows[axis],
                    before=getattr(reflector, name),
                    shift=float(shifts[axis]),
                    sigma=float(sigmas[axis]),
                    shown=MILLIMETRES,
                    is_place=True,
                    is_wrong=wrong,
                )
            )
    return listed


def _early_odometry(inputs: CalibrationInput, offset: float) -> tuple[float, str]:
    """Part of a clock's offset [s] that is rather odometry stamped an interval too early, and what to say of it."""
    intervals = np.diff(inputs.log.odometry_stamps_ns)
    interval = float(np.median(intervals)) * 1e-9 if len(intervals) else 0.0
    if interval < COARSE_S or offset < 0.5 * interval:
        return 0.0, ""
    return interval, (
        f"scans and odometry are {MILLISECONDS.text(offset)} apart; rows of odometry probably hold the motion of the "
        f"{MILLISECONDS.text(interval)} that begin at their stamp (move them on by a row), the rest is the scanner's"
    )


def _stretches(problem: CalibrationProblem, whole: CalibrationFit):
    """Return what tells the stretches that say most of a constant: half of all that is said of it."""
    seconds = (problem.drive.stamps_ns[-1] - problem.drive.stamps_ns[0]) * 1e-9
    length = seconds / max(len(whole.scores), 1)

    def of(row: int) -> tuple[tuple[float, float], ...]:
        said = np.abs(whole.scores[:, row])
        order = np.argsort(-said)[:3]
        return tuple((float(length * i), float(length * (i + 1))) for i in sorted(order.tolist()) if said[i] > 0.0)

    return of


def _noisy(setup: LocalizerSetup, sigmas: FloatArray, odometry: FloatArray) -> LocalizerSetup:
    """Return the setup with other noise: 1-sigmas of range and bearing, variances of odometry."""
    driven = dict(zip(ODOMETRY, np.sqrt(odometry).tolist(), strict=True))
    given = setup.parameters
    parameters = replace(
        given,
        observation=replace(given.observation, range_sigma=float(sigmas[0]), bearing_sigma=float(sigmas[1])),
        odometry=replace(given.odometry, **driven),
    )
    scanners = tuple(
        replace(each, detection_range_sigma=None, detection_bearing_sigma_deg=None) for each in setup.scanners
    )
    return replace(setup, scanners=scanners, parameters=parameters)


def _noise_values(
    inputs: CalibrationInput, whole: CalibrationFit, odometry: FloatArray, spread: FloatArray, factor: float
) -> list[Value]:
    """Noise as figures of the project: what two localizers that see different reflectors need to agree."""
    seen, driven = inputs.parameters.observation, inputs.parameters.odometry
    shown = [MILLIMETRES, DEGREES, *_shown_of_noise()]
    keys = ["observation.range_sigma", "observation.bearing_sigma", *(f"odometry.{name}" for name in ODOMETRY)]
    before = [seen.range_sigma, seen.bearing_sigma, *(getattr(driven, name) for name in ODOMETRY)]
    after = [*(factor * spread).tolist(), *np.sqrt(odometry).tolist()]
    values: list[Value] = []
    for index, key in enumerate(keys):
        # Correlated residuals are as many independent ones as the square of the factor leaves of them.
        relative = 0.5 * factor * float(whole.noise_sigmas[index])
        is_shown = relative < 0.5
        values.append(
            Value(
                key=key,
                before=before[index],
                proposed=after[index],
                sigma=after[index] * relative,
                verdict=CalibrationVerdict.PROPOSED if is_shown else CalibrationVerdict.NOT_SHOWN,
                shown=shown[index],
                reason="" if is_shown else "other noise of the wheels hides it in this drive",
            )
        )
    return values


def _shown_of_noise() -> tuple[Shown, ...]:
    """Units of the noises of odometry."""
    along, turning = MILLIMETRES.scale, DEGREES.scale
    return (
        *(Shown("mm/√m", along), Shown("mm/√s", along), Shown("mm/√m", along)),
        *(Shown("°/√m", turning), Shown("°/√rad", turning), Shown("°/√s", turning)),
    )


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


def _with(setup: LocalizerSetup, key: str, value: float) -> LocalizerSetup:
    """Return the setup with one figure changed; see `Value.key`."""
    group, _, name = key.partition(".")
    if group == "reflectors":
        of, _, axis = name.rpartition(".")
        changed = tuple(
            replace(each, **{axis: value}) if each.id == of else each for each in setup.reflectors.reflectors
        )
        return replace(setup, reflectors=ReflectorMap(changed))
    if group == "scanners":
        return replace(setup, scanners=tuple(_scanner_with(each, name, value) for each in setup.scanners))
    owner = getattr(setup.parameters, group)
    return replace(setup, parameters=replace(setup.parameters, **{group: replace(owner, **{name: value})}))


def _scanner_with(scanner: Scanner, name: str, value: float) -> Scanner:
    """Return the scanner with one figure changed if it is the one that is named."""
    if not name.startswith(f"{scanner.name}."):
        return scanner
    field = name[len(scanner.name) + 1 :]
    if field == "clock_offset":
        return replace(scanner, clock_offset=value)
    mounting = scanner.mounting.copy()
    axis = ("mounting.x", "mounting.y", "mounting.heading").index(field)
    mounting[axis] = float(wrap(value)) if axis == 2 else value
    return replace(scanner, mounting=frozen(mounting, (3,), "mounting"))

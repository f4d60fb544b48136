"""What a localized recording says about its own setup: a mirrored or turned scanner, a range bias, late scans.

The drive is localized again under each suspicion, and what fits far better is named with what cures it. It finds gross
mistakes of a setup (scans late by less than about 80 ms fit as well); fine figures are the business of a calibration.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, fields, replace
from itertools import combinations

import numpy as np

from commission.geometry.angles import wrap
from commission.geometry.arrays import FloatArray, read_only
from commission.localization import whole_run
from commission.localization.detection_log import DetectionLog
from commission.localization.estimate import Belief, Status
from commission.localization.run_columns import RunColumns
from commission.localization.setup import FEWEST_TO_FIND, LocalizerSetup
from commission.localization.state import FilterState
from commission.progress import Progress, silent
from commission.site.disturbances import WheelNoise
from commission.site.quantity import DEGREES, MILLIMETRES, MILLISECONDS, PERCENT
from commission.site.record_log import RecordLog
from commission.site.reflectors import Reflector, ReflectorMap
from commission.site.scanner import Scanner
from commission.studies.consistency_findings import lost_findings
from commission.studies.inputs import StudyInput
from commission.studies.plausibility import Finding
from commission.studies.scanner_figures import scanner_figures
from commission.studies.start import unknown_start_at

JUDGED_CYCLES = 6000
"""Scans from the start of the drive that are localized under each suspicion: four minutes at 25 per second."""
POOR_SHARE = 0.6
"""Share of accepted detections below which the mounting itself is suspected."""
GOOD_SHARE = 0.8
"""Share above which a suspicion is confirmed."""
BETTER = 0.94
"""A suspicion must lower the misfit to this share of what it was."""
SURE = 40.0
"""It must lower the sum of the squared Mahalanobis distances by this much: 6 sigma of one parameter (chi-square)."""
DISAGREEMENT = math.radians(0.25)
"""Difference between the mean bearings of two scanners from which their mountings are suspected [rad]. A smaller error
is shared out by the filter, which gives way to both: it is the business of a calibration."""
FEWEST_SEEN = 100
"""Detections of a scanner below which its mean says nothing."""
_CLIPPED_AT = 4.0
"""A detection counts at most this often the gate: false ones weigh the same under every suspicion."""
_MOUNTINGS = (
    ("mirrored", -1.0, 0.0, "mounted upside down (or the map is mirrored)"),
    ("turned by 90 deg", 1.0, 0.5 * math.pi, "turned to the left"),
    ("turned by -90 deg", 1.0, -0.5 * math.pi, "turned to the right"),
    ("turned by 180 deg", 1.0, math.pi, "turned to the rear"),
)
_BIASES_M = np.arange(-0.12, 0.1201, 0.02)
_LAGS_S = np.arange(-0.4, 0.4001, 0.02)
_SMALLEST_LAG_S = 0.03
_VALLEY = 1.06
"""Lags whose misfit is at most this often the least one are as good: a steady drive hardly tells them apart."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class MisfitInput(StudyInput):
    """All that the study reads."""

    log: RecordLog
    """The recording."""
    setup: LocalizerSetup
    """Reflectors, scanners and parameters of the run."""
    initial: Belief | FilterState
    """Belief or state before the first record."""
    run: RunColumns
    """The run with them."""


@dataclass(frozen=True, slots=True)
class _Fit:
    """How well a drive fits under one suspicion."""

    accepted: float
    """Share of the detector's detections that are accepted [0..1]."""
    worst: float
    """The same of the scanner with the least of it, among those that detect anything."""
    misfit: float
    """Mean squared Mahalanobis distance of all of them to their likeliest reflectors, each clipped."""
    count: int
    """Number of detections."""

    def is_far_better_than(self, other: _Fit) -> bool:
        """Whether this suspicion explains the drive, and the other one does not."""
        gain = self.count * (other.misfit - self.misfit)
        accepts = self.accepted >= max(POOR_SHARE, other.accepted - 0.02)
        return accepts and gain > SURE and self.misfit < BETTER * other.misfit


def misfit(inputs: MisfitInput, progress: Progress = silent) -> tuple[Finding, ...]:
    """Judge whether the recording fits the site much better once the setup is another one.

    Parameters
    ----------
    inputs : the recording and what it is localized with.
    progress : told which suspicion is looked into; may raise to cancel.

    Returns
    -------
    findings : none where the setup fits, or where nothing fits better.
    """
    lost = lost_findings(inputs.run)
    detected = inputs.run.detected.part(0, min(JUDGED_CYCLES, len(inputs.run)))
    if not len(detected.range_bearing):
        return lost
    # A wrong setup is judged by how it fits, not by what a search makes of it.
    inputs = replace(inputs, setup=_tracking(inputs.setup))
    progress(0.0, "as recorded")
    before = _fit(inputs, detected)
    progress(0.1, "mounting")
    mounting = tuple(_mounting(inputs, detected, before)) if before.worst < POOR_SHARE else ()
    if not mounting and before.worst < POOR_SHARE:
        progress(0.2, "mirrored map")
        mounting = tuple(_mirrored_map(inputs, detected, before))
    if mounting:
        return (*lost, *mounting)
    apart = tuple(_disagreement(inputs.run))
    progress(0.3, "range bias")
    biases = tuple(_range_bias(inputs, detected, before))
    progress(0.5, "clock offset")
    lags = tuple(_lag(replace(inputs, setup=trusting(inputs.setup)), detected))
    progress(1.0, "")
    return (*lost, *apart, *biases, *lags)


def _tracking(setup: LocalizerSetup) -> LocalizerSetup:
    """Return the setup with a supervisor that does not search."""
    supervisor = replace(setup.parameters.supervisor, find_again=False)
    return replace(setup, parameters=replace(setup.parameters, supervisor=supervisor))


def _mounting(inputs: MisfitInput, detected: DetectionLog, before: _Fit) -> Iterator[Finding]:
    """Suspect all scanners at once, and where there are several each alone."""
    scanners = range(len(inputs.setup.scanners))
    suspected = [tuple(scanners), *((each,) for each in scanners if len(scanners) > 1)]
    fits: list[tuple[_Fit, tuple[int, ...], tuple[str, float, float, str]]] = []
    for chosen in suspected:
        rows = np.isin(np.repeat(detected.scanners, np.diff(detected.offsets)), chosen)
        for mounting in _MOUNTINGS:
            _, sign, turn, _ = mounting
            seen = np.array(detected.range_bearing)
            seen[rows, 1] = wrap(sign * seen[rows, 1] + turn)
            fits.append((_fit(inputs, replace(detected, range_bearing=read_only(seen))), chosen, mounting))
    best, chosen, (name, sign, turn, meaning) = max(fits, key=lambda fit: fit[0].worst)
    if best.worst < GOOD_SHARE or best.worst < before.worst + 0.2:
        return
    own = inputs.setup.scanners[chosen[0]].name
    what, who = "they", "all scanners are"
    if len(scanners) == 1:
        who = "the scanner is"
    elif len(chosen) == 1:
        what, who = f"those of {own}", f"the scanner {own} is"
    accused = [inputs.setup.scanners[index] for index in chosen]
    if sign > 0.0:
        # Of a scanner that hangs upside down, bearings count the other way.
        if all(one.upside_down for one in accused):
            meaning = next(mean for _, _, other, mean in _MOUNTINGS[1:] if abs(wrap(turn + other)) < 1e-9)
        cures = [
            f"set the heading of {'scanner.mounting' if len(scanners) == 1 else f'the mounting of {one.name}'} "
            f"to {float(wrap(one.mounting[2] + one.upright(np.array(turn)))):+.3f} rad"
            for one in accused
        ]
    else:
        cures = [
            f"set {'scanner.upside_down' if len(scanners) == 1 else f'upside_down of {one.name}'} "
            f"to {str(not one.upside_down).lower()}"
            for one in accused
        ]
        if any(one.upside_down for one in accused):
            meaning = "not mounted as the project says: some are said to hang upside down"
            meaning = "not mounted upside down, as the project says" if len(accused) == 1 else meaning
    yield Finding(
        found=f"{PERCENT.text(before.accepted)} of the detections fit the reflectors, "
        f"{PERCENT.text(best.accepted)} once {what} are {name}",
        probably=f"{who} {meaning}",
        remedy=", ".join(cures),
    )


def _mirrored_map(inputs: MisfitInput, detected: DetectionLog, before: _Fit) -> Iterator[Finding]:
    """Suspect that the map is mirrored: then the vehicle turns the wrong way in it, too, and starts nowhere in it.

    So it is looked for, in the map as it is and in the mirrored one: a wrong start alone fits both, or the first.
    """

    def sought(reflectors: ReflectorMap) -> _Fit:
        parameters = inputs.setup.parameters
        # Walls, tags and zones are those of the map as it is.
        setup = replace(
            inputs.setup,
            reflectors=reflectors,
            floor=None,
            tags=(),
            zones=(),
            parameters=replace(parameters, supervisor=replace(parameters.supervisor, find_again=True)),
        )
        start = unknown_start_at(inputs.log.first_ns, reflectors.centers)
        return _fit(replace(inputs, setup=setup, initial=start.state()), detected)

    if len(inputs.setup.reflectors.reflectors) < FEWEST_TO_FIND:
        return
    mirrored = sought(ReflectorMap(tuple(map(_mirrored, inputs.setup.reflectors.reflectors))))
    if mirrored.worst < GOOD_SHARE or mirrored.worst < sought(inputs.setup.reflectors).worst + 0.2:
        return
    yield Finding(
        found=f"{PERCENT.text(before.accepted)} of the detections fit the reflectors, "
        f"{PERCENT.text(mirrored.accepted)} once the map is mirrored and the vehicle is looked for in it",
        probably="the map is mirrored: its y points down or to the right of x, as in images and some drawings",
        remedy="change the sign of y of all reflectors, and of walls and routes that come from the same source",
    )


def _mirrored(reflector: Reflector) -> Reflector:
    """Return a reflector on the other side of the x axis."""
    heading = None if reflector.heading is None else -reflector.heading
    return replace(reflector, y=-reflector.y, heading=heading)


def _disagreement(run: RunColumns) -> Iterator[Finding]:
    """Say which scanners see the same reflectors in other directions."""
    figures = scanner_figures(run, np.full((len(run), 3), math.nan))
    known = [each for each in figures if math.isfinite(each.bearing_residual) and each.seen >= FEWEST_SEEN]
    for one, other in combinations(known, 2):
        apart = one.bearing_residual - other.bearing_residual
        if abs(apart) < DISAGREEMENT:
            continue
        yield Finding(
            found=f"{one.name} sees the reflectors {DEGREES.text(apart, '+.2f')} from where {other.name} sees them "
            f"({one.accepted} of {one.seen} and {other.accepted} of {other.seen} detections are accepted)",
            probably="one of the two is mounted askew; the filter goes by the one that it began with",
            remedy="measure both mountings; against a reference the residuals of each scanner say which one it is",
        )


def _range_bias(inputs: MisfitInput, detected: DetectionLog, before: _Fit) -> Iterator[Finding]:
    present = inputs.setup.parameters.observation.range_bias

    def fit_of(bias: float) -> _Fit:
        seen = np.array(detected.range_bearing)
        seen[:, 0] -= bias
        return _fit(inputs, replace(detected, range_bearing=read_only(seen)))

    bias, fit = _best(_BIASES_M, fit_of)
    noise = inputs.setup.parameters.observation
    # The scanner with the least noise shows a bias of all first.
    sigma = min(each.detection_sigmas(noise.range_sigma, noise.bearing_sigma)[0] for each in inputs.setup.scanners)
    if abs(bias) < 0.5 * sigma or not fit.is_far_better_than(before):
        return
    yield Finding(
        found=f"ranges are {MILLIMETRES.text(bias, '+.0f')} off on average ({PERCENT.text(before.accepted)} of the "
        f"detections are accepted, {PERCENT.text(fit.accepted)} without that)",
        probably="the scanner has a range bias; reflective tape often causes one",
        remedy=f"observation.range_bias = {present + bias:.3f}",
    )


def trusting(setup: LocalizerSetup) -> LocalizerSetup:
    """Return the setup with odometry that is believed at least as much as that of a good vehicle.

    A filter that gives way to every scan hides that scans and odometry are of different times.
    """
    own, good = setup.parameters.odometry, WheelNoise()
    names = (each.name for each in fields(WheelNoise))
    sharp = replace(own, **{name: min(getattr(own, name), getattr(good, name)) for name in names})
    return replace(setup, parameters=replace(setup.parameters, odometry=sharp))


def _lag(inputs: MisfitInput, detected: DetectionLog) -> Iterator[Finding]:
    before = _fit(inputs, detected)

    def fit_of(lag: float) -> _Fit:
        return _fit(inputs, replace(detected, stamps_ns=read_only(detected.stamps_ns - round(lag * 1e9))))

    fits = [fit_of(float(lag)) for lag in _LAGS_S]
    values = np.array([fit.misfit for fit in fits])
    # The middle of the valley: the least value of a flat one is anywhere in it.
    lag = float(_LAGS_S[values <= _VALLEY * values.min()].mean())
    fit = fit_of(lag)
    if abs(lag) < _SMALLEST_LAG_S or not fit.is_far_better_than(before):
        return
    yield Finding(
        found=f"the scans fit the odometry best when they are taken {MILLISECONDS.text(abs(lag))} "
        f"{'earlier' if lag > 0.0 else 'later'} than stamped (misfit {before.misfit:.2f} becomes {fit.misfit:.2f})",
        probably=f"the scans lag behind the odometry by about {MILLISECONDS.text(lag)}"
        if lag > 0.0
        else f"the odometry lags behind the scans by about {MILLISECONDS.text(-lag)}",
        remedy=_later_clocks(inputs.setup.scanners, lag),
    )


def _later_clocks(scanners: Sequence[Scanner], lag: float) -> str:
    """Say by which clock offsets stamps that are late by `lag` [s] are made good."""
    return ", ".join(
        f"set {'scanner.clock_offset' if len(scanners) == 1 else f'clock_offset of {one.name}'} "
        f"to {one.clock_offset + lag:.3f} s"
        for one in scanners
    )


def _best(candidates: FloatArray, fit_of: Callable[[float], _Fit]) -> tuple[float, _Fit]:
    """Candidate with the least misfit, refined by the parabola through it and its neighbors."""
    fits = [fit_of(float(candidate)) for candidate in candidates]
    values = np.array([fit.misfit for fit in fits])
    index = int(values.argmin())
    if 0 < index < len(values) - 1:
        left, middle, right = values[index - 1 : index + 2]
        curvature = left - 2.0 * middle + right
        if curvature > 0.0:
            step = float(candidates[1] - candidates[0])
            refined = float(candidates[index]) + 0.5 * step * float(left - right) / float(curvature)
            return refined, fit_of(refined)
    return float(candidates[index]), fits[index]


def _fit(inputs: MisfitInput, detected: DetectionLog) -> _Fit:
    run = whole_run.run(inputs.log, inputs.setup, inputs.initial, detected=detected)
    judged = run.status != Status.OUTLIER_DETECTOR
    total = int(np.count_nonzero(judged))
    d2 = np.nan_to_num(run.d2[judged], nan=math.inf)
    count = len(inputs.setup.scanners)
    of = np.repeat(detected.scanners, np.diff(detected.offsets))
    seen = np.bincount(of[judged], minlength=count)
    accepted = np.bincount(of[run.status == Status.INLIER], minlength=count)
    return _Fit(
        accepted=float(accepted.sum()) / max(1, total),
        worst=float(min(accepted[seen > 0] / seen[seen > 0], default=0.0)),
        misfit=float(np.minimum(d2, _CLIPPED_AT * inputs.setup.filter.gate.d2).sum()) / max(1, total),
        count=total,
    )

"""What becomes of each constant: the localizer over a half of the drive, by what the other half says.

Constants alone; noise is not judged by innovations.
"""

from __future__ import annotations

import numpy as np

from commission.geometry.arrays import FloatArray
from commission.localization.detection_log import DetectionLog
from commission.localization.setup import LocalizerSetup
from commission.studies.calibration_constants import CalibratedConstant, calibrated_constants
from commission.studies.calibration_fit import CalibrationFit, CalibrationProblem
from commission.studies.calibration_judging import Score, gain, score
from commission.studies.calibration_noise import noisy, residual_spread
from commission.studies.calibration_values import CalibrationInput, CalibrationVerdict, Value, with_value

SURE = 2.0
"""A value that differs from the project's by less than so many 1-sigma agrees with it."""


class ConstantsJudge:
    """Decides value by value, each half of the drive by what the other half says.

    Parameters
    ----------
    inputs, problem : what the project says, and what was solved.
    halves : constants by the first half of the drive alone, and by the second.
    noise : (6,) variances of odometry.
    detected : detections of the recording.
    """

    def __init__(
        self,
        inputs: CalibrationInput,
        problem: CalibrationProblem,
        halves: tuple[FloatArray, FloatArray],
        noise: FloatArray,
        detected: DetectionLog,
    ) -> None:
        self._inputs, self._problem, self._halves, self._noise = inputs, problem, halves, noise
        self._detected = detected

    def constants(self, whole: CalibrationFit) -> tuple[list[Value], LocalizerSetup]:
        """Judge every constant, the surest first; return the values and a setup in which all of them are as found."""
        listed = calibrated_constants(self._inputs, self._problem, whole)
        order = sorted(range(len(listed)), key=lambda i: -abs(listed[i].shift) / max(listed[i].sigma, 1e-12))
        # With the noise that residuals show, twice: a judge that is lost himself says nothing.
        base = noisy(self._inputs.setup, 2.0 * residual_spread(whole), self._noise)
        kept: list[CalibratedConstant] = []
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
            told = " and ".join(f"{value:+.4f}" for value, _ in gains)
            reason = f"log-likelihood per detection of each half, localized by what the other says: {told}"
            if sum(value for value, _ in gains) > 0.0 and all(value > -scatter for value, scatter in gains):
                kept, before = [*kept, each], after
                verdicts[index] = CalibrationVerdict.PROPOSED, "; ".join(filter(None, (each.remark, reason)))
            else:
                verdicts[index] = CalibrationVerdict.WORSE, reason
        setup = self._inputs.setup
        for each in listed:
            setup = with_value(setup, each.key, each.before + each.shift)
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

    def _scores(self, base: LocalizerSetup, chosen: list[CalibratedConstant]) -> tuple[Score, Score]:
        """Score the second half by values of the first, and the first half by values of the second."""
        found: list[Score] = []
        for of_half, constants in enumerate(self._halves):
            setup = base
            for each in chosen:
                setup = with_value(setup, each.key, each.before + each.of(constants))
            scored = score(self._inputs.log, setup, self._inputs.start.belief, self._detected)
            found.append(scored.half(1 - of_half))
        return found[0], found[1]


def _stretches(problem: CalibrationProblem, whole: CalibrationFit):
    """Return what tells the stretches that say most of a constant: half of all that is said of it."""
    seconds = (problem.drive.stamps_ns[-1] - problem.drive.stamps_ns[0]) * 1e-9
    length = seconds / max(len(whole.scores), 1)

    def of(row: int) -> tuple[tuple[float, float], ...]:
        said = np.abs(whole.scores[:, row])
        order = np.argsort(-said)[:3]
        return tuple((float(length * i), float(length * (i + 1))) for i in sorted(order.tolist()) if said[i] > 0.0)

    return of

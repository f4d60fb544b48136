"""What becomes of the noise that a drive shows: each half of the drive by the noise of the other half.

The noise of a detection is judged by two localizers that see different reflectors: innovations are correlated in time.
That of odometry, which both have in common, by the innovations of one; it was estimated beside the other, and falls
with it.
"""

from __future__ import annotations

from dataclasses import dataclass

from commission.geometry.arrays import FloatArray, IntArray
from commission.localization.detection_log import DetectionLog
from commission.localization.estimate import Belief
from commission.localization.setup import LocalizerSetup
from commission.site.record_log import RecordLog
from commission.studies.calibration_judging import Agreement, Score, agreements, best_factor, gain, score
from commission.studies.calibration_noise import noisy
from commission.studies.calibration_values import NoiseVerdict

LOSS = 1.0
"""A half gets worse when it loses more than so many 1-sigma of what its stretches scatter."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class NoiseJudge:
    """Judges the noise of detections, then that of odometry."""

    log: RecordLog
    """The recording."""
    start: Belief
    """Belief before its first record."""
    detected: DetectionLog
    """Its detections."""
    reflector: IntArray
    """(n,) reflector of each, by the calibration; -1: none."""
    setup: LocalizerSetup
    """With all constants as found, and the noise of the project."""
    spread: FloatArray
    """(2,) standard deviation of the residuals of range [m] and bearing [rad]."""
    spreads: tuple[FloatArray, FloatArray]
    """The same by the first half of the drive alone, and by the second."""
    odometry: tuple[FloatArray, FloatArray]
    """(6,) variances by either half alone."""

    def both(self, tried: tuple[Agreement, ...], odometry: FloatArray) -> tuple[NoiseVerdict, NoiseVerdict]:
        """Judge the noise of a detection, then that of odometry beside it.

        Parameters
        ----------
        tried, odometry : as in `detections`.
        """
        seen = self.detections(tried, odometry)
        if seen.is_worse:
            return seen, NoiseVerdict(is_worse=True, reason="estimated beside that of detections")
        return seen, self.driven(best_factor(tried) * self.spread)

    def detections(self, tried: tuple[Agreement, ...], odometry: FloatArray) -> NoiseVerdict:
        """Judge the noise of a detection.

        Parameters
        ----------
        tried : multiples of it, over the whole drive.
        odometry : (6,) variances by the whole drive.
        """
        before = self._agreement(self.setup)
        if before is None:
            return NoiseVerdict(is_worse=False, reason="too few reflectors to judge it by")
        gains: list[tuple[float, float]] = []
        for half in (0, 1):
            factor = best_factor(tried, half)
            sigmas = factor * self.spread if factor > 1.0 else self.spreads[half]
            after = self._agreement(noisy(self.setup, sigmas, odometry))
            gains.append(gain(after.half(1 - half), before.half(1 - half)) if after else (0.0, 0.0))
        return _verdict(gains, "log-likelihood per scan of two localizers that see different reflectors")

    def _agreement(self, setup: LocalizerSetup) -> Score | None:
        found = agreements(self.log, setup, self.start, self.detected, self.reflector, factors=(1.0,))
        return found[0].score if found else None

    def driven(self, sigmas: FloatArray) -> NoiseVerdict:
        """Judge the noise of odometry.

        Parameters
        ----------
        sigmas : (2,) noise of a detection that is used with it.
        """
        before = score(self.log, noisy(self.setup, sigmas, None), self.start, self.detected)
        gains: list[tuple[float, float]] = []
        for half in (0, 1):
            after = score(self.log, noisy(self.setup, sigmas, self.odometry[half]), self.start, self.detected)
            gains.append(gain(after.half(1 - half), before.half(1 - half)))
        return _verdict(gains, "log-likelihood per detection")


def _verdict(gains: list[tuple[float, float]], of: str) -> NoiseVerdict:
    """Say whether a half gets worse; `gains` are of the second half, then of the first."""
    told = " and ".join(f"{value:+.4f}" for value, _ in gains)
    is_worse = any(value < -LOSS * scatter for value, scatter in gains)
    return NoiseVerdict(is_worse=is_worse, reason=f"{of}, of each half with what the other says: {told}")

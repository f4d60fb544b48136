"""Variants of one drive beside each other: the same detections localized with other parameters, figure by figure.

Runs are compared here and made elsewhere (`run`). A difference is marked where it is larger than what the drive itself
scatters: both runs met the same scans, so that block by block of time their difference is known.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from scipy.special import stdtrit  # pyright: ignore[reportAttributeAccessIssue]

from commission.errors import UsageError
from commission.geometry.arrays import BoolArray, FloatArray, IntArray
from commission.geometry.stretches import stretches_of
from commission.localization.estimate import Mode
from commission.progress import Progress, silent
from commission.site.quantity import MILLIMETRES
from commission.studies.inputs import StudyInput
from commission.studies.run import RunResult
from commission.studies.variant_figures import FIGURES, Aim, VariantFigure

MOST_BLOCKS, FEWEST_BLOCKS = 20, 5
"""Blocks of time that a drive is cut into; of fewer the scatter is not known, and nothing is marked."""
BLOCK_S = 2.0
"""Shortest block [s]: what is correlated from scan to scan stays within one."""
LEVEL = 0.99
"""Probability with which a difference that is chance alone is not marked, two-sided."""
MOST_MOMENTS = 6
NEAREST_S = 2.0
"""Two moments are at least so far apart [s]."""
NEGLIGIBLE = 0.001
"""Estimates that are nearer to each other are the same [m]."""
RULE = (
    f"Marked: the difference to the first column is larger than chance: the drive is cut into up to {MOST_BLOCKS} "
    f"blocks of at least {BLOCK_S:g} s, both runs met the same scans, and the mean difference of the blocks is beyond "
    f"its {LEVEL:.0%} bound by Student's t. Single events (longest, largest) and the time have no such spread."
)
"""By which rule a difference is marked, for a person."""


class Verdict(StrEnum):
    """How a figure of a variant stands to that of the first run."""

    SAME = "same"
    """No difference beyond what the drive scatters."""
    BETTER = "better"
    WORSE = "worse"
    DIFFERENT = "different"
    """A difference that is neither better nor worse by itself."""
    UNJUDGED = "unjudged"
    """A single event, or a drive that is too short: nothing says how far it scatters."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class VariantsInput(StudyInput):
    """All that the study reads."""

    names: tuple[str, ...]
    """Name of each variant."""
    runs: tuple[RunResult, ...]
    """The drive localized with each; the first is what the others are compared with."""

    def __post_init__(self) -> None:
        stamps = self.runs[0].columns.stamps_ns
        for name, run in zip(self.names, self.runs, strict=True):
            if run.inputs.log is not self.runs[0].inputs.log or len(run.columns.stamps_ns) != len(stamps):
                raise UsageError(f"variant {name} is of another drive; expected that of {self.names[0]}")


@dataclass(frozen=True, slots=True, kw_only=True)
class ComparedFigure:
    """One row of the table: a figure of V variants."""

    figure: VariantFigure
    """What it is."""
    values: tuple[float, ...]
    """(V) values in SI units; NaN where undefined."""
    expected: tuple[float, ...]
    """(V) what a consistent filter shows; NaN where the figure has no such value."""
    verdicts: tuple[Verdict, ...]
    """(V) how each stands to the first, which itself is `same`."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DifferingMoment:
    """A moment at which variants differ."""

    time: float
    """When, after the first record [s]."""
    apart: float
    """How far the two estimates are from each other then [m]."""
    between: tuple[str, str]
    """The two variants that differ most."""
    lasts: float = 0.0
    """How long one of them may drive and the other may not [s]; 0 where both may, or neither."""

    def __str__(self) -> str:
        """A few words."""
        if self.lasts > 0.0:
            return f"{self.between[0]} drives, {self.between[1]} not, {self.lasts:.1f} s"
        return f"{self.between[0]}, {self.between[1]} {MILLIMETRES.text(self.apart)} apart"


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class VariantsResult:
    """Variants compared."""

    inputs: VariantsInput
    """What was compared."""
    figures: tuple[ComparedFigure, ...]
    """The table, row by row; figures that need a reference only where the drive has one."""
    moments: tuple[DifferingMoment, ...]
    """Where they differ most, what matters most first."""


def variants(inputs: VariantsInput, progress: Progress = silent) -> VariantsResult:
    """Compare runs of one drive.

    Parameters
    ----------
    inputs : the runs.
    progress : told how far it is; may raise to cancel.
    """
    rows: list[ComparedFigure] = []
    blocks = blocks_of(inputs.runs[0].times)
    shown = [each for each in FIGURES if not each.of_errors or inputs.runs[0].statistics is not None]
    for number, figure in enumerate(shown):
        progress(0.8 * number / len(shown), "comparing variants")
        rows.append(_compared(figure, inputs.runs, blocks))
    progress(0.8, "where variants differ")
    return VariantsResult(inputs=inputs, figures=tuple(rows), moments=differing_moments(inputs))


def blocks_of(times: FloatArray) -> IntArray:
    """(B,) first cycle of each block of time; none where the drive is too short for `FEWEST_BLOCKS`.

    Parameters
    ----------
    times : (K,) array [s], ascending.
    """
    count = min(int((times[-1] - times[0]) / BLOCK_S), MOST_BLOCKS)
    if count < FEWEST_BLOCKS:
        return np.empty(0, dtype=np.int64)
    edges = np.linspace(times[0], times[-1], count + 1)[:-1]
    firsts = np.unique(np.searchsorted(times, edges))
    return firsts if len(firsts) >= FEWEST_BLOCKS else np.empty(0, dtype=np.int64)


def is_beyond_chance(
    one: tuple[FloatArray, FloatArray], other: tuple[FloatArray, FloatArray], blocks: IntArray
) -> bool | None:
    """Whether two ratios of sums over the same cycles differ by more than blocks of time scatter.

    The ratio is linearized (Cochran 1977, section 6.4): a block contributes its numerator less the ratio times its
    denominator. Student's t of the paired differences, `LEVEL` two-sided.

    Parameters
    ----------
    one, other : numerator and denominator of each cycle, (K,) arrays.
    blocks : (B,) first cycle of each block.

    Returns
    -------
    beyond : None where there are too few blocks, or nothing is counted in one of the two.
    """
    if len(blocks) < FEWEST_BLOCKS:
        return None
    means, parts = [], []
    for numerator, denominator in (one, other):
        above, below = np.add.reduceat(numerator, blocks), np.add.reduceat(denominator, blocks)
        total = float(below.sum())
        if total <= 0.0:
            return None
        ratio = float(above.sum()) / total
        means.append(ratio)
        parts.append((above - ratio * below) / (total / len(blocks)))
    difference = means[1] - means[0]
    if not math.isfinite(difference):
        return None
    error = float(np.std(parts[1] - parts[0], ddof=1)) / math.sqrt(len(blocks))
    return abs(difference) > float(stdtrit(len(blocks) - 1, 0.5 + 0.5 * LEVEL)) * error + 1e-12 * abs(means[0])


def _compared(figure: VariantFigure, runs: Sequence[RunResult], blocks: IntArray) -> ComparedFigure:
    """One row of the table."""
    values = tuple(figure.value(run) for run in runs)
    expected = tuple(math.nan if figure.expected is None else figure.expected(run) for run in runs)
    rows = [None if figure.rows is None else figure.rows(run) for run in runs]
    verdicts = [Verdict.SAME]
    for number in range(1, len(runs)):
        verdicts.append(_verdict(figure, (rows[0], rows[number]), blocks, gains_of(figure, values, expected, number)))
        if figure.text(values[number]) == figure.text(values[0]):
            verdicts[number] = Verdict.SAME
    return ComparedFigure(figure=figure, values=values, expected=expected, verdicts=tuple(verdicts))


def gains_of(figure: VariantFigure, values: Sequence[float], expected: Sequence[float], number: int) -> float:
    """How much better a variant is than the first: positive is better; 0 where nothing is better by itself.

    Parameters
    ----------
    figure : what is compared.
    values, expected : (V) its values, and what a consistent filter shows.
    number : index of the variant.
    """
    if figure.aim is Aim.EXPECTED:
        distances = [
            abs(math.log(max(values[index], 1e-300) / expected[index])) if expected[index] > 0.0 else math.nan
            for index in (0, number)
        ]
        return distances[0] - distances[1]
    return {Aim.LOW: -1.0, Aim.HIGH: 1.0, Aim.NONE: 0.0, Aim.EXPECTED: 0.0}[figure.aim] * (values[number] - values[0])


def _verdict(
    figure: VariantFigure,
    rows: tuple[tuple[FloatArray, FloatArray] | None, tuple[FloatArray, FloatArray] | None],
    blocks: IntArray,
    gains: float,
) -> Verdict:
    one, other = rows
    beyond = None if one is None or other is None else is_beyond_chance(one, other, blocks)
    if beyond is None:
        return Verdict.UNJUDGED
    if not beyond:
        return Verdict.SAME
    if figure.aim is Aim.NONE or gains == 0.0 or math.isnan(gains):
        return Verdict.DIFFERENT
    return Verdict.BETTER if gains > 0.0 else Verdict.WORSE


def differing_moments(inputs: VariantsInput) -> tuple[DifferingMoment, ...]:
    """Find where variants differ most: first where one may drive and another may not, then where they are far apart.

    Parameters
    ----------
    inputs : the runs.
    """
    times = inputs.runs[0].times
    found: list[DifferingMoment] = []
    for one, other in itertools.combinations(range(len(inputs.runs)), 2):
        a, b = inputs.runs[one].columns, inputs.runs[other].columns
        apart = np.hypot(*(a.means[:, :2] - b.means[:, :2]).T)
        names = inputs.names[one], inputs.names[other]
        drives = a.modes == Mode.OPERATIONAL, b.modes == Mode.OPERATIONAL
        found += [*_disagreements(times, apart, drives, names), *_peaks(times, apart, names)]
    kept: list[DifferingMoment] = []
    for moment in sorted(found, key=lambda each: (-each.lasts, -each.apart)):
        if all(abs(moment.time - other.time) >= NEAREST_S for other in kept):
            kept.append(moment)
    return tuple(kept[:MOST_MOMENTS])


def _disagreements(
    times: FloatArray, apart: FloatArray, drives: tuple[BoolArray, BoolArray], names: tuple[str, str]
) -> list[DifferingMoment]:
    """Stretches in which one of two variants may drive and the other may not."""
    found = []
    for first, after in stretches_of(drives[0] != drives[1]).tolist():
        between = names if drives[0][first] else (names[1], names[0])
        end = float(times[min(after, len(times) - 1)])
        found.append(
            DifferingMoment(
                time=float(times[first]), apart=float(apart[first]), between=between, lasts=end - float(times[first])
            )
        )
    return [each for each in found if each.lasts > 0.0]


def _peaks(times: FloatArray, apart: FloatArray, names: tuple[str, str]) -> list[DifferingMoment]:
    """The moments at which two variants are farthest apart, not near each other."""
    left, found = np.array(apart), list[DifferingMoment]()
    while len(found) < MOST_MOMENTS:
        index = int(np.argmax(left))
        if not left[index] > NEGLIGIBLE:
            break
        found.append(DifferingMoment(time=float(times[index]), apart=float(apart[index]), between=names))
        left[slice(*np.searchsorted(times, (times[index] - NEAREST_S, times[index] + NEAREST_S)))] = 0.0
        left[index] = 0.0
    return found

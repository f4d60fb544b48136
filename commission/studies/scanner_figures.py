"""What each scanner of a vehicle contributed to a run, and how far its detections lie from where they should.

One scanner that is mounted askew pulls the estimate, or is rejected as a whole: against the estimate the residuals of
the scanners differ, and do not say which one is right. Against a reference only its own residuals grow.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from commission.compiled import compiled
from commission.geometry import se2
from commission.geometry.angles import wrap_scalar
from commission.geometry.arrays import BoolArray, FloatArray, IntArray, read_only
from commission.localization.estimate import Status
from commission.localization.observation import observation_at, observation_model, observation_rows, scanner_offset
from commission.localization.run_columns import RunColumns, RunSegment
from commission.site.quantity import DEGREES, MILLIMETRES

BELONGS = 1.0
"""A detection that lies farther from its reflector [m], seen from reference or estimate, is of something else."""
CYCLES_AT_ONCE = 4096
"""Cycles whose residuals are computed at once: hours of what leads to them need no memory."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ScannerFigures:
    """Figures of one scanner; means are NaN where there is nothing to take them of."""

    name: str
    """Name of the scanner."""
    scans: int
    """Number of its scans."""
    seen: int
    """Detections that the detector passed."""
    accepted: int
    """Detections that corrected the estimate."""
    nis_mean: float
    """Mean squared Mahalanobis distance of the accepted (2 degrees of freedom)."""
    range_residual: float
    """Mean of ranges minus those expected from the estimate after the scan [m], of all detections near their
    reflector: of a scanner that is mounted askew none may be accepted."""
    bearing_residual: float
    """Mean of bearings minus those expected from the estimate after the scan [rad], of the same."""
    reference_range_residual: float
    """Mean of ranges minus those expected from the reference pose [m], of all detections near their reflector."""
    reference_bearing_residual: float
    """Mean of bearings minus those expected from the reference pose [rad], of all detections near their reflector."""


def scanner_figures(columns: RunColumns, references: FloatArray) -> tuple[ScannerFigures, ...]:
    """Figures of each scanner of the last setup of a run.

    Parameters
    ----------
    columns : the run.
    references : (K, 3) reference pose at each cycle [m, m, rad], map frame; NaN where there is none.
    """
    names = [scanner.name for scanner in columns.segments[-1].setup.scanners]
    own, known = (_means_of_near(columns, poses, names) for poses in (columns.means, references))
    return tuple(_figures(name, columns, (own[index], known[index])) for index, name in enumerate(names))


def _means_of_near(columns: RunColumns, poses: FloatArray, names: list[str]) -> list[tuple[float, float]]:
    """Mean residuals [m, rad] of the detections of each scanner that are near their reflector."""
    totals = np.zeros((len(names), 3))
    ends = (*columns.firsts[1:].tolist(), len(columns))
    for segment, end in zip(columns.segments, ends, strict=True):
        setup = segment.setup
        if not len(setup.reflectors):
            continue
        cycles, rows = slice(segment.first, end), slice(columns.offsets[segment.first], columns.offsets[end])
        sums = _sums_of_near(
            read_only(columns.offsets[segment.first : end + 1]),
            read_only(columns.detected.scanners[cycles]),
            read_only(poses[cycles]),
            read_only(columns.range_bearing[rows]),
            read_only(columns.reflector[rows]),
            read_only(setup.reflectors.centers),
            observation_rows([observation_model(each, setup.parameters.observation) for each in setup.scanners]),
        )
        for scanner, found in zip(setup.scanners, sums, strict=True):
            if scanner.name in names:
                totals[names.index(scanner.name)] += found
    return [
        (float(ranges / of), float(bearings / of)) if of else (math.nan, math.nan) for ranges, bearings, of in totals
    ]


@compiled
def _sums_of_near(  # noqa: PLR0917 - columns and tables, array by array
    offsets: IntArray,
    scanners: IntArray,
    poses: FloatArray,
    measured: FloatArray,
    reflectors: IntArray,
    centers: FloatArray,
    models: FloatArray,
) -> FloatArray:
    """(S, 3) sums of the residuals in range [m] and bearing [rad] of what is near its reflector, and how many.

    Parameters
    ----------
    offsets : (K + 1,) first row of each cycle, counted in any way that goes on, and behind the last.
    scanners : (K,) scanner of each cycle.
    poses : (K, 3) pose of base [m, m, rad], map frame; NaN where unknown.
    measured : (n, 2) range [m] and bearing [rad] of each row, scanner frame.
    reflectors : (n,) index of the reflector of each row; negative: nobody's.
    centers : (N, 2) reflector centers [m], map frame.
    models : (S, 6) rows of `observation_rows`.

    Notes
    -----
    Residuals: z - h of equation 2 of Sobreira et al. 2016, less the range bias. Near: hypot(dr, r dphi) < `BELONGS`.
    """
    sums = np.zeros((len(models), 3))
    for k in range(len(scanners)):
        x, y, theta = poses[k, 0], poses[k, 1], poses[k, 2]
        if not math.isfinite(x + y + theta):
            continue
        model = observation_at(models, scanners[k])
        offset_x, offset_y = scanner_offset(theta, model)
        for row in range(offsets[k] - offsets[0], offsets[k + 1] - offsets[0]):
            if reflectors[row] < 0:
                continue
            rx, ry = centers[reflectors[row], 0] - x - offset_x, centers[reflectors[row], 1] - y - offset_y
            distance = math.sqrt(rx * rx + ry * ry)
            along = measured[row, 0] - model.range_bias - distance
            turn = wrap_scalar(measured[row, 1] - math.atan2(ry, rx) + theta + model.mount_theta)
            across = (measured[row, 0] - along) * turn
            if along * along + across * across < BELONGS * BELONGS:
                sums[scanners[k], 0] += along
                sums[scanners[k], 1] += turn
                sums[scanners[k], 2] += 1.0
    return sums


def warm_up() -> None:
    """Compile what sums up residuals."""
    rows, nobody = read_only(np.zeros((0, 2))), read_only(np.zeros(0, dtype=np.int64))
    offsets, models = read_only(np.zeros(1, dtype=np.int64)), read_only(np.zeros((1, 6)))
    _sums_of_near(offsets, nobody, read_only(np.zeros((0, 3))), rows, nobody, rows, models)


def sensors_of(columns: RunColumns, poses: FloatArray, stretch: tuple[RunSegment, int, int]) -> FloatArray:
    """(n, 3) pose of the scanner at each detection of some cycles [m, m, rad], map frame.

    Parameters
    ----------
    columns : the run.
    poses : (B, 3) pose of base in each of these cycles [m, m, rad], map frame.
    stretch : segment, first cycle and the one behind the last.
    """
    segment, first, last = stretch
    mounted = np.array([scanner.mounting for scanner in segment.setup.scanners])
    mountings = mounted[columns.detected.scanners[first:last]]
    return np.repeat(se2.compose(poses, mountings), np.diff(columns.offsets[first : last + 1]), axis=0)


def _stretches(columns: RunColumns) -> Iterator[tuple[RunSegment, int, int]]:
    """Stretches of a few cycles of one segment: first cycle, and the one behind the last."""
    ends = (*columns.firsts[1:].tolist(), len(columns))
    for segment, end in zip(columns.segments, ends, strict=True):
        for first in range(segment.first, end, CYCLES_AT_ONCE):
            yield segment, first, min(first + CYCLES_AT_ONCE, end)


def _cycles_of(columns: RunColumns, name: str) -> BoolArray:
    """(K,) whether each cycle is of the scanner of a name."""
    its = np.zeros(len(columns), dtype=np.bool_)
    for segment, first, last in _stretches(columns):
        known = np.array([scanner.name == name for scanner in segment.setup.scanners])
        its[first:last] = known[columns.detected.scanners[first:last]]
    return its


def _figures(name: str, columns: RunColumns, means: tuple[tuple[float, float], tuple[float, float]]) -> ScannerFigures:
    """Figures of one scanner; `means` are its residuals against the estimate and against the reference."""
    cycles = _cycles_of(columns, name)
    its = np.repeat(cycles, np.diff(columns.offsets))
    accepted = its & (columns.status == Status.INLIER)
    return ScannerFigures(
        name=name,
        scans=int(np.count_nonzero(cycles)),
        seen=int(np.count_nonzero(its & (columns.status != Status.OUTLIER_DETECTOR))),
        accepted=int(np.count_nonzero(accepted)),
        nis_mean=_mean(columns.d2[accepted]),
        range_residual=means[0][0],
        bearing_residual=means[0][1],
        reference_range_residual=means[1][0],
        reference_bearing_residual=means[1][1],
    )


def _mean(values: FloatArray) -> float:
    finite = values[np.isfinite(values)]
    return float(finite.mean()) if len(finite) else math.nan


def residuals_told(figures: ScannerFigures) -> tuple[str, str] | None:
    """Say what residuals are against, and how large: the reference where there is one; None where nothing is known.

    Millimetres and degrees, as is the habit.
    """
    source, ranges, bearings = "reference", figures.reference_range_residual, figures.reference_bearing_residual
    if not math.isfinite(ranges):
        source, ranges, bearings = "estimate", figures.range_residual, figures.bearing_residual
    if not math.isfinite(ranges):
        return None
    return source, f"{MILLIMETRES.text(ranges, '+.1f')}, {DEGREES.text(bearings, '+.2f')}"


def told(figures: ScannerFigures) -> str:
    """One line for a person: what was accepted, and the mean residuals."""
    text, known = f"{figures.accepted} of {figures.seen} accepted", residuals_told(figures)
    return text if known is None else f"{text}, residuals {known[1]} against the {known[0]}"


def figures_entries(figures: tuple[ScannerFigures, ...]) -> list[dict[str, str | int | float | None]]:
    """Entries of `summary.json` under `scanners`, one mapping for each; None where a mean is undefined."""
    return [
        {
            "name": each.name,
            "scans": each.scans,
            "seen": each.seen,
            "accepted": each.accepted,
            "nis_mean": _or_none(each.nis_mean),
            "range_residual_m": _or_none(each.range_residual),
            "bearing_residual_rad": _or_none(each.bearing_residual),
            "reference_range_residual_m": _or_none(each.reference_range_residual),
            "reference_bearing_residual_rad": _or_none(each.reference_bearing_residual),
        }
        for each in figures
    ]


def _or_none(value: float) -> float | None:
    return value if math.isfinite(value) else None

"""What each scanner of a vehicle contributed to a run, and how far its detections lie from where they should.

One scanner that is mounted askew pulls the estimate, or is rejected as a whole: against the estimate the residuals of
the scanners differ, and do not say which one is right. Against a reference only its own residuals grow.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from commission.compiled import compiled, compiled_inline
from commission.geometry import se2
from commission.geometry.arrays import BoolArray, FloatArray, IntArray, read_only
from commission.geometry.directions import UnitVector, composed, direction_of, turn_to
from commission.localization.estimate import Status
from commission.localization.observation import (
    ObservationModel,
    observation_at,
    observation_model,
    observation_rows,
    offset_facing,
)
from commission.localization.run_columns import RunColumns, RunSegment
from commission.site.quantity import DEGREES, MILLIMETRES
from commission.studies.tallies import Tallies, tallies_of

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


def scanner_figures(
    columns: RunColumns, references: FloatArray, tallies: Tallies | None = None
) -> tuple[ScannerFigures, ...]:
    """Figures of each scanner of the last setup of a run that measures ranges.

    Parameters
    ----------
    columns : the run.
    references : (K, 3) reference pose at each cycle [m, m, rad], map frame; NaN where there is none.
    tallies : of its cycles, where they are known.
    """
    names = [scanner.name for scanner in columns.segments[-1].setup.scanners]
    tallies = tallies_of(columns) if tallies is None else tallies
    means = _means_of_near(columns, references, names)
    # What a goniometer tells is no detection: its figures are `bearing_figures`.
    turning = {scanner.name for scanner in columns.segments[-1].setup.scanners if scanner.is_goniometer}
    return tuple(
        _figures(name, columns, tallies, means[index]) for index, name in enumerate(names) if name not in turning
    )


def _means_of_near(columns: RunColumns, references: FloatArray, names: list[str]) -> FloatArray:
    """(S, 2, 2) mean residuals [m, rad] of the detections of each scanner that are near their reflector.

    First against the estimate, then against the reference; NaN where there is none.
    """
    totals = np.zeros((len(names), 2, 3))
    ends = (*columns.firsts[1:].tolist(), len(columns))
    for segment, end in zip(columns.segments, ends, strict=True):
        setup = segment.setup
        if not len(setup.reflectors):
            continue
        cycles, rows = slice(segment.first, end), slice(columns.offsets[segment.first], columns.offsets[end])
        sums = _sums_of_near(
            read_only(columns.offsets[segment.first : end + 1]),
            read_only(columns.detected.scanners[cycles]),
            read_only(columns.means[cycles]),
            read_only(references[cycles]),
            read_only(columns.range_bearing[rows]),
            read_only(columns.reflector[rows]),
            read_only(setup.reflectors.centers),
            observation_rows([observation_model(each, setup.parameters.observation) for each in setup.scanners]),
        )
        for scanner, found in zip(setup.scanners, sums, strict=True):
            if scanner.name in names:
                totals[names.index(scanner.name)] += found
    return np.where(totals[..., 2:] > 0.0, totals[..., :2] / np.maximum(totals[..., 2:], 1.0), math.nan)


@compiled
def _sums_of_near(  # noqa: PLR0917 - columns and tables, array by array
    offsets: IntArray,
    scanners: IntArray,
    means: FloatArray,
    references: FloatArray,
    measured: FloatArray,
    reflectors: IntArray,
    centers: FloatArray,
    models: FloatArray,
) -> FloatArray:
    """(S, 2, 3) sums of residuals in range [m] and bearing [rad] of what is near its reflector, and how many.

    Parameters
    ----------
    offsets : (K + 1,) first row of each cycle, counted in any way that goes on, and behind the last.
    scanners : (K,) scanner of each cycle.
    means, references : (K, 3) poses of base [m, m, rad], map frame, seen from which the sums are; NaN where unknown.
    measured : (n, 2) range [m] and bearing [rad] of each row, scanner frame.
    reflectors : (n,) index of the reflector of each row; negative: nobody's.
    centers : (N, 2) reflector centers [m], map frame.
    models : (S, 6) rows of `observation_rows`.

    Notes
    -----
    Residuals: z - h of equation 2 of Sobreira et al. 2016, less the range bias. Near: hypot(dr, r dphi) < `BELONGS`.
    """
    sums = np.zeros((len(models), 2, 3))
    for k in range(len(scanners)):
        model = observation_at(models, scanners[k])
        own, known = _seat(means, k, model), _seat(references, k, model)
        for row in range(offsets[k] - offsets[0], offsets[k + 1] - offsets[0]):
            if reflectors[row] < 0:
                continue
            x, y = centers[reflectors[row], 0], centers[reflectors[row], 1]
            measured_range, aim = measured[row, 0] - model.range_bias, direction_of(measured[row, 1])
            for which in range(2):
                along, turn = _residual(own if which == 0 else known, measured_range, aim, x, y)
                across = (measured[row, 0] - along) * turn
                if along * along + across * across < BELONGS * BELONGS:
                    sums[scanners[k], which, 0] += along
                    sums[scanners[k], which, 1] += turn
                    sums[scanners[k], which, 2] += 1.0
    return sums


class _Seat(NamedTuple):
    """Place of a scanner [m], map frame, and where it faces; NaN where unknown."""

    x: float
    y: float
    facing: UnitVector


@compiled_inline
def _seat(poses: FloatArray, cycle: int, model: ObservationModel) -> _Seat:
    """Scanner of the base in a cycle."""
    facing = direction_of(poses[cycle, 2])
    offset_x, offset_y = offset_facing(facing, model)
    facing = composed(facing, direction_of(model.mount_theta))
    return _Seat(poses[cycle, 0] + offset_x, poses[cycle, 1] + offset_y, facing)


@compiled_inline
def _residual(seat: _Seat, measured_range: float, aim: UnitVector, x: float, y: float) -> tuple[float, float]:
    """Residual in range [m] and bearing [rad] of a detection of a place; NaN where the scanner's is unknown."""
    rx, ry = x - seat.x, y - seat.y
    distance = math.sqrt(rx * rx + ry * ry)
    inverse = 1.0 / distance if distance > 0.0 else 0.0
    return measured_range - distance, turn_to(rx * inverse, ry * inverse, composed(seat.facing, aim))


def warm_up() -> None:
    """Compile what sums up residuals."""
    rows, nobody = read_only(np.zeros((0, 2))), read_only(np.zeros(0, dtype=np.int64))
    offsets, models, poses = read_only(np.zeros(1, dtype=np.int64)), read_only(np.zeros((1, 6))), np.zeros((0, 3))
    _sums_of_near(offsets, nobody, read_only(poses), read_only(poses), rows, nobody, rows, models)


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


def _figures(name: str, columns: RunColumns, tallies: Tallies, means: FloatArray) -> ScannerFigures:
    """Figures of one scanner; `means` are its residuals against the estimate and against the reference."""
    cycles = _cycles_of(columns, name)
    counts = tallies.counts.sum(axis=0, dtype=np.int64, where=cycles[:, np.newaxis])
    accepted = int(counts[Status.INLIER])
    return ScannerFigures(
        name=name,
        scans=int(np.count_nonzero(cycles)),
        seen=accepted + int(counts[Status.OUTLIER_ASSOCIATION]),
        accepted=accepted,
        nis_mean=float(tallies.accepted_d2[cycles].sum()) / accepted if accepted else math.nan,
        range_residual=float(means[0, 0]),
        bearing_residual=float(means[0, 1]),
        reference_range_residual=float(means[1, 0]),
        reference_bearing_residual=float(means[1, 1]),
    )


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

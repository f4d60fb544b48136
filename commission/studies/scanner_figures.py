"""What each scanner of a vehicle contributed to a run, and how far its detections lie from where they should.

One scanner that is mounted askew pulls the estimate, or is rejected as a whole: against the estimate the residuals of
the scanners differ, and do not say which one is right. Against a reference only its own residuals grow.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from commission.geometry import se2
from commission.geometry.angles import wrap
from commission.geometry.arrays import BoolArray, FloatArray
from commission.localization.estimate import Status
from commission.localization.run_columns import RunColumns
from commission.site.quantity import DEGREES, MILLIMETRES

BELONGS = 1.0
"""A detection that lies farther from its reflector [m], seen from reference or estimate, is of something else."""


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
    cycle_names = _names(columns)
    cycles = np.repeat(np.arange(len(columns)), np.diff(columns.offsets))
    own, known = (_of_near(columns, residuals(columns, poses)) for poses in (columns.means, references))
    return tuple(_figures(name, columns, cycle_names == name, (cycles, own, known)) for name in names)


def _of_near(columns: RunColumns, found: FloatArray) -> FloatArray:
    """Residuals (n, 2) of the detections near their reflector; NaN for the others."""
    expected = columns.range_bearing[:, 0] - found[:, 0]
    with np.errstate(invalid="ignore"):
        near = np.hypot(found[:, 0], expected * found[:, 1]) < BELONGS
    return np.where(near[:, np.newaxis], found, math.nan)


def residuals(columns: RunColumns, poses: FloatArray) -> FloatArray:
    """Measured range and bearing minus those expected of the associated reflector.

    Parameters
    ----------
    columns : the run.
    poses : (K, 3) pose of base in each cycle [m, m, rad], map frame.

    Returns
    -------
    residuals : (n, 2) array [m, rad]; the range bias that the localizer knows is taken off; NaN for nobody.
    """
    found = np.full(columns.range_bearing.shape, math.nan)
    ends = (*columns.firsts[1:].tolist(), len(columns))
    for segment, end in zip(columns.segments, ends, strict=True):
        setup, cycles = segment.setup, slice(segment.first, end)
        rows = slice(int(columns.offsets[segment.first]), int(columns.offsets[end]))
        mountings = np.array([scanner.mounting for scanner in setup.scanners])[columns.detected.scanners[cycles]]
        counts = np.diff(columns.offsets[segment.first : end + 1])
        sensors = np.repeat(se2.compose(poses[cycles], mountings), counts, axis=0)
        reflectors = columns.reflector[rows]
        if not len(setup.reflectors) or not len(reflectors):
            continue
        delta = setup.reflectors.centers[reflectors] - sensors[:, :2]
        measured = columns.range_bearing[rows]
        bias = setup.parameters.observation.range_bias
        ranges = measured[:, 0] - bias - np.hypot(delta[:, 0], delta[:, 1])
        bearings = wrap(measured[:, 1] - np.arctan2(delta[:, 1], delta[:, 0]) + sensors[:, 2])
        found[rows] = np.where((reflectors >= 0)[:, np.newaxis], np.stack((ranges, bearings), axis=1), math.nan)
    return found


def _names(columns: RunColumns) -> np.ndarray:
    """(K,) name of the scanner of each cycle."""
    names = np.empty(len(columns), dtype=object)
    ends = (*columns.firsts[1:].tolist(), len(columns))
    for segment, end in zip(columns.segments, ends, strict=True):
        known = np.array([scanner.name for scanner in segment.setup.scanners], dtype=object)
        names[segment.first : end] = known[columns.detected.scanners[segment.first : end]]
    return names


def _figures(
    name: str, columns: RunColumns, is_its: BoolArray, found: tuple[np.ndarray, FloatArray, FloatArray]
) -> ScannerFigures:
    """Figures of the cycles of one scanner; `found` is the cycle of each detection and both kinds of residuals."""
    cycles, own, known = found
    its = is_its[cycles]
    accepted = its & (columns.status == Status.INLIER)
    return ScannerFigures(
        name=name,
        scans=int(np.count_nonzero(is_its)),
        seen=int(np.count_nonzero(its & (columns.status != Status.OUTLIER_DETECTOR))),
        accepted=int(np.count_nonzero(accepted)),
        nis_mean=_mean(columns.d2[accepted]),
        range_residual=_mean(own[its, 0]),
        bearing_residual=_mean(own[its, 1]),
        reference_range_residual=_mean(known[its, 0]),
        reference_bearing_residual=_mean(known[its, 1]),
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

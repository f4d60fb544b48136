"""Whether detections fit what the filter says of them: over a drive, a stretch of it, or the last second of it.

What the gate accepts looks consistent whatever the filter believes. So every figure of the accepted comes with that of
all, with the share that was rejected, and with how long nothing was accepted.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from commission.geometry.arrays import BoolArray, FloatArray, IntArray, read_only
from commission.geometry.gaussian import truncated_chi_square_mean
from commission.localization.estimate import Status
from commission.localization.run_columns import RunColumns
from commission.studies.tallies import Tallies, tallies_of

DOF = 2
"""Degrees of freedom of a detection: range and bearing."""
RECENT_S = 1.0
"""Time over which the figures of a moment are taken [s]: a single scan has too few detections to say anything."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Consistency:
    """Figures of a stretch of cycles; NaN where there is nothing to take them of."""

    cycles: int
    """Number of cycles."""
    accepted: int
    """Detections that corrected the estimate."""
    rejected: int
    """Detections that the association filter rejected."""
    nis_mean: float
    """Mean squared Mahalanobis distance of the accepted (2 degrees of freedom)."""
    nis_expected: float
    """What that is for a consistent filter: less than 2, as the gate cuts off the tail."""
    nis_before_gate_mean: float
    """Mean squared Mahalanobis distance of all detections that have a reflector near, accepted or not: 2 is consistent,
    as far as what is seen are reflectors of the map."""
    rejected_fraction: float
    """Share of the rejected [0..1]."""
    unseen_fraction: float
    """Share of the cycles without any accepted detection [0..1]."""
    longest_unseen: float
    """Longest time between two accepted detections, or to either end of the stretch [s]."""


def has_distance(columns: RunColumns) -> BoolArray:
    """(n,) whether each detection passed the detector and has a reflector whose distance is known."""
    return np.isfinite(columns.d2) & (columns.status != Status.OUTLIER_DETECTOR)


def consistency(
    columns: RunColumns, first: int = 0, after: int | None = None, *, tallies: Tallies | None = None
) -> Consistency:
    """Figures of the cycles from `first` to the one before `after`; to the last one when None.

    Parameters
    ----------
    columns : the run.
    first, after : bounds of at least one cycle.
    tallies : of these cycles, where they are known.
    """
    after = len(columns) if after is None else after
    tallies = tallies_of(columns, first, after) if tallies is None else tallies
    per_cycle = tallies.counts[:, Status.INLIER]
    accepted, rejected = (int(tallies.counts[:, s].sum()) for s in (Status.INLIER, Status.OUTLIER_ASSOCIATION))
    times = np.asarray((columns.stamps_ns[first:after] - columns.stamps_ns[first]) * 1e-9, dtype=np.float64)
    seen = times[per_cycle > 0]
    # A frame of a camera that looks for tags is no scan, nor a reflex: that it shows no reflector says nothing.
    is_scan = columns.detected.is_scan
    of_scans = per_cycle if is_scan is None else per_cycle[is_scan[first:after]]
    return Consistency(
        cycles=after - first,
        accepted=accepted,
        rejected=rejected,
        nis_mean=_mean(tallies.accepted_d2, accepted),
        nis_expected=_expected(columns, first, after),
        nis_before_gate_mean=_mean(tallies.known_d2, int(tallies.known.sum())),
        rejected_fraction=rejected / (accepted + rejected) if accepted + rejected else math.nan,
        unseen_fraction=float(np.mean(of_scans == 0)) if len(of_scans) else 1.0,
        longest_unseen=float(np.diff(np.concatenate((times[:1], seen, times[-1:]))).max()),
    )


def _expected(columns: RunColumns, first: int, after: int) -> float:
    """Mean NIS of a consistent filter behind its gate; of several gates as often as each is used."""
    ends = np.append(columns.firsts[1:], len(columns))
    cycles = np.clip(ends, first, after) - np.clip(columns.firsts, first, after)
    means = [
        truncated_chi_square_mean(gate.d2 if gate.enabled else math.inf, DOF)
        for gate in (segment.setup.filter.gate for segment in columns.segments)
    ]
    return float(np.average(means, weights=cycles))


class Recent(NamedTuple):
    """Figures over the last second before each of K cycles, that cycle included; NaN where nothing is seen."""

    nis: FloatArray
    """(K,) mean squared Mahalanobis distance of all detections that have a reflector near."""
    rejected: FloatArray
    """(K,) share of the detections that are rejected [0..1]."""


def recent(columns: RunColumns, *, tallies: Tallies | None = None) -> Recent:
    """Figures of each moment of a run.

    Parameters
    ----------
    columns : the run.
    tallies : of all its cycles, where they are known.
    """
    tallies = tallies_of(columns) if tallies is None else tallies
    firsts = np.searchsorted(columns.stamps_ns, columns.stamps_ns - round(RECENT_S * 1e9), side="right")
    nis = _ratio(_until(tallies.known_d2, firsts), _until(tallies.known, firsts))
    outliers = _until(tallies.counts[:, Status.OUTLIER_ASSOCIATION], firsts)
    inliers = _until(tallies.counts[:, Status.INLIER], firsts)
    return Recent(read_only(nis), read_only(_ratio(outliers, inliers + outliers)))


def _until(values: NDArray[Any], firsts: IntArray) -> NDArray[Any]:
    """(K,) sum of a value of each cycle from another cycle on, up to and with each."""
    # Of hours, each column of the cycles is 4 MB: one is filled, and none is copied.
    totals = np.zeros(len(values) + 1, np.int64 if values.dtype == np.int32 else np.float64)
    np.cumsum(values, out=totals[1:])
    return totals[1:] - totals[firsts]


def _ratio(values: NDArray[Any], counts: NDArray[Any]) -> FloatArray:
    """Values by their counts; NaN where nothing is counted."""
    return np.where(counts > 0.0, values / np.maximum(counts, 1.0), math.nan)


def _mean(sums: FloatArray, count: int) -> float:
    return float(sums.sum()) / count if count else math.nan

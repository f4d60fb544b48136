"""What the page remembers of a run: one row per cycle and every detection's place, in arrays made once per drive."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from commission.app.run.view import Accumulated, Series
from commission.geometry.arrays import FloatArray
from commission.localization.estimate import Estimate, Mode, Status

MOST_POINTS = 40_000
"""Accumulated points of each kind that are kept; older ones are thinned out, not cut off."""


@dataclass(frozen=True, slots=True)
class Measured:
    """What is known about a cycle besides its estimate."""

    microseconds: float
    """Time that the localizer took [us]."""
    error: float
    """Position error against the reference [m]; NaN where there is none."""


class PointStore:
    """Points of a whole drive in bounded memory: when full, every second one is dropped and only every second kept."""

    def __init__(self, capacity: int = MOST_POINTS) -> None:
        self._points = np.empty((capacity, 2))
        self._count = 0
        self._stride = 1
        self._skipped = 0

    def add(self, points: FloatArray) -> None:
        """Append (N, 2) points [m]."""
        if len(points) == 0:
            return
        if self._stride > 1:
            offset = (-self._skipped) % self._stride
            self._skipped += len(points)
            points = points[offset :: self._stride]
        if self._count + len(points) > len(self._points):
            kept = self._points[: self._count : 2].copy()
            self._count, self._stride = len(kept), self._stride * 2
            self._points[: self._count] = kept
        room = min(len(points), len(self._points) - self._count)
        self._points[self._count : self._count + room] = points[:room]
        self._count += room

    def points(self) -> FloatArray:
        """Return a copy of the points."""
        return self._points[: self._count].copy()


class History:
    """Rows of one drive, filled cycle by cycle.

    Parameters
    ----------
    cycles : number of scans of the drive.
    start_ns : time that counts as zero [ns].
    """

    def __init__(self, cycles: int, start_ns: int) -> None:
        self._start_ns = start_ns
        self._count = 0
        self._times = np.empty(cycles)
        self._means = np.empty((cycles, 3))
        self._two_sigma = np.empty((cycles, 3))
        self._nis = np.empty(cycles)
        self._counts: NDArray[np.int64] = np.empty((cycles, len(Status)), np.int64)
        self._failed = np.empty(cycles, bool)
        self._microseconds = np.empty(cycles)
        self._error = np.empty(cycles)
        self._inliers, self._outliers = PointStore(), PointStore()

    def __len__(self) -> int:
        """Return the number of cycles so far."""
        return self._count

    def add(self, estimate: Estimate, measured: Measured) -> None:
        """Append one cycle."""
        row = self._count
        self._count += 1
        inlier = estimate.status == Status.INLIER
        self._times[row] = (estimate.stamp_ns - self._start_ns) * 1e-9
        self._means[row] = estimate.posterior.mean
        self._two_sigma[row] = 2.0 * np.sqrt(np.maximum(np.diagonal(estimate.posterior.covariance), 0.0))
        self._nis[row] = estimate.d2[inlier].max() if inlier.any() else 0.0
        self._counts[row] = np.bincount(estimate.status, minlength=len(Status))
        self._failed[row] = estimate.mode is Mode.FAIL
        self._microseconds[row] = measured.microseconds
        self._error[row] = measured.error
        self._inliers.add(estimate.points_map[inlier])
        self._outliers.add(estimate.points_map[~inlier])

    def series(self) -> Series:
        """Return views of the rows so far; rows never change once added."""
        n = self._count
        return Series(
            self._times[:n],
            self._means[:n],
            self._two_sigma[:n],
            self._nis[:n],
            self._counts[:n],
            self._failed[:n],
            self._microseconds[:n],
            self._error[:n],
        )

    def accumulated(self) -> Accumulated:
        """Return every detection's place so far."""
        return Accumulated(self._inliers.points(), self._outliers.points())


def episodes(times: FloatArray, failed: NDArray[np.bool_]) -> tuple[tuple[float, float], ...]:
    """Return start and end [s] of each stretch of cycles in fail mode; one that goes on ends at its last cycle."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], failed.astype(np.int8), [0]])))
    last = len(times) - 1
    return tuple((float(times[a]), float(times[min(b, last)])) for a, b in edges.reshape(-1, 2))

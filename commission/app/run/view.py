"""What the run has come to, as panels and layers draw it: frozen, newest wins."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from commission.geometry.arrays import FloatArray
from commission.localization.estimate import Estimate, Mode


@dataclass(frozen=True, slots=True, eq=False)
class Series:
    """What is known about each cycle of the drive so far; one row per scan, views of the run's own arrays."""

    times: FloatArray
    """(K,) time of each scan after the start of the drive [s]."""
    means: FloatArray
    """(K, 3) estimated pose of base in map [m, m, rad]."""
    two_sigma: FloatArray
    """(K, 3) 2-sigma of x [m], y [m] and heading [rad]."""
    nis: FloatArray
    """(K,) largest squared Mahalanobis distance of the scan's inliers; 0 where there is none."""
    counts: NDArray[np.int64]
    """(K, 3) detections of each `Status`."""
    failed: NDArray[np.bool_]
    """(K,) whether the supervisor was in fail mode."""
    microseconds: FloatArray
    """(K,) time that the localizer took for the cycle [us]."""
    error: FloatArray
    """(K,) position error against the reference [m]; NaN where there is none."""

    def __len__(self) -> int:
        """Return the number of cycles."""
        return len(self.times)


@dataclass(frozen=True, slots=True, eq=False)
class Accumulated:
    """Where detections lay over the drive so far (Sobreira et al. 2016, Fig. 11)."""

    inliers: FloatArray
    """(N, 2) points [m], map frame."""
    outliers: FloatArray
    """(M, 2) points [m], map frame."""


@dataclass(frozen=True, slots=True, eq=False)
class RunView:
    """The run as it is now."""

    time: float
    """Time of the play clock after the start of the drive [s]."""
    duration: float
    """Length of the drive [s]."""
    pose: FloatArray
    """(3,) pose at which the vehicle is drawn: the filter's own [m, m, rad]."""
    covariance: FloatArray
    """(3, 3) its covariance."""
    mode: Mode
    """State of the supervisor."""
    estimate: Estimate | None
    """The newest cycle; none before the first."""
    scan_map: FloatArray
    """(B, 2) end points of the newest scan's beams [m], map frame."""
    gates: FloatArray
    """(R, n, 2) outlines of the validation areas of the reflectors in view [m], map frame."""
    reference: FloatArray | None
    """(3,) reference pose of the newest cycle [m, m, rad], where there is one."""
    references: FloatArray
    """(L, 2) reference positions so far [m], map frame."""
    series: Series
    """Every cycle so far."""
    accumulated: Accumulated | None
    """Every detection so far; none in views that are drawn at the full rate."""
    episodes: tuple[tuple[float, float], ...]
    """Start and end of each fail episode [s]: as lived up to now, as predicted for the rest."""
    seeking: float | None = None
    """Share of a seek that is done [0..1]; none when none is under way."""
    at_end: bool = False
    """Whether the drive is over."""

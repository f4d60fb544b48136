"""What the localizer says after each scan: belief, mode, and what became of every detection. Values only."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from commission.geometry.arrays import FloatArray, IntArray


class Mode(IntEnum):
    """State of the supervisor: of its rule by the covariance (Sobreira et al. 2016, Algorithm 4) and by rejections."""

    OPERATIONAL = 0
    """The vehicle may drive on the estimate."""
    FAIL = 1
    """The covariance is too large, or was so and no detections confirm the pose yet: the output is withheld."""
    LOST = 2
    """Too many detections fit no reflector, however small the covariance is: the output is withheld."""
    INITIALIZING = 3
    """Nobody has said where the vehicle is, and it has not been found yet: there is no output."""


class Status(IntEnum):
    """What became of a detection."""

    INLIER = 0
    OUTLIER_DETECTOR = 1
    OUTLIER_ASSOCIATION = 2


@dataclass(frozen=True, slots=True, eq=False)
class Belief:
    """A Gaussian over the pose of base in map."""

    stamp_ns: int
    """Time that the belief is about [ns]."""
    mean: FloatArray
    """(3,) `T_map_base`: x [m], y [m], theta [rad]."""
    covariance: FloatArray
    """(3, 3) of x [m], y [m], theta [rad]."""


@dataclass(frozen=True, slots=True, eq=False)
class SeenTags:
    """Tags that a camera saw in one frame."""

    sightings: FloatArray
    """(n, 6) x [m], y [m], heading [rad] in the camera's frame, then 1-sigma of each or NaN."""
    ids: tuple[str, ...]
    """(n,) id of each; empty: not read."""
    figures: FloatArray | None
    """(n, 6) what became of each, see `tags`; None: they are not looked at."""


@dataclass(frozen=True, slots=True, eq=False)
class SeenBearing:
    """What one reflex of a goniometer told."""

    bearing: float
    """Bearing as reported [rad], scanner frame; NaN: a whole turn met no reflector."""
    reflector: str
    """Id of the reflector that it is said to be of; empty: nobody says."""
    figures: FloatArray | None
    """(4,) what became of it, see `bearings`; None: bearings are not looked at."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Estimate:
    """One cycle: one scan processed, one frame of a camera that looks for tags, or one reflex of a goniometer."""

    stamp_ns: int
    """Time of the scan [ns]."""
    prior: Belief
    """After *predict*, before any detection of this scan; validation ellipses come from it."""
    posterior: Belief
    """The filter's own state after *correct*; it goes on whatever the mode is."""
    output: Belief
    """What the vehicle is given: the posterior, or while not operational the last one from before (withheld)."""
    mode: Mode
    """State of the supervisor after this scan."""
    detections: FloatArray
    """(N, 2) range [m] and bearing [rad] of each detection or rejected cluster at the stamp, scanner frame, upright."""
    measured: FloatArray
    """(N, 2) the same as the scanner measured them: each at its own time, mirrored where it hangs upside down."""
    beams: IntArray
    """(N,) beams of each cluster; 0 where the sensor itself detected."""
    expected_beams: FloatArray
    """(N,) beams that the likeliest kind of reflector has there; NaN where nobody knows."""
    points_map: FloatArray
    """(N, 2) the detections seen from the posterior [m], map frame."""
    status: NDArray[np.int8]
    """(N,) a `Status` each."""
    reflector: IntArray
    """(N,) index into the reflector map of the associated (or, for an outlier, most likely) reflector; -1: none."""
    d2: FloatArray
    """(N,) squared Mahalanobis distance to that reflector (NIS, 2 degrees of freedom); NaN: none."""
    gate: float
    """Largest squared Mahalanobis distance of an inlier (chi-square, 2 degrees of freedom)."""
    scanner: int = 0
    """Index of the scanner that saw them, in the setup."""
    contours: FloatArray | None = None
    """(12,) what became of the contours of the scan, see `contour`; None: they are not looked at."""
    temporary: FloatArray | None = None
    """(9,) what became of the temporary landmarks in the scan, see `temporary`; None: they are not looked at."""
    tags: SeenTags | None = None
    """What a frame saw of tags; None of a scan or a reflex."""
    bearing: SeenBearing | None = None
    """What a reflex told; None of a scan or a frame."""
    levels: FloatArray | None = None
    """(2,) protection level of position [m] and heading [rad], inf where there is none; None: the supervisor goes by
    2-sigma."""

    def count(self, status: Status) -> int:
        """Return the number of detections of one status."""
        return int(np.count_nonzero(self.status == status))

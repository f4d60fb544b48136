"""Triangulation while the vehicle moves: each bearing has its own time, and goes along until it is used.

Alenya et al. 2005, section II. Between reflexes the range rho_i and the bearing theta_i of a landmark change by

    d rho_i / dt = -(v_1 cos theta_i + v_2 sin theta_i)
    d theta_i / dt = (v_1 sin theta_i - v_2 cos theta_i) / rho_i - d psi / dt

which is a point that stands still, seen from a scanner that moves: over a displacement it is solved exactly by moving
the point. Ranges begin with the last fix, each bearing with its own last reflex, as in the paper's integrals.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from commission.compiled import compiled
from commission.geometry import se2
from commission.geometry.angles import wrap_scalar
from commission.geometry.arrays import FloatArray, IntArray
from commission.localization.odometry import OdometryNoise
from commission.localization.triangulation import (
    NOWHERE,
    fix_covariance,
    intersect_circles,
    most_informative,
)

NEAREST = 1e-3
"""Range below which a bearing is not evolved [m]."""


@compiled
def evolve(ranges: FloatArray, bearings: FloatArray, dx: float, dy: float, dtheta: float) -> None:
    """Move ranges and bearings of landmarks along with the scanner, in place.

    Parameters
    ----------
    ranges, bearings : (N,) [m] and [rad], scanner frame; NaN where a landmark was not seen.
    dx, dy, dtheta : displacement of the scanner, in its frame before [m, m, rad].

    Notes
    -----
    p' = R(dtheta)^T (p - d): integral of the paper's evolution (section II) over a displacement,
    by definition.
    """
    for i in range(len(ranges)):
        x, y = ranges[i] * math.cos(bearings[i]) - dx, ranges[i] * math.sin(bearings[i]) - dy
        ranges[i] = max(math.sqrt(x * x + y * y), NEAREST)
        bearings[i] = wrap_scalar(math.atan2(y, x) - dtheta)


@dataclass(frozen=True, slots=True, kw_only=True)
class TriangulatedFix:
    """A pose by three bearings at the time of the last of them."""

    pose: FloatArray
    """(3,) `T_map_base` [m, m, rad]."""
    covariance: FloatArray
    """(3, 3) of the pose, by the noise of the three bearings and of odometry since each."""
    chosen: IntArray
    """(3,) landmarks, indices into the map."""


class DynamicTriangulation:
    """The goniometer's positioning: reflexes and displacements in, a fix at each reflex out.

    Parameters
    ----------
    landmarks : (N, 2) [m], map frame.
    mounting : (3,) `T_base_scanner` [m, m, rad].
    bearing_sigma : 1-sigma of a bearing [rad].
    noise : of odometry: what bearings that wait lose.
    memory : how long a reflex is used [s]: one and a half turns of the goniometer, so that one may be missed.
    """

    def __init__(
        self, landmarks: FloatArray, mounting: FloatArray, bearing_sigma: float, *, noise: OdometryNoise, memory: float
    ) -> None:
        self._landmarks = np.ascontiguousarray(landmarks, dtype=np.float64)
        self._mounting = np.asarray(mounting, dtype=np.float64)
        self._back = se2.inverse(self._mounting)
        self._variance, self._noise, self._memory_ns = bearing_sigma**2, noise, round(memory * 1e9)
        N = len(landmarks)
        self._ranges, self._bearings = np.full(N, np.nan), np.full(N, np.nan)
        self._stamps = np.zeros(N, np.int64)
        self._moved, self._across = np.zeros(N), np.zeros(N)
        self._T_map_scanner = np.zeros(3)

    def start(self, T_map_base: FloatArray) -> None:
        """Begin at a pose: ranges begin with it, no bearing is known yet."""
        self._T_map_scanner = se2.compose(T_map_base, self._mounting)
        self._bearings[:] = np.nan
        self._ranges = np.hypot(*(self._landmarks - self._T_map_scanner[:2]).T)

    @property
    def pose(self) -> FloatArray:
        """(3,) `T_map_base` by the last fix and the motion since then."""
        return se2.compose(self._T_map_scanner, self._back)

    def expected(self) -> tuple[FloatArray, FloatArray]:
        """(N,) range [m] and bearing [rad] of every landmark from the pose of now, scanner frame."""
        away = se2.transform_points(se2.inverse(self._T_map_scanner), self._landmarks)
        return np.hypot(away[:, 0], away[:, 1]), np.arctan2(away[:, 1], away[:, 0])

    def move(self, displacement: FloatArray, seconds: float) -> None:
        """Go along with a displacement of base, in base before it [m, m, rad], that took some time [s]."""
        here = se2.compose(se2.compose(self._back, displacement), self._mounting)
        self._T_map_scanner = se2.compose(self._T_map_scanner, here)
        seen = np.isfinite(self._bearings)
        if seen.any():
            ranges, bearings = self._ranges[seen], self._bearings[seen]
            evolve(ranges, bearings, *map(float, here))
            self._ranges[seen], self._bearings[seen] = ranges, bearings
        way, turn = math.hypot(*displacement[:2]), abs(float(displacement[2]))
        n = self._noise
        along = n.forward_per_m * way + n.forward_per_s * seconds
        self._across += max(along, n.lateral_per_m * way)
        self._moved += n.heading_per_m * way + n.heading_per_rad * turn + n.heading_per_s * seconds

    def reflex(self, landmark: int, stamp_ns: int, bearing: float) -> TriangulatedFix | None:
        """Take a reflex in, and give the fix at its time; None where no three bearings tell one.

        Parameters
        ----------
        landmark : which one.
        stamp_ns : its own time [ns].
        bearing : [rad], scanner frame.
        """
        distances, _ = self.expected()
        fresh = np.isfinite(self._bearings)
        self._ranges = np.where(fresh, self._ranges, distances)
        self._bearings[landmark], self._stamps[landmark] = bearing, stamp_ns
        self._moved[landmark], self._across[landmark] = 0.0, 0.0
        self._bearings[stamp_ns - self._stamps > self._memory_ns] = np.nan
        known = np.isfinite(self._bearings)
        if np.count_nonzero(known) < 3:
            return None
        spread = self._moved + self._across / np.square(np.maximum(self._ranges, NEAREST))
        variances = np.where(known, self._variance + spread, NOWHERE)
        return self._fix(np.ascontiguousarray(self._landmarks - self._T_map_scanner[:2]), variances)

    def _fix(self, points: FloatArray, variances: FloatArray) -> TriangulatedFix | None:
        """Fix by the three most informative landmarks, seen from where the vehicle is expected."""
        # By arrangement alone, as the paper: ages of reflexes would make the choice flicker between equals.
        chosen, _ = most_informative(points, np.where(variances < NOWHERE, self._variance, NOWHERE))
        if chosen[0] < 0:
            return None
        landmarks = self._landmarks[chosen]
        fix = intersect_circles(landmarks, self._bearings[chosen])
        if not fix.is_fix:
            return None
        is_regular, covariance = fix_covariance(landmarks, fix.x, fix.y, variances[chosen])
        if not is_regular:
            return None
        self._T_map_scanner = np.array([fix.x, fix.y, fix.theta])
        # The paper's ranges begin anew with each fix; bearings are those of their own reflexes.
        self._ranges = np.hypot(*(self._landmarks - self._T_map_scanner[:2]).T)
        pose = self.pose
        # Base moves by (-offset_y, offset_x) per radian of the scanner's heading.
        J = np.eye(3)
        J[:2, 2] = fix.y - pose[1], pose[0] - fix.x
        return TriangulatedFix(pose=pose, covariance=J @ covariance @ J.T, chosen=chosen)

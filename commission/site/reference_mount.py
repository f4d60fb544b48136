"""Where on the vehicle a reference system measures, and how late its clock is: what its poses are poses of.

A tracker's prism or a GNSS antenna is not where the vehicle's base is, and it has a clock of its own.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from commission.geometry.arrays import FloatArray, IntArray
from commission.site.quantity import Bounds

FARTHEST_ARM = 50.0
"""Distance from the vehicle's base beyond which no antenna is [m]."""
LATEST = 3600.0
"""Offset beyond which clocks are not those of one recording [s]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ReferenceMount:
    """How the poses of a recording's reference were measured."""

    antenna: tuple[float, ...] = (0.0, 0.0)
    """Point whose position the reference measures: x, y and, if anybody says so, z in the base frame [m]. Its heading,
    where it has one, is the vehicle's."""
    clock_offset: float = 0.0
    """How much later than they were measured its poses are stamped [s]."""

    def __post_init__(self) -> None:
        if len(self.antenna) not in (2, 3):
            raise ValueError(f"reference.antenna has {len(self.antenna)} numbers; expected x, y and maybe z [m]")
        for number in self.antenna:
            Bounds.between(-FARTHEST_ARM, FARTHEST_ARM).check(number, "reference.antenna", "m")
        Bounds.between(-LATEST, LATEST).check(self.clock_offset, "reference.clock_offset", "s")

    @property
    def is_at_base(self) -> bool:
        """Whether the reference measures the place of base itself."""
        return self.antenna[0] == 0.0 and self.antenna[1] == 0.0

    def true_stamps(self, stamps_ns: IntArray) -> IntArray:
        """(R,) when poses with these stamps were measured [ns]."""
        return stamps_ns - round(self.clock_offset * 1e9)

    def arms(self, headings: FloatArray) -> FloatArray:
        """(N, 2) from base to the antenna of a vehicle with these headings [rad]: [m], map frame."""
        x, y = self.antenna[:2]
        c, s = np.cos(headings), np.sin(headings)
        return np.stack((c * x - s * y, s * x + c * y), axis=-1)

    def at_base(self, poses: FloatArray, headings: FloatArray | None = None) -> FloatArray:
        """Poses of base (R, 3) of poses that were measured at the antenna.

        Parameters
        ----------
        poses : (R, 3) array [m, m, rad], map frame; a heading may be NaN.
        headings : (R,) those taken instead of the unknown ones [rad]; without, such rows stay where the antenna is.
        """
        if self.is_at_base:
            return poses
        found = poses.copy()
        known = poses[:, 2] if headings is None else np.where(np.isnan(poses[:, 2]), headings, poses[:, 2])
        arms = self.arms(known)
        found[:, :2] -= np.where(np.isfinite(arms), arms, 0.0)
        return found

    def at_antenna(self, covariances: FloatArray, headings: FloatArray) -> FloatArray:
        """Covariances (N, 3, 3) of the antenna's place and the heading, of those of base.

        Parameters
        ----------
        covariances : (N, 3, 3) of x [m], y [m] and heading [rad] of base.
        headings : (N,) of the vehicle [rad].

        Notes
        -----
        J P J^T with the antenna at p + R(theta) a: its derivative to the heading is R(theta) a turned by 90 degrees.
        """
        if self.is_at_base:
            return covariances
        jacobians = np.tile(np.eye(3), (len(headings), 1, 1))
        arms = self.arms(headings)
        jacobians[:, 0, 2], jacobians[:, 1, 2] = -arms[:, 1], arms[:, 0]
        return jacobians @ covariances @ jacobians.transpose(0, 2, 1)

    def told(self) -> str:
        """Say it in words: where the antenna is, and how late its clock."""
        places = ", ".join(f"{number:g}" for number in self.antenna)
        return f"antenna at {places} m in the base frame, clock {self.clock_offset:g} s late"


BASE = ReferenceMount()
"""A reference that measures base itself, by the recording's clock."""

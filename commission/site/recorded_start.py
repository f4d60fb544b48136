"""Where a vehicle was said to be when its recording began. What a run starts with is made of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from commission.geometry.arrays import FloatArray, frozen


@dataclass(frozen=True, slots=True, eq=False)
class RecordedStart:
    """Pose of base before the first record, and how well it is known."""

    pose: FloatArray
    """(3,) `T_map_base`: x [m], y [m], theta [rad]."""
    covariance: FloatArray
    """(3, 3) of it, symmetric and positive definite."""
    sought: bool = False
    """Whether the vehicle looked where it is: pose and covariance are then as wide as the floor."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "pose", frozen(self.pose, (3,), "pose"))
        covariance = frozen(self.covariance, (3, 3), "covariance")
        if not np.array_equal(covariance, covariance.T) or np.linalg.eigvalsh(covariance)[0] <= 0.0:
            raise ValueError("covariance is none; expected a symmetric, positive definite matrix")
        object.__setattr__(self, "covariance", covariance)

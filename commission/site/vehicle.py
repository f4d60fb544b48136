"""Kinds of vehicle: their wheels and outline as plain values. Kinematics live in `localization.kinematics`."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TypeAlias

from commission.site.checks import above, between

DEFAULT_OUTLINE = ((0.5, 0.3), (-0.5, 0.3), (-0.5, -0.3), (0.5, -0.3))


def _check_outline(outline: tuple[tuple[float, float], ...]) -> None:
    if len(outline) < 3 or not all(math.isfinite(c) for corner in outline for c in corner):
        raise ValueError(f"vehicle.outline has {len(outline)} corners; expected 3 or more finite [x, y] in metres")


@dataclass(frozen=True, slots=True)
class DifferentialVehicle:
    """Two driven wheels on one axle; base is the middle of the axle."""

    wheel_separation: float = 0.4
    """Distance between the two driven wheels [m]."""
    outline: tuple[tuple[float, float], ...] = DEFAULT_OUTLINE
    """Corners of the vehicle's outline, base frame [m]."""
    height: float = 0.4
    """Height of the vehicle [m], for the 3D view."""

    kind = "differential"

    def __post_init__(self) -> None:
        above(self.wheel_separation, 0.0, "vehicle.wheel_separation", "m")
        _check_outline(self.outline)


@dataclass(frozen=True, slots=True)
class TricycleVehicle:
    """One driven and steered wheel ahead of a fixed axle; base is the middle of the axle."""

    wheelbase: float = 1.2
    """Distance from the fixed axle to the steered wheel [m]; negative when the steered wheel is behind."""
    max_steering_deg: float = 75.0
    """Largest steering angle to either side [deg]."""
    outline: tuple[tuple[float, float], ...] = (
        (1.5, 0.4),
        (-0.4, 0.4),
        (-0.4, -0.4),
        (1.5, -0.4),
    )
    """Corners of the vehicle's outline, base frame [m]."""
    height: float = 0.6
    """Height of the vehicle [m], for the 3D view."""

    kind = "tricycle"

    def __post_init__(self) -> None:
        above(abs(self.wheelbase), 0.0, "vehicle.wheelbase (absolute value)", "m")
        between(self.max_steering_deg, (1.0, 90.0), "vehicle.max_steering_deg", "deg")
        _check_outline(self.outline)


@dataclass(frozen=True, slots=True, kw_only=True)
class OmnidirectionalVehicle:
    """Omnidirectional wheels around the base, each rolling at a right angle to its spoke (Dixon et al. 2010)."""

    wheel_angles_deg: tuple[float, ...] = (0.0, 90.0, 180.0, 270.0)
    """Angle alpha_i of each wheel's spoke, base frame [deg]."""
    wheel_radius: float = 0.05
    """Radius r of the wheels [m]."""
    center_distance: float = 0.3
    """Distance R from the base to each wheel [m]."""
    outline: tuple[tuple[float, float], ...] = DEFAULT_OUTLINE
    """Corners of the vehicle's outline, base frame [m]."""
    height: float = 0.4
    """Height of the vehicle [m], for the 3D view."""

    kind = "omnidirectional"

    def __post_init__(self) -> None:
        if len({round(a % 360.0, 9) for a in self.wheel_angles_deg}) < 3:
            raise ValueError(
                f"vehicle.wheel_angles_deg is {list(self.wheel_angles_deg)}; expected 3 or more different angles"
            )
        above(self.wheel_radius, 0.0, "vehicle.wheel_radius", "m")
        above(self.center_distance, 0.0, "vehicle.center_distance", "m")
        _check_outline(self.outline)


Vehicle: TypeAlias = DifferentialVehicle | TricycleVehicle | OmnidirectionalVehicle

"""Kinds of vehicle: their wheels and outline as plain values. Kinematics live in `localization.kinematics`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, TypeAlias

from commission.site.checks import above, check_fields
from commission.site.polygon import Corners, check_polygon
from commission.site.quantity import AS_DEGREES, POSITIVE, Bounds, Quantity

DEFAULT_OUTLINE = ((0.5, 0.3), (-0.5, 0.3), (-0.5, -0.3), (0.5, -0.3))

_OUTLINE = Quantity(label="Outline", unit="m", decimals=4)
_HEIGHT = Quantity(label="Height", unit="m", decimals=4)


def _check_outline(outline: Corners) -> None:
    check_polygon(outline, "vehicle.outline", "the vehicle")


@dataclass(frozen=True, slots=True)
class DifferentialVehicle:
    """Two driven wheels on one axle; base is the middle of the axle."""

    wheel_separation: Annotated[float, Quantity(label="Wheel separation", unit="m", bounds=POSITIVE, decimals=4)] = 0.4
    """Distance between the two driven wheels."""
    outline: Annotated[tuple[tuple[float, float], ...], _OUTLINE] = DEFAULT_OUTLINE
    """Corners of the vehicle's outline, base frame."""
    height: Annotated[float, _HEIGHT] = 0.4
    """Height of the vehicle, for the 3D view."""

    kind = "differential"

    def __post_init__(self) -> None:
        check_fields(self, "vehicle.")
        _check_outline(self.outline)


@dataclass(frozen=True, slots=True)
class TricycleVehicle:
    """One driven and steered wheel ahead of a fixed axle; base is the middle of the axle."""

    wheelbase: Annotated[float, Quantity(label="Wheelbase", unit="m", decimals=4)] = 1.2
    """Distance from the fixed axle to the steered wheel; negative when the steered wheel is behind."""
    max_steering_deg: Annotated[
        float,
        Quantity(label="Steering to", unit="deg", shown=AS_DEGREES, bounds=Bounds.between(1.0, 90.0), decimals=6),
    ] = 75.0
    """Largest steering angle to either side."""
    outline: Annotated[tuple[tuple[float, float], ...], _OUTLINE] = (
        (1.5, 0.4),
        (-0.4, 0.4),
        (-0.4, -0.4),
        (1.5, -0.4),
    )
    """Corners of the vehicle's outline, base frame."""
    height: Annotated[float, _HEIGHT] = 0.6
    """Height of the vehicle, for the 3D view."""

    kind = "tricycle"

    def __post_init__(self) -> None:
        check_fields(self, "vehicle.")
        above(abs(self.wheelbase), 0.0, "vehicle.wheelbase (absolute value)", "m")
        _check_outline(self.outline)


@dataclass(frozen=True, slots=True, kw_only=True)
class OmnidirectionalVehicle:
    """Omnidirectional wheels around the base, each rolling at a right angle to its spoke (Dixon et al. 2010)."""

    wheel_angles_deg: Annotated[
        tuple[float, ...], Quantity(label="Wheel angles", unit="deg", shown=AS_DEGREES, decimals=6)
    ] = (0.0, 90.0, 180.0, 270.0)
    """Angle alpha_i of each wheel's spoke, base frame."""
    wheel_radius: Annotated[float, Quantity(label="Wheel radius", unit="m", bounds=POSITIVE, decimals=4)] = 0.05
    """Radius r of the wheels."""
    center_distance: Annotated[float, Quantity(label="Wheel distance", unit="m", bounds=POSITIVE, decimals=4)] = 0.3
    """Distance R from the base to each wheel."""
    outline: Annotated[tuple[tuple[float, float], ...], _OUTLINE] = DEFAULT_OUTLINE
    """Corners of the vehicle's outline, base frame."""
    height: Annotated[float, _HEIGHT] = 0.4
    """Height of the vehicle, for the 3D view."""

    kind = "omnidirectional"

    def __post_init__(self) -> None:
        check_fields(self, "vehicle.")
        if len({round(a % 360.0, 9) for a in self.wheel_angles_deg}) < 3:
            raise ValueError(
                f"vehicle.wheel_angles_deg is {list(self.wheel_angles_deg)}; expected 3 or more different angles"
            )
        _check_outline(self.outline)


Vehicle: TypeAlias = DifferentialVehicle | TricycleVehicle | OmnidirectionalVehicle

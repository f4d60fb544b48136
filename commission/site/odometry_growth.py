"""What odometry is uncertain of, and how that grows: quantities that the filter's belief and the true wheels share."""

from __future__ import annotations

from commission.site.quantity import DEGREES, MILLIMETRES, NOT_NEGATIVE, Quantity, Shown


def _growth(label: str, unit: str, shown: Shown, step: float, most: float) -> Quantity:
    """Uncertainty that grows with the square root of way, turn or time."""
    return Quantity(label=label, unit=unit, shown=shown, bounds=NOT_NEGATIVE, step=step, slider=(0.0, most))


_PER_ROOT_OF_A_METRE = Shown("mm/√m", MILLIMETRES.scale)

FORWARD_PER_SQRT_M = _growth("Along", "m/sqrt(m)", _PER_ROOT_OF_A_METRE, 0.5, 100.0)
LATERAL_PER_SQRT_M = _growth("Across", "m/sqrt(m)", _PER_ROOT_OF_A_METRE, 0.5, 100.0)
HEADING_PER_SQRT_M = _growth("Heading", "rad/sqrt(m)", Shown("°/√m", DEGREES.scale), 0.01, 5.0)
HEADING_PER_SQRT_RAD = _growth("Turning", "rad/sqrt(rad)", Shown("°/√rad", DEGREES.scale), 0.01, 5.0)
FORWARD_PER_SQRT_S = _growth("Along, in time", "m/sqrt(s)", Shown("mm/√s", MILLIMETRES.scale), 0.1, 50.0)
HEADING_PER_SQRT_S = _growth("Heading, in time", "rad/sqrt(s)", Shown("°/√s", DEGREES.scale), 0.01, 3.0)

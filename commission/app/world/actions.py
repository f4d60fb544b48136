"""What a person can ask for of the virtual world, as frozen values."""

from __future__ import annotations

from dataclasses import dataclass

from commission.app.base.actions import Action


@dataclass(frozen=True, slots=True)
class SetDisturbance(Action):
    """Change one number of what a virtual drive suffers."""

    name: str
    """Its dotted name in the disturbances: `wheels.forward_per_sqrt_m`, `constants.mounting_sigma[2]`."""
    value: object
    """New value, in the unit of code and files."""

"""How well the constants of a site and its vehicle are known: what a filter considers, and a prediction counts on.

Not what is wrong in a virtual world: that is drawn by `disturbances.constants`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from commission.site.checks import check_fields
from commission.site.quantity import DEGREES, MILLIMETRES, MILLISECONDS, Bounds, Quantity

_SHORT = Bounds.between(0.0, 1.0)


def _length(label: str) -> Quantity:
    """1-sigma of a length that does not change while the vehicle drives."""
    return Quantity(label=label, unit="m", shown=MILLIMETRES, bounds=_SHORT, step=0.5, slider=(0.0, 20.0), decimals=6)


EXACT = {
    "survey": "every reflector without a sigma of its own is taken to stand exactly where the map says",
    "mounting_position": "scanners are taken to be mounted exactly where the project says",
    "mounting_heading": "scanners are taken to be mounted exactly in the direction that the project says",
    "range_bias": "scanners are taken to measure without any range bias but `observation.range_bias`",
    "clock": "scans are taken to be stamped exactly when they were taken",
}
"""What it means that a field is 0."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Uncertainty:
    """1-sigma of what stays as it is while a vehicle drives, and is not known exactly."""

    survey: Annotated[float, _length("Survey 1σ")] = 0.003
    """1-sigma of a reflector's place along x and along y, where the map gives it no sigma of its own."""
    mounting_position: Annotated[float, _length("Mounting 1σ")] = 0.002
    """1-sigma of a scanner's place on the vehicle, along x and along y."""
    mounting_heading: Annotated[
        float,
        Quantity(
            label="Facing 1σ",
            unit="rad",
            shown=DEGREES,
            bounds=_SHORT,
            step=0.01,
            slider=(0.0, 2.0),
            decimals=6,
        ),
    ] = 0.001745  # 0.1 degrees, as a file has it
    """1-sigma of the direction in which a scanner is mounted."""
    range_bias: Annotated[float, _length("Range bias 1σ")] = 0.005
    """1-sigma of what a scanner adds to all its ranges, beyond `observation.range_bias`."""
    clock: Annotated[
        float,
        Quantity(
            label="Clock 1σ",
            unit="s",
            shown=MILLISECONDS,
            bounds=_SHORT,
            step=0.5,
            slider=(0.0, 50.0),
            decimals=6,
        ),
    ] = 0.005
    """1-sigma of how much later than they were taken the scans of a scanner are stamped."""

    def taken_for_exact(self) -> tuple[str, ...]:
        """Say what is taken for exact, one line each: nothing is unless somebody has said so."""
        return tuple(
            f"uncertainty.{name} is 0: {meaning}; expected more than 0"
            for name, meaning in EXACT.items()
            if getattr(self, name) == 0.0
        )

    def __post_init__(self) -> None:
        check_fields(self, "uncertainty.")

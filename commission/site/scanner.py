"""The laser scanner: where it sits on the vehicle, what it sees, and how well. Not its telegrams, not its scans."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from commission.geometry.arrays import FloatArray, equal_fields, frozen
from commission.site.checks import above, at_least, between

LONGEST_RANGE = 10_000.0
"""No laser scanner measures farther [m]."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Scanner:
    """A 2D laser scanner on the vehicle."""

    mounting: FloatArray = field(default_factory=lambda: frozen([0.0, 0.0, 0.0], (3,), "scanner.mounting"))
    """(3,) `T_base_scanner`: x [m], y [m] and heading [rad] of the scanner in the base frame."""
    field_of_view_deg: tuple[float, float] = (-135.0, 135.0)
    """First and last bearing [deg], scanner frame, counter-clockwise; a full turn is -180 to 180."""
    resolution_deg: float = 0.5
    """Step between neighboring beams [deg]."""
    rate: float = 25.0
    """Scans per second [1/s]."""
    range: tuple[float, float] = (0.05, 30.0)
    """Smallest and largest range at which the scanner measures [m]."""
    range_sigma: float = 0.01
    """1-sigma noise of each beam's range [m]."""
    bearing_sigma_deg: float = 0.05
    """1-sigma noise of each beam's bearing [deg]."""
    beam_width_deg: float = 0.25
    """Divergence of a beam: a reflector is met when any part of the beam touches it [deg]."""
    reflector_range: float = 20.0
    """Range up to which the scanner tells reflectors from other things [m]."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "mounting", frozen(self.mounting, (3,), "scanner.mounting"))
        first, last = self.field_of_view_deg
        if not (math.isfinite(first) and math.isfinite(last) and 0.0 < last - first <= 360.0):
            raise ValueError(
                f"scanner.field_of_view_deg is [{first:g}, {last:g}]; expected first < last, at most 360 deg apart"
            )
        between(self.resolution_deg, (0.01, 10.0), "scanner.resolution_deg", "deg")
        between(self.rate, (0.1, 1000.0), "scanner.rate", "scans per second")
        nearest, farthest = self.range
        at_least(nearest, 0.0, "scanner.range[0]", "m")
        if not nearest < farthest <= LONGEST_RANGE:
            raise ValueError(
                f"scanner.range is [{nearest:g}, {farthest:g}]; "
                f"expected smallest < largest range, at most {LONGEST_RANGE:g} m"
            )
        at_least(self.range_sigma, 0.0, "scanner.range_sigma", "m")
        at_least(self.bearing_sigma_deg, 0.0, "scanner.bearing_sigma_deg", "deg")
        at_least(self.beam_width_deg, 0.0, "scanner.beam_width_deg", "deg")
        above(self.reflector_range, 0.0, "scanner.reflector_range", "m")

    def __eq__(self, other: object) -> bool:
        """Equal when every field is, arrays element by element."""
        return equal_fields(self, other)

    @property
    def angle_min(self) -> float:
        """Bearing of the first beam [rad]."""
        return math.radians(self.field_of_view_deg[0])

    @property
    def angle_increment(self) -> float:
        """Step between neighboring beams [rad]."""
        return math.radians(self.resolution_deg)

    @property
    def is_full_turn(self) -> bool:
        """Whether the last beam is the first one's neighbor."""
        first, last = self.field_of_view_deg
        return last - first > 360.0 - 1.5 * self.resolution_deg

    @property
    def beam_count(self) -> int:
        """Number of beams in one scan; a full turn does not repeat its first beam."""
        first, last = self.field_of_view_deg
        count = math.floor((last - first) / self.resolution_deg + 1e-6) + 1
        return count - 1 if (count - 1) * self.resolution_deg > 360.0 - 0.5 * self.resolution_deg else count

    @property
    def period_ns(self) -> int:
        """Time between scans [ns]."""
        return round(1e9 / self.rate)

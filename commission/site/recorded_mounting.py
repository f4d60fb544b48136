"""Where a recording says that a scanner is mounted, as transforms of a ROS bag do. A value."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class RecordedMounting:
    """Mounting of a scanner in the frame of its vehicle, as recorded."""

    scanner: str
    """Name of the scanner."""
    base: str
    """Frame of the vehicle, as the recording calls it: `base_link`."""
    x: float
    """Place ahead of that frame [m]."""
    y: float
    """Place to the left of it [m]."""
    heading: float
    """Heading of the first axis of the scanner [rad]."""
    upside_down: bool
    """Whether it hangs upside down."""
    lean: float
    """Angle of the plane in which it measures with the floor [rad]."""

    @property
    def words(self) -> str:
        """It in a note."""
        down = ", upside down" if self.upside_down else ""
        leaning = ""
        if self.lean > LEANING:
            lean = f"{math.degrees(self.lean):.3g} deg"
            leaning = f", its plane leaning by {lean}: expected is the frame in which it measures"
        at = f"[{self.x:.4g}, {self.y:.4g}, {self.heading:.4g}]{down}{leaning}"
        return f"{at} (x [m], y [m], heading [rad] in {self.base})"


LEANING = math.radians(5.0)
"""Angle of a scanner's plane with the floor from which it is told [rad]; an optical frame stands upright."""

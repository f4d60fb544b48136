"""The one event type of simulation, replay and live: what a vehicle reports, in the order of its stamps.

Records carry measurements only; nothing here says where they come from or what is done with them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from commission.geometry.arrays import FloatArray, frozen


@dataclass(frozen=True, slots=True)
class Odometry:
    """Motion since the previous odometry record."""

    stamp_ns: int
    """Time of the end of the motion [ns]."""
    displacement: FloatArray
    """(3,) pose of base now in base at the previous record: dx [m], dy [m], dtheta [rad]."""

    def __post_init__(self) -> None:
        object.__setattr__(
            self,
            "displacement",
            frozen(self.displacement, (3,), "odometry displacement"),
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Scan:
    """One turn of a laser scanner."""

    stamp_ns: int
    """Time of the scan [ns]."""
    ranges: NDArray[np.float32]
    """(B,) distance along each beam [m], scanner frame; NaN where nothing came back."""
    angle_min: float
    """Bearing of the first beam [rad], scanner frame."""
    angle_increment: float
    """Bearing step from beam to beam [rad], positive counter-clockwise."""
    intensities: NDArray[np.float32] | None = None
    """(B,) strength of each echo [sensor's own unit], or None."""
    reflector: NDArray[np.bool_] | None = None
    """(B,) whether the sensor says that the beam met a reflector, or None."""
    scanner: int = 0
    """Which of the vehicle's scanners: index into the names that log or setup have."""

    @property
    def bearings(self) -> FloatArray:
        """(B,) bearing of each beam [rad], scanner frame."""
        return self.angle_min + self.angle_increment * np.arange(len(self.ranges), dtype=np.float64)


@dataclass(frozen=True, slots=True)
class Detections:
    """Reflectors that the sensor itself has detected in one scan; empty when it saw none."""

    stamp_ns: int
    """Time of the scan [ns]."""
    range_bearing: FloatArray
    """(N, 2) range [m] and bearing [rad] of each reflector's center, scanner frame."""
    scanner: int = 0
    """Which of the vehicle's scanners: index into the names that log or setup have."""

    def __post_init__(self) -> None:
        values = frozen(self.range_bearing, (None, 2), "detections")
        if len(values) and not values[:, 0].min() > 0.0:
            raise ValueError(f"detections: a range is {values[:, 0].min():g} m; expected more than 0 m")
        object.__setattr__(self, "range_bearing", values)


@dataclass(frozen=True, slots=True)
class TagSightings:
    """Tags that a camera has measured in one frame; empty when it saw none."""

    stamp_ns: int
    """Time of the frame [ns]."""
    sightings: FloatArray
    """(N, 6) x [m], y [m] and heading [rad] of each tag in the camera's frame, then 1-sigma of each; NaN: not said."""
    ids: tuple[str, ...]
    """(N,) id of each tag; empty where the camera cannot read it."""

    def __post_init__(self) -> None:
        values = frozen(self.sightings, (None, 6), "tag sightings", finite=False)
        if not np.isfinite(values[:, :3]).all():
            raise ValueError("tag sightings: x, y or heading is no finite number; expected metres and radians")
        if (values[:, 3:] <= 0.0).any() or np.isinf(values[:, 3:]).any():
            raise ValueError(
                "tag sightings: a sigma is not positive; expected more than 0, or NaN where it is not said"
            )
        if len(self.ids) != len(values):
            raise ValueError(f"tag sightings: {len(self.ids)} ids of {len(values)} tags; expected one each")
        object.__setattr__(self, "sightings", values)


@dataclass(frozen=True, slots=True)
class Reflex:
    """The bearing at which the turning laser of a goniometer has met a reflector, at its own time."""

    stamp_ns: int
    """Time of the reflex [ns]."""
    bearing: float
    """Bearing of the reflector [rad], scanner frame; NaN: a whole turn met none, and ended then."""
    reflector: str = ""
    """Id of the reflector; empty: the goniometer does not know it."""

    def __post_init__(self) -> None:
        if math.isinf(self.bearing):
            raise ValueError(
                f"reflex: the bearing is {self.bearing:g}; expected radians, or NaN for a turn without any"
            )


@dataclass(frozen=True, slots=True)
class ReferencePose:
    """Ground truth, or the pose that a second system reports. The localizer never reads it."""

    stamp_ns: int
    """Time of the pose [ns]."""
    pose: FloatArray
    """(3,) `T_map_base`: x [m], y [m], theta [rad]; theta is NaN when the second system does not know it."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "pose", frozen(self.pose, (3,), "reference pose", finite=False))


Record: TypeAlias = Odometry | Scan | Detections | TagSightings | Reflex | ReferencePose

ORDER_WITHIN_A_STAMP: dict[type, int] = {
    Odometry: 0,
    ReferencePose: 1,
    TagSightings: 2,
    Reflex: 3,
    Detections: 4,
    Scan: 5,
}
"""Records of one stamp are delivered in this order: motion first, then what was seen after it."""

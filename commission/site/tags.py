"""Tags: landmarks that tell place and heading at once, and the camera on the vehicle that sees them.

A fiducial mark on the floor or a pole, the contour of a docking station: an all-state landmark of Dixon et al. 2010.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated

import numpy as np

from commission.geometry.arrays import FloatArray, equal_fields, frozen
from commission.site.checks import check_fields
from commission.site.quantity import (
    AS_DEGREES,
    BARE,
    DEGREES,
    MILLIMETRES,
    NOT_NEGATIVE,
    POSITIVE,
    Bounds,
    Quantity,
    Switch,
    Words,
    X,
    Y,
)

_ON_A_VEHICLE = Bounds.between(-100.0, 100.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class Tag:
    """A landmark whose place and heading a camera measures at once."""

    id: Annotated[str, Words("Tag id")]
    """What the camera reads on it, unique within the project."""
    x: Annotated[float, X]
    """Place, x in the map frame."""
    y: Annotated[float, Y]
    """Place, y in the map frame."""
    heading: Annotated[float, Quantity(label="Tag heading", unit="rad", shown=DEGREES, step=0.01, decimals=6)] = 0.0
    """Direction of the tag's own x axis, map frame."""
    anonymous: Annotated[bool, Switch("Without id")] = False
    """Whether the camera cannot read which one it is, as of the contour of a dock."""
    sigma: Annotated[
        float, Quantity(label="Placed 1σ", unit="m", shown=MILLIMETRES, bounds=NOT_NEGATIVE, step=0.5, decimals=6)
    ] = 0.003
    """1-sigma of its surveyed place, each axis: it does not average out."""
    heading_sigma: Annotated[
        float, Quantity(label="Facing 1σ", unit="rad", shown=DEGREES, bounds=NOT_NEGATIVE, step=0.01, decimals=6)
    ] = 0.003
    """1-sigma of its surveyed heading: it does not average out."""

    def __post_init__(self) -> None:
        if not self.id.strip():
            raise ValueError("a tag's id is empty; expected text")
        check_fields(self, "tags.")

    @property
    def pose(self) -> FloatArray:
        """(3,) `T_map_tag` [m, m, rad]."""
        return frozen(np.array([self.x, self.y, self.heading]), (3,), "tag")


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class TagCamera:
    """A camera on the vehicle that measures tags, mounted where base is unless it is said."""

    mounting: Annotated[
        FloatArray,
        Quantity(label="Camera at x", unit="m", bounds=_ON_A_VEHICLE, decimals=4),
        Quantity(label="Camera at y", unit="m", bounds=_ON_A_VEHICLE, decimals=4),
        Quantity(label="Camera faces", unit="rad", shown=DEGREES, step=0.01, decimals=6),
    ] = field(default_factory=lambda: frozen([0.0, 0.0, 0.0], (3,), "tag_camera.mounting"))
    """(3,) `T_base_camera`: x, y and heading of the camera in the base frame."""
    field_of_view_deg: Annotated[
        float,
        Quantity(label="Camera sees", unit="deg", shown=AS_DEGREES, bounds=Bounds.between(1.0, 360.0), decimals=6),
    ] = 90.0
    """Angle of the field of view, half of it to either side."""
    range: Annotated[
        tuple[float, float],
        Quantity(label="Tags seen from", unit="m", bounds=NOT_NEGATIVE, step=0.01, decimals=4),
        Quantity(label="Tags seen to", unit="m", bounds=POSITIVE, step=0.01, decimals=4),
    ] = (0.1, 5.0)
    """Smallest and largest distance at which it measures a tag."""
    rate: Annotated[
        float,
        Quantity(label="Frames per s", unit="frames/s", shown=BARE, bounds=Bounds.between(0.1, 1000.0), step=0.01),
    ] = 10.0
    """Frames per second."""
    position_sigma: Annotated[
        float, Quantity(label="Seen place 1σ", unit="m", shown=MILLIMETRES, bounds=NOT_NEGATIVE, step=0.5)
    ] = 0.02
    """1-sigma noise of a measured tag's place, each axis."""
    heading_sigma: Annotated[
        float, Quantity(label="Seen heading 1σ", unit="rad", shown=DEGREES, bounds=NOT_NEGATIVE, step=0.01)
    ] = 0.02
    """1-sigma noise of a measured tag's heading."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "mounting", frozen(self.mounting, (3,), "tag_camera.mounting"))
        check_fields(self, "tag_camera.")
        if not self.range[0] < self.range[1]:
            raise ValueError(
                f"tag_camera.range is {self.range[0]:g} to {self.range[1]:g} m; expected the smaller distance first"
            )

    def __eq__(self, other: object) -> bool:
        """Equal when every field is, arrays element by element."""
        return equal_fields(self, other)

    def __hash__(self) -> int:
        """Equal ones have the same."""
        return hash((*self.mounting.tolist(), self.field_of_view_deg, self.range, self.rate))

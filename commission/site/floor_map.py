"""The floor map: which cells of the hall are walls, free or unknown. Not its file formats, not its rays."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from commission.geometry.arrays import FloatArray, equal_fields, frozen
from commission.geometry.occupancy import OccupancyGrid
from commission.site.checks import check_fields
from commission.site.quantity import COORDINATE, DEGREES, Quantity

UNKNOWN = -1
FREE = 0
OCCUPIED = 100
"""Values of a cell, as in ROS nav_msgs/OccupancyGrid."""
MOST_CELLS = 64_000_000
"""Cells that a map may have: 400 x 400 m at 0.05 m."""


@dataclass(frozen=True, slots=True, eq=False)
class FloorMap:
    """A grid of cells. The laser stops at occupied cells only; unknown ones let it pass."""

    cells: NDArray[np.int8]
    """(H, W) UNKNOWN, FREE or OCCUPIED; row 0 is the lowest y of the grid's own frame."""
    # Thousands of cells lie side by side: a tenth of a millimetre each would move the last ones by a hand.
    resolution: Annotated[float, Quantity(label="Cell", unit="m", decimals=9)]
    """Edge of a cell."""
    origin: Annotated[
        FloatArray,
        Quantity(label="Origin x", unit="m", bounds=COORDINATE, decimals=4),
        Quantity(label="Origin y", unit="m", bounds=COORDINATE, decimals=4),
        Quantity(label="Turned by", unit="rad", shown=DEGREES, decimals=6),
    ] = field(default_factory=lambda: frozen([0.0, 0.0, 0.0], (3,), "origin"))
    """(3,) pose of the lower-left corner of cell (0, 0) in the map frame."""

    def __post_init__(self) -> None:
        if not (math.isfinite(self.resolution) and self.resolution > 0.0):
            raise ValueError(f"resolution is {self.resolution:g}; expected metres per cell > 0")
        if self.cells.ndim != 2 or 0 in self.cells.shape:
            raise ValueError(f"cells have shape {self.cells.shape}; expected rows x columns, each 1 or more")
        object.__setattr__(self, "origin", frozen(self.origin, (3,), "origin"))
        check_fields(self)
        cells = np.ascontiguousarray(self.cells, dtype=np.int8)
        cells.setflags(write=False)
        object.__setattr__(self, "cells", cells)

    def __eq__(self, other: object) -> bool:
        """Equal when every field is, arrays element by element."""
        return equal_fields(self, other)

    @property
    def size(self) -> tuple[float, float]:
        """Width and height of the grid [m], along its own axes."""
        rows, columns = self.cells.shape
        return columns * self.resolution, rows * self.resolution

    def occupancy(self) -> OccupancyGrid:
        """Return the occupied cells as a grid for rays and distances."""
        return OccupancyGrid(self.cells == OCCUPIED, self.resolution, self.origin)

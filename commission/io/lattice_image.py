"""Figures over a lattice as a picture, north up. Which figure has which color is the caller's business."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from commission.geometry.arrays import FloatArray
from commission.planning.coverage import Lattice

STOPS = np.array([[68, 1, 84], [59, 82, 139], [33, 145, 140], [94, 201, 98], [253, 231, 37]], dtype=np.float64)
"""Five colors of the map `viridis`, good to bad: readable in gray and by the color-blind."""
NO_FLOOR = (25, 25, 28)
"""Color of walls and unknown ground."""
LARGEST_CELL = 8
"""Pixels of one point along each side, at most."""
LARGEST_SIDE = 1600
"""Pixels of the longer side, as long as a point has one."""


def shades(badness: FloatArray) -> FloatArray:
    """Colors (n, 3) of n values from 0, good, to 1, bad."""
    at = np.clip(badness, 0.0, 1.0) * (len(STOPS) - 1)
    return np.stack([np.interp(at, np.arange(len(STOPS)), channel) for channel in STOPS.T], axis=-1)


def lattice_image(lattice: Lattice, colors: NDArray[np.uint8]) -> Image.Image:
    """Picture of a lattice with the colors (N, 3) of its points."""
    image = Image.fromarray(np.ascontiguousarray(colors.reshape(lattice.rows, lattice.columns, 3)[::-1]))
    scale = max(1, min(LARGEST_CELL, LARGEST_SIDE // max(lattice.rows, lattice.columns)))
    return image.resize((lattice.columns * scale, lattice.rows * scale), Image.Resampling.NEAREST)

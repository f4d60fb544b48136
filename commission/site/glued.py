"""Plates that are drawn inside a wall's cells: they are glued to the wall, and seen from in front of it.

A cell of the floor map is as thick as it is long, and a survey is more precise than a map: a plate on a wall then lies
behind the surface of the wall's cell, by up to a cell.
"""

from __future__ import annotations

import math

import numpy as np

from commission.geometry.arrays import FloatArray
from commission.geometry.occupancy import OccupancyGrid
from commission.site.reflectors import ReflectorMap

STEP = 0.002
"""Steps in which the surface of a wall is looked for [m]."""
DIRECTIONS = 32
"""Directions in which it is looked for around a plate that may face any of them."""


def depths_in_walls(reflectors: ReflectorMap, grid: OccupancyGrid) -> FloatArray:
    """How far behind the surface of a wall each plate lies, along the direction that it faces.

    One of unknown direction lies as far behind as the nearest surface around it is.

    Parameters
    ----------
    reflectors : M reflectors, map frame.
    grid : the walls.

    Returns
    -------
    depths : (M,) array [m]; 0 for cylinders, plates outside of walls, and those that are more than a cell behind.
    """
    depths = np.zeros(len(reflectors))
    plates = np.flatnonzero(reflectors.is_flat)
    if not len(plates):
        return depths
    steps = np.arange(0.0, grid.resolution + 2.0 * STEP, STEP)
    known = reflectors.is_directed[plates]
    headings = reflectors.headings[plates[known]]
    depths[plates[known]] = _depths(reflectors.centers[plates[known]], headings, steps, grid)
    unknown = plates[~known]
    if len(unknown):
        turns = np.linspace(0.0, 2.0 * math.pi, DIRECTIONS, endpoint=False)
        found = _depths(
            np.repeat(reflectors.centers[unknown], DIRECTIONS, 0), np.tile(turns, len(unknown)), steps, grid
        )
        nearest = np.where(found > 0.0, found, np.inf).reshape(-1, DIRECTIONS).min(axis=1)
        depths[unknown] = np.where(np.isfinite(nearest), nearest, 0.0)
    return depths


def _depths(centers: FloatArray, headings: FloatArray, steps: FloatArray, grid: OccupancyGrid) -> FloatArray:
    """(K,) first of some steps at which ways that begin in a wall leave it [m]; 0 where they begin or end otherwise."""
    facing = np.stack((np.cos(headings), np.sin(headings)), axis=-1)
    places = centers[:, np.newaxis] + steps[:, np.newaxis] * facing[:, np.newaxis]
    walled = grid.is_occupied(places)
    surface = np.argmin(walled, axis=1)
    return np.where(walled[:, 0] & ~walled.all(axis=1), steps[surface], 0.0)

"""The rectangle of the floor that a site takes up, for cameras, grids and the size of marks."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from commission.geometry import se2
from commission.site.project import Project

MARGIN = 0.6
FAR = 1000.0
"""A site without a floor map shows the map's zero, too, where everything is nearer to it than this [m]."""
SMALLEST, SMALLEST_FIELD = 4.0, 12.0
"""Least width and height of a hall, and of an open field: one that is empty has room for a site [m]."""


@dataclass(frozen=True, slots=True)
class Extent:
    """An axis-parallel rectangle of the map frame."""

    low: tuple[float, float]
    """Smallest x and y [m]."""
    high: tuple[float, float]
    """Largest x and y [m]."""

    @property
    def center(self) -> tuple[float, float]:
        """Middle of the rectangle [m]."""
        return 0.5 * (self.low[0] + self.high[0]), 0.5 * (self.low[1] + self.high[1])

    @property
    def size(self) -> tuple[float, float]:
        """Width and height [m]."""
        return self.high[0] - self.low[0], self.high[1] - self.low[1]

    def mark_size(self) -> float:
        """Diameter of a mark that is seen when the whole site is in view and small when one looks closer [m]."""
        return float(np.clip(min(self.size) / 110.0, 0.03, 0.25))


def extent_of(project: Project) -> Extent:
    """Return the rectangle around floor map, reflectors and routes, with a margin."""
    points = [np.empty((0, 2))]
    if project.floor_map is not None:
        width, height = project.floor_map.size
        corners = np.array([[0.0, 0.0], [width, 0.0], [width, height], [0.0, height]])
        points = [se2.transform_points(project.floor_map.origin, corners)]
    if len(project.reflectors):
        points.append(project.reflectors.centers)
    points.extend(segment.control_points for route in project.routes for segment in route.segments)
    every = np.concatenate(points)
    if project.floor_map is None and np.all(np.abs(every) < FAR):
        every = np.concatenate([every, np.zeros((1, 2))])
    low, high = every.min(axis=0) - MARGIN, every.max(axis=0) + MARGIN
    smallest = SMALLEST_FIELD if project.floor_map is None else SMALLEST
    middle, half = 0.5 * (low + high), np.maximum(0.5 * (high - low), 0.5 * smallest)
    low, high = middle - half, middle + half
    return Extent((float(low[0]), float(low[1])), (float(high[0]), float(high[1])))

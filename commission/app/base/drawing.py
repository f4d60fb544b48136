"""From points of the floor to what the scene takes: points with a height, map frame. Nothing here knows viser."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from commission.geometry.arrays import FloatArray, Scalar

Points = NDArray[Any]
"""(..., 3) points of the map frame with a height [m], float64: far from zero float32 is too coarse (`map_scene`)."""

NO_POINTS: Points = np.empty((0, 3))
# An empty array of segments makes the browser drop the buffer's size; one of zero length, far below, draws nothing.
NO_SEGMENTS: Points = np.full((1, 2, 3), -1000.0)

RING_POINTS = 28


def lift(points: FloatArray, height: float) -> Points:
    """Return (N, 2) points [m] as (N, 3) at a height [m]."""
    lifted = np.full((len(points), 3), height)
    lifted[:, :2] = points
    return lifted


def rings(centers: FloatArray, radius: float | FloatArray) -> FloatArray:
    """Return the (N, RING_POINTS, 2) outlines of circles of one radius, or of (N,) radii [m]."""
    angles = np.linspace(0.0, 2.0 * np.pi, RING_POINTS, endpoint=False)
    unit = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    return centers[:, np.newaxis, :] + np.reshape(radius, (-1, 1, 1)) * unit


def outline_segments(outlines: FloatArray, height: float) -> Points:
    """Return the (N * n, 2, 3) segments of N closed outlines given as (N, n, 2) points [m]."""
    if len(outlines) == 0:
        return NO_SEGMENTS
    closed = np.stack([outlines, np.roll(outlines, -1, axis=1)], axis=2).reshape(-1, 2, 2)
    return lift(closed.reshape(-1, 2), height).reshape(-1, 2, 3)


def polyline_segments(points: FloatArray, height: float) -> Points:
    """Return the (N - 1, 2, 3) segments of one open line through (N, 2) points [m]."""
    if len(points) < 2:
        return NO_SEGMENTS
    lifted = lift(points, height)
    return np.stack([lifted[:-1], lifted[1:]], axis=1)


def stroke_segments(strokes: FloatArray, height: float) -> Points:
    """Return the (N, 2, 3) segments of N strokes given as (N, 2, 2) points [m]."""
    return lift(strokes.reshape(-1, 2), height).reshape(-1, 2, 3) if len(strokes) else NO_SEGMENTS


def crosses(places: FloatArray, size: float) -> FloatArray:
    """Return the (2 N, 2, 2) strokes of a cross on each of N places [m]."""
    arm = size * np.array([[(-1.0, -1.0), (1.0, 1.0)], [(-1.0, 1.0), (1.0, -1.0)]])
    return (places[:, np.newaxis, np.newaxis] + arm).reshape(-1, 2, 2)


def heading_mark(outline: FloatArray) -> FloatArray:
    """Return the (3, 2, 2) strokes of an arrow from base towards the front of an (n, 2) outline [m], base frame."""
    tip = 0.85 * float(outline[:, 0].max())
    wing = 0.3 * tip
    return np.array([[(0, 0), (tip, 0)], [(tip, 0), (tip - wing, wing)], [(tip, 0), (tip - wing, -wing)]])


def thinned(points: NDArray[Scalar], at_most: int) -> NDArray[Scalar]:
    """Return about every k-th of (N, ...) points so that at most `at_most` remain; the last one always does."""
    if len(points) <= at_most:
        return points
    step = -(-len(points) // (at_most - 1))
    return np.concatenate([points[:-1:step], points[-1:]])


def yaw_quaternion(theta: float) -> tuple[float, float, float, float]:
    """Return the (w, x, y, z) rotation about the vertical by theta [rad]."""
    return float(np.cos(0.5 * theta)), 0.0, 0.0, float(np.sin(0.5 * theta))

"""A figure of eight through the laboratory: 37 s and 10 rad of turns each lap."""

from __future__ import annotations

import numpy as np

from commission.site.routes import Route, Segment


def eight(laps: int) -> Route:
    """The route that drives it some times without a stop."""
    t = np.linspace(0.0, 2.0 * np.pi * laps, 16 * laps + 1)
    points = np.column_stack((6.0 + 3.2 * np.sin(t), 4.0 + 2.2 * np.sin(2.0 * t)))
    return Route(name="Eight", speed=0.6, segments=(Segment(control_points=points),))

"""The vehicle of a site with two scanners of 275 degrees, as most vehicles of this class carry them."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from commission.site.project import Project

FIELD = (-137.5, 137.5)
NAMES = ("front left", "rear right")


def with_two(project: Project, **changes) -> Project:
    """A scanner on the front left and one on the rear right corner of the outline, otherwise like the only one."""
    (only,) = project.scanners
    x, y = np.array(project.vehicle.outline).max(axis=0)
    back = float(np.array(project.vehicle.outline)[:, 0].min())
    front, rear = (x, y, math.radians(45.0)), (back, -y, math.radians(-135.0))
    scanners = tuple(
        replace(only, name=name, mounting=np.array(mounting), field_of_view_deg=FIELD)
        for name, mounting in zip(NAMES, (front, rear), strict=True)
    )
    return replace(project, scanners=scanners, **changes)

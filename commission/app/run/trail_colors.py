"""What the trail of the estimate can be colored by: how well detections of the last second fit. No viser in here."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from commission.app.base import theme
from commission.app.base.ramp import colors
from commission.geometry.arrays import FloatArray, IntArray
from commission.studies.consistency import Recent

NOTHING_SEEN = theme.NOT_KNOWN
"""Where nothing was detected in the last second."""


class TrailBy(StrEnum):
    """What colors the trail."""

    NOTHING = "one color"
    REJECTED = "share rejected"
    NIS = "NIS of all"


@dataclass(frozen=True, slots=True, kw_only=True)
class Coloring:
    """How a quantity becomes colors."""

    title: str
    """Name and unit."""
    bounds: tuple[float, ...]
    """Where one color ends and the next begins, in the page's unit."""
    scale: float
    """From the study's unit to the page's."""
    note: str
    """What is right."""

    def classes(self, values: FloatArray) -> IntArray:
        """(N,) index into the palette of each of N values in the study's unit; the last one where it is unknown."""
        classes = np.digitize(values * self.scale, self.bounds)
        return np.where(np.isfinite(values), classes, len(self.bounds) + 1).astype(np.int64)


COLORINGS = {
    TrailBy.REJECTED: Coloring(
        title="Detections rejected [%]",
        bounds=(5.0, 10.0, 20.0, 40.0, 60.0),
        scale=100.0,
        note="of the last second; above 60 % for seconds the vehicle is lost; grey: nothing seen",
    ),
    TrailBy.NIS: Coloring(
        title="NIS of all near a reflector",
        bounds=(1.0, 2.0, 4.0, 8.0, 16.0),
        scale=1.0,
        note="mean of the last second, accepted or not; 2 is consistent; grey: nothing seen",
    ),
}
CLASSES = 6
"""Colors of the ramp, and one more where nothing is seen."""


def palette() -> tuple[theme.Color, ...]:
    """Color of each class, the last one of what is unknown."""
    # Without the darkest two, which would not be seen on a dark floor.
    ramp = ((int(red), int(green), int(blue)) for red, green, blue in colors(CLASSES + 2)[2:])
    return (*ramp, NOTHING_SEEN)


def values_of(by: TrailBy, found: Recent) -> FloatArray:
    """(K,) what the trail is colored by at each cycle, in the study's unit."""
    return found.rejected if by is TrailBy.REJECTED else found.nis


def pieces(points: FloatArray, classes: IntArray, at_most: int) -> tuple[FloatArray, IntArray]:
    """Thin a colored line without losing its worst spots.

    Parameters
    ----------
    points : (K, 2) array [m].
    classes : (K,) class of each point; the largest one, of what is unknown, never hides another.
    at_most : about how many pieces remain.

    Returns
    -------
    lines : (N, 2, 2) pieces [m], end to end; none of fewer than two points.
    classes : (N,) the largest class of each that is known.
    """
    if len(points) < 2:
        return np.empty((0, 2, 2)), np.empty(0, np.int64)
    step = max(1, -(-len(points) // at_most))
    starts = np.arange(0, len(points) - 1, step)
    ends = np.minimum(starts + step, len(points) - 1)
    known = np.where(classes > len(palette()) - 2, -1, classes)
    largest = np.maximum.reduceat(known, starts)
    return np.stack([points[starts], points[ends]], axis=1), np.where(largest < 0, len(palette()) - 1, largest)

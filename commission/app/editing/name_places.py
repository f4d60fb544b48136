"""On which side of its reflector or station a name stands: it covers neither another name nor a mark. No viser in here.

Names are as large on the screen from near and far: where they have room while the whole site is in view, they have more
of it from nearer.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Literal, NamedTuple, TypeAlias

import numpy as np

from commission.app.base.extent import Extent, extent_of
from commission.geometry.arrays import FloatArray
from commission.site.project import Project
from commission.site.reflectors import Reflector
from commission.site.stations import ACCURACY, Station

Anchor: TypeAlias = Literal[
    "bottom-left",
    "bottom-right",
    "top-left",
    "top-right",
    "center-left",
    "center-right",
    "bottom-center",
    "top-center",
]
FLOOR_PX = (640.0, 440.0)
"""Floor of a window of 1280 x 720 [pixels], by which room is judged."""
LETTER_PX, AROUND_PX, HIGH_PX = 5.6, 5.0, 13.0
"""Width of a letter, of the frame around a name, and its height [pixels]."""
MARK_PX = 5.0
"""Half the width of what is kept free around a reflector [pixels]."""
STATION_NAME_BELOW = 3.2
"""From a station to its name, in sizes of a mark on the floor."""
SIDES: dict[Anchor, tuple[int, int]] = {
    "bottom-left": (1, 1),
    "bottom-right": (-1, 1),
    "top-left": (1, -1),
    "top-right": (-1, -1),
    "center-left": (1, 0),
    "center-right": (-1, 0),
    "bottom-center": (0, 1),
    "top-center": (0, -1),
}
"""Towards which side of the reflector a name lies, by its corner that is nearest: the first is liked best."""


STATION_SIDES: dict[Anchor, tuple[int, int]] = {
    anchor: SIDES[anchor]
    for anchor in (
        "top-center",
        "bottom-center",
        "center-left",
        "center-right",
        "top-left",
        "top-right",
        "bottom-left",
        "bottom-right",
    )
}
"""The same of a station, whose name stands under it where there is room."""


class NamePlace(NamedTuple):
    """Where a name stands."""

    at: tuple[float, float]
    """Place of its corner [m], map frame."""
    anchor: Anchor
    """Which corner that is."""


def station_text(station: Station) -> str:
    """Return what stands beside a station: its name, and how accurately the vehicle has to stand there."""
    return f"{station.name}  {ACCURACY.brief(station.required_accuracy)}"


def reflector_names(project: Project, shown: Sequence[Reflector]) -> list[NamePlace]:
    """Return where the names of reflectors stand, beside each other and beside those of the stations.

    Parameters
    ----------
    project : the site.
    shown : reflectors whose names are written.
    """
    extent = extent_of(project)
    scale, gap = pixels_per_metre(extent), STATION_NAME_BELOW * extent.mark_size()
    stations = np.array([(station.x, station.y) for station in project.stations]).reshape(-1, 2)
    sides = np.array([SIDES[place.anchor] for place in station_names(project)], dtype=np.float64).reshape(-1, 2)
    taken = boxes_of(stations * scale, sides, [station_text(station) for station in project.stations], gap * scale)
    points = np.array([(reflector.x, reflector.y) for reflector in shown]).reshape(-1, 2)
    return name_places(points, [reflector.id for reflector in shown], extent, taken)


def station_names(project: Project) -> list[NamePlace]:
    """Return where the names of stations stand: beside each other, and off the marks of reflectors and stations.

    Parameters
    ----------
    project : the site.
    """
    extent = extent_of(project)
    reflectors = np.array([(each.x, each.y) for each in project.reflectors.reflectors]).reshape(-1, 2)
    marks = reflectors * pixels_per_metre(extent)
    return name_places(
        np.array([(station.x, station.y) for station in project.stations]).reshape(-1, 2),
        [station_text(station) for station in project.stations],
        extent,
        np.concatenate([marks - MARK_PX, marks + MARK_PX], axis=1),
        sides=STATION_SIDES,
        gap=STATION_NAME_BELOW * extent.mark_size(),
    )


def pixels_per_metre(extent: Extent) -> float:
    """Scale of the plan while the whole site is in view [1/m]."""
    return min(side / length for side, length in zip(FLOOR_PX, extent.size, strict=True))


def boxes_of(places: FloatArray, sides: FloatArray, names: list[str], gap: float) -> FloatArray:
    """Return the rectangles of names.

    Parameters
    ----------
    places : (N, 2) array of what is named [pixels].
    sides : (N, 2) array of -1, 0 or 1: towards which side each name lies.
    names : of each.
    gap : from the middle of the mark to the name [pixels].

    Returns
    -------
    boxes : (N, 4) array of left, lower, right and upper edge [pixels].
    """
    size = np.array([(len(name) * LETTER_PX + AROUND_PX, HIGH_PX) for name in names]).reshape(-1, 2)
    middle = places + sides * (gap + 0.5 * size)
    return np.concatenate([middle - 0.5 * size, middle + 0.5 * size], axis=1)


def name_places(
    points: FloatArray,
    names: list[str],
    extent: Extent,
    taken: FloatArray,
    *,
    sides: Mapping[Anchor, tuple[int, int]] = SIDES,
    gap: float | None = None,
) -> list[NamePlace]:
    """Return where each name stands: on the first of its sides where it covers least.

    Parameters
    ----------
    points : (N, 2) array of what is named [m], map frame.
    names : of each.
    extent : of the site.
    taken : (M, 4) array of rectangles that are kept free [pixels of `pixels_per_metre`].
    sides : in the order in which they are liked.
    gap : from the middle of the mark to the name [m]; none: the size of a mark on the floor.
    """
    scale, gap = pixels_per_metre(extent), extent.mark_size() if gap is None else gap
    places = points * scale
    marks = np.concatenate([places - MARK_PX, places + MARK_PX], axis=1)
    low, high = np.array(extent.low) * scale, np.array(extent.high) * scale
    found: list[NamePlace] = []
    covered = taken.reshape(-1, 4)
    towards = np.array(list(sides.values()), dtype=np.float64)
    for index, name in enumerate(names):
        here = np.repeat(places[index : index + 1], len(towards), axis=0)
        options = boxes_of(here, towards, [name] * len(towards), gap * scale)
        others = np.delete(marks, index, axis=0)
        outside = np.maximum(low - options[:, :2], 0.0).sum(axis=1) + np.maximum(options[:, 2:] - high, 0.0).sum(axis=1)
        cost = overlaps(options, covered) + overlaps(options, others) + HIGH_PX * outside
        best = int(np.argmin(np.round(cost, 3)))
        anchor, (x, y) = list(sides.items())[best]
        corner = points[index] + gap * np.array([x, y])
        found.append(NamePlace((float(corner[0]), float(corner[1])), anchor))
        covered = np.concatenate([covered, options[best : best + 1]])
    return found


def overlaps(boxes: FloatArray, others: FloatArray) -> FloatArray:
    """(N,) area of each box that others cover [pixels²]; where several do it counts several times."""
    low = np.maximum(boxes[:, None, :2], others[None, :, :2])
    high = np.minimum(boxes[:, None, 2:], others[None, :, 2:])
    return np.prod(np.maximum(high - low, 0.0), axis=2).sum(axis=1)

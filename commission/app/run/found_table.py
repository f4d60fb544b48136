"""Events and reflectors of a drive as the page's script lists them; the figures by which the floor can be colored."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from commission.app.base import theme
from commission.app.base.ramp import colors
from commission.geometry.arrays import FloatArray, IntArray
from commission.site.quantity import MILLIMETRES, PERCENT
from commission.studies.events import EventsResult, told
from commission.studies.integrity import Protection
from commission.studies.plausibility import Finding
from commission.studies.reflector_figures import ReflectorFigures

CLASSES = 6
"""Colors of the floor's reflectors, and one more where nothing is known."""


@dataclass(frozen=True, slots=True, eq=False)
class Found:
    """What was found on a drive."""

    events: EventsResult
    """What happened."""
    figures: ReflectorFigures
    """What each reflector contributed."""
    misplaced: tuple[Finding, ...] = ()
    """What single scans say of where reflectors stand to each other."""
    levels: Protection | None = None
    """Protection levels of its cycles."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FigureColumn:
    """One column of the table of reflectors."""

    key: str
    """Its name in the state, and in a file."""
    title: str
    """Short name."""
    unit: str = ""
    """Unit; empty: a count or a ratio."""
    hint: str
    """What it is, in a line."""
    decimals: int = 0
    """Decimals that are shown."""
    values: Callable[[ReflectorFigures], FloatArray]
    """(M,) value of each reflector in that unit; NaN where nothing is known."""


def _share_seen(figures: ReflectorFigures) -> FloatArray:
    """(M,) share of the expected scans in which each was seen [%]; NaN where none was expected."""
    expected = np.where(figures.expected > 0, figures.expected, math.nan)
    return PERCENT.of(figures.seen / expected)


COLUMNS = (
    FigureColumn(
        key="expected",
        title="expected",
        unit="scans",
        hint="By the floor map: scans in which it is in free sight from the estimated pose, within the field of view "
        "and near enough to pass the detector; not those in which reflectors were covered.",
        values=lambda figures: figures.expected.astype(np.float64),
    ),
    FigureColumn(
        key="seen",
        title="seen",
        unit="scans",
        hint="Scans with a detection within a metre of it that passed the detector, accepted or not.",
        values=lambda figures: figures.seen.astype(np.float64),
    ),
    FigureColumn(
        key="seen_percent",
        title="seen",
        unit="%",
        hint="Seen, of the expected. More than 100: seen where the map says that something stands in between.",
        values=_share_seen,
    ),
    FigureColumn(
        key="accepted",
        title="accepted",
        hint="Detections that corrected the estimate.",
        values=lambda figures: figures.accepted.astype(np.float64),
    ),
    FigureColumn(
        key="rejected",
        title="rejected",
        hint="Detections within a metre of it that the gate rejected.",
        values=lambda figures: figures.rejected.astype(np.float64),
    ),
    FigureColumn(
        key="along_mean_mm",
        title="along",
        unit="mm",
        decimals=1,
        hint="Mean innovation of the accepted along the beam: measured minus expected range, before the scan corrects.",
        values=lambda figures: MILLIMETRES.of(figures.along_mean),
    ),
    FigureColumn(
        key="along_spread_mm",
        title="± along",
        unit="mm",
        decimals=1,
        hint="Standard deviation of the same.",
        values=lambda figures: MILLIMETRES.of(figures.along_spread),
    ),
    FigureColumn(
        key="across_mean_mm",
        title="across",
        unit="mm",
        decimals=1,
        hint="Mean innovation of the accepted across the beam, to the left: by the bearing, times the range.",
        values=lambda figures: MILLIMETRES.of(figures.across_mean),
    ),
    FigureColumn(
        key="across_spread_mm",
        title="± across",
        unit="mm",
        decimals=1,
        hint="Standard deviation of the same.",
        values=lambda figures: MILLIMETRES.of(figures.across_spread),
    ),
    FigureColumn(
        key="nis",
        title="NIS",
        decimals=2,
        hint="Mean squared Mahalanobis distance of accepted and rejected; 2 is consistent.",
        values=lambda figures: figures.nis,
    ),
    FigureColumn(
        key="last_seen",
        title="last seen",
        unit="s",
        decimals=1,
        hint="When it was accepted last, after the start of the drive.",
        values=lambda figures: figures.last_seen,
    ),
)
BY_KEY = {column.key: column for column in COLUMNS}


def message_of(found: Found, colored: str) -> dict[str, Any]:
    """Return both lists for the script.

    Parameters
    ----------
    found : what they hold.
    colored : key of the column that colors the floor; empty: none.
    """
    values = [column.values(found.figures) for column in COLUMNS]
    rows = [
        [name, *(None if math.isnan(value) else round(float(value), 6) for value in row)]
        for name, row in zip(found.figures.names, np.stack(values, axis=1).tolist(), strict=True)
    ]
    return {
        "events": [[round(event.time, 4), event.kind.value, told(event)] for event in found.events.events],
        "leftOut": found.events.left_out,
        "columns": [
            {"key": each.key, "title": each.title, "unit": each.unit, "hint": each.hint, "decimals": each.decimals}
            for each in COLUMNS
        ],
        "reflectors": rows,
        "colored": colored,
        "scale": scale_of(found.figures, colored) if colored in BY_KEY else None,
    }


def palette() -> tuple[theme.Color, ...]:
    """Color of each class, the last one of what is unknown."""
    # Without the darkest two, which would not be seen on a dark floor.
    ramp = ((int(red), int(green), int(blue)) for red, green, blue in colors(CLASSES + 2)[2:])
    return (*ramp, theme.NOT_KNOWN)


def bounds_of(values: FloatArray) -> FloatArray:
    """(CLASSES + 1,) even steps from the least to the largest known value; none where nothing is known."""
    known = values[np.isfinite(values)]
    return np.linspace(known.min(), known.max(), CLASSES + 1) if len(known) else np.empty(0)


def classes_of(values: FloatArray) -> IntArray:
    """(M,) class of each value: index into the palette, the last one where it is unknown."""
    bounds = bounds_of(values)
    if not len(bounds):
        return np.full(len(values), CLASSES, dtype=np.int64)
    classes = np.digitize(values, bounds[1:-1])
    return np.where(np.isfinite(values), classes, CLASSES).astype(np.int64)


def scale_of(figures: ReflectorFigures, key: str) -> dict[str, Any]:
    """Return what the colors of the floor mean: name, and the color of each step with its bounds.

    Parameters
    ----------
    figures : of the drive.
    key : of the column.
    """
    column = BY_KEY[key]
    bounds = [f"{bound:.{column.decimals}f}" for bound in bounds_of(column.values(figures)).tolist()]
    named = f"{column.title} [{column.unit}]" if column.unit else column.title
    return {"title": named, "bounds": bounds, "colors": [theme.css(color) for color in palette()]}

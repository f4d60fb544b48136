"""From the figures of a coverage to classes of color: round bounds, few steps, one look for "no fix".

Bright asks for attention: few reflectors, large errors. Few steps keep the picture small on its way to the browser and
its values readable by eye; the colors grow evenly in lightness (after matplotlib's viridis) and are told apart by
color-blind people. Where there is no fix the floor is hatched, so that it is never taken for a value.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from commission.app.base.paints import Plan
from commission.app.base.ramp import colors
from commission.app.coverage.settings import COUNTED, Figure
from commission.geometry.arrays import BoolArray, FloatArray
from commission.planning.dilution import Measurement
from commission.site.quantity import BARE, DEGREES, MILLIMETRES, PERCENT, Shown

NOTHING, NO_FIX, FIRST = 0, 1, 2
"""Classes: beside the floor, no fix; the steps of the scale follow."""
MOST_BOUNDS = 9
NICE = (1.0, 1.5, 2.0, 3.0, 5.0, 7.0)
HATCH = 3
"""Width of a stripe, in points of the lattice."""
NO_FIX_COLORS = Plan.NO_FIX.dark, Plan.NO_FIX_HATCH.dark
COUNTS = (2.0, 3.0, 4.0, 6.0, 8.0, 12.0, 16.0)
CHANCES = (50.0, 70.0, 80.0, 90.0, 95.0, 98.0, 99.0, 99.9)


@dataclass(frozen=True, slots=True, kw_only=True)
class ShownFigure:
    """How a figure is shown."""

    label: str
    """Its name, with unit where it has one."""
    shown: Shown = BARE
    """Its unit on the page."""
    bounds: tuple[float, ...] = ()
    """Fixed bounds of its classes in the page's unit; none: chosen from the values."""
    more_is_better: bool = False
    """Whether a large number is good."""


QUANTITIES: dict[Figure, ShownFigure] = {
    Figure.VISIBLE: ShownFigure(label="Visible reflectors", bounds=COUNTS, more_is_better=True),
    Figure.POSITION_SIGMA: ShownFigure(label="Position error, 1σ [mm]", shown=MILLIMETRES),
    Figure.HEADING_SIGMA: ShownFigure(label="Heading error, 1σ [°]", shown=DEGREES),
    Figure.TOTAL_SIGMA: ShownFigure(label="With constants: position error, 1σ [mm]", shown=MILLIMETRES),
    Figure.CONTOUR_POSITION: ShownFigure(label="Contours: position error, 1σ [mm]", shown=MILLIMETRES),
    Figure.CONTOUR_HEADING: ShownFigure(label="Contours: heading error, 1σ [°]", shown=DEGREES),
    Figure.TAG_POSITION: ShownFigure(label="Tags: position error, 1σ [mm]", shown=MILLIMETRES),
    Figure.TAG_HEADING: ShownFigure(label="Tags: heading error, 1σ [°]", shown=DEGREES),
    Figure.REELS: ShownFigure(label="Reels as temporary landmarks", bounds=COUNTS, more_is_better=True),
    Figure.POSITION_DOP: ShownFigure(label="Position dilution (DOP)"),
    Figure.HEADING_DOP: ShownFigure(label="Heading dilution (DOP)"),
    Figure.EXPECTED_VISIBLE: ShownFigure(
        label="Among people: visible, mean", bounds=(1.0, *COUNTS), more_is_better=True
    ),
    Figure.TWO_OR_MORE: ShownFigure(
        label="2 or more seen: chance [%]", shown=PERCENT, bounds=CHANCES, more_is_better=True
    ),
    Figure.THREE_OR_MORE: ShownFigure(
        label="3 or more seen: chance [%]", shown=PERCENT, bounds=CHANCES, more_is_better=True
    ),
}


@dataclass(frozen=True, slots=True)
class Scale:
    """Classes of one figure."""

    figure: Figure
    """What it shows."""
    bounds: tuple[float, ...]
    """Where one class ends and the next begins, ascending, in the page's unit."""

    @property
    def quantity(self) -> ShownFigure:
        """How the figure is shown."""
        return QUANTITIES[self.figure]

    def colors(self) -> NDArray[np.uint8]:
        """(K, 3) color of each class, in the order of its values."""
        ramp = colors(len(self.bounds) + 1)
        return ramp[::-1] if self.quantity.more_is_better else ramp

    def classes(self, values: FloatArray, floor: BoolArray) -> NDArray[np.uint8]:
        """Class of each value.

        Parameters
        ----------
        values : (N,) array, SI; not finite where there is no fix.
        floor : (N,) whether there is floor at all.
        """
        shown = self.quantity.shown.of(values)
        # A hair, so that 3 reflectors and 0.95 are in the class that begins with them, however they were rounded.
        steps = np.digitize(shown * (1.0 + 1e-12), self.bounds).astype(np.uint8)
        found = np.where(is_fix(self.figure, values), steps + FIRST, NO_FIX)
        return np.where(floor, found, NOTHING).astype(np.uint8)


def is_fix(figure: Figure, values: ArrayLike) -> BoolArray:
    """Whether there is something to show: a fix, or for counts at least one reflector or reel."""
    return np.asarray(values) > 0.0 if figure in COUNTED else np.isfinite(values)


def scale_for(figure: Figure, values: FloatArray) -> Scale:
    """Choose round bounds for a figure.

    Parameters
    ----------
    figure : what is shown.
    values : (N,) array of it on the floor, SI; the bounds span all but the outer hundredths.
    """
    quantity = QUANTITIES[figure]
    if quantity.bounds:
        return Scale(figure, quantity.bounds)
    known = quantity.shown.of(np.sort(values[np.isfinite(values)]))
    if not len(known):
        return Scale(figure, (1.0,))
    low, high = (float(known[int(share * (len(known) - 1))]) for share in (0.02, 0.98))
    return Scale(figure, round_bounds(max(low, 1e-9), max(high, 1e-9)))


def round_bounds(low: float, high: float) -> tuple[float, ...]:
    """Return up to `MOST_BOUNDS` round numbers from about `low` to about `high`, both greater than 0."""
    first, last = math.floor(math.log10(low)), math.ceil(math.log10(high))
    every = [float(f"{nice}e{power}") for power in range(first, last + 1) for nice in NICE]
    inside = [bound for bound in every if low <= bound <= high]
    if not inside:
        return (min(every, key=lambda bound: abs(math.log(bound / low))),)
    step = math.ceil(len(inside) / MOST_BOUNDS)
    return tuple(inside[::step])


def picture(classes: NDArray[np.uint8], scale: Scale, opacity: float) -> NDArray[np.uint8]:
    """Return the (rows, columns, 4) picture of classes given as (rows, columns).

    Parameters
    ----------
    classes : (rows, columns) class of each spot, as `Scale.classes` gives them.
    scale : has the color of each class.
    opacity : on the floor [0..1]; what is beside it is transparent.
    """
    palette = np.zeros((256, 4), np.uint8)
    ramp = scale.colors()
    palette[FIRST : FIRST + len(ramp), :3] = ramp
    palette[NO_FIX:, 3] = round(255 * opacity)
    image = palette[classes]
    row, column = np.nonzero(classes == NO_FIX)
    image[row, column, :3] = np.array(NO_FIX_COLORS, np.uint8)[((row + column) // HATCH) % 2]
    return image


def unit_of(figure: Figure, measurement: Measurement) -> str:
    """Return the unit of a figure; a position's dilution of bearings alone is not a plain number."""
    triangulates = measurement is Measurement.BEARING_ONLY
    return "m/rad" if figure is Figure.POSITION_DOP and triangulates else QUANTITIES[figure].shown.unit

"""From the difference of two layouts over the floor to classes of color, symmetric around "the same". Pure."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from commission.app.base import theme
from commission.geometry.arrays import FloatArray
from commission.planning.coverage import Lattice
from commission.site.quantity import BARE, DEGREES, MILLIMETRES, Shown
from commission.studies.layouts import FloorDifference, FloorFigure

NOTHING, NEITHER, LOST, GAINED, SAME = 0, 1, 2, 3, 7
"""Classes: beside the floor; a fix with none of the two; one with the kept layout only; one now only; and in the middle
of those that say how much worse (below) or better (above) a fix is."""
STEPS = 3
"""Classes of worse, and as many of better."""
CLASSES = SAME + STEPS + 1
NICE = (1.0, 2.0, 5.0)
SPAN = 0.95
"""Share of the floor that has changed which is within the largest bound or beyond it by little."""
HATCH = 3
"""Width of a stripe, in points of the lattice."""
UNITS: dict[FloorFigure, Shown] = {
    FloorFigure.POSITION_SIGMA: MILLIMETRES,
    FloorFigure.HEADING_SIGMA: DEGREES,
    FloorFigure.VISIBLE: BARE,
}
COUNTS = (1.0, 2.0, 4.0)


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class DifferenceView:
    """How much better a fix is than with the kept layout, as the floor shows it."""

    lattice: Lattice
    """Its points."""
    figure: FloorFigure
    """What is compared."""
    bounds: tuple[float, ...]
    """(STEPS,) smallest difference of each class, in the page's unit, ascending."""
    classes: NDArray[np.uint8]
    """(rows, columns) class of each point; row 0 is the lowest y."""
    shares: FloatArray
    """(CLASSES - 1,) share of the floor in each class from `NEITHER` on [0..1]."""

    @property
    def better(self) -> float:
        """Share of the floor on which a fix is better, or is there now only [0..1]."""
        return float(self.shares[SAME : SAME + STEPS].sum() + self.shares[GAINED - 1])

    @property
    def worse(self) -> float:
        """Share of the floor on which it is worse, or is not there any more [0..1]."""
        return float(self.shares[SAME - STEPS - 1 : SAME - 1].sum() + self.shares[LOST - 1])


def difference_view(found: FloorDifference) -> DifferenceView:
    """Sort the difference at each point into classes.

    Parameters
    ----------
    found : the difference, SI.
    """
    gains = UNITS[found.figure].of(found.gains)
    bounds = COUNTS if found.figure is FloorFigure.VISIBLE else round_bounds(np.abs(gains[np.isfinite(gains)]))
    # A hair, so that a difference of just one bound is in the class that begins with it, however it was rounded.
    steps = np.digitize(np.abs(gains) * (1.0 + 1e-9), bounds)
    classes = np.where(np.isfinite(gains), SAME + np.sign(np.nan_to_num(gains)) * steps, NOTHING)
    for chosen, index in ((found.neither, NEITHER), (found.lost, LOST), (found.gained, GAINED)):
        classes[chosen] = index
    sorted_in = classes.astype(np.uint8)
    counts = np.bincount(sorted_in, minlength=CLASSES)[NEITHER:]
    return DifferenceView(
        lattice=found.lattice,
        figure=found.figure,
        bounds=bounds,
        classes=sorted_in.reshape(found.lattice.rows, found.lattice.columns),
        shares=counts / max(1, counts.sum()),
    )


def round_bounds(sizes: FloatArray) -> tuple[float, ...]:
    """Return `STEPS` round numbers, each about five times the one before, that tell apart how large differences are.

    Parameters
    ----------
    sizes : (N,) differences without their sign, in the page's unit; those of zero do not count.
    """
    changed = np.sort(sizes[sizes > 0.0])
    largest = float(changed[int(SPAN * (len(changed) - 1))]) if len(changed) else 1.0
    power = math.floor(math.log10(largest))
    every = [nice * 10.0**exponent for exponent in range(power - 3, power + 2) for nice in NICE]
    last = max(index for index, bound in enumerate(every) if bound <= largest * (1.0 + 1e-9))
    return tuple(float(f"{every[last - 2 * step]:.1g}") for step in reversed(range(STEPS)))


def picture(classes: NDArray[np.uint8], opacity: float) -> NDArray[np.uint8]:
    """Return the (rows, columns, 4) picture of classes given as (rows, columns); `opacity` is from 0 to 1."""
    palette = np.zeros((CLASSES, 4), np.uint8)
    colors = class_colors()
    for index, color in colors.items():
        palette[index] = (*color, round(255 * opacity))
    image = palette[classes]
    row, column = np.nonzero((classes >= NEITHER) & (classes <= GAINED))
    dark = ((row + column) // HATCH) % 2 == 1
    image[row[dark], column[dark], :3] = theme.NO_FIX_DARK
    return image


def class_colors() -> dict[int, theme.Color]:
    """Color of each class; those without a number are hatched with it."""
    steps = {SAME - 1 - index: color for index, color in enumerate(theme.WORSE)}
    steps |= {SAME + 1 + index: color for index, color in enumerate(theme.BETTER)}
    return steps | {
        NEITHER: theme.NO_FIX_NEITHER,
        LOST: theme.WORSE[-1],
        GAINED: theme.BETTER[-1],
        SAME: theme.NO_DIFFERENCE,
    }

"""What was found over the floor, as panels and layers draw it: frozen, newest wins."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from commission.app.base.view import PageView
from commission.app.coverage.following import Covered
from commission.app.coverage.scale import FIRST, NO_FIX, QUANTITIES, Scale
from commission.app.coverage.settings import Figure
from commission.geometry.arrays import FloatArray
from commission.planning.coverage import Lattice


@dataclass(frozen=True, slots=True)
class FloorReading:
    """Values at one place of the floor."""

    place: tuple[float, float]
    """Where [m], map frame."""
    values: dict[Figure, float]
    """Every figure, SI."""
    on_floor: bool
    """Whether a vehicle could stand there."""
    shares: tuple[float, ...] = ()
    """Share of each of `CONTRIBUTIONS` in the square of the error with constants [0..1]; none where it is not shown."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class HeatView:
    """A heatmap."""

    lattice: Lattice
    """Its points."""
    scale: Scale
    """Its classes."""
    classes: NDArray[np.uint8]
    """(rows, columns) class of each point; row 0 is the lowest y."""
    shares: FloatArray
    """Share of the floor in each class, from `NO_FIX` on [0..1]."""
    outdated: bool
    """Whether the site has changed since, and it is being computed anew."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class EllipseView:
    """Ellipses of a fix."""

    centers: FloatArray
    """(N, 2) where [m], map frame."""
    covariances: FloatArray
    """(N, 2, 2) of the position [m^2]."""
    factor: float
    """At which they are drawn."""
    without_fix: int
    """Number of chosen points where there is no fix, and so no ellipse."""
    too_large: int
    """Number of those on the grid that would hide the others, and are not drawn."""


@dataclass(frozen=True, slots=True, eq=False)
class CoverageView:
    """Everything that was found over the floor."""

    heat: HeatView | None = None
    """The heatmap."""
    reading: FloorReading | None = None
    """Values at the place that was clicked."""
    ellipses: EllipseView | None = None
    """Ellipses on the heatmap."""


NOTHING = CoverageView()


def coverage_of(view: PageView) -> CoverageView:
    """Return what was found; nothing before the service has followed."""
    return view.part(CoverageView) or NOTHING


def heat_view(covered: Covered, scale: Scale, *, outdated: bool) -> HeatView:
    """Sort the figure into the classes of its scale.

    Parameters
    ----------
    covered : the figures of each spot, and where a vehicle could stand.
    scale : the figure, and the bounds of its classes.
    outdated : whether the project has changed since.
    """
    lattice = covered.live.coverage.lattice
    classes = scale.classes(covered.values(scale.figure), covered.floor)
    counts = np.bincount(classes, minlength=FIRST + len(scale.bounds) + 1)[NO_FIX:]
    return HeatView(
        lattice=lattice,
        scale=scale,
        classes=classes.reshape(lattice.rows, lattice.columns),
        shares=counts / max(1, counts.sum()),
        outdated=outdated,
    )


def reading_of(covered: Covered, probe: tuple[float, float]) -> FloorReading | None:
    """Read every figure at a place; none beside the lattice."""
    index = covered.live.coverage.lattice.index_near(*probe)
    if index is None:
        return None
    shown = [figure for figure in QUANTITIES if covered.has(figure)]
    values = {figure: float(covered.values(figure)[index]) for figure in shown}
    shares = () if covered.budget is None else tuple(covered.budget.shares[index].tolist())
    return FloorReading(probe, values, bool(covered.floor[index]), shares)

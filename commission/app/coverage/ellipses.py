"""Ellipses of a fix at chosen points of the heatmap's lattice, under the same conditions as the heatmap."""

from __future__ import annotations

import numpy as np

from commission.app.coverage.following import Covered
from commission.app.coverage.settings import Place
from commission.app.coverage.view import EllipseView
from commission.geometry.arrays import IntArray
from commission.geometry.gaussian import ellipse_axes
from commission.planning.fix_ellipses import every_nth, position_covariances

ALONG = 14
"""Ellipses along the longer side of a grid of them."""
LARGEST = 0.06
"""Half the length of the largest ellipse of a grid, as drawn, in lengths of the longer side."""


def ellipses(covered: Covered, places: tuple[Place, ...], factor: float, *, grid: bool) -> EllipseView:
    """Return the ellipses at the lattice's points nearest to places, or to those of a coarse grid, too.

    Parameters
    ----------
    covered : the heatmap.
    places : where [m], map frame; beside the lattice, or where no vehicle could stand, there is none.
    factor : at which they are drawn.
    grid : whether to add a coarse grid of them.
    """
    lattice, options = covered.live.coverage.lattice, covered.live.coverage.options
    near = np.array([index for index in (lattice.index_near(*place) for place in places) if index is not None], int)
    chosen = np.unique(np.concatenate([near, _coarse(covered) if grid else near]))
    chosen = chosen[(covered.floor & covered.live.coverage.counts)[chosen]]
    points = lattice.points()[chosen]
    covariances = position_covariances(covered.live.visible, points, options)
    known = np.isfinite(covariances).all(axis=(1, 2))
    lengths = np.full(len(points), np.inf)
    lengths[known] = factor * ellipse_axes(covariances[known])[0].max(axis=-1, initial=0.0)
    # Who asks for one sees it; of a grid, a few huge ones would hide all others.
    most = LARGEST * lattice.spacing * max(lattice.rows, lattice.columns)
    shown = known & (np.isin(chosen, near) | (lengths <= most))
    return EllipseView(
        centers=points[shown],
        covariances=covariances[shown],
        factor=factor,
        without_fix=int((~known).sum()),
        too_large=int((known & ~shown).sum()),
    )


def _coarse(covered: Covered) -> IntArray:
    """Indices of a grid of lattice points that can be told apart on the page."""
    lattice = covered.live.coverage.lattice
    return every_nth(lattice, max(1, round(max(lattice.rows, lattice.columns) / ALONG)))

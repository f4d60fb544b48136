"""Ellipses of a fix at chosen points of the heatmap's lattice, under the same conditions as the heatmap."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from commission.app.plan.settings import Place
from commission.app.plan.view import EllipseView
from commission.app.plan.work import Covered
from commission.geometry.arrays import FloatArray, IntArray
from commission.geometry.gaussian import ellipse_axes
from commission.planning.dilution import FixOptions, Heading, fix_covariances
from commission.planning.visibility import VisibilityModel

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
    chosen = chosen[covered.floor[chosen]]
    points = lattice.points()[chosen]
    covariances = _covariances(covered.live.model, points, options)
    known = np.isfinite(covariances).all(axis=(1, 2))
    lengths = np.full(len(points), np.inf)
    lengths[known] = factor * ellipse_axes(covariances[known])[0].max(axis=-1, initial=0.0)
    # Who asks for one sees it; of a grid, a few huge ones would hide all others.
    most = LARGEST * lattice.spacing * max(lattice.rows, lattice.columns)
    shown = known & (np.isin(chosen, near) | (lengths <= most))
    return EllipseView(points[shown], covariances[shown], factor, int((~known).sum()), int((known & ~shown).sum()))


def _coarse(covered: Covered) -> IntArray:
    """Indices of every n-th point of every n-th row."""
    lattice = covered.live.coverage.lattice
    step = max(1, round(max(lattice.rows, lattice.columns) / ALONG))
    rows, columns = np.arange(step // 2, lattice.rows, step), np.arange(step // 2, lattice.columns, step)
    return (rows[:, np.newaxis] * lattice.columns + columns).reshape(-1)


def _covariances(model: VisibilityModel, points: FloatArray, options: FixOptions) -> FloatArray:
    """(N, 2, 2) covariance of the position at each point [m^2]; infinite where there is no fix.

    Of several headings it is that with the longest (worst) or shortest (best) longest axis, which is what the heatmap
    of the position error shows.
    """
    if options.heading is Heading.GIVEN:
        headings = np.array([options.given_heading])
    else:
        # Here the points are places of the scanner and not of the base, as in the heatmap.
        mounting = np.array([0.0, 0.0, float(model.scanner.mounting[2])])
        model = replace(model, scanner=replace(model.scanner, mounting=mounting))
        count = 1 if options.heading is Heading.ALL_ROUND else options.headings
        headings = np.arange(count) * (2.0 * np.pi / count)
    poses = np.column_stack((np.tile(points, (len(headings), 1)), np.repeat(headings, len(points))))
    found = fix_covariances(model, poses, options)[:, :2, :2].reshape(len(headings), len(points), 2, 2)
    known = np.isfinite(found).all(axis=(2, 3))
    longest = np.full(found.shape[:2], np.inf)
    longest[known] = ellipse_axes(found[known])[0].max(axis=-1)
    pick = longest.argmin(axis=0) if options.heading is Heading.BEST else longest.argmax(axis=0)
    return found[pick, np.arange(len(points))]

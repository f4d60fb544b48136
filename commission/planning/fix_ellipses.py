"""The position's covariance of a fix at single points, where `coverage` has the length of its longest axis alone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from commission.geometry.arrays import FloatArray, IntArray
from commission.geometry.gaussian import ellipse_axes
from commission.planning.coverage import Lattice
from commission.planning.dilution import FixOptions, Heading, fix_covariances
from commission.planning.visibility import VisibilityModel


def position_covariances(model: VisibilityModel, points: FloatArray, options: FixOptions) -> FloatArray:
    """Covariance of the position of a fix.

    Parameters
    ----------
    model : what is visible.
    points : (N, 2) [m], map frame; what they are places of is as in `coverage`.
    options : measurement model and headings. Of several headings the covariance is that with the longest (worst) or
        shortest (best) longest axis.

    Returns
    -------
    covariances : (N, 2, 2) array [m^2]; infinite where there is no fix.
    """
    if options.heading is Heading.GIVEN:
        headings = np.array([options.given_heading])
    else:
        # Here the points are places of the scanner and not of the base.
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


def every_nth(lattice: Lattice, step: int) -> IntArray:
    """Indices of every n-th point of every n-th row of a lattice, so that they lie about its middle."""
    rows, columns = np.arange(step // 2, lattice.rows, step), np.arange(step // 2, lattice.columns, step)
    return (rows[:, np.newaxis] * lattice.columns + columns).reshape(-1)

"""The position's covariance of a fix at single points, where `coverage` has the length of its longest axis alone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from commission.geometry.arrays import FloatArray, IntArray
from commission.geometry.gaussian import ellipse_axes
from commission.planning.coverage import Lattice
from commission.planning.dilution import FixOptions, Heading
from commission.planning.vehicle_fixes import fix_covariances, views_of
from commission.planning.vehicle_visibility import VehicleVisibility
from commission.planning.visibility import VisibilityModel


def position_covariances(visible: VehicleVisibility, points: FloatArray, options: FixOptions) -> FloatArray:
    """Covariance of the position of a fix.

    Parameters
    ----------
    visible : what is visible.
    points : (N, 2) [m], map frame; what they are places of is as in `coverage`.
    options : measurement model and headings. Of several headings the covariance is that with the longest (worst) or
        shortest (best) longest axis.

    Returns
    -------
    covariances : (N, 2, 2) array [m^2]; infinite where there is no fix.
    """
    all_round = options.heading is Heading.ALL_ROUND
    if options.heading is Heading.GIVEN:
        headings = np.array([options.given_heading])
    else:
        if all_round or len(visible.models) == 1:
            # Here the points are places of the scanner and not of the base.
            visible = VehicleVisibility(tuple(map(_at_base, visible.models)))
        count = 1 if all_round else options.headings
        headings = np.arange(count) * (2.0 * np.pi / count)
    poses = np.column_stack((np.tile(points, (len(headings), 1)), np.repeat(headings, len(points))))
    found = fix_covariances(visible, poses, options)[:, :2, :2].reshape(len(headings), len(points), 2, 2)
    known = np.isfinite(found).all(axis=(2, 3))
    longest = np.full(found.shape[:2], np.inf)
    longest[known] = ellipse_axes(found[known])[0].max(axis=-1)
    views = views_of(visible.scanners, options)
    stands = views.stands(views.places(points), visible.caster).T
    # A heading that puts a scanner into a wall is none; where there is no other, there is no fix.
    found[:, ~stands.any(axis=0)] = np.inf
    if options.heading is Heading.BEST:
        pick = np.where(stands, longest, np.inf).argmin(axis=0)
    else:
        pick = np.where(stands, longest, -np.inf).argmax(axis=0)
    return found[pick, np.arange(len(points))]


def _at_base(model: VisibilityModel) -> VisibilityModel:
    """A scanner that looks as it does and stands where the base is."""
    mounting = np.array([0.0, 0.0, float(model.scanner.mounting[2])])
    return replace(model, scanner=replace(model.scanner, mounting=mounting))


def every_nth(lattice: Lattice, step: int) -> IntArray:
    """Indices of every n-th point of every n-th row of a lattice, so that they lie about its middle."""
    rows, columns = np.arange(step // 2, lattice.rows, step), np.arange(step // 2, lattice.columns, step)
    return (rows[:, np.newaxis] * lattice.columns + columns).reshape(-1)

"""Coverage of a site: what its scanner sees over the floor and how well it can localize there, with a summary.

The figures themselves come from `planning`; files and images are elsewhere.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from commission.geometry.arrays import BoolArray, FloatArray
from commission.geometry.gaussian import ellipse_axes
from commission.planning.coverage import Coverage, coverage, lattice_of
from commission.planning.dilution import FixOptions
from commission.planning.fix_ellipses import every_nth, position_covariances
from commission.planning.visibility import VisibilityOptions, visibility_model
from commission.progress import Progress, silent
from commission.site.floor_map import FREE
from commission.site.parameters import SupervisorParameters
from commission.site.project import Project

Number = int | float | None


def coverage_of(
    project: Project,
    options: FixOptions,
    *,
    spacing: float = 0.25,
    visibility: VisibilityOptions | None = None,
    progress: Progress = silent,
) -> Coverage:
    """Visibility and dilution over the floor of a project.

    Parameters
    ----------
    project : the site.
    options : measurement model and headings.
    spacing : distance between neighboring points [m].
    visibility : what counts as visible; the defaults when None.
    progress : called with the fraction done [0..1] and what is being done; may raise to cancel.
    """
    return coverage(visibility_model(project, visibility), lattice_of(project, spacing), options, progress)


@dataclass(frozen=True, slots=True, eq=False)
class Ellipses:
    """1-sigma ellipses of a fix at N points of drivable floor that have one."""

    points: FloatArray
    """(N, 2) their centers [m], map frame."""
    semi_axes: FloatArray
    """(N, 2) half their lengths [m], the longer one first."""
    angles: FloatArray
    """(N,) direction of the longer axis [rad], map frame."""


def ellipses_of(project: Project, found: Coverage, spacing: float, visibility: VisibilityOptions) -> Ellipses:
    """Ellipses at points of the lattice of a coverage, under its conditions.

    Parameters
    ----------
    project, found, visibility : of `coverage_of`.
    spacing : least distance between two of them [m].
    """
    chosen = every_nth(found.lattice, max(1, math.ceil(spacing / found.lattice.spacing - 1e-9)))
    points = found.lattice.points()[chosen[drivable(project, found)[chosen]]]
    covariances = position_covariances(visibility_model(project, visibility), points, found.options)
    known = np.isfinite(covariances).all(axis=(1, 2))
    return Ellipses(points[known], *ellipse_axes(covariances[known]))


def drivable(project: Project, found: Coverage) -> BoolArray:
    """Whether each point lies on floor that the map knows to be free: (N,) array; all of it without a map."""
    return np.array(found.floor) if project.floor_map is None else free_floor(project, found.lattice.points())


def free_floor(project: Project, points: FloatArray) -> BoolArray:
    """Whether points (N, 2) [m, map frame] lie on floor that the map knows to be free; all do without a map."""
    if project.floor_map is None:
        return np.ones(len(points), dtype=np.bool_)
    grid = project.floor_map.occupancy()
    cells = grid.cells_at(points)
    inside = np.all((cells >= 0) & (cells < project.floor_map.cells.shape), axis=-1)
    row, column = np.where(inside[:, np.newaxis], cells, 0).T
    return inside & (project.floor_map.cells[row, column] == FREE)


def summary(project: Project, found: Coverage) -> dict[str, Number]:
    """Entries of `summary.json`, by their keys; shares are of the drivable floor, None where it has no area.

    Parameters
    ----------
    project : the site; its supervisor's limits are what a fix is held against.
    found : of `coverage_of`.
    """
    on = drivable(project, found)
    fixes, limits = found.fixes, project.parameters.supervisor
    entries: dict[str, Number] = {
        "points": int(on.sum()),
        "spacing_m": found.lattice.spacing,
        "area_m2": float(on.sum() * found.lattice.spacing**2),
        "reflectors": len(project.reflectors),
        "visible_mean": _mean(fixes.visible[on]),
        "visible_min": int(fixes.visible[on].min()) if on.any() else None,
    }
    for count in (1, 2, 3):
        entries[f"share_{count}_visible"] = _mean(fixes.visible[on] >= count)
    if found.options.blocked_per_m > 0.0:
        entries |= {
            "expected_visible_mean": _mean(fixes.expected_visible[on]),
            "two_or_more_mean": _mean(fixes.two_or_more[on]),
            "three_or_more_mean": _mean(fixes.three_or_more[on]),
        }
    regular = on & np.isfinite(fixes.position_sigma)
    entries["share_with_fix"] = _mean(regular[on])
    entries["share_within_limits"] = _mean(within_limits(found, limits)[on])
    for name, values in (("position_sigma", fixes.position_sigma), ("heading_sigma", fixes.heading_sigma)):
        unit = "m" if name == "position_sigma" else "rad"
        for quantile, label in ((0.5, "median"), (0.95, "p95")):
            # Of the whole floor: where more than a twentieth has no fix, the 95 % quantile does not exist.
            entries[f"{name}_{label}_{unit}"] = _quantile(values[on], quantile)
    return entries


def within_limits(found: Coverage, limits: SupervisorParameters) -> BoolArray:
    """Whether two sigma of a single fix stay below the supervisor's limits at each point: (N,) array."""
    position_ok = 2.0 * found.fixes.position_sigma <= limits.position_limit
    return position_ok & (2.0 * found.fixes.heading_sigma <= limits.heading_limit)


def _mean(values: NDArray[np.float64] | NDArray[np.int32] | BoolArray) -> float | None:
    """Mean, None of nothing."""
    return float(np.mean(values, dtype=np.float64)) if len(values) else None


def _quantile(values: NDArray[np.float64], share: float) -> float | None:
    """Value that a share of the points does not exceed; None where it is infinite."""
    if len(values) == 0:
        return None
    found = float(np.sort(values)[min(len(values) - 1, int(share * len(values)))])
    return found if np.isfinite(found) else None

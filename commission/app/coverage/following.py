"""A coverage that follows reflectors while they are dragged: the study's result, and what it takes to keep it up."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from commission.app.coverage.settings import Figure
from commission.geometry.arrays import BoolArray, FloatArray, IntArray
from commission.planning import coverage as coverage_kernels
from commission.planning.contour_coverage import ContourCoverage
from commission.planning.coverage import LiveCoverage
from commission.planning.floor_budget import FloorBudget
from commission.planning.tag_coverage import TagCoverage
from commission.progress import Progress, part
from commission.site.reflectors import ReflectorMap
from commission.studies.coverage import CoverageInput, coverage

MOST_MOVED = 12
"""Reflectors that are moved one by one; the floor is computed anew when more have changed."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Covered:
    """A coverage that can be kept up to date."""

    live: LiveCoverage
    """The figures; whoever holds this result may move reflectors."""
    floor: BoolArray
    """(N,) where a vehicle could stand."""
    budget: FloorBudget | None = None
    """The error of a fix with all constants, where it is asked for: of the reflectors as they were at first."""
    contours: ContourCoverage | None = None
    """What contours tell, where it is asked for and there is a floor map."""
    tags: TagCoverage | None = None
    """What tags tell, where it is asked for."""
    reels: IntArray | None = None
    """(N,) temporary landmarks in sight, where it is asked for."""

    def values(self, figure: Figure) -> FloatArray:
        """(N,) a figure of the floor, SI; infinite where it is not known."""
        beside = self._beside_fixes()
        if figure not in beside:
            return getattr(self.live.coverage.fixes, figure.value)
        found = beside[figure]
        return np.full(len(self.floor), math.inf) if found is None else found

    def has(self, figure: Figure) -> bool:
        """Whether a figure was computed."""
        return self._beside_fixes().get(figure, self.floor) is not None

    def _beside_fixes(self) -> dict[Figure, FloatArray | None]:
        """Figures that are not of a fix by reflectors; None where they were not asked for."""
        contours, tags = self.contours, self.tags
        return {
            Figure.TOTAL_SIGMA: None if self.budget is None else self.budget.sigma,
            Figure.CONTOUR_POSITION: None if contours is None else contours.position_sigma,
            Figure.CONTOUR_HEADING: None if contours is None else contours.heading_sigma,
            Figure.TAG_POSITION: None if tags is None else tags.position_sigma,
            Figure.TAG_HEADING: None if tags is None else tags.heading_sigma,
            Figure.REELS: None if self.reels is None else self.reels.astype(np.float64),
        }

    def follow(self, before: CoverageInput, now: CoverageInput) -> bool:
        """Move the reflectors that were moved, where nothing else is different.

        Parameters
        ----------
        before : what the figures are of.
        now : what they should be of.

        Returns
        -------
        followed : whether they are; else they are as they were.
        """
        if replace(now, reflectors=before.reflectors) != before or self.budget is not None:
            # A budget does not follow reflectors: it is computed anew.
            return False
        changed = changed_reflectors(self.live.reflectors, now.reflectors)
        # Without a floor map the reflectors say how far the floor reaches.
        if changed is None or (now.floor_map is None and now.lattice() != self.live.coverage.lattice):
            return False
        for index in changed:
            self.live.move(index, now.reflectors.reflectors[index])
        return True


def cover(inputs: CoverageInput, progress: Progress) -> Covered:
    """Compute the coverage of the floor, and keep what it takes to follow reflectors.

    Parameters
    ----------
    inputs : the site and what is asked.
    progress : told how far it is; may raise to cancel.
    """
    found = coverage(inputs, part(progress, 0.0, 0.95))
    progress(0.95, "compiling moved reflectors")
    coverage_kernels.warm_up()
    live = LiveCoverage(found.visible, found.coverage)
    return Covered(
        live=live,
        floor=found.drivable,
        budget=found.budget,
        contours=found.contours,
        tags=found.tags,
        reels=found.reels,
    )


def changed_reflectors(before: ReflectorMap, after: ReflectorMap) -> list[int] | None:
    """Return the indices of the reflectors that changed; none when there are other ones, or too many."""
    if len(before) != len(after):
        return None
    pairs = zip(before.reflectors, after.reflectors, strict=True)
    changed = [index for index, (old, new) in enumerate(pairs) if old != new]
    return changed if len(changed) <= MOST_MOVED else None

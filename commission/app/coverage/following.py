"""A coverage that follows reflectors while they are dragged: the study's result, and what it takes to keep it up."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from commission.app.coverage.settings import BY_CONTOURS, BY_TAGS, Figure
from commission.geometry.arrays import BoolArray, FloatArray
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

    def values(self, figure: Figure) -> FloatArray:
        """(N,) a figure of the floor, SI; infinite where it is not known."""
        nothing = np.full(len(self.floor), math.inf)
        if figure is Figure.TOTAL_SIGMA:
            return nothing if self.budget is None else self.budget.sigma
        if figure is Figure.CONTOUR_POSITION:
            return nothing if self.contours is None else self.contours.position_sigma
        if figure is Figure.CONTOUR_HEADING:
            return nothing if self.contours is None else self.contours.heading_sigma
        if figure is Figure.TAG_POSITION:
            return nothing if self.tags is None else self.tags.position_sigma
        if figure is Figure.TAG_HEADING:
            return nothing if self.tags is None else self.tags.heading_sigma
        return getattr(self.live.coverage.fixes, figure.value)

    def has(self, figure: Figure) -> bool:
        """Whether a figure was computed."""
        if figure is Figure.TOTAL_SIGMA:
            return self.budget is not None
        if figure in BY_TAGS:
            return self.tags is not None
        return self.contours is not None if figure in BY_CONTOURS else True

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
    return Covered(live=live, floor=found.drivable, budget=found.budget, contours=found.contours, tags=found.tags)


def changed_reflectors(before: ReflectorMap, after: ReflectorMap) -> list[int] | None:
    """Return the indices of the reflectors that changed; none when there are other ones, or too many."""
    if len(before) != len(after):
        return None
    pairs = zip(before.reflectors, after.reflectors, strict=True)
    changed = [index for index, (old, new) in enumerate(pairs) if old != new]
    return changed if len(changed) <= MOST_MOVED else None

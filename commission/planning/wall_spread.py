"""Reflectors spread along walls: no place there that a route sees is far from the nearest one.

What is near does not say what is seen; that is for the other demands.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from commission.geometry.arrays import BoolArray, FloatArray
from commission.planning.route_prediction import PlannedRoute
from commission.planning.telling_apart import nearest_on_routes
from commission.planning.unmet import Unmet


class WallSpread:
    """The demand that reflectors spread along the walls: rows of a covering problem.

    Parameters
    ----------
    planned : the routes, with all M reflectors that could be taken.
    covers : of each route, (K, M) whether each reflector is seen at each scan.
    centers : (M, 2) of the reflectors [m], map frame.
    reach : how far a place may be from the nearest reflector [m]; 0: any distance.
    """

    def __init__(
        self, planned: Sequence[PlannedRoute], covers: Sequence[BoolArray], centers: FloatArray, reach: float
    ) -> None:
        self._planned = planned
        seen = np.zeros(len(centers), np.bool_)
        for each in covers:
            seen |= each.any(axis=0)
        self._places = centers[seen] if reach > 0.0 else np.zeros((0, 2))
        self.rows: BoolArray = far_from(self._places, centers) <= reach
        """(P, M) which reflectors are near enough to each place that a route sees; one of them is needed."""
        # One that no route sees is no use.
        self.rows &= seen

    def unmet(self, taken: BoolArray) -> Iterator[Unmet]:
        """Metres of the routes that are nearest to places that no reflector of a layout (M,) is near to."""
        found: dict[str, set[int]] = {}
        for place in self._places[~self.rows[:, taken].any(axis=1)]:
            route, metres = nearest_on_routes(place, self._planned)
            found.setdefault(route, set()).update(metres)
        for route, numbers in found.items():
            yield Unmet(route=route, metres=tuple(sorted(numbers)), reason="spread")


def far_from(places: FloatArray, centers: FloatArray) -> FloatArray:
    """(P, M) distance of each of some places (P, 2) from each reflector (M, 2) [m]."""
    delta = places[:, np.newaxis] - centers
    return np.hypot(delta[..., 0], delta[..., 1])

"""Where a vehicle could take its place for another one, as panels and layers draw it; unasked, none."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

from commission.app.ambiguity.cold_start import AmbiguousFloor
from commission.geometry.arrays import FloatArray

Pose: TypeAlias = tuple[float, float, float]
"""x, y and heading of base, map frame [m, m, rad]."""


@dataclass(frozen=True, slots=True, eq=False)
class TwinsView:
    """One pair of look-alikes: two groups of reflectors, and two poses that see the same."""

    groups: tuple[FloatArray, FloatArray]
    """(n, 2) places of the reflectors of each group [m], in the same order."""
    poses: tuple[Pose, Pose]
    """A pose that sees the first group, and the one that sees the second alike [m, m, rad]."""


@dataclass(frozen=True, slots=True, eq=False)
class ColdStartView:
    """Where a vehicle could take its place for another one."""

    ambiguity: AmbiguousFloor
    """Map and pairs."""
    twins: TwinsView | None
    """The pair that is shown on the floor."""
    is_drawn: bool
    """Whether its map is: where a heatmap is, it is not."""
    outdated: bool
    """Whether the site or the tolerance has changed since."""


def cold_start_view(ambiguity: AmbiguousFloor, shown: int, *, is_drawn: bool, outdated: bool) -> ColdStartView:
    """Find the reflectors and poses of the pair that is shown.

    Parameters
    ----------
    ambiguity : map and pairs.
    shown : which pair is shown, in the order of the list; -1: none.
    is_drawn : whether the map is.
    outdated : whether the site or the tolerance has changed since.
    """
    twins = None
    if 0 <= shown < len(ambiguity.pairs):
        pair = ambiguity.pairs[shown]
        centers = ambiguity.reflectors.centers
        groups = centers[list(pair.constellation)], centers[list(pair.image)]
        twins = TwinsView(groups, (pair.example, pair.partner))
    return ColdStartView(ambiguity, twins, is_drawn, outdated)

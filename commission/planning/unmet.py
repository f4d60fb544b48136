"""Where a demand does not hold, how near to it anything that could be put up would come, and what would help."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from commission.geometry.arrays import FloatArray, read_only
from commission.planning.error_budget import CONTRIBUTIONS, predict_errors
from commission.planning.route_prediction import PlannedRoute, predict_route
from commission.site.quantity import MILLIMETRES, PERCENT, PLAIN_DEGREES

REMEDIES = {
    "noise": "the noise of odometry and beams: drive slower, or take a scanner with less of it",
    "map": "the survey: survey the reflectors better",
    "mounting": "the mounting: measure better how the scanner is mounted",
    "range": "the range bias: calibrate the scanner's ranges",
    "clock": "the clock: synchronize that of the scanner, or drive slower",
}
"""What each of `CONTRIBUTIONS` is, and what makes it smaller."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Beyond:
    """N metres of a route on which a layout passes a limit; each by its worst scan. Arrays are read-only."""

    metres: tuple[int, ...]
    """Numbers of the metres."""
    is_heading: tuple[bool, ...]
    """Whether it is the limit of the heading [rad] that is passed, and not that of x or y [m]."""
    limits: FloatArray
    """(N,) demanded 2-sigma [m or rad]."""
    kept: FloatArray
    """(N,) 2-sigma that the layout keeps, whichever single reflector fails where that is demanded [m or rad]."""
    best: FloatArray
    """(N,) the same with a reflector at every place [m or rad]."""
    parts: FloatArray
    """(N, 5) what of the square of the best each of `CONTRIBUTIONS` has [0..1]."""

    def worst(self) -> int:
        """Return which of the metres is farthest over its limit."""
        return int((self.kept / self.limits).argmax())

    def between(self, first: int, last: int) -> Beyond:
        """Return the metres from `first` to before `last`."""
        inside = [index for index, metre in enumerate(self.metres) if first <= metre < last]
        return Beyond(
            metres=tuple(self.metres[index] for index in inside),
            is_heading=tuple(self.is_heading[index] for index in inside),
            limits=read_only(self.limits[inside]),
            kept=read_only(self.kept[inside]),
            best=read_only(self.best[inside]),
            parts=read_only(self.parts[inside]),
        )

    def is_out_of_reach(self) -> bool:
        """Whether the worst metre passes its limit with a reflector at every place as well."""
        return bool(self.best[self.worst()] > self.limits[self.worst()])

    def told(self) -> str:
        """Say how far off the worst metre is, how near a reflector at every place would come, and what would help."""
        worst = self.worst()
        shown, form = (PLAIN_DEGREES, ".3f") if self.is_heading[worst] else (MILLIMETRES, ".1f")
        kept, limit, best = (float(each[worst]) for each in (self.kept, self.limits, self.best))
        far = f"2-sigma {shown.number(kept, form)} / {shown.text(limit, form)} at metre {self.metres[worst]}"
        if not self.is_out_of_reach():
            return f"{far}; {shown.text(best, form)} with every place taken: less leeway gets nearer, with far more"
        part, share = self.main_part()
        helps = f"{PERCENT.text(share, '.0f')} of its square is {REMEDIES[part]}"
        return f"{far}; out of reach: {shown.text(best, form)} with every place taken; {helps}"

    def main_part(self) -> tuple[str, float]:
        """Return which of `CONTRIBUTIONS` has the largest part at the worst metre, and its share of the square."""
        shares = self.parts[self.worst()]
        return CONTRIBUTIONS[int(shares.argmax())], float(shares.max())


@dataclass(frozen=True, slots=True, kw_only=True)
class Unmet:
    """Where a demand does not hold."""

    route: str
    """Name of the route; of an ambiguous place the route that leads nearest to it."""
    metres: tuple[int, ...]
    """Metres of its way; of an ambiguous place the metre nearest to it."""
    reason: str
    """`visible`, `uncertainty`, `ambiguous`, `pairs` (two alike) or `spread` (a place is far from any reflector)."""
    place: str = ""
    """Which place is ambiguous."""
    beyond: Beyond | None = None
    """Of an uncertainty, by how much."""

    def stretches(self) -> tuple[tuple[int, int], ...]:
        """Return the metres in a row together: the first, and the one at which the stretch ends."""
        rows = np.split(np.array(self.metres, np.int64), np.flatnonzero(np.diff(self.metres) > 1) + 1)
        return tuple((int(row[0]), int(row[-1]) + 1) for row in rows if len(row))


def beyond(planned: PlannedRoute, kept: FloatArray, limits: FloatArray, best: FloatArray) -> Beyond | None:
    """Return the metres on which a limit is passed; None where there are none.

    Parameters
    ----------
    planned : the route, with a reflector at every place.
    kept : (K, 3) 2-sigma of x [m], y [m] and heading [rad] of the layout.
    limits : (K, 3) demanded.
    best : (K, 3) with a reflector at every place.
    """
    shares = (kept / limits).max(axis=1)
    over = np.flatnonzero(shares > 1.0)
    if len(over) == 0:
        return None
    numbers = planned.drive.metres[over].astype(np.int64)
    # The worst scan of each metre comes first of those of its metre.
    order = np.lexsort((-shares[over], numbers))
    metres, first = np.unique(numbers[order], return_index=True)
    scans = over[order][first]
    axes = (kept / limits)[scans].argmax(axis=1)
    parts = predict_errors(planned, predict_route(planned)).parts[scans, :, axes, axes]
    return Beyond(
        metres=tuple(metres.tolist()),
        is_heading=tuple((axes == 2).tolist()),
        limits=read_only(limits[scans, axes]),
        kept=read_only(kept[scans, axes]),
        best=read_only(best[scans, axes]),
        parts=read_only(parts / np.maximum(parts.sum(axis=1, keepdims=True), 1e-30)),
    )

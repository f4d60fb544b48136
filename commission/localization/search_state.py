"""What is remembered while a vehicle does not know where it is: a value in the filter's state. No step in here."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from commission.geometry.arrays import FloatArray, read_only
from commission.localization.beam_ends import Ends, no_ends
from commission.localization.hypothesis_fit import ROW
from commission.localization.pose_gaussian import PoseGaussian
from commission.localization.sightings import COLUMNS
from commission.localization.trail import no_trail
from commission.localization.trail_fit import Trail

PATIENCE = 0.02
"""Share of the time of the search that lies between two attempts: what was not found in a minute comes no sooner by
ten attempts a second."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class ContourViews:
    """Hypotheses by the contours of the hall; arrays are read-only."""

    hypotheses: FloatArray
    """(H, ROW) see `start`, the likeliest first; in place of things that fit, percent of the points that do."""
    past: FloatArray
    """(H,) what views before the newest one that counts said of each: log of how much likelier than anywhere."""
    said: FloatArray
    """(H,) what the newest one says."""
    judged_ns: int
    """Stamp of the last attempt [ns]."""
    view: tuple[float, float, float]
    """Pose of base in the frame of odometry at the newest view that counts [m, m, rad]."""
    scanner: int
    """Which scanner it was of."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Search:
    """What is remembered while the vehicle does not know where it is; arrays are read-only."""

    since_ns: int
    """When the search began [ns]."""
    around: PoseGaussian | None
    """The last good pose, as uncertain as it is by now; None: there is none."""
    track: PoseGaussian
    """Pose of base in the frame of odometry, which is base when the search began; covariance since the last scan."""
    drift: tuple[float, float] = (0.0, 0.0)
    """Variance of odometry up to the last scan: position [m^2], heading [rad^2]."""
    things: FloatArray
    """(C, COLUMNS) what was seen, see `sightings`."""
    views: FloatArray
    """(V, 5) pose of scanners in the frame of odometry, scanner, and time [s]."""
    ends: Ends
    """(V, BINS) where the beams of each view end, see `beam_ends`."""
    hypotheses: FloatArray
    """(H, ROW) see `start`, the likeliest first."""
    searched_ns: int
    """Stamp of the last search of all pairs [ns]."""
    judged_ns: int
    """Stamp of the last attempt [ns]."""
    trail: Trail
    """Scans of the way since the search began."""
    way: float
    """How much of the way lies behind the last attempt to explain the trail, see `way_between`."""
    explained: FloatArray
    """(H, ROW) hypotheses by the trail, the likeliest first."""
    contours: ContourViews
    """Hypotheses by the contours of the hall, where they are looked at."""

    @property
    def told(self) -> FloatArray:
        """(H, ROW) hypotheses as they stand: by the way as a whole, else by things, else by contours."""
        by_reflectors = self.explained if len(self.explained) else self.hypotheses
        return by_reflectors if len(by_reflectors) else self.contours.hypotheses

    @property
    def agreed(self) -> Agreed:
        """Attempts in a row in which one place was left."""
        told = (self.hypotheses, self.explained, self.contours.hypotheses)
        return Agreed(*(int(each[0, 11]) if len(each) else 0 for each in told))

    def waits_ns(self, now_ns: int, shortest: float, longest: float) -> float:
        """Return the time between two attempts [ns].

        Parameters
        ----------
        now_ns : now [ns].
        shortest, longest : bounds of it [s].
        """
        return max(shortest * 1e9, min(PATIENCE * (now_ns - self.since_ns), longest * 1e9))

    def moment(self, cycle: int) -> SearchMoment:
        """Return what the search tells after a cycle.

        Parameters
        ----------
        cycle : its index.
        """
        by_contours = not len(self.explained) and not len(self.hypotheses)
        return SearchMoment(cycle, self.told, self.track, self.agreed, by_contours)

    def _content(self) -> tuple[object, ...]:
        """All of it, comparable."""
        arrays = (
            each.tobytes()
            for each in (
                *(self.things, self.views, self.ends, self.hypotheses, *self.trail, self.explained),
                *(self.contours.hypotheses, self.contours.past, self.contours.said),
            )
        )
        scalars = (self.since_ns, self.around, self.track, self.drift, self.searched_ns, self.judged_ns, self.way)
        views = self.contours.judged_ns, self.contours.view, self.contours.scanner
        return (*scalars, *views, *arrays)

    def __eq__(self, other: object) -> bool:
        """Whether both go on alike, to the last bit."""
        return isinstance(other, Search) and self._content() == other._content()

    def __hash__(self) -> int:
        """Equal ones have the same."""
        return hash(self._content())


class Agreed(NamedTuple):
    """Attempts in a row in which one place was left."""

    by_things: int = 0
    """By things that came back."""
    by_way: int = 0
    """By the way as a whole."""
    by_contours: int = 0


class SearchMoment(NamedTuple):
    """Hypotheses as they stand after one cycle of a search."""

    cycle: int
    """Which cycle of the run."""
    hypotheses: FloatArray
    """(H, ROW) see `Search`."""
    track: PoseGaussian
    """Pose of base in the frame of odometry at that cycle."""
    agreed: Agreed = Agreed()
    """See `Search`."""
    by_contours: bool = False
    """Whether they are hypotheses by contours, see `ContourViews`."""


NOTHING = PoseGaussian(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
LONG_AGO_NS = -(2**62)


def new_search(stamp_ns: int, around: PoseGaussian | None = None) -> Search:
    """Return a search that begins.

    Parameters
    ----------
    stamp_ns : now [ns].
    around : the last good pose, as uncertain as it is by now; None: there is none.
    """
    return Search(
        since_ns=stamp_ns,
        around=around,
        track=NOTHING,
        things=read_only(np.empty((0, COLUMNS))),
        views=read_only(np.empty((0, 5))),
        ends=read_only(no_ends(0)),
        hypotheses=read_only(np.empty((0, ROW))),
        searched_ns=LONG_AGO_NS,
        judged_ns=LONG_AGO_NS,
        trail=no_trail(),
        way=0.0,
        explained=read_only(np.empty((0, ROW))),
        contours=ContourViews(
            hypotheses=read_only(np.empty((0, ROW))),
            past=read_only(np.empty(0)),
            said=read_only(np.empty(0)),
            judged_ns=LONG_AGO_NS,
            view=(0.0, 0.0, 0.0),
            scanner=-1,
        ),
    )

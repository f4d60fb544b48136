"""Zones for the filter's kernels: which kinds of observation correct the pose where the vehicle is.

A kind that does not count there corrects nothing: contours and tags are not looked at. Reflectors are associated all
the same, and still testify for the pose or against it: a vehicle that rejects the world is lost, whatever corrects it.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from commission.compiled import compiled, compiled_inline
from commission.geometry.arrays import BoolArray, FloatArray, IntArray, read_only
from commission.site.zones import ObservationKind, Zone


class ZoneRows(NamedTuple):
    """Zones for kernels."""

    offsets: IntArray
    """(Z + 1,) corners of zone z: offsets[z] to offsets[z + 1]."""
    corners: FloatArray
    """(n, 2) [m], map frame."""
    counts: NDArray[np.bool_]
    """(Z, 3) whether reflectors, contours and tags correct the pose in it."""


class KindsHere(NamedTuple):
    """What corrects the pose at a place."""

    reflectors: bool
    contours: bool
    tags: bool


def zone_rows(zones: Sequence[Zone]) -> ZoneRows:
    """Return zones for kernels: one kernel serves sites with and without them.

    Parameters
    ----------
    zones : of the site; where they overlap the first of them counts.
    """
    kinds = [[kind in zone.kinds for kind in ObservationKind] for zone in zones]
    offsets = np.cumsum([0, *(len(zone.outline) for zone in zones)], dtype=np.int64)
    corners = np.array([corner for zone in zones for corner in zone.outline], dtype=np.float64).reshape(-1, 2)
    counts = np.array(kinds, dtype=np.bool_).reshape(-1, len(ObservationKind))
    return ZoneRows(read_only(offsets), read_only(corners), read_only(counts))


def counts_at(zones: Sequence[Zone], kind: ObservationKind, points: FloatArray) -> BoolArray:
    """Whether a kind corrects the pose at places: (N,) array, by the rule of `kinds_at`.

    Parameters
    ----------
    zones : of the site.
    kind : which one.
    points : (N, 2) places of base [m], map frame.
    """
    found = np.ones(len(points), dtype=np.bool_)
    if zones:
        _fill_counts(zone_rows(zones), list(ObservationKind).index(kind), points, found)
    return found


@compiled
def _fill_counts(zones: ZoneRows, kind: int, points: FloatArray, found: BoolArray) -> None:
    """Write whether a kind counts at each place."""
    for n in range(len(points)):
        found[n] = kinds_at(zones, points[n, 0], points[n, 1])[kind]


@compiled_inline
def kinds_at(zones: ZoneRows, x: float, y: float) -> KindsHere:
    """Which kinds correct the pose at a place; all of them outside of the zones.

    Parameters
    ----------
    zones : of the site.
    x, y : of base [m], map frame.

    Notes
    -----
    Inside where the edges from a to b with y between ay and by and x < ax + (y - ay) / (by - ay) (bx - ax) are odd in
    number, by definition: a ray along x leaves the zone once more than it enters it (Jordan). A place on the border of
    two zones that touch is in one of them.
    """
    for z in range(len(zones.offsets) - 1):
        first, last = zones.offsets[z], zones.offsets[z + 1]
        inside = False
        ax, ay = zones.corners[last - 1, 0], zones.corners[last - 1, 1]
        for k in range(first, last):
            bx, by = zones.corners[k, 0], zones.corners[k, 1]
            if (ay > y) != (by > y) and x < ax + (y - ay) / (by - ay) * (bx - ax):
                inside = not inside
            ax, ay = bx, by
        if inside:
            return KindsHere(zones.counts[z, 0], zones.counts[z, 1], zones.counts[z, 2])
    return KindsHere(True, True, True)

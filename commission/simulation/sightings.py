"""Where a scanner would find each reflector in its sight: range, bearing and incidence of pairs. No noise in here."""

from __future__ import annotations

import math

import numpy as np

from commission.compiled import compiled
from commission.geometry.angles import wrap_scalar
from commission.geometry.arrays import FloatArray, IntArray
from commission.simulation.detection_library import Sightings


def sightings_of(
    seen: tuple[IntArray, IntArray], T_map_scanner: FloatArray, places: FloatArray, kinds: IntArray, *, mirrored: bool
) -> Sightings:
    """Range, bearing and incidence of every reflector in sight; one whose center a nearer one hides is infinitely far.

    Parameters
    ----------
    seen : (K + 1,) offsets and (n,) indices: pose k sees the reflectors `indices[offsets[k]:offsets[k + 1]]`.
    T_map_scanner : (K, 3) poses of the scanner [m, m, rad].
    places : (M, 4) center [m], heading [rad] and radius [m] of each reflector, map frame; NaN where it faces nowhere.
    kinds : (M,) kind of each.
    mirrored : whether the scanner hangs upside down.
    """
    count = len(seen[1])
    sightings = Sightings(np.empty(count), np.empty(count), np.empty(count), np.empty(count, dtype=np.int64))
    _look(*seen, np.ascontiguousarray(T_map_scanner), places, kinds, -1.0 if mirrored else 1.0, sightings)
    return sightings


@compiled
def _look(  # noqa: PLR0917 - pairs, poses, places
    offsets: IntArray,
    indices: IntArray,
    poses: FloatArray,
    places: FloatArray,
    kinds: IntArray,
    sign: float,
    out: Sightings,
) -> None:
    """Fill the pairs of each pose."""
    for k in range(len(poses)):
        for n in range(offsets[k], offsets[k + 1]):
            m = indices[n]
            dx, dy = places[m, 0] - poses[k, 0], places[m, 1] - poses[k, 1]
            sight = math.atan2(dy, dx)
            out.distances[n] = math.sqrt(dx * dx + dy * dy)
            out.bearings[n] = sign * wrap_scalar(sight - poses[k, 2])
            facing = places[m, 2]
            out.incidences[n] = 0.0 if math.isnan(facing) else sign * wrap_scalar(facing - sight - math.pi)
            out.kinds[n] = kinds[m]
        for near in range(offsets[k], offsets[k + 1]):
            distance = out.distances[near]
            wide = places[indices[near], 3] / distance
            for far in range(offsets[k], offsets[k + 1]):
                if distance < out.distances[far] < math.inf:
                    if abs(wrap_scalar(out.bearings[far] - out.bearings[near])) < wide:
                        out.distances[far] = math.inf

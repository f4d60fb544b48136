"""Where the beams of a scan end, by direction: it says what is hidden from there, and what a beam went through.

A scan that no range is known of says nothing. Nothing is compared with the map here: `missed` does that.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from commission.compiled import compiled_inline
from commission.geometry.arrays import read_only
from commission.site.records import Scan

Ends = NDArray[np.float32]
"""(V, BINS) nearest end of the beams of each direction [m], by views; infinite where nothing came back."""

BINS = 720
"""Directions: half a degree each, from 0 counter-clockwise."""
BIN = 2.0 * math.pi / BINS
UNKNOWN, HIDDEN, THROUGH = 0, 1, 2
"""What the beams towards a place say of it."""
BEFORE = 0.3
"""A beam that ends that much before a place does not say what is there [m]."""
BEHIND = 0.5
"""One that ends that much behind it went through [m]."""
ASIDE = 0.2
"""Beams up to that far aside of a place are asked [m]: half a reflector, and the error of a hypothesis."""
TURNED = 0.02
"""And up to that angle aside [rad]: the vehicle turns during a scan."""


def no_ends(count: int) -> Ends:
    """Return the ends of views of which no range is known: nothing came back.

    Parameters
    ----------
    count : of the views.
    """
    return np.full((count, BINS), np.inf, dtype=np.float32)


def beam_ends(scan: Scan | None, *, upside_down: bool) -> Ends:
    """Return the nearest end of the beams of a scan in each direction: (1, BINS) array [m].

    Parameters
    ----------
    scan : with ranges; None: nothing is known of it.
    upside_down : whether the scanner hangs so: its bearings are mirrored.
    """
    ends = no_ends(1)
    if scan is not None:
        ranges = np.asarray(scan.ranges, dtype=np.float32)
        known = np.isfinite(ranges) & (ranges > 0.0)
        bearings = -scan.bearings if upside_down else scan.bearings
        bins = np.floor(np.mod(bearings[known], 2.0 * math.pi) / BIN).astype(np.int64) % BINS
        np.minimum.at(ends[0], bins, ranges[known])
    return read_only(ends)


@compiled_inline
def what_beams_say(view: int, distance: float, bearing: float, ends: Ends) -> int:
    """Whether the beams of a view towards a place end before it, all of them behind it, or neither.

    Parameters
    ----------
    view : row of `ends`.
    distance, bearing : of the place, seen by the scanner [m, rad].
    ends : see `beam_ends`.

    Notes
    -----
    hidden if any end < distance - BEFORE; through if all ends > distance + BEHIND and something came back, over the
    directions up to ASIDE / distance + TURNED from the bearing; by definition. Directions without an end say nothing:
    beams of a degree leave every second one empty.
    """
    half = min(ASIDE / max(distance, ASIDE) + TURNED, 0.5)
    first, last = math.floor((bearing - half) / BIN), math.floor((bearing + half) / BIN)
    nearest = math.inf
    for each in range(first, last + 1):
        nearest = min(nearest, float(ends[view, each % BINS]))
    if nearest < distance - BEFORE:
        return HIDDEN
    return THROUGH if math.inf > nearest > distance + BEHIND else UNKNOWN

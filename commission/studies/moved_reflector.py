"""Whether, how far and when one reflector was moved, by cumulative sums over what a drive sees of it, second by second.

It takes one drive's diagnosis as it is; what several drives say together, and what else may be wrong, is `monitor`'s.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from commission.geometry.arrays import FloatArray, IntArray
from commission.studies.calibration_fit import places_of
from commission.studies.diagnosis import NEAR_M, Diagnosis

BLOCK_S = 1.0
"""Offsets are averaged over so long a time [s]: those of neighboring scans have their errors in common."""
ALARM = 8.0
"""Sum of log-likelihood ratios from which a change is believed: by chance once in 3,000 (Page 1954, Wald's bound)."""
AT_ONCE_S = 3.0
"""A change within this time of the first sighting was there before the drive [s]."""
LOOKED_FOR_M = 0.04
"""Shift that is looked for in a reflector that the diagnosis does not suspect [m]."""
LEAST_SPREAD_M = 0.006
"""Standard deviation of the mean of a second at least [m]: errors of shape and mounting change along the way."""
FEWEST_BLOCKS = 5
"""Seconds with sightings of a reflector, before and after, below which nothing is said of when it was moved."""
FARTHEST_M = 10.0
"""Sightings farther away do not tell where exactly it stands: half a degree is a hand there [m]."""
APART = 0.8
"""Share of the blocks before and after a change that must lie on their own side, where both places were seen."""


@dataclass(frozen=True, slots=True)
class MovedReflector:
    """How far and when a reflector was moved."""

    off: tuple[float, float]
    """From its place by the map [m]."""
    sigma: float
    """1-sigma of that, each axis [m]."""
    seconds: float | None
    """When, after the first scan [s]; None: before the drive."""


def moved_at(found: Diagnosis, index: int) -> MovedReflector | None:
    """Return how far and when a reflector was moved by one drive; None where it stands, or stands twice.

    Parameters
    ----------
    found : the drive.
    index : of the reflector.

    Notes
    -----
    S <- max(0, S + |d| (u . x - |d| / 2) / s^2): the cumulative sum of the log-likelihood ratio of a known shift
    d = |d| u (Page, Biometrika 41, 1954), over means x of a second with standard deviation s; the change is where the
    sum left zero for the last time before it passed the alarm. x is the offset from the mapped place on the floor,
    with poses smoothed over the whole drive.
    """
    times, offsets = blocks_of(found, index)
    if len(times) < FEWEST_BLOCKS:
        return None
    known = np.array(found.reflectors[index].off)
    if known.any():
        return _moved_along(times, offsets, known)
    # Of one that was moved on the way, the diagnosis of the whole drive sees the mean of both places.
    turns = np.arange(0.0, 2.0 * math.pi, 0.25 * math.pi)
    looked_for = (LOOKED_FOR_M * np.array([math.cos(turn), math.sin(turn)]) for turn in turns)
    moved = [_moved_along(times, offsets, off) for off in looked_for]
    late = [
        each
        for each in moved
        if each is not None
        and each.seconds is not None
        and min(np.count_nonzero(times < each.seconds), np.count_nonzero(times >= each.seconds)) >= FEWEST_BLOCKS
    ]
    return max(late, key=lambda each: math.hypot(*each.off), default=None)


def _moved_along(times: FloatArray, offsets: FloatArray, off: FloatArray) -> MovedReflector | None:
    """Look for a shift of about `off` (2,) [m] in offsets (n, 2) [m] at (n,) times [s]."""
    length = float(np.hypot(*off))
    along = offsets @ (off / length)
    spread = max(float(np.median(np.abs(np.diff(along)))) / 0.95, LEAST_SPREAD_M)
    began = change_point(length * (along - 0.5 * length) / spread**2)
    if began is None:
        return None
    after, before = offsets[began:], along[:began]
    shift = np.median(after, axis=0)
    size = float(shift @ (off / length))
    # Where it stands twice, both places are seen by turns; one that was touched only is back where it was.
    if size < 0.5 * length or np.mean(after @ (off / length) > 0.5 * size) < APART:
        return None
    if began and np.mean(before < 0.5 * size) < APART:
        return None
    error = 1.25 * np.std(after, axis=0).max() / math.sqrt(len(after))
    seconds = None if times[began] - times[0] <= AT_ONCE_S else float(times[began])
    return MovedReflector((float(shift[0]), float(shift[1])), max(float(error), 0.002), seconds)


def change_point(ratios: FloatArray) -> int | None:
    """Index from which on something has changed, by a cumulative sum; None where it never passes the alarm.

    Parameters
    ----------
    ratios : (n,) log-likelihood ratios of changed against unchanged, in the order of time.
    """
    total, began = 0.0, 0
    for at, ratio in enumerate(ratios.tolist()):
        if total <= 0.0:
            total, began = 0.0, at
        total += ratio
        if total > ALARM:
            return began
    return None


def blocks_of(found: Diagnosis, index: int) -> tuple[FloatArray, FloatArray]:
    """Offsets of what is seen near a reflector, second by second.

    Parameters
    ----------
    found : the drive.
    index : of the reflector.

    Returns
    -------
    times : (n,) after the first scan [s].
    offsets : (n, 2) median offset from its place by the map [m], map frame.
    """
    fitted = found.inputs.calibration
    drive, point = fitted.problem.drive, fitted.fit.point
    _, places, ranges = places_of(drive, point)
    offsets = places - drive.places[index]
    owner = fitted.fit.reflector
    # What is of none may be it at another place, where the diagnosis suspects that; else it is somebody who walks by.
    is_its = (owner == index) | ((owner < 0) & any(found.reflectors[index].off))
    near = is_its & (np.hypot(offsets[:, 0], offsets[:, 1]) < NEAR_M) & (ranges < FARTHEST_M)
    seconds = (drive.stamps_ns[drive.cycle[near]] - drive.stamps_ns[0]) * 1e-9
    block: IntArray = np.floor(seconds / BLOCK_S).astype(np.int64)
    kept = [each for each in np.unique(block).tolist() if np.count_nonzero(block == each) >= 3]
    medians = [np.median(offsets[near][block == each], axis=0) for each in kept]
    return (np.array(kept) + 0.5) * BLOCK_S, np.array(medians).reshape(-1, 2)

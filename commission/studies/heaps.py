"""Heaps of sightings on the floor, each of one thing that stands there, or of several that are no thing."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree

from commission.geometry.arrays import FloatArray, IntArray


def heaps_of(places: FloatArray, cell: float) -> list[IntArray]:
    """Return the rows of each heap, in their order; the largest heap first.

    Parameters
    ----------
    places : (N, 2) where something was seen [m], map frame.
    cell : side of the squares of the floor in which sightings are joined; those of neighbors are one heap [m].

    Notes
    -----
    Squares of the floor, not sightings, are joined: of a thing that stands there are thousands, each near all others.
    """
    squares, square = np.unique(np.floor(places / cell), axis=0, return_inverse=True)
    pairs = KDTree(squares).query_pairs(1.5, output_type="ndarray")
    links = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(len(squares), len(squares)))
    label = connected_components(links, directed=False)[1][square.reshape(-1)]
    counts = np.bincount(label)
    heaps = np.split(np.argsort(label, kind="stable"), np.cumsum(counts)[:-1])
    return [heaps[index] for index in np.argsort(-counts, kind="stable").tolist()]


def middle_of(places: FloatArray) -> tuple[FloatArray, float]:
    """Return where the thing of a heap stands, the median (2,) [m], and the median distance from there [m].

    Parameters
    ----------
    places : (N, 2) sightings of the heap [m].
    """
    middle = np.median(places, axis=0)
    return middle, float(np.median(np.hypot(*(places - middle).T)))


def nearest_of(centers: FloatArray, place: FloatArray, within: float) -> int:
    """Return which center is nearest to a place; -1: none is within a distance.

    Parameters
    ----------
    centers : (N, 2) [m].
    place : (2,) [m].
    within : distance [m].
    """
    off = np.hypot(*(centers - place).T)
    nearest = int(np.argmin(off)) if len(off) else -1
    return nearest if nearest >= 0 and off[nearest] < within else -1

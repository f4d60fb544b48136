"""What the reflectors of a site lack of what the project demands of a layout: how many, how different, how spread.

The demands on accuracy are for prediction; these are told while the site is edited.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from commission.geometry.arrays import BoolArray, FloatArray
from commission.planning.pair_distances import alike_pairs, seen_at_once
from commission.planning.wall_spread import far_from
from commission.site.layout_brief import Demands
from commission.site.reflectors import ReflectorMap
from commission.studies.problems import Problem, Severity, Subject

ENOUGH = 3
"""Reflectors that fix a pose though one of them fails: expected whatever the project demands."""


class SeenAlong(NamedTuple):
    """What is seen along a route."""

    name: str
    """Name of the route."""
    poses: FloatArray
    """(K, 3) along it [m, m, rad]."""
    metres: FloatArray
    """(K,) way driven [m]."""
    sees: BoolArray
    """(K, M) whether each reflector is seen from each pose."""


def lacking_along(along: SeenAlong, reflectors: ReflectorMap, demands: Demands) -> Iterator[Problem]:
    """Tell where along a route fewer reflectors are in sight than demanded, and where pairs are taken for each other.

    Parameters
    ----------
    along : what is seen.
    reflectors : the M reflectors.
    demands : of the project.
    """
    needed = demands.visible + int(demands.survive_failure)
    few = along.sees.sum(axis=1) < needed
    if needed > ENOUGH and few.any():
        left = f", so that {demands.visible} are left when one fails" if demands.survive_failure else ""
        yield _along(along, few, f"fewer than {needed} reflectors in sight", f"{needed} or more{left}")
    alike = alike_pairs(along.sees, reflectors.centers, demands.pairs_differ)
    if len(alike.distances):
        ids = [reflectors.reflectors[index].id for index in alike.reflectors[0].tolist()]
        one, other = alike.distances[0].tolist()
        more = f" and {len(alike.distances) - 1} more" if len(alike.distances) > 1 else ""
        pairs = f"{ids[0]} to {ids[1]} {one:.2f} m, {ids[2]} to {ids[3]} {other:.2f} m{more}"
        what = f"pairs of reflectors with nearly the same distance in sight at once ({pairs})"
        yield _along(along, seen_at_once(alike, along.sees), what, f"more than {demands.pairs_differ:g} m between them")


def lacking_at_walls(places: FloatArray, centers: FloatArray, demands: Demands) -> Iterator[Problem]:
    """Tell which places along walls are farther from any reflector than demanded.

    Parameters
    ----------
    places : (P, 2) that a route sees [m], map frame.
    centers : (M, 2) of the reflectors that a route sees [m].
    demands : of the project.
    """
    far = ~(far_from(places, centers) <= demands.wall_reach).any(axis=1)
    if not far.any():
        return
    x, y = places[int(far.argmax())].tolist()
    yield Problem(
        severity=Severity.NOTE,
        text=f"Walls: {np.count_nonzero(far)} of {len(places)} places along walls in sight of the routes are far from "
        f"any reflector, first at {x:.1f}, {y:.1f} m; expected one within {demands.wall_reach:g} m, as demanded",
        subject=Subject.FLOOR_MAP,
        place=(x, y),
    )


def _along(along: SeenAlong, there: BoolArray, what: str, expected: str) -> Problem:
    # Every pose stands for half of the way to its neighbors.
    share = np.gradient(along.metres) if len(along.metres) > 1 else np.zeros(1)
    first = int(there.argmax())
    return Problem(
        severity=Severity.NOTE,
        text=f"Route {along.name!r}: {what} on {share[there].sum():.1f} m, first at {along.metres[first]:.1f} m; "
        f"expected {expected}, as demanded",
        subject=Subject.ROUTE,
        ids=(along.name,),
        place=(float(along.poses[first, 0]), float(along.poses[first, 1])),
    )

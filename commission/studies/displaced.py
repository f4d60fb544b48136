"""Reflectors that are seen nowhere where the map has them, while something like a reflector stands beside.

`map_shape` judges what lies near its place, by much less; this is of what was moved by more than a gate lets pass. It
needs a pose that the others tell.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from commission.geometry.arrays import FloatArray
from commission.localization.estimate import Status
from commission.localization.setup import LocalizerSetup
from commission.site.quantity import MILLIMETRES
from commission.studies.heaps import heaps_of, middle_of
from commission.studies.map_shape import sightings
from commission.studies.map_shape_told import shape_of_map, told_of
from commission.studies.plausibility import Finding
from commission.studies.reflector_figures import ReflectorFigures, ReflectorFiguresInput, reflector_figures
from commission.studies.run import RunResult
from commission.studies.scanner_figures import BELONGS

BESIDE_M = 2.5
"""Something farther from a reflector than this is not taken for it [m]."""
HIDDEN_M = 1.2
"""The same of a reflector that no scan should see: of two things that stand there one may be hidden [m]."""
AT_ITS_PLACE_M = 0.3
"""A detection nearer to a reflector than this is at its place [m]."""
CELL_M, WIDEST_M = 0.05, 0.15
"""Squares of the floor that detections are joined in, and median distance of those of one thing from its middle [m]."""
FEWEST, FEWEST_EXPECTED = 50, 50
"""Detections of a thing, and scans that should see a reflector, below which nothing is said."""
SEEN_SHARE, THING_SHARE = 0.02, 0.3
"""It is seen at its place in at most, and the thing in at least, such a part of the scans that should see it [0..1]."""


class _Displaced(NamedTuple):
    reflector: int
    off: FloatArray
    """(2,) from its place to the thing [m]."""
    seen: int
    """Detections of the thing."""


def misplaced_findings(result: RunResult, figures: ReflectorFigures | None = None) -> tuple[Finding, ...]:
    """Name the reflectors that do not stand where the map has them, by a little or by much.

    Parameters
    ----------
    result : the run; of several setups on the way nothing is said.
    figures : what each reflector contributed, where it is known already.
    """
    shape = shape_of_map(result)
    setup = result.inputs.segments[0].setup
    if shape is None or not len(setup.reflectors):
        return ()
    found = tuple(each for each in _beside(result, setup) if each.reflector not in shape.wrong)
    if found and figures is None:
        figures = reflector_figures(ReflectorFiguresInput.of(result, setup.floor))
    told = (_told(each, setup, figures) for each in found if figures is not None and _is_missed(each, figures))
    return (*told_of(shape, setup), *told)


def _beside(result: RunResult, setup: LocalizerSetup) -> Iterator[_Displaced]:
    """Things of which the nearest reflector is seen nowhere, each reflector once."""
    columns, centers = result.columns, setup.reflectors.centers
    looked = sightings(columns, setup)
    status, reflector = columns.status[looked.rows], columns.reflector[looked.rows]
    accepted = reflector[(status == Status.INLIER) & (reflector >= 0)]
    lonely = np.flatnonzero(np.bincount(accepted, minlength=len(centers)) == 0)
    places, step = looked.places[status == Status.OUTLIER_ASSOCIATION], looked.every
    if not len(lonely) or not len(places):
        return
    left = lonely.tolist()
    for heap in heaps_of(places, CELL_M):
        if len(heap) * step < FEWEST or not left:
            return
        middle, spread = middle_of(places[heap])
        apart = np.hypot(*(centers[left] - middle).T)
        nearest = int(np.argmin(apart))
        if spread < WIDEST_M and AT_ITS_PLACE_M < apart[nearest] < BESIDE_M:
            reflector = left.pop(nearest)
            yield _Displaced(reflector, middle - centers[reflector], len(heap) * step)


def _is_missed(each: _Displaced, figures: ReflectorFigures) -> bool:
    """Whether scans that should see a reflector see something beside it instead."""
    expected, apart = int(figures.expected[each.reflector]), float(np.hypot(*each.off))
    if figures.accepted[each.reflector]:
        return False
    if expected < FEWEST_EXPECTED:
        # The map has it behind a wall: it may stand there, out of sight, unless the thing is close by.
        return apart < HIDDEN_M
    if each.seen < THING_SHARE * expected:
        return False
    # What lies within a metre counts as seen there: it is the thing itself, which scatters.
    return apart < BELONGS + WIDEST_M or int(figures.seen[each.reflector]) <= SEEN_SHARE * expected


def _told(each: _Displaced, setup: LocalizerSetup, figures: ReflectorFigures) -> Finding:
    """Say which reflector, and where something stands."""
    name, (x, y) = setup.reflectors.reflectors[each.reflector].id, each.off.tolist()
    return Finding(
        found=f"{name} is seen nowhere at its place, in {int(figures.expected[each.reflector])} scans that should; "
        f"something like a reflector stands {MILLIMETRES.text(float(np.hypot(x, y)))} beside it "
        f"({MILLIMETRES.text(x, '+.0f')} in x, {MILLIMETRES.text(y, '+.0f')} in y), by {each.seen} detections",
        probably=f"{name} was moved, or surveyed wrongly; the vehicle goes by the others",
        remedy="survey it again, or take it out of the map",
    )

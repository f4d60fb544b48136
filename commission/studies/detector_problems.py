"""What scanner and detector make of a site's reflectors, in words: the rejected, unresolved and seldom seen ones."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from commission.geometry.arrays import BoolArray, FloatArray
from commission.localization.detector_model import detector_model
from commission.planning.detection_noise import LIKELY, DetectionTable, detection_table
from commission.site.parameters import DetectorParameters
from commission.site.quantity import MILLIMETRES, PERCENT
from commission.site.reflectors import UNKNOWN, ReflectorMap
from commission.site.scanner import Scanner

NOTABLE = 0.05
"""Share of scans without a detection of a reflector in sight that is told."""
FEW_BEAMS = 2.0
"""Mean beams of a reflector below which a single stray echo looks like it."""


@dataclass(frozen=True, slots=True)
class DetectorFinding:
    """One thing that the detector does to a kind of reflectors."""

    text: str
    """What was found and what is expected, with units."""
    is_loss: bool
    """Whether detections are lost; else they are there, but hardly told from other things."""


def detector_findings(
    reflectors: ReflectorMap, scanner: Scanner, parameters: DetectorParameters, farthest: float = math.inf
) -> Iterator[DetectorFinding]:
    """Say for each kind of reflectors what the detector does not pass, and where.

    Parameters
    ----------
    reflectors : their distinct radii and kinds are looked at.
    scanner : beams and their noise.
    parameters : of the detector.
    farthest : distance that there is between scanner and reflector [m]; what is beyond it is not told.
    """
    if not len(reflectors):
        return
    table = detection_table(reflectors, scanner, parameters)
    model = detector_model(reflectors, scanner, parameters)
    rejected, here = table.rejected(), table.distances <= farthest
    yield from _seldom_seen(table, here)
    for row, (radius, flat) in enumerate(zip(model.radii.tolist(), model.flat.tolist(), strict=True)):
        is_known = model.smallest[row] == model.largest[row]
        size = MILLIMETRES.text(radius, ".3g") if is_known else UNKNOWN
        kind = f"plates of half width {size}" if flat else f"reflectors of radius {size}"
        yield from _losses(kind, table, np.where(here, rejected[row], 0.0), np.where(here, table.shown[row], 1.0))
        few = np.flatnonzero(here & ~(table.beams[row] >= FEW_BEAMS))
        if len(few):
            yield DetectorFinding(
                f"{kind[0].upper()}{kind[1:]} show fewer than {FEW_BEAMS:g} beams from {table.distances[few[0]]:.1f} m "
                "on: from there a single stray echo looks like one; expected finer steps, or larger reflectors",
                is_loss=False,
            )


def _seldom_seen(table: DetectionTable, here: BoolArray) -> Iterator[DetectorFinding]:
    """Where the scanner tells reflectors from other things so seldom that they do not count as visible."""
    seldom = np.flatnonzero(here & (table.rates < LIKELY))
    if len(seldom):
        yield DetectorFinding(
            f"By its detection rates the scanner sees reflectors in less than {PERCENT.text(LIKELY, '.0f')} of the "
            f"scans from {table.distances[seldom[0]]:.1f} m on, {PERCENT.text(table.rates[seldom].min(), '.0f')} at "
            "worst: there they do not count as visible; expected reflectors nearer to the routes",
            is_loss=True,
        )


def _losses(kind: str, table: DetectionTable, rejected: FloatArray, shown: FloatArray) -> Iterator[DetectorFinding]:
    """What is rejected, and what raises no flag at all."""
    worst = int(np.argmax(rejected))
    if rejected[worst] > NOTABLE:
        where = table.distances[np.flatnonzero(rejected > NOTABLE)]
        yield DetectorFinding(
            f"The detector rejects {PERCENT.text(rejected[worst], '.0f')} of {kind} at {table.distances[worst]:.1f} m, "
            f"and more than {PERCENT.text(NOTABLE, '.0f')} between {where[0]:.1f} and {where[-1]:.1f} m; expected the "
            "beam's width and aperture as they are, and beams expected by width",
            is_loss=True,
        )
    missed = np.flatnonzero(1.0 - shown > NOTABLE)
    if len(missed):
        yield DetectorFinding(
            f"The beams miss {PERCENT.text(1.0 - shown[missed].min(), '.0f')} of {kind} at up to "
            f"{table.distances[missed[-1]]:.1f} m, and more than {PERCENT.text(NOTABLE, '.0f')} from "
            f"{table.distances[missed[0]]:.1f} m on; expected finer steps, wider beams or larger reflectors",
            is_loss=True,
        )

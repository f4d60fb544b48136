"""Scanners with the detection rates of a drive: what `detection_rates` counted, as the table that plans read.

The detector's own losses are taken out of what was counted: plans reckon with them already.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np

from commission.localization.run_columns import RunColumns
from commission.planning.detection_noise import classes_of, detection_table
from commission.site.detection_rates import DetectionRates
from commission.site.project import Project
from commission.site.scanner import Scanner
from commission.studies.detection_rates import DetectionRate

LEAST_EXPECTED = 30
"""Pairs of a scan and a reflector from which on a share says something: its interval is then at most 0.35 wide."""
LEAST_PASSING = 0.2
"""Share that detector and beams pass below which nothing is said of the rest: what is divided by is too uncertain."""


def rated_scanners(project: Project, columns: RunColumns, rates: Sequence[DetectionRate]) -> tuple[Scanner, ...]:
    """Give each scanner the table that a drive shows, and a range for reflectors that ends where none is seen.

    Parameters
    ----------
    project : reflectors, scanners and the detector of the drive.
    columns : the drive: a scanner whose detections have no beams detects by itself, behind no window.
    rates : what was counted in it, by ascending distances.

    Returns
    -------
    scanners : those of which nothing was counted as they are.

    Notes
    -----
    entry = (mean distance, seen / expected / P(beams flag it and the window passes)), at most 1: by definition.
    """
    cycles = np.repeat(np.arange(len(columns)), np.diff(columns.offsets))
    has_beams = columns.beams > 0
    by_beams = {int(each) for each in columns.detected.scanners[cycles[has_beams]]}
    return tuple(
        _rated(project, scanner, [each for each in rates if each.scanner == scanner.name], by_beams=index in by_beams)
        for index, scanner in enumerate(project.scanners)
    )


def _rated(project: Project, scanner: Scanner, rates: Sequence[DetectionRate], *, by_beams: bool) -> Scanner:
    """One scanner; `by_beams`: whether the project's detector finds its reflectors."""
    counted = [each for each in rates if each.expected >= LEAST_EXPECTED]
    passing = _passing(project, scanner, counted) if by_beams else [1.0] * len(counted)
    table: DetectionRates = tuple(
        (round(each.distance, 2), round(min(each.share / passes, 1.0), 3))
        for each, passes in zip(counted, passing, strict=True)
        if passes >= LEAST_PASSING
    )
    if not table:
        return scanner
    seen = [each.farthest for each in counted if each.seen]
    reach = min(max(seen), scanner.range[1]) if seen else scanner.reflector_range
    return dataclasses.replace(scanner, detection_rates=table, reflector_range=reach)


def _passing(project: Project, scanner: Scanner, rates: Sequence[DetectionRate]) -> list[float]:
    """Mean probability that beams flag the reflectors of the map and the detector passes them, at each distance."""
    plain = dataclasses.replace(scanner, detection_rates=(), reflector_range=scanner.range[1])
    table = detection_table(project.reflectors, plain, project.parameters.detector)
    mean = table.noise.columns[classes_of(project.reflectors, plain, project.parameters.detector), :, 0].mean(axis=0)
    return np.interp([each.distance for each in rates], table.distances, mean).tolist()


def rated_told(before: Scanner, after: Scanner) -> str:
    """One line for a person: the tables before and after."""
    was, now = (_table_text(each.detection_rates) for each in (before, after))
    return (
        f"Rates        {was} -> {now}; reflectors to {before.reflector_range:g} -> {after.reflector_range:g} m, "
        f"scanner {after.name}"
    )


def _table_text(rates: DetectionRates) -> str:
    """A table as it is typed: distances [m] with their shares."""
    return ", ".join(f"{distance:g} {share:g}" for distance, share in rates) or "none"

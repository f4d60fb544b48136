"""Drives of a site whose scanners sweep, judged with and without the correction."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Any

import numpy as np

from commission.simulation.scenario import virtual_drive
from commission.site.project import Project
from commission.site.scanner import StampOf
from tests.acceptance.judged import judge

RATES = {0.04: 25.0, 0.125: 8.0}
"""Scans per second of each duration [s]: without a pause between sweeps."""
ONE_INSTANT, AS_OLD = "one instant", "one instant, as old as sweeps stamped with their last beam"
"""Cases without a sweep."""


@dataclass(frozen=True, slots=True)
class Swept:
    """RMS of the position error [m]."""

    corrected: float
    neglected: float


def fields_of(duration: float) -> dict[str, dict[str, Any]]:
    """Timing of the scanners of a duration, by what it is called.

    The first is of one instant. The second is, too, but its clock is known to be ahead by half of the duration: its
    detections are then as old at their stamp as those of a sweep that is stamped with its last beam are on average.
    """
    sweeping = {"rate": RATES[duration], "sweep_duration": duration}
    cases: dict[str, dict[str, Any]] = {
        ONE_INSTANT: {"rate": RATES[duration]},
        AS_OLD: {"rate": RATES[duration], "clock_offset": 0.5 * duration},
    }
    for stamp_of, direction in product(StampOf, (1, -1)):
        way = "counter-clockwise" if direction > 0 else "clockwise"
        cases[f"{stamp_of.value} beam, {way}"] = {**sweeping, "stamp_of": stamp_of, "sweep_direction": direction}
    cases["middle beam, upside down"] = {**sweeping, "stamp_of": StampOf.MIDDLE, "upside_down": True}
    return cases


def with_fields(project: Project, fields: dict[str, Any]) -> Project:
    """Return the project whose scanners all have some fields changed."""
    return replace(project, scanners=tuple(replace(scanner, **fields) for scanner in project.scanners))


def swept(project: Project, fields: dict[str, Any], seeds: Sequence[int], *, neglect: bool = True) -> Swept:
    """Drive the first route with each seed.

    Parameters
    ----------
    project : the site.
    fields : of its scanners.
    seeds : of the drives.
    neglect : whether to localize once more by a filter that takes every scan for one of one instant.
    """
    route, made = project.routes[0].name, with_fields(project, fields)
    blind = with_fields(made, {"sweep_duration": 0.0})
    corrected, neglected = [], []
    for seed in seeds:
        log = virtual_drive(made, route, seed)
        corrected.append(_known(judge(made, route, log).distances))
        neglected.append(_known(judge(blind, route, log).distances) if neglect else corrected[-1])
    return Swept(_rms(corrected), _rms(neglected))


def _known(distances: np.ndarray) -> np.ndarray:
    """Leave out the last scan where a clock that is ahead stamps it later than the truth ends."""
    known = ~np.isnan(distances)
    assert np.all(known[:-1])
    return distances[known]


def _rms(distances: list[np.ndarray]) -> float:
    return float(np.sqrt(np.mean(np.concatenate(distances) ** 2)))

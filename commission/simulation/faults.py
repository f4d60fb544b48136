"""Faults on finished records: covered reflectors, lost scans, dead odometry. They work on any source of records.

Each `...ed(records, ...)` passes a stream on with one fault in it; faults compose by nesting.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace

import numpy as np

from commission.site.records import Detections, Odometry, Record, Scan


def cover(record: Record) -> Record:
    """Return what a vehicle reports while all reflectors are covered: the same ranges, nothing that shines.

    Scans lose their flags, and their intensities become zero; detections become empty; other records pass.
    """
    if isinstance(record, Scan):
        flags = None if record.reflector is None else np.zeros_like(record.reflector)
        intensities = None if record.intensities is None else np.zeros_like(record.intensities)
        return replace(record, reflector=flags, intensities=intensities)
    if isinstance(record, Detections):
        return replace(record, range_bearing=np.empty((0, 2)))
    return record


def covered(records: Iterable[Record], start_ns: int, end_ns: int) -> Iterator[Record]:
    """Cover all reflectors for a while.

    Parameters
    ----------
    records : in the order of their stamps.
    start_ns, end_ns : first stamp that is covered, first that is not any more [ns].
    """
    return (cover(record) if start_ns <= record.stamp_ns < end_ns else record for record in records)


def scans_dropped(records: Iterable[Record], share: float, rng: np.random.Generator) -> Iterator[Record]:
    """Lose scans and detections at random; motion and reference still arrive.

    Parameters
    ----------
    records : in the order of their stamps.
    share : of scans and detections that are lost [0..1].
    rng : one uniform number for each of them.
    """
    for record in records:
        if isinstance(record, Scan | Detections) and rng.uniform() < share:
            continue
        yield record


def odometry_stuck(records: Iterable[Record], start_ns: int, end_ns: int) -> Iterator[Record]:
    """Report a standing vehicle for a while, whatever it does: a torn encoder cable.

    Parameters
    ----------
    records : in the order of their stamps.
    start_ns, end_ns : first stamp at which it stands, first at which it does not any more [ns].
    """
    for record in records:
        if isinstance(record, Odometry) and start_ns <= record.stamp_ns < end_ns:
            yield replace(record, displacement=np.zeros(3))
        else:
            yield record


def odometry_scaled(records: Iterable[Record], factor: float) -> Iterator[Record]:
    """Report `factor` times the motion forward and sideways: a worn wheel."""
    for record in records:
        if isinstance(record, Odometry):
            yield replace(record, displacement=record.displacement * (factor, factor, 1.0))
        else:
            yield record

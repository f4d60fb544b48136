"""A drive cut at the stations that it passes, and how consistent each section is. Where stations are, the site says."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from commission.geometry.angles import difference
from commission.geometry.arrays import FloatArray
from commission.geometry.stretches import stretches_of
from commission.localization.run_columns import RunColumns
from commission.planning.route_prediction import AT_STATION, FACING_STATION
from commission.site.stations import Station
from commission.studies.consistency import Consistency, consistency

AWAY = 2.0
"""A station is left at that many times the distance at which it is reached: a vehicle that stands there shakes."""
START, END = "start", "end"


@dataclass(frozen=True, slots=True, kw_only=True)
class Section:
    """The cycles between two stations."""

    begin: str
    """Name of the station where it begins; `start` for the begin of the drive."""
    end: str
    """Name of the station where it ends; `end` for the end of the drive."""
    first: int
    """Its first cycle."""
    from_s: float
    """Time of its first cycle after that of the drive [s]."""
    to_s: float
    """Time of its last cycle after the first one of the drive [s]."""
    figures: Consistency
    """How well its detections fit."""


def sections(columns: RunColumns, stations: Sequence[Station]) -> tuple[Section, ...]:
    """Cut a run at each station that its estimates pass, looking the station's way.

    Parameters
    ----------
    columns : the run: at least one cycle.
    stations : of the site.

    Returns
    -------
    sections : in order, without a gap; the whole drive where no station is passed.
    """
    cuts = sorted(cut for station in stations for cut in _passings(columns.means, station))
    bounds = [(0, START), *(cut for cut in cuts if 0 < cut[0] < len(columns) - 1), (len(columns), END)]
    times = (columns.stamps_ns - columns.stamps_ns[0]) * 1e-9
    return tuple(
        Section(
            begin=begin,
            end=end,
            first=first,
            from_s=float(times[first]),
            to_s=float(times[after - 1]),
            figures=consistency(columns, first, after),
        )
        for (first, begin), (after, end) in pairwise(bounds)
        if after > first
    )


def _passings(poses: FloatArray, station: Station) -> list[tuple[int, str]]:
    """Cycles at which a vehicle is nearest to a station, once for each time that it passes it."""
    distance = np.hypot(*(poses[:, :2] - station.pose[:2]).T)
    is_there = (distance <= AT_STATION) & (np.abs(difference(poses[:, 2], station.pose[2])) < FACING_STATION)
    return [
        (first + int(np.where(is_there[first:after], distance[first:after], math.inf).argmin()), station.name)
        for first, after in stretches_of(distance <= AWAY * AT_STATION).tolist()
        if is_there[first:after].any()
    ]


def section_entries(cut: Sequence[Section]) -> list[dict[str, str | int | float | None]]:
    """Entries of `summary.json` under `sections`, one mapping for each; None where a figure is undefined."""
    return [
        {
            "begin": each.begin,
            "end": each.end,
            "from_s": each.from_s,
            "to_s": each.to_s,
            "cycles": each.figures.cycles,
            "inliers": each.figures.accepted,
            "outliers_association": each.figures.rejected,
            **{
                name: value if math.isfinite(value) else None
                for name, value in (
                    ("nis_mean", each.figures.nis_mean),
                    ("nis_expected", each.figures.nis_expected),
                    ("nis_before_gate_mean", each.figures.nis_before_gate_mean),
                    ("rejected_fraction", each.figures.rejected_fraction),
                    ("unseen_fraction", each.figures.unseen_fraction),
                    ("longest_unseen_s", each.figures.longest_unseen),
                )
            },
        }
        for each in cut
    ]

"""Protection levels of a run: what its error is no larger than, but for a stated risk, even where a reflector misleads.

One reflector at a time: a wrong place in the map, a thing taken for it, or any other fault of what is seen of it.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from commission.geometry.arrays import BoolArray, FloatArray, IntArray, read_only
from commission.localization.protection import Levels, ProtectionModel, new_bank, protect
from commission.localization.reflector_index import in_order_of_map
from commission.localization.run_columns import RunColumns
from commission.localization.zones import zone_rows
from commission.progress import Progress, silent
from commission.site.parameters import IntegrityParameters
from commission.studies.reflector_figures import numbered
from commission.studies.run import RunResult, limits_along
from commission.studies.stanford import stanford


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Protection:
    """Protection levels of K cycles."""

    given: IntegrityParameters
    """Integrity risk and probability of a fault that they hold for."""
    position: FloatArray
    """(K,) of the position [m]; inf where the vehicle is lost or not located."""
    heading: FloatArray
    """(K,) of the heading [rad]."""
    reflector: tuple[str, ...]
    """Ids, by the numbers of `worst`."""
    worst: IntArray
    """(K,) number of the reflector whose failure would be worst for the position; -1: none would be."""

    def within(self, limits: FloatArray) -> BoolArray:
        """(K,) whether both levels are within the (K, 2) limits of position [m] and heading [rad]."""
        return (self.position <= limits[:, 0]) & (self.heading <= limits[:, 1])


def protection(
    columns: RunColumns, given: IntegrityParameters | None = None, progress: Progress = silent
) -> Protection:
    """Compute the protection levels of a run.

    Parameters
    ----------
    columns : the run.
    given : integrity risk and probability of a fault; None: those of the run's first setup.
    progress : told how far it is; may raise to cancel.
    """
    given = columns.segments[0].setup.parameters.integrity if given is None else given
    count = len(columns)
    levels = Levels(np.full(count, math.inf), np.full(count, math.inf), np.full(count, -1, dtype=np.int64))
    names, _, own = numbered(columns)
    bank, first = new_bank(), 0
    for rows in columns.priors.blocks():
        after = first + len(rows.means)
        progress(first / max(count, 1), "protection levels")
        bounds = [first, *(bound for bound in columns.firsts.tolist() if first < bound < after), after]
        for begin, end in itertools.pairwise(bounds):
            setup = columns.segment(begin).setup
            here = slice(begin - first, end - first)
            numbers = own[columns.segments.index(columns.segment(begin))]
            model = ProtectionModel(
                given.risk,
                given.fault_probability,
                in_order_of_map(setup.index),
                read_only(numbers),
                not setup.parameters.temporary.enabled,
            )
            protect(
                begin,
                read_only(rows.means[here]),
                read_only(rows.covariances[here]),
                columns.means,
                columns.covariances,
                columns.modes,
                columns.offsets,
                columns.range_bearing,
                columns.status,
                columns.reflector,
                columns.detected.scanners,
                setup.observation_rows,
                model,
                bank,
                levels,
                setup.zone_rows,
            )
        first = after
    return Protection(
        given=given,
        position=read_only(levels.position),
        heading=read_only(levels.heading),
        reflector=names,
        worst=read_only(levels.reflector),
    )


def protection_entries(result: RunResult, levels: Protection) -> dict[str, Any]:
    """Entries of `summary.json`: levels, how often they are within the limits, and how often the error is beyond them.

    Parameters
    ----------
    result : a run.
    levels : of it.
    """
    position, heading = levels.position, levels.heading
    entries: dict[str, Any] = {
        "integrity_risk": levels.given.risk,
        "protection_position_median_m": _quantile(position, 0.5),
        "protection_position_p95_m": _quantile(position, 0.95),
        "protection_heading_p95_rad": _quantile(heading, 0.95),
        "protected_fraction": float(np.mean(levels.within(limits_along(result.columns)))) if len(position) else None,
    }
    known = np.isfinite(result.position_errors)
    diagram = stanford(result, position)
    if diagram is not None:
        entries["stanford"] = asdict(diagram.regions)
        turned = np.abs(result.errors[:, 2])
        entries["beyond_protection"] = int(np.count_nonzero(result.position_errors[known] > position[known]))
        entries["beyond_heading_protection"] = int(np.count_nonzero(turned > heading))
    return entries


def _quantile(values: FloatArray, share: float) -> float | None:
    """Quantile of levels, of which some may be infinite; None where it is, or where there is none."""
    if not len(values):
        return None
    value = float(np.sort(values)[min(int(share * len(values)), len(values) - 1)])
    return value if math.isfinite(value) else None


def warm_up() -> None:
    """Compile what the study needs."""
    nothing, no_rows = read_only(np.empty((0, 3))), read_only(np.empty(0, dtype=np.int64))
    empty = read_only(np.empty((0, 3, 3)))
    levels = Levels(np.empty(0), np.empty(0), np.empty(0, dtype=np.int64))
    protect(
        0,
        nothing,
        empty,
        nothing,
        empty,
        read_only(np.empty(0, dtype=np.int8)),
        read_only(np.zeros(1, dtype=np.int64)),
        read_only(np.empty((0, 2))),
        read_only(np.empty(0, dtype=np.int8)),
        no_rows,
        no_rows,
        read_only(np.empty((0, 6))),
        ProtectionModel(0.1, 0.1, nothing, no_rows, True),
        new_bank(),
        levels,
        zone_rows(()),
    )

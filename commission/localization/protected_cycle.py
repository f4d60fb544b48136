"""What a cycle comes to where the supervisor goes by protection levels: the last step, after `cycle` or `tag_cycle`.

Called by the same two: live, and by the compiled loop of whole runs; by neither where it goes by 2-sigma.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from commission.compiled import compiled
from commission.geometry.arrays import FloatArray
from commission.localization.cycle import Cycle, held_back, with_mode
from commission.localization.observation import ObservationModel
from commission.localization.protection import Bank, ProtectionModel, forget, protect_cycle
from commission.localization.rival_poses import RivalPoses
from commission.localization.scan_rows import ScanRows
from commission.localization.setup import FilterModel
from commission.localization.state import Tracking
from commission.localization.supervisor import FAIL, LOST, judge
from commission.localization.zones import ZoneRows, kinds_at


class ProtectionRoom(NamedTuple):
    """What levels are reckoned with."""

    model: ProtectionModel
    """Map, integrity risk and probability of a fault."""
    bank: Bank
    """Filters that leave one reflector out each; in and out."""


@compiled
def supervised_by_level(  # noqa: PLR0917 - a cycle, and what it is written to
    before: Tracking,
    cycle: Cycle,
    rows: ScanRows,
    observation: ObservationModel,
    model: FilterModel,
    protected: ProtectionRoom,
    levels: FloatArray,
    zones: ZoneRows,
    rivals: RivalPoses | None,
) -> Tracking:
    """State after a cycle whose supervisor holds the protection level against its limits, in place of 2-sigma.

    Parameters
    ----------
    before : state before the cycle.
    cycle : what it comes to by 2-sigma.
    rows : the scan's detections after it, see `process_scan`.
    observation : mounting and noise of the scan's scanner.
    model : of the whole filter.
    protected : what levels are reckoned with.
    levels : (2,) out: of the position [m] and of the heading [rad]; inf while the vehicle is lost.
    zones : where which kinds correct the pose.
    rivals : where the vehicle may stand as well, after the cycle, or None.

    Notes
    -----
    No formula: `protect_cycle`, then Sobreira et al. 2016, Algorithm 4, with levels for 2-sigma; the rules by
    rejections, confirmations and lasting innovations overrule it as they do otherwise.
    """
    after = cycle.state
    if LOST in (before.mode, after.mode):
        # What the filters without a reflector would begin from is what the vehicle was lost with.
        forget(protected.bank)
        levels[0], levels[1] = math.inf, math.inf
        return after if after.mode == LOST else with_mode(before, after, FAIL)
    last = rows.last if kinds_at(zones, cycle.prior.x, cycle.prior.y).reflectors else rows.first
    found = protect_cycle(
        protected.bank,
        cycle.prior,
        after.belief,
        rows.first,
        last,
        rows.measured,
        rows.status,
        rows.entries,
        observation,
        protected.model,
    )
    levels[0], levels[1] = found.position, found.heading
    if after.evidence.confirmed < model.rejection.confirmations or after.evidence.lasting:
        return with_mode(before, after, FAIL)
    judged = with_mode(before, after, judge(before.mode, found.position, found.heading, model.limits))
    return held_back(rivals, before, judged, model)

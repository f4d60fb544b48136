"""The reflector map as drives show it: what findings change in it, and what they leave to a person."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace

from commission.site.reflectors import Reflector, ReflectorMap
from commission.studies.map_findings import MapFault, MapFinding

CORRECTED_M = 1e-3
"""A reflector nearer than this to where it was found has been put there [m]."""
SAME_PLACE_M = 1e-6
"""A reflector farther from where it was by the map has been edited since [m]."""


def corrected(reflectors: ReflectorMap, findings: Iterable[MapFinding], *, add_new: bool = False) -> ReflectorMap:
    """Return the map as the drives show it: moved ones at their new places, missing ones gone.

    Parameters
    ----------
    reflectors : the map before; locked reflectors stay as they are.
    findings : what was found; dirty and double ones are for a person to look at.
    add_new : whether things that no reflector of the map explains are added, which may be shiny columns.
    """
    found = {each.id: each for each in findings}
    kept: list[Reflector] = []
    for each in reflectors.reflectors:
        finding = found.get(each.id)
        if finding is None or each.locked or finding.fault not in {MapFault.MOVED, MapFault.MISSING}:
            kept.append(each)
        elif finding.fault is MapFault.MOVED and finding.after is not None:
            x, y = (round(value, 4) for value in finding.after)
            kept.append(replace(each, x=x, y=y, sigma=max(each.sigma, round(finding.sigma, 4))))
    if add_new:
        for each in found.values():
            if each.fault is MapFault.NEW and each.after is not None:
                x, y = (round(value, 4) for value in each.after)
                kept.append(Reflector(id=each.id, x=x, y=y, radius=None, sigma=each.sigma, note="seen, not surveyed"))
    return ReflectorMap(tuple(kept))


def why_not(reflectors: ReflectorMap, finding: MapFinding) -> str:
    """Say why a finding changes nothing in a map, as the end of a sentence about it; empty where it does.

    Parameters
    ----------
    reflectors : the map as it is now, which may have been edited since the drive was looked at.
    finding : what the drive shows.
    """
    if finding.fault is MapFault.DIRTY:
        return "nothing to correct in the map: clean it, or look what hides it"
    if finding.fault is MapFault.DOUBLE:
        return "nothing to correct in the map: look which of the two is meant, and take the other one down"
    now = next((each for each in reflectors.reflectors if each.id == finding.id), None)
    if finding.fault is MapFault.NEW:
        return "" if now is None else "the map has a reflector of that name by now"
    if now is None:
        return "the map has it no more"
    if finding.before is None or math.dist((now.x, now.y), finding.before) > SAME_PLACE_M:
        is_there = finding.after is not None and math.dist((now.x, now.y), finding.after) < CORRECTED_M
        return "the map has it there by now" if is_there else "the map has it elsewhere by now: check again"
    return "it is locked and stays: unlock it first" if now.locked else ""

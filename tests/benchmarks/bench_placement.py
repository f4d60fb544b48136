"""Suggested layouts: against all layouts of small cases, and against the hand-made ones of the bundled sites.

    python -m tests.benchmarks.bench_placement.py [DRIVES] [CASES]

Prints how often small cases are solved with the fewest reflectors. Then, for shop floor and warehouse, the layouts from
nothing for the supervisor's limits and for what the hand-made layout achieves; and what virtual drives show of them,
each with one random reflector missing in the hall while the localizer's map still has it: without people, and with all
the disturbances of the site.
"""

from __future__ import annotations

import sys
import time

import numpy as np

from commission.io.bundled import bundled_folder
from commission.io.project_file import load_project
from commission.site.disturbances import Disturbances
from commission.site.layout_brief import Demands
from commission.site.project import Project
from tests.acceptance.placed import blocked_drive, demands_met_by, suggested, verdict
from tests.planning.small_cases import judged, small_case

SITES = ("shop_floor", "warehouse")
TO_PEOPLE = np.array([1e3, 1e3, np.degrees(1.0)])
"""From metres and radians to millimetres and degrees."""


def small(cases: int) -> None:
    verdicts = [judged(small_case(seed)) for seed in range(cases)]
    possible = [each for each in verdicts if each.fewest is not None]
    extra = np.array([each.extra for each in possible])
    print(
        f"{cases} small cases, {len(possible)} of them possible: {100 * np.mean(extra == 0):.1f} % with the fewest "
        f"reflectors, {extra.max()} more at most; all met: {all(each.met for each in possible)}; "
        f"bound kept: {all(each.at_least <= each.fewest for each in possible)}",
        flush=True,
    )


def compare(site: str, drives: int) -> None:
    project = load_project(bundled_folder("maps") / site)
    for name, demands in (
        ("supervisor's limits", Demands(visible=2)),
        ("as the hand-made one", demands_met_by(project)),
    ):
        began = time.perf_counter()
        placed, found = suggested(project, demands)
        limit, heading = demands.position_limit, demands.heading_limit
        limits = "" if limit is None or heading is None else f", {1e3 * limit:.1f} mm, {np.degrees(heading):.3f} deg"
        print(
            f"{site}, {name} ({demands.visible} visible with any one blocked{limits}): {found.added} reflectors, "
            f"at least {found.at_least}, hand-made {len(project.reflectors)}; {time.perf_counter() - began:.0f} s; "
            f"unmet: {len(found.unmet)}",
            flush=True,
        )
        for what, disturbances in (
            ("nobody about", project.disturbances.undisturbed()),
            ("disturbed", project.disturbances),
        ):
            drive_all(placed, demands, drives, what, disturbances)


def drive_all(project: Project, demands: Demands, drives: int, what: str, disturbances: Disturbances) -> None:
    for route in project.routes:
        driven = [blocked_drive(project, route.name, seed, disturbances) for seed in range(drives)]
        seen = verdict(project, demands, driven)
        x, y, heading = seen.largest * TO_PEOPLE
        print(
            f"  {what}, {route.name!r}: {seen.operational} of {drives} drives operational throughout, "
            f"{100 * seen.within:.2f} % of cycles within the limits, worst metre {seen.worst_metre:.2f} of its limit, "
            f"at most {x:.0f} mm, {y:.0f} mm, {heading:.2f} deg; {seen.visible} visible at least",
            flush=True,
        )


if __name__ == "__main__":
    small(int(sys.argv[2]) if len(sys.argv) > 2 else 400)
    for each in SITES:
        compare(each, int(sys.argv[1]) if len(sys.argv) > 1 else 50)

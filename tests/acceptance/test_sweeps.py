"""Sweeps that take time cost the localizer next to nothing on the warehouse, whatever is stamped and however it turns.

The figures of all drives are in the README's table, printed by `tests.benchmarks.bench_sweeps`.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from commission.io.project_file import load_project
from commission.localization.estimate import Belief
from commission.simulation.scenario import start_of, virtual_drive
from commission.site.parameters import FilterParameters
from commission.site.project import Project
from commission.studies.metrics import reference_at
from tests.acceptance.in_order import InOrder
from tests.acceptance.judged import judge
from tests.acceptance.swept import AS_OLD, ONE_INSTANT, fields_of, swept, with_fields
from tests.conftest import Seeds
from tests.planning.driven import QUICK

COST = 5e-4
"""What a sweep may cost beside a scanner of one instant whose detections are as old at their stamp [m]."""

INSTANTS = (ONE_INSTANT, AS_OLD)

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def warehouse(repository: Path) -> Project:
    return load_project(repository / "maps" / "warehouse")


@pytest.fixture(scope="module")
def laboratory(repository: Path) -> Project:
    """Its route is shorter."""
    return load_project(repository / "maps" / "laboratory")


@pytest.mark.with_all_seeds
def test_a_sweep_of_125_ms_costs_less_than_half_a_millimetre(warehouse: Project, seeds: Seeds) -> None:
    cases = fields_of(0.125)
    once, as_old = (swept(warehouse, cases[name], seeds(1, 3), neglect=False).corrected for name in INSTANTS)
    some = ("last beam, counter-clockwise", "middle beam, upside down")
    for name in [case for case in cases if case not in INSTANTS] if seeds.all else some:
        found = swept(warehouse, cases[name], seeds(1, 3))
        # What is stamped with its last beam is 62 ms old on average, and odometry has noise that nothing corrects.
        assert found.corrected < (as_old if name.startswith("last") else once) + COST, name
        assert found.neglected > 5.0 * found.corrected, name


def test_a_sweep_of_40_ms_at_25_scans_per_second_costs_less_than_half_a_millimetre(
    warehouse: Project, laboratory: Project, seeds: Seeds
) -> None:
    cases, site = fields_of(0.04), warehouse if seeds.all else laboratory
    once = swept(site, cases[ONE_INSTANT], seeds(1, 2), neglect=False).corrected
    found = swept(site, cases["first beam, clockwise"], seeds(1, 2))
    assert found.corrected < once + COST
    assert found.neglected > 2.0 * found.corrected


@pytest.mark.with_all_seeds
def test_an_exact_filter_pays_as_much_for_sweeps_that_are_stamped_with_their_last_beam(
    warehouse: Project, seeds: Seeds
) -> None:
    """Nothing is left to be gained: every detection at the time of its own beam gives no smaller error."""
    plain = replace(warehouse, parameters=replace(warehouse.parameters, filter=FilterParameters(consider=False)))
    once = swept(plain, fields_of(0.125)[ONE_INSTANT], seeds(1, 8), neglect=False).corrected
    for way in ("counter-clockwise", "clockwise") if seeds.all else ("clockwise",):
        made = with_fields(plain, fields_of(0.125)[f"last beam, {way}"])
        route, (scanner,) = made.routes[0].name, made.scanners
        squares = []
        for seed in seeds(1, 8):
            log = virtual_drive(made, route, seed, options=QUICK)
            judged, start = judge(made, route, log), start_of(made, route)
            exact = InOrder(
                made.reflectors, scanner, made.parameters, Belief(0, start.pose, np.diag(np.square(start.sigmas)))
            )
            means = exact.means_of(log, judged.run)
            references = reference_at(judged.run.stamps_ns, log.reference_stamps_ns, log.reference_poses)
            squares.append((np.mean(judged.distances**2), np.mean(np.sum((means - references)[:, :2] ** 2, axis=1))))
        found, optimum = np.sqrt(np.mean(squares, axis=0))
        assert found < optimum + 1e-4
        assert optimum > once + COST

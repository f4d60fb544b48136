"""Sweeps that take time cost the localizer next to nothing on the warehouse, whatever is stamped and however it turns.

The figures of all drives are in the README's table, printed by `tests.benchmarks.bench_sweeps`.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from commission.io.project_file import load_project
from commission.site.project import Project
from tests.acceptance.swept import fields_of, swept
from tests.conftest import Seeds

COST = 5e-4
"""What a sweep may cost [m]."""
# The detections of a sweep of 125 ms that is stamped with its last beam are 62 ms old on average, half of them more:
# the odometry since then has noise that nothing corrects before the next scan.
COST_OF_OLD_BEAMS = 1.2e-3

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def warehouse(repository: Path) -> Project:
    return load_project(repository / "maps" / "warehouse")


def test_a_sweep_of_125_ms_costs_less_than_half_a_millimetre(warehouse: Project, seeds: Seeds) -> None:
    cases = fields_of(0.125)
    once = swept(warehouse, cases["one instant"], seeds(1, 3), neglect=False).corrected
    some = ("first beam, clockwise", "last beam, counter-clockwise", "middle beam, upside down")
    for name in list(cases)[1:] if seeds.all else some:
        found = swept(warehouse, cases[name], seeds(1, 3))
        assert found.corrected < once + (COST_OF_OLD_BEAMS if name.startswith("last") else COST), name
        assert found.neglected > 5.0 * found.corrected, name


def test_a_sweep_of_40_ms_at_25_scans_per_second_costs_less_than_half_a_millimetre(
    warehouse: Project, seeds: Seeds
) -> None:
    cases = fields_of(0.04)
    once = swept(warehouse, cases["one instant"], seeds(1, 2), neglect=False).corrected
    found = swept(warehouse, cases["first beam, clockwise"], seeds(1, 2))
    assert found.corrected < once + COST
    assert found.neglected > 2.0 * found.corrected

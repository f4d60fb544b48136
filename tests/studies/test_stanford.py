"""The Stanford diagram: every cycle in one region, by hand on both sides of each limit; sums; a whole run."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from commission.localization.estimate import Mode
from commission.studies.run import RunInput, judged_run, summary
from commission.studies.stanford import counted, merged, stanford
from commission.studies.start import Start, StartOrigin
from tests.studies.recorded import PROJECT, drive, start


def one(error: float, level: float, *, operational: bool = True):
    return counted(np.array([error]), np.array([level]), np.array([0.1]), np.array([operational]))


@pytest.mark.parametrize(
    ("error", "level", "region"),
    [
        (0.02, 0.05, "nominal"),
        (0.05, 0.05, "nominal"),
        (0.1, 0.1, "nominal"),
        (0.02, 0.1001, "unavailable"),
        (0.12, 0.12, "unavailable"),
        (0.02, math.inf, "unavailable"),
        (0.02, math.nan, "unavailable"),
        (0.0501, 0.05, "misleading"),
        (0.1, 0.0999, "misleading"),
        (0.1001, 0.1, "hazardous"),
        (0.3, 0.0, "hazardous"),
        (0.13, 0.12, "unavailable_misleading"),
    ],
)
def test_a_cycle_is_in_the_region_of_its_definition_and_in_no_other(error: float, level: float, region: str) -> None:
    regions = one(error, level).regions
    assert getattr(regions, region) == 1
    assert regions.total == 1


@pytest.mark.parametrize(
    ("error", "level", "operational", "verdict"),
    [
        (0.02, 0.05, True, "nominal"),
        (0.06, 0.05, True, "misleading"),
        (0.11, 0.05, True, "hazardous"),
        # Without a supervisor the level may be beyond the limit: to drive on it is as wrong.
        (0.11, 0.2, True, "hazardous"),
        (0.1, 0.05, False, "false_alarm"),
        (0.1001, 0.05, False, "true_alarm"),
    ],
)
def test_a_cycle_has_one_verdict(error: float, level: float, operational: bool, verdict: str) -> None:
    verdicts = one(error, level, operational=operational).verdicts
    assert getattr(verdicts, verdict) == 1
    assert verdicts.total == 1


def test_cells_are_those_of_error_and_level_and_the_last_ones_hold_what_is_beyond() -> None:
    counts = one(0.0124, 0.0376).counts
    assert counts[2, 7] == counts.sum() == 1
    assert one(0.1, 0.1).counts[19, 19] == 1
    assert one(5.0, math.inf).counts[40, 40] == 1
    assert one(0.0, 0.0).counts[0, 0] == 1


def test_diagrams_of_several_runs_add_up() -> None:
    rng = np.random.default_rng(3)
    errors, levels, drives = rng.exponential(0.05, 300), rng.exponential(0.08, 300), rng.random(300) < 0.8
    limits = np.full(300, 0.1)
    whole = counted(errors, levels, limits, drives)
    parts = merged(
        counted(errors[rows], levels[rows], limits[rows], drives[rows]) for rows in (slice(0, 80), slice(80, 300))
    )
    assert parts is not None
    assert (parts.regions, parts.verdicts) == (whole.regions, whole.verdicts)
    assert np.array_equal(parts.counts, whole.counts)
    assert whole.regions.total == whole.verdicts.total == whole.counts.sum() == 300
    assert merged(()) is None


def test_a_run_is_counted_over_the_cycles_that_have_a_reference() -> None:
    log = drive(20.0)
    cut = replace(log, reference_stamps_ns=log.reference_stamps_ns[40:], reference_poses=log.reference_poses[40:])
    result = judged_run(RunInput.of(PROJECT, cut, Start(start(), StartOrigin.GIVEN)))
    diagram = stanford(result)
    assert diagram is not None
    known = np.isfinite(result.position_errors)
    assert diagram.regions.total == diagram.verdicts.total == known.sum() < result.cycles
    assert diagram.verdicts.hazardous == summary(result)["wrong_while_operational"]
    drives = diagram.verdicts.nominal + diagram.verdicts.misleading + diagram.verdicts.hazardous
    assert drives == np.count_nonzero((result.columns.modes == Mode.OPERATIONAL) & known)
    assert diagram.limit == PROJECT.parameters.supervisor.position_limit
    nothing = replace(log, reference_stamps_ns=np.empty(0, np.int64), reference_poses=np.empty((0, 3)))
    assert stanford(judged_run(RunInput.of(PROJECT, nothing, Start(start(), StartOrigin.GIVEN)))) is None

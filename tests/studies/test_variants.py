"""Variants of a drive: figures are those of each run, marks follow the rule, and moments are where they differ."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import ttest_1samp

from commission.errors import UsageError
from commission.localization.estimate import Mode
from commission.localization.setup import LocalizerSetup
from commission.site.parameters import Parameters
from commission.studies.run import RunInput, RunResult, judged_run, summary
from commission.studies.start import Start, StartOrigin
from commission.studies.variant_figures import BY_KEY, FIGURES, Aim, largest_correction
from commission.studies.variants import (
    FEWEST_BLOCKS,
    NEAREST_S,
    VariantsInput,
    VariantsResult,
    Verdict,
    blocks_of,
    gains_of,
    is_beyond_chance,
    variants,
)
from tests.studies.recorded import PROJECT, drive, start

LIMIT = 0.03
"""Limit of the supervisor that 2-sigma passes at times where the gate is far too narrow [m]: its median is 25 mm."""


def run_with(parameters: Parameters, earlier: RunResult | None = None) -> RunResult:
    if earlier is None:
        inputs = RunInput.of(PROJECT, drive(), Start(start(), StartOrigin.GIVEN))
    else:
        inputs = earlier.inputs.with_setup(LocalizerSetup.of(replace(PROJECT, parameters=parameters)))
    return judged_run(inputs, earlier=earlier)


def strict() -> Parameters:
    """A gate far too narrow, and a limit that the covariance then passes at times."""
    parameters = PROJECT.parameters
    association = replace(parameters.association, gate_probability=0.05)
    return replace(parameters, association=association, supervisor=replace(parameters.supervisor, position_limit=LIMIT))


@pytest.fixture(scope="module")
def wide() -> RunResult:
    return run_with(PROJECT.parameters)


@pytest.fixture(scope="module")
def narrow(wide: RunResult) -> RunResult:
    return run_with(strict(), wide)


@pytest.fixture(scope="module")
def compared(wide: RunResult, narrow: RunResult) -> VariantsResult:
    return variants(VariantsInput(names=("Now", "A"), runs=(wide, narrow)))


def row(result: VariantsResult, key: str) -> tuple[tuple[float, ...], tuple[Verdict, ...]]:
    found = next(each for each in result.figures if each.figure.key == key)
    return found.values, found.verdicts


def test_figures_are_those_of_the_summary_of_each_run(
    compared: VariantsResult, wide: RunResult, narrow: RunResult
) -> None:
    for index, run in enumerate((wide, narrow)):
        told = summary(run)
        known = [each for each in compared.figures if each.figure.key in told]
        assert len(known) >= 13
        for each in known:
            assert each.values[index] == pytest.approx(told[each.figure.key]), each.figure.key


def test_what_each_cycle_contributes_adds_up_to_the_figure(wide: RunResult, narrow: RunResult) -> None:
    squared, counted = {"position_rmse_m", "heading_rmse_rad"}, {"fail_episodes", "wrong_while_operational"}
    for run in (wide, narrow):
        for figure in FIGURES:
            if figure.rows is None:
                continue
            above, below = (float(each.sum()) for each in figure.rows(run))
            value = figure.value(run)
            expected = value**2 if figure.key in squared else value / below if figure.key in counted else value
            assert above / below == pytest.approx(expected), figure.key


def test_a_gate_that_is_far_too_narrow_is_marked_where_it_shows(compared: VariantsResult) -> None:
    (_, rejected), verdicts = row(compared, "rejected_fraction")
    assert rejected > 0.5
    assert verdicts == (Verdict.SAME, Verdict.DIFFERENT)
    assert row(compared, "accepted_fraction")[1][1] is Verdict.DIFFERENT
    assert row(compared, "operational_fraction")[1][1] is Verdict.WORSE
    assert row(compared, "largest_jump_m")[1][1] is Verdict.UNJUDGED


def test_a_run_beside_itself_is_the_same_everywhere(wide: RunResult) -> None:
    result = variants(VariantsInput(names=("Now", "A"), runs=(wide, wide)))
    assert {each.verdicts[1] for each in result.figures} == {Verdict.SAME}
    assert result.moments == ()


def test_chance_alone_is_marked_in_one_of_a_hundred_and_a_shift_in_most() -> None:
    rng, blocks = np.random.default_rng(3), np.arange(0, 2000, 100)
    marked = {0.0: 0, 0.02: 0}
    for shift, _ in [(shift, number) for shift in marked for number in range(400)]:
        shared = np.repeat(rng.normal(size=20), 100)
        # Correlated over a whole block: a test that takes cycles for independent marks most of these.
        own = [np.repeat(rng.normal(scale=0.02, size=20), 100) for _ in range(2)]
        one, other = ((shared + each, np.ones(2000)) for each in own)
        marked[shift] += bool(is_beyond_chance(one, (other[0] + shift, other[1]), blocks))
    # Of 400 at 1 %, 4 are expected; 12 or more have a probability of 0.1 %.
    assert marked[0.0] < 12
    assert marked[0.02] > 160


def test_means_are_judged_as_a_paired_t_test_judges_them() -> None:
    rng, blocks = np.random.default_rng(4), np.arange(0, 120, 10)
    for shift in np.linspace(0.0, 0.3, 60):
        one, other = rng.normal(size=(2, 120)) * 0.3
        other = other + shift
        means = (other - one).reshape(12, 10).mean(axis=1)
        expected = ttest_1samp(means, 0.0).pvalue < 0.01
        assert is_beyond_chance((one, np.ones(120)), (other, np.ones(120)), blocks) is bool(expected)


def test_a_drive_too_short_for_a_spread_is_not_judged() -> None:
    assert len(blocks_of(np.linspace(0.0, 9.9, 100))) == 0
    assert len(blocks_of(np.linspace(0.0, 10.1, 100))) == FEWEST_BLOCKS
    assert len(blocks_of(np.linspace(0.0, 3600.0, 100))) == 20
    ones = np.ones(100)
    assert is_beyond_chance((ones, ones), (0.5 * ones, ones), np.empty(0, np.int64)) is None
    assert is_beyond_chance((ones, 0.0 * ones), (ones, ones), np.arange(0, 100, 10)) is None


def test_moments_are_where_one_drives_and_the_other_does_not_and_where_they_are_far_apart(
    compared: VariantsResult, wide: RunResult, narrow: RunResult
) -> None:
    stopped = narrow.columns.modes != Mode.OPERATIONAL
    assert stopped.any()
    assert not (wide.columns.modes != Mode.OPERATIONAL).any()
    first = compared.moments[0]
    assert first.between == ("Now", "A")
    assert first.lasts == pytest.approx(max((e.end_ns - e.start_ns) * 1e-9 for e in narrow.episodes))
    assert "Now drives, A not" in str(first)
    apart = np.hypot(*(wide.columns.means - narrow.columns.means)[:, :2].T)
    for moment in compared.moments:
        cycle = int(np.argmin(np.abs(wide.times - moment.time)))
        assert moment.apart == pytest.approx(apart[cycle])
    far = [each for each in compared.moments if each.lasts == 0.0]
    assert all(each.apart > 0.001 for each in far)
    gaps = np.abs(np.subtract.outer(*[[each.time for each in compared.moments]] * 2))
    assert (gaps[~np.eye(len(gaps), dtype=bool)] >= NEAREST_S).all()


def test_the_moment_of_the_largest_distance_is_found(wide: RunResult) -> None:
    means = np.array(wide.columns.means)
    means[300:303, 0] += (0.01, 0.04, 0.02)
    other = replace(wide, columns=replace(wide.columns, means=means))
    result = variants(VariantsInput(names=("Now", "B"), runs=(wide, other)))
    assert result.moments[0].time == wide.times[301]
    assert str(result.moments[0]) == "Now, B 40 mm apart"
    assert len(result.moments) == 1


def test_the_largest_jump_is_the_longest_way_a_scan_moves_the_estimate(wide: RunResult) -> None:
    moved = [math.dist(wide.columns.estimate(k).prior.mean[:2], wide.columns.means[k, :2]) for k in range(wide.cycles)]
    assert largest_correction(wide) == pytest.approx(max(moved))


def test_nearer_to_what_a_consistent_filter_shows_is_better_from_either_side() -> None:
    assert BY_KEY["nis_mean"].aim is Aim.NONE
    figure = BY_KEY["anees_position"]
    assert gains_of(figure, (3.0, 1.5), (1.0, 1.0), 1) > 0.0
    assert gains_of(figure, (0.5, 0.25), (1.0, 1.0), 1) < 0.0


def test_variants_of_another_drive_are_refused(wide: RunResult) -> None:
    other = run_with(PROJECT.parameters)
    with pytest.raises(UsageError, match="variant A is of another drive; expected that of Now"):
        VariantsInput(names=("Now", "A"), runs=(wide, other))

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from scipy.stats import chi2

from commission.studies import metrics

SECOND = 1_000_000_000


def stamps(*seconds):
    return np.array([round(s * SECOND) for s in seconds], dtype=np.int64)


def identity_covariances(count, size=3):
    return np.broadcast_to(np.eye(size), (count, size, size)).copy()


def test_reference_between_two_poses_is_on_the_line_and_turns_the_short_way_across_pi():
    poses = np.array([[0.0, 0.0, 3.0], [1.0, 2.0, -3.0]])
    found = metrics.reference_at(stamps(0.25), stamps(0.0, 1.0), poses)
    turn = 2.0 * math.pi - 6.0
    assert_allclose(found, [[0.25, 0.5, 3.0 + 0.25 * turn]])


def test_reference_heading_that_crosses_pi_stays_wrapped():
    poses = np.array([[0.0, 0.0, 3.1], [0.0, 0.0, -3.0]])
    found = metrics.reference_at(stamps(0.9), stamps(0.0, 1.0), poses)[0, 2]
    assert -math.pi <= found < math.pi
    assert found < 0.0


def test_cycles_without_a_reference_are_outside_of_its_time_or_in_its_gaps():
    reference = stamps(1.0, 1.1, 1.2, 3.0, 3.1)
    cycles = stamps(0.9, 1.0, 1.15, 2.0, 2.9, 3.05, 3.2, 9.0)
    found = metrics.reference_at(cycles, reference, np.zeros((5, 3)))
    assert metrics.without_reference(cycles, reference, found) == (3, 2)
    assert metrics.without_reference(cycles, stamps(), np.full((8, 3), np.nan)) == (8, 0)


def test_nothing_is_extrapolated_before_the_first_and_after_the_last_reference():
    poses = np.array([[1.0, 1.0, 0.0], [2.0, 1.0, 0.0]])
    found = metrics.reference_at(stamps(-0.1, 0.0, 0.1, 0.11), stamps(0.0, 0.1), poses)
    assert np.isnan(found[[0, 3]]).all()
    assert_allclose(found[[1, 2]], poses)


def test_one_missing_reference_pose_is_a_gap_whose_ends_still_count():
    reference_stamps = stamps(0.0, 0.1, 0.2, 0.4, 0.5)
    poses = np.zeros((5, 3))
    found = metrics.reference_at(stamps(0.15, 0.2, 0.3, 0.4, 0.45), reference_stamps, poses)
    assert np.isnan(found[:, 0]).tolist() == [False, False, True, False, False]


def test_references_more_than_a_second_apart_are_never_joined():
    found = metrics.reference_at(stamps(0.0, 1.0), stamps(0.0, 2.0, 4.0), np.zeros((3, 3)))
    assert np.isnan(found[:, 0]).tolist() == [False, True]


def test_position_is_interpolated_where_the_reference_has_no_heading():
    poses = np.array([[0.0, 0.0, math.nan], [1.0, 0.0, 0.5], [2.0, 0.0, 0.5]])
    found = metrics.reference_at(stamps(0.5, 1.5), stamps(0.0, 1.0, 2.0), poses)
    assert_allclose(found, [[0.5, 0.0, math.nan], [1.5, 0.0, 0.5]])


def test_of_two_references_with_one_stamp_the_last_one_counts():
    poses = np.array([[0.0, 0.0, 0.0], [5.0, 0.0, 0.0], [6.0, 0.0, 0.0]])
    assert_allclose(metrics.reference_at(stamps(0.0), stamps(0.0, 0.0, 1.0), poses)[0, 0], 5.0)


@pytest.mark.parametrize("count", [0, 1])
def test_too_few_references_give_no_interpolation_and_no_warning(count):
    found = metrics.reference_at(stamps(0.0, 1.0), stamps(0.0)[:count], np.ones((1, 3))[:count])
    assert np.isfinite(found).all(axis=1).tolist() == [count == 1, False]


def test_heading_error_is_the_short_turn():
    errors = metrics.pose_errors(np.array([[1.0, 2.0, 3.1]]), np.array([[0.5, 2.0, -3.1]]))
    assert_allclose(errors, [[0.5, 0.0, 6.2 - 2.0 * math.pi]])


def test_statistics_of_a_run_worked_out_by_hand():
    distances = np.array([3.0, 4.0, 12.0, 5.0]) * 0.01
    errors = np.zeros((6, 3))
    errors[:4, 0] = 0.6 * distances
    errors[:4, 1] = 0.8 * distances
    errors[:4, 2] = [0.01, -0.01, 0.01, math.nan]
    errors[4:] = math.nan
    covariances = np.broadcast_to(np.diag([4e-4, 4e-4, 1e-4]), (6, 3, 3))
    operational = np.array([True, True, True, False, True, True])
    found = metrics.error_statistics(errors, covariances, operational, 0.04)
    assert found is not None
    assert found.compared == 4
    assert found.position_rmse == pytest.approx(math.sqrt((9 + 16 + 144 + 25) / 4) * 0.01)
    assert found.position_median == pytest.approx(0.045)
    assert found.position_p95 == pytest.approx(np.percentile(distances, 95))
    assert found.position_max == pytest.approx(0.12)
    assert found.heading_rmse == pytest.approx(0.01)
    assert found.anees_position == pytest.approx(np.mean(distances**2) / 4e-4 / 2)
    assert found.anees == pytest.approx((np.mean(distances[:3] ** 2) / 4e-4 + 1.0) / 3)
    assert found.largest_jump == pytest.approx(0.08)
    # 0.04 itself does not exceed the limit; 0.05 does, in fail mode.
    assert found.wrong_while_operational == 1


@pytest.mark.parametrize(("distance", "wrong"), [(0.0999, 0), (0.1, 0), (0.1001, 1), (0.19, 1), (0.21, 1)])
def test_wrong_while_operational_are_errors_beyond_the_limit_that_nobody_is_warned_of(distance, wrong):
    errors = np.array([[distance, 0.0, 0.0], [0.0, -distance, 0.0], [0.0, 0.0, 3.0]])
    operational = np.array([True, False, True])
    found = metrics.error_statistics(errors, identity_covariances(3), operational, 0.1)
    assert found is not None
    assert found.wrong_while_operational == wrong
    # The first limit holds the second cycle, which is in fail mode, and not the first.
    along = metrics.error_statistics(errors, identity_covariances(3), ~operational, np.array([9.0, 0.1, 9.0]))
    assert along is not None
    assert along.wrong_while_operational == wrong


def test_a_run_without_any_reference_has_no_statistics():
    nothing = np.full((3, 3), math.nan)
    assert metrics.error_statistics(nothing, identity_covariances(3), np.ones(3, bool), 0.1) is None


def test_statistics_without_reference_headings_are_those_of_the_position():
    errors = np.array([[0.01, 0.0, math.nan]] * 2)
    found = metrics.error_statistics(errors, identity_covariances(2), np.ones(2, bool), 0.1)
    assert found is not None
    assert math.isnan(found.heading_rmse)
    assert math.isnan(found.anees)
    assert found.anees_position == pytest.approx(0.5e-4)


def test_anees_of_a_consistent_filter_is_within_its_chi_square_bounds():
    rng = np.random.default_rng(1)
    count = 4000
    factors = rng.normal(size=(count, 3, 3)) * np.array([0.02, 0.05, 0.004])[:, np.newaxis]
    covariances = factors @ factors.transpose(0, 2, 1)
    errors = np.einsum("kij,kj->ki", factors, rng.normal(size=(count, 3)))
    found = metrics.error_statistics(errors, covariances, np.ones(count, bool), 1.0)
    assert found is not None
    # 1 - 1e-6 two-sided: the seed is fixed, the bounds say what a consistent filter may show.
    for anees, dof in ((found.anees, 3), (found.anees_position, 2)):
        low, high = chi2.ppf([5e-7, 1 - 5e-7], count * dof) / (count * dof)
        assert low < anees < high


def test_anees_of_a_filter_twice_too_sure_is_four():
    errors = np.random.default_rng(2).normal(size=(20_000, 3))
    found = metrics.error_statistics(errors, 0.25 * identity_covariances(20_000), np.ones(20_000, bool), 1.0)
    assert found is not None
    # The standard deviation of the mean of 60,000 chi-square values (1 dof), times 4, is 0.023.
    assert found.anees == pytest.approx(4.0, abs=0.1)


@given(st.lists(st.floats(-10.0, 10.0), min_size=9, max_size=9), st.lists(st.floats(-1.0, 1.0), min_size=3, max_size=3))
def test_nees_is_that_of_the_inverse_covariance(entries, error):
    factor = np.array(entries).reshape(3, 3)
    covariance = factor @ factor.T + np.diag([1e-2, 1e-2, 1e-2])
    expected = np.array(error) @ np.linalg.inv(covariance) @ np.array(error)
    # inv loses digits with the condition number, here up to about 1e5.
    assert_allclose(metrics.nees(np.array([error]), covariance[np.newaxis]), [expected], rtol=1e-7, atol=1e-12)


def test_claiming_to_know_exactly_what_it_does_not_makes_nees_infinite():
    covariances = np.array([np.diag([1e-4, 0.0, 1e-4]), [[1.0, 1.0, 0.0], [1.0, 1.0, 0.0], [0.0, 0.0, 1.0]]])
    assert np.isposinf(metrics.nees(np.full((2, 3), 0.01), covariances)).all()


def test_tiny_covariances_are_not_taken_for_singular_ones():
    assert_allclose(metrics.nees(np.full((1, 2), 1e-9), 1e-18 * identity_covariances(1, 2)), [2.0])


def test_a_cycle_without_reference_is_not_bridged_by_a_jump():
    errors = np.array([[0.0, 0.0, 0.0], [math.nan] * 3, [9.0, 0.0, 0.0], [9.0, 0.3, 0.0]])
    assert metrics.largest_jump(errors) == pytest.approx(0.3)
    assert math.isnan(metrics.largest_jump(errors[:2]))


def test_fail_episodes_are_found_at_the_start_inside_and_at_the_end():
    modes = np.array([1, 0, 1, 1, 0, 1], dtype=np.int8)
    found = metrics.fail_episodes(stamps(0, 1, 2, 3, 4, 5), modes)
    assert [(e.start_ns // SECOND, e.end_ns // SECOND, e.recovered) for e in found] == [
        (0, 1, True),
        (2, 4, True),
        (5, 5, False),
    ]


@pytest.mark.parametrize("modes", [[], [0, 0]])
def test_a_run_that_is_always_operational_has_no_fail_episode(modes):
    assert metrics.fail_episodes(stamps(0, 1)[: len(modes)], np.array(modes, dtype=np.int8)) == ()

"""What if a reflector fails: the ranking is that of the metres that fail."""

import numpy as np
import pytest

from commission.planning.dependence import Failure, FailureOptions, dependences, worst_failures
from commission.planning.route_prediction import Damage, plan_route, predict_route
from commission.site.parameters import OdometryParameters, Parameters
from commission.site.scanner import Scanner
from tests.planning.sites import open_field

SHORT_SIGHTED = Scanner(field_of_view_deg=(-180.0, 180.0), reflector_range=6.0)
CARELESS = Parameters(odometry=OdometryParameters(heading_per_sqrt_m=0.03))
"""Odometry so poor that a few metres on it alone pass the limits."""

# Plenty at both ends and one alone in the middle of forty metres.
PLACES = [(1.0, 2.0), (2.0, -2.0), (3.0, 2.0), (16.0, 1.0), (20.0, -1.0), (35.0, 2.0), (37.0, -2.0), (39.0, 2.0)]


@pytest.fixture
def planned():
    return plan_route(open_field(PLACES, 40.0, scanner=SHORT_SIGHTED, parameters=CARELESS), "Line")


def test_the_reflectors_on_which_metres_depend_come_first(planned):
    ranked = dependences([planned])
    assert {ranked[0].reflector, ranked[1].reflector} == {3, 4}
    assert ranked[0].failing_metres >= ranked[1].failing_metres > 0
    assert len(ranked) == len(PLACES)
    totals = [each.failing_metres for each in ranked]
    assert totals == sorted(totals, reverse=True)


def test_the_failing_metres_are_those_of_a_prediction_without_the_reflector(planned):
    intact = set(predict_route(planned).failing_metres())
    for each in dependences([planned]):
        failing = set(predict_route(planned, Damage(blocked=(each.reflector,))).failing_metres())
        assert set(each.routes[0].metres) == failing - intact


def test_a_reflector_that_no_route_sees_has_no_dependents():
    project = open_field([(5.0, 2.0), (5.0, 90.0)], scanner=SHORT_SIGHTED)
    assert [each.reflector for each in dependences([plan_route(project, "Line")])] == [0]


def test_dirt_never_harms_more_than_blocking(planned):
    blocked = {each.reflector: each.limit_share for each in dependences([planned])}
    for each in dependences([planned], FailureOptions(Failure.DIRTY)):
        assert each.limit_share <= blocked[each.reflector] * (1.0 + 1e-9)


def test_a_reflector_moved_within_its_gate_harms_where_few_others_are_seen(planned):
    lonely = open_field([(10.0, 1.0)], parameters=CARELESS)
    ranked = dependences([plan_route(lonely, "Line")], FailureOptions(Failure.MOVED, 0.04))
    crowd = open_field([(10.0, 1.0), *((float(x), -2.0) for x in range(1, 20, 2))], parameters=CARELESS)
    among = dependences([plan_route(crowd, "Line")], FailureOptions(Failure.MOVED, 0.04))
    of_first = next(each for each in among if each.reflector == 0)
    assert ranked[0].limit_share > 1.5 * of_first.limit_share


def test_the_next_failure_is_asked_for_beside_those_that_there_are(planned):
    first, second = worst_failures([planned], 2)
    assert first.reflector == dependences([planned])[0].reflector
    given = FailureOptions(given=Damage(blocked=(first.reflector,)))
    assert second.reflector == dependences([planned], given)[0].reflector
    assert second.reflector != first.reflector


def test_more_failures_than_reflectors_end_with_the_last_reflector(planned):
    failures = worst_failures([planned], 20)
    assert sorted(each.reflector for each in failures) == list(range(len(PLACES)))


def test_progress_rises_to_one_and_may_cancel(planned):
    seen = []
    dependences([planned], progress=lambda fraction, _: seen.append(fraction))
    assert seen == sorted(seen)
    assert seen[-1] == 1.0

    def stop(fraction, _):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        dependences([planned], progress=stop)


def test_several_routes_are_ranked_together(planned):
    both = dependences([planned, planned])
    alone = dependences([planned])
    assert both[0].failing_metres == 2 * alone[0].failing_metres
    assert np.array_equal(both[0].routes[0].metres, both[0].routes[1].metres)

"""Shares in a fix: they add up at their layout, and tell which reflector a prediction gains most by."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from commission.planning.fix_shares import FixShares, fix_shares
from commission.planning.information import tangent_at
from commission.planning.route_prediction import PlannedRoute, plan_route, predict_route, restricted
from commission.site.project import Project
from commission.site.routes import Route, Segment
from commission.site.scanner import Scanner
from commission.site.uncertainty import Uncertainty
from tests.planning.driven import EXACT
from tests.planning.sites import open_field, reflectors_at, room

COUNT, SCAN = 24, 50
AHEAD = Scanner(name="ahead", field_of_view_deg=(-135.0, 135.0), reflector_range=9.0, rate=5.0)
BEHIND = Scanner(name="behind", mounting=(-0.6, 0.0, np.pi), field_of_view_deg=(-135.0, 135.0), reflector_range=9.0)


def hall(*scanners: Scanner, **parts: Any) -> PlannedRoute:
    """A drive through a hall with reflectors along its walls."""
    rng = np.random.default_rng(4)
    places = np.column_stack((rng.uniform(0.5, 17.5, COUNT), np.where(np.arange(COUNT) % 2, 0.3, 7.7)))
    bends = np.array([[2.0, 4.0], [7.0, 2.0], [11.0, 6.0], [16.0, 3.0]])
    route = Route("Through", (Segment(control_points=bends, degree=3),), 1.0)
    site = Project(
        floor_map=room(18.0, 8.0),
        scanners=scanners or (AHEAD,),
        routes=(route,),
        reflectors=reflectors_at(places.tolist()),
        **parts,
    )
    return plan_route(site, "Through")


def shares_of(planned: PlannedRoute, layout: np.ndarray, axis: int, scan: int = SCAN) -> FixShares:
    return fix_shares(planned, predict_route(restricted(planned, layout)), scan, axis, layout)


def variance_of(planned: PlannedRoute, layout: np.ndarray, axis: int) -> float:
    return float(predict_route(restricted(planned, layout)).covariances[SCAN, axis, axis])


def some(rng: np.random.Generator, size: int) -> np.ndarray:
    return rng.permutation(COUNT) < size


@pytest.mark.parametrize("scanners", [(AHEAD,), (AHEAD, BEHIND)])
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_shares_of_a_layout_and_what_there_is_besides_are_all_of_the_information(axis: int, scanners: Any) -> None:
    planned, layout = hall(*scanners), some(np.random.default_rng(axis), 6)
    shares = shares_of(planned, layout, axis)
    assert shares.gains[layout].sum() + shares.rest == pytest.approx(1.0, abs=1e-9)
    assert np.all(shares.gains >= 0.0)
    assert shares.gains[~layout].max() > 0.0


def test_shares_say_what_one_more_reflector_makes_of_the_variance_where_tangents_say_far_too_much() -> None:
    """Of all that could be added to each of some layouts, each predicted on its own."""
    planned, rng, ranks, errors, of_tangents = hall(), np.random.default_rng(3), [], [], []
    for _ in range(12):
        layout, axis = some(rng, 5), int(rng.integers(2))
        outside = np.flatnonzero(~layout)
        after = np.array([variance_of(planned, layout | (np.arange(COUNT) == each), axis) for each in outside])
        fell = np.log(variance_of(planned, layout, axis) / after)
        shares = shares_of(planned, layout, axis)
        tangent = tangent_at(planned, predict_route(restricted(planned, layout)), SCAN, axis)
        ranks.append(int(after.argsort().argsort()[shares.gains[outside].argmax()]))
        errors.append(np.log1p(shares.gains[outside]) - fell)
        of_tangents.append(np.log1p(tangent.gains[outside]) - fell)
    assert np.mean(ranks) <= 1.0
    # In the logarithm of the variance, which falls by up to 1.5 here.
    assert np.abs(errors).mean() < 0.07 < np.abs(of_tangents).mean()


def test_a_reflector_beside_another_adds_little_where_constants_remain_and_as_much_as_it_where_there_are_none() -> None:
    """Two of one place ahead: with range bias and mounting known exactly, the second is as good as the first."""
    places = [(12.0, 0.2), (12.0, -0.2), (-2.0, 0.0), (5.0, 7.0), (5.0, -7.0)]
    layout = np.array([True, False, False, True, True])
    seen = {"scanner": Scanner(field_of_view_deg=(-180.0, 180.0), reflector_range=15.0)}
    bias = Uncertainty(survey=0.0, mounting_position=0.0, mounting_heading=0.0, range_bias=0.02, clock=0.0)
    rest, known = (
        shares_of(plan_route(open_field(places, uncertainty=each, **seen), "Line"), layout, 0, scan=60).gains
        for each in (bias, EXACT)
    )
    assert rest[2] > 3.0 * rest[1] > 0.0
    assert known[1] == pytest.approx(known[0], rel=0.05)
    assert known[2] < 3.0 * known[1]


def test_a_reflector_whose_place_is_less_well_known_has_a_smaller_share() -> None:
    planned = hall(uncertainty=Uncertainty(survey=0.001))
    layout = some(np.random.default_rng(0), 8)
    places = np.array(planned.places)
    one = int(np.flatnonzero(layout)[shares_of(planned, layout, 1).gains[layout].argmax()])
    places[one, 2:] = 0.03**2
    vague = PlannedRoute(**{name: getattr(planned, name) for name in PlannedRoute.__slots__} | {"places": places})
    assert shares_of(vague, layout, 1).gains[one] < 0.5 * shares_of(planned, layout, 1).gains[one]

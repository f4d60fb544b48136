"""Tangents of the information: they touch at their layout, and no other layout is better than they say."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from commission.planning.information import tangent_at
from commission.planning.route_prediction import PlannedRoute, plan_route, predict_route, restricted
from commission.site.parameters import AssociationParameters, DetectorParameters, FilterParameters, Parameters
from commission.site.project import Project
from commission.site.routes import Route, Segment
from commission.site.scanner import Scanner
from tests.planning.sites import reflectors_at, room

COUNT = 14
SCAN = 40


def hall(**parameters: Any) -> PlannedRoute:
    """A drive through a hall with reflectors along its walls."""
    rng = np.random.default_rng(4)
    places = np.column_stack((rng.uniform(0.5, 17.5, COUNT), np.where(np.arange(COUNT) % 2, 0.3, 7.7)))
    route = Route("Through", (Segment(control_points=np.array([[2.0, 4.0], [16.0, 3.0]]), degree=1),), 1.0)
    scanner = Scanner(field_of_view_deg=(-180.0, 180.0), reflector_range=9.0, rate=5.0)
    site = Project(
        floor_map=room(18.0, 8.0),
        scanners=(scanner,),
        routes=(route,),
        reflectors=reflectors_at(places.tolist()),
        parameters=Parameters(**parameters),
    )
    return plan_route(site, "Through")


def some(rng: np.random.Generator) -> np.ndarray:
    return rng.permutation(COUNT) < rng.integers(3, COUNT)


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_tangent_touches_at_its_layout_where_every_detection_is_certain(axis: int) -> None:
    """All information comes from reflectors, odometry and start; a beam may be lost at 9 m even so, hence the hair."""
    planned = hall(
        association=AssociationParameters(enabled=False),
        detector=DetectorParameters(enabled=False),
        filter=FilterParameters(consider=False),
    )
    layout = some(np.random.default_rng(axis))
    tangent = tangent_at(planned, predict_route(restricted(planned, layout)), SCAN, axis)
    assert tangent.gains[layout].sum() + tangent.rest == pytest.approx(1.0, abs=1e-4)
    assert tangent.need(tangent.variance) == pytest.approx(1.0 - tangent.rest)
    assert tangent.need(0.5 * tangent.variance) == pytest.approx(1.5 - tangent.rest)


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_no_layout_keeps_a_limit_that_the_tangent_says_it_cannot(axis: int) -> None:
    """The variance of each of many layouts, predicted on its own, as the limit."""
    planned, rng = hall(), np.random.default_rng(7)
    tangents = [tangent_at(planned, predict_route(restricted(planned, some(rng))), SCAN, axis) for _ in range(5)]
    for _ in range(40):
        layout = some(rng)
        variance = float(predict_route(restricted(planned, layout)).covariances[SCAN, axis, axis])
        assert all(tangent.gains[layout].sum() >= tangent.need(variance) - 1e-9 for tangent in tangents)

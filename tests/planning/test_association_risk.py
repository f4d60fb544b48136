"""Neighbors along a route: found where the gates meet, with the probability of a mistake."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import norm

from commission.planning.association_risk import neighbor_risks
from commission.planning.route_prediction import plan_route, predict_route
from commission.site.reflectors import ReflectorMap
from tests.localization import plain_observation as plain
from tests.planning.sites import open_field, reflectors_at

CLOSE = ((3.0, 3.0), (8.0, -2.0), (12.0, 2.5), (12.05, 2.5), (18.0, -3.0))


def risks_of(places):
    planned = plan_route(open_field(places), "Line")
    prediction = predict_route(planned)
    return planned, prediction, neighbor_risks(planned, prediction)


def test_only_reflectors_close_to_each_other_are_named():
    _, _, risks = risks_of(CLOSE)
    assert {(risk.reflector, risk.neighbor) for risk in risks} == {(2, 3), (3, 2)}
    assert all(0.0 < risk.worst <= 0.5 for risk in risks)
    assert risks_of([CLOSE[i] for i in (0, 1, 2, 4)])[2] == ()


def separations(planned, prediction, scan: int) -> np.ndarray:
    """(M, M) squared Mahalanobis distance of each reflector's expected observation from that of another; diagonal 0."""
    pose, mounting, observation = (
        planned.drive.poses[scan],
        planned.scanners[0].mounting,
        planned.parameters.observation,
    )
    centers, surveyed = planned.places[:, :2], np.sqrt(planned.places[:, 2])
    sigmas = observation.range_sigma, observation.bearing_sigma
    S = plain.innovation_covariances(pose, prediction.prior_covariances[scan], mounting, centers, sigmas, surveyed)
    seen = plain.observed(pose, mounting, centers)
    d = seen[np.newaxis] - seen[:, np.newaxis]
    d[..., 1] = plain.turned(d[..., 1])
    return np.einsum("ijk,ikl,ijl->ij", d, np.linalg.inv(S), d)


def surveyed(*sigmas: float):
    """Two reflectors close to each other, with 1-sigma of their places."""
    places = reflectors_at([CLOSE[2], CLOSE[3], CLOSE[0]]).reflectors
    given = tuple(replace(r, sigma=sigma) for r, sigma in zip(places, (*sigmas, 0.0), strict=True))
    planned = plan_route(replace(open_field(()), reflectors=ReflectorMap(given)), "Line")
    prediction = predict_route(planned)
    return planned, prediction, neighbor_risks(planned, prediction)


@pytest.mark.parametrize("sigmas", [(0.0, 0.0), (0.0, 0.1), (0.1, 0.02)])
def test_probability_is_that_of_half_the_distance_in_the_reflectors_own_gate(sigmas: tuple[float, float]):
    planned, prediction, risks = surveyed(*sigmas)
    assert {(0, 1), (1, 0)} <= {(risk.reflector, risk.neighbor) for risk in risks}
    # The gate of 95 % of two degrees of freedom is -2 ln 0.05.
    gate = -2.0 * math.log(0.05)
    for risk in risks:
        for scan, probability in list(zip(risk.scans.tolist(), risk.probability, strict=True))[::20]:
            squared = separations(planned, prediction, scan)[risk.reflector, risk.neighbor]
            assert squared <= gate
            # Differences of 1e-10 in the oracle's Jacobian.
            assert probability == pytest.approx(norm.sf(0.5 * math.sqrt(squared)), rel=1e-5)


def test_no_neighbor_within_a_gate_is_missed():
    planned, prediction, risks = risks_of(CLOSE)
    found = {(risk.reflector, risk.neighbor): set(risk.scans.tolist()) for risk in risks}
    for scan in range(0, len(planned.drive), 37):
        inside = separations(planned, prediction, scan) <= -2.0 * math.log(0.05)
        for i in planned.visible.of(scan).tolist():
            for j in set(range(len(CLOSE))) - {i}:
                assert inside[i, j] == (scan in found.get((i, j), set()))


def test_the_nearer_the_neighbor_the_likelier_the_mistake():
    worst = [risks_of([*CLOSE[:3], (12.0 + gap, 2.5)])[2][0].worst for gap in (0.03, 0.04, 0.05)]
    assert worst == sorted(worst, reverse=True)


@pytest.mark.parametrize("places", [(), ((5.0, 2.0),)])
def test_fewer_than_two_reflectors_are_never_mistaken(places):
    assert risks_of(places)[2] == ()

"""Neighbors along a route: found where the gates meet, with the probability of a mistake."""

import numpy as np
import pytest
from scipy.special import ndtr

from commission.geometry.angles import difference
from commission.geometry.gaussian import chi_square_gate
from commission.localization.estimate import Belief
from commission.localization.observation import innovation_covariances, range_bearing
from commission.planning.association_risk import neighbor_risks
from commission.planning.route_prediction import plan_route, predict_route
from tests.planning.sites import open_field

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


def test_separation_is_that_of_the_innovation_covariance():
    planned, prediction, risks = risks_of(CLOSE)
    risk = next(risk for risk in risks if risk.reflector == 2)
    centers, gate = planned.places[:, :2], chi_square_gate(0.95, 2)
    for scan, probability in list(zip(risk.scans.tolist(), risk.probability, strict=True))[::20]:
        pose = planned.drive.poses[scan]
        belief = Belief(0, pose, prediction.prior_covariances[scan])
        own, other = range_bearing(pose, planned.scanner.mounting, centers[2:4])
        d = np.array([other[0] - own[0], difference(other[1], own[1])])
        squared = d @ np.linalg.solve(innovation_covariances(belief, planned.model().observation, centers[2:3])[0], d)
        assert squared <= gate
        assert probability == pytest.approx(ndtr(-0.5 * np.sqrt(squared)), rel=1e-9)


def test_no_neighbor_within_a_gate_is_missed():
    planned, prediction, risks = risks_of(CLOSE)
    found = {(risk.reflector, risk.neighbor): set(risk.scans.tolist()) for risk in risks}
    centers, gate = planned.places[:, :2], chi_square_gate(0.95, 2)
    for scan in range(0, len(planned.drive), 37):
        pose = planned.drive.poses[scan]
        belief = Belief(0, pose, prediction.prior_covariances[scan])
        observed = range_bearing(pose, planned.scanner.mounting, centers)
        S = innovation_covariances(belief, planned.model().observation, centers)
        for i in planned.visible.of(scan).tolist():
            for j in set(range(len(centers))) - {i}:
                d = np.array([observed[j, 0] - observed[i, 0], difference(observed[j, 1], observed[i, 1])])
                inside = d @ np.linalg.solve(S[i], d) <= gate
                assert inside == (scan in found.get((i, j), set()))


def test_the_nearer_the_neighbor_the_likelier_the_mistake():
    worst = [risks_of([*CLOSE[:3], (12.0 + gap, 2.5)])[2][0].worst for gap in (0.03, 0.04, 0.05)]
    assert worst == sorted(worst, reverse=True)


@pytest.mark.parametrize("places", [(), ((5.0, 2.0),)])
def test_fewer_than_two_reflectors_are_never_mistaken(places):
    assert risks_of(places)[2] == ()

"""Neighbors along a route: found where a detection may be taken for them, with the probability of a mistake."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.stats import norm

from commission.planning.association_risk import mistaken, neighbor_risks
from commission.planning.route_prediction import plan_route, predict_route
from commission.site.parameters import FilterParameters, Parameters
from commission.site.reflectors import ReflectorMap
from tests.localization import plain_observation as plain
from tests.planning.sites import open_field, reflectors_at, surely_detected

CLOSE = ((3.0, 3.0), (8.0, -2.0), (12.0, 2.5), (12.05, 2.5), (18.0, -3.0))


GATE = -2.0 * math.log(0.05)
"""Of 95 % of two degrees of freedom."""
FARTHEST = (3.1 + math.sqrt(GATE)) ** 2
"""Beyond, fewer than one of a thousand detections is inside the neighbor's gate."""
NOT_CONSIDERED = Parameters(filter=FilterParameters(consider=False))


def risks_of(places):
    planned = plan_route(open_field(places, parameters=NOT_CONSIDERED), "Line")
    prediction = predict_route(planned)
    return planned, prediction, neighbor_risks(planned, prediction)


def taken(squared: float, gate: float = GATE) -> float:
    """How much of a normal distribution is nearer to (d, 0) than to the origin, and inside the gate about it."""
    d, g = math.sqrt(squared), math.sqrt(gate)

    def across(x: float) -> float:
        return norm.pdf(x) * (1.0 - 2.0 * norm.sf(math.sqrt(max(gate - (x - d) ** 2, 0.0))))

    return quad(across, max(0.5 * d, d - g), d + g, epsabs=1e-12, epsrel=1e-9)[0]


def test_a_mistaken_detection_is_nearer_to_the_neighbor_and_inside_its_gate():
    d = np.array([0.0, 0.4, 1.5, math.sqrt(GATE), 4.0, 2.0 * math.sqrt(GATE), 5.5])
    found = mistaken(d**2, GATE)
    np.testing.assert_allclose(found, [taken(each) for each in d**2], rtol=1e-7)
    assert found[0] == pytest.approx(0.5 * 0.95)
    x, y = np.random.default_rng(0).normal(size=(2, 400_000, 1))
    drawn = ((x > 0.5 * d) & ((x - d) ** 2 + y**2 <= GATE)).mean(axis=0)
    # Four sigma of a share of 400,000.
    np.testing.assert_allclose(drawn, found, atol=4.0 * np.sqrt(found.max() / 400_000))
    # Without a gate it is the side of the line between both alone.
    np.testing.assert_allclose(mistaken(d**2, math.inf), norm.sf(0.5 * d))


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
    planned = plan_route(replace(open_field((), parameters=NOT_CONSIDERED), reflectors=ReflectorMap(given)), "Line")
    prediction = predict_route(planned)
    return planned, prediction, neighbor_risks(planned, prediction)


@pytest.mark.parametrize("sigmas", [(0.0, 0.0), (0.0, 0.1), (0.1, 0.02)])
def test_probability_is_that_of_half_the_distance_in_the_reflectors_own_gate(sigmas: tuple[float, float]):
    planned, prediction, risks = surveyed(*sigmas)
    assert {(0, 1), (1, 0)} <= {(risk.reflector, risk.neighbor) for risk in risks}
    for risk in risks:
        for scan, probability in list(zip(risk.scans.tolist(), risk.probability, strict=True))[::20]:
            squared = separations(planned, prediction, scan)[risk.reflector, risk.neighbor]
            assert squared <= FARTHEST
            # Differences of 1e-10 in the oracle's Jacobian.
            assert probability == pytest.approx(taken(squared), rel=1e-5)


def test_no_neighbor_that_a_detection_may_be_taken_for_is_missed():
    planned, prediction, risks = risks_of(CLOSE)
    found = {(risk.reflector, risk.neighbor): set(risk.scans.tolist()) for risk in risks}
    for scan in range(0, len(planned.drive), 37):
        inside = separations(planned, prediction, scan) <= FARTHEST
        for i in planned.visible.of(scan).tolist():
            for j in set(range(len(CLOSE))) - {i}:
                assert inside[i, j] == (scan in found.get((i, j), set()))


def test_the_nearer_the_neighbor_the_likelier_the_mistake():
    worst = [risks_of([*CLOSE[:3], (12.0 + gap, 2.5)])[2][0].worst for gap in (0.03, 0.04, 0.05)]
    assert worst == sorted(worst, reverse=True)


@pytest.mark.parametrize("places", [(), ((5.0, 2.0),)])
def test_fewer_than_two_reflectors_are_never_mistaken(places):
    assert risks_of(places)[2] == ()


def considered_innovations(planned, prediction) -> dict[tuple[int, int], np.ndarray]:
    """S of each scan and visible reflector by a filter of pose and constants together, whose gain moves no constant.

    What odometry adds is taken from the prediction. Constants: places of reflectors, then mounting, range and clock.
    """
    count, u, mounting = len(planned.places), planned.uncertainty, np.array(planned.scanners[0].mounting)
    sigmas = [*np.sqrt(planned.places[:, 2]).repeat(2), *(u.mounting_position,) * 2, u.mounting_heading]
    P = np.diag(np.square([*planned.options.start_sigmas, *sigmas, u.range_bias, u.clock]))
    noise = planned.parameters.observation
    R, drive, found = np.diag([noise.range_sigma**2, noise.bearing_sigma**2]), planned.drive, {}
    for k, pose in enumerate(drive.poses):
        velocity = np.zeros(3)
        if k > 0:
            step = pose - drive.poses[k - 1]
            F = np.eye(len(P))
            F[:2, 2] = -step[1], step[0]
            P = F @ P @ F.T
            P[:3, :3] += prediction.prior_covariances[k] - F[:3, :3] @ prediction.covariances[k - 1] @ F[:3, :3].T
            velocity = step / (1e-9 * (drive.stamps_ns[k] - drive.stamps_ns[k - 1]))
        rows = {}
        for m in planned.visible.of(k).tolist():

            def seen(x: np.ndarray, m: int = m, pose: np.ndarray = pose) -> np.ndarray:
                center = planned.places[m, :2] + x[3 + 2 * m : 5 + 2 * m]
                own = 3 + 2 * count
                there = pose + x[:3] - velocity * x[own + 4]  # noqa: B023 - called within this scan
                range_and_bearing = plain.observed(there, mounting + x[own : own + 3], center[np.newaxis])[0]
                return range_and_bearing + np.array([x[own + 3], 0.0])

            tiny = 1e-6 * np.eye(len(P))
            rows[m] = np.column_stack([(seen(each) - seen(-each)) / 2e-6 for each in tiny])
            # Right behind the scanner, one of the two bearings may be a turn off.
            rows[m][1] = plain.turned(2e-6 * rows[m][1]) / 2e-6
            found[k, m] = rows[m] @ P @ rows[m].T + R
        for B in rows.values():
            gain = P @ B.T @ np.linalg.inv(B @ P @ B.T + R)
            gain[3:] = 0.0
            A = np.eye(len(P)) - gain @ B
            P = 0.95 * (A @ P @ A.T + gain @ R @ gain.T) + 0.05 * P
    return found


def test_the_gate_is_that_of_a_filter_which_considers_survey_mounting_range_and_clock():
    places = [CLOSE[1], (9.0, 3.0), (9.06, 3.0), CLOSE[4]]
    planned = surely_detected(plan_route(open_field(places, 8.0), "Line"))
    prediction = predict_route(planned)
    risks = {(risk.reflector, risk.neighbor): risk for risk in neighbor_risks(planned, prediction)}
    innovations, checked = considered_innovations(planned, prediction), 0
    for k in range(0, len(planned.drive), 7):
        centers = planned.places[:, :2]
        seen = plain.observed(planned.drive.poses[k], planned.scanners[0].mounting, centers)
        for one, other in ((1, 2), (2, 1)):
            if (k, one) not in innovations:
                continue
            d = seen[other] - seen[one]
            squared = float(d @ np.linalg.solve(innovations[k, one], d))
            risk = risks[one, other]
            at = np.flatnonzero(risk.scans == k)
            assert len(at) == (squared <= FARTHEST)
            if len(at):
                assert risk.probability[at[0]] == pytest.approx(taken(squared), rel=1e-4)
                checked += 1
    assert checked > 10

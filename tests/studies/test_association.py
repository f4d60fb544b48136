"""One reflector of one scan: S, d2, gate, rivals and innovations against numbers worked out here by hand."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from commission.localization.estimate import Belief, Estimate, Status
from commission.localization.growing_run import GrowingRun
from commission.localization.run_columns import RunColumns
from commission.localization.setup import LocalizerSetup
from commission.localization.validation import validation_ellipses
from commission.localization.whole_run import run
from commission.site.fields import with_field
from commission.site.project import Project
from commission.site.records import Detections
from commission.site.reflectors import Reflector, ReflectorMap
from commission.studies import association as study
from commission.studies.association import AssociationInput, association, last_innovations
from tests.studies.recorded import PROJECT, drive, start

GATE = 2.0
"""Of 63.2 %: -2 ln(1 - p)."""
PROBABILITY = 1.0 - math.exp(-1.0)


def plain_setup(*reflectors: Reflector, bias: float = 0.0, probability: float = PROBABILITY) -> LocalizerSetup:
    """A scanner in the middle of base that nothing is uncertain about but its noise: 10 mm and 2 mrad."""
    project = dataclasses.replace(PROJECT, reflectors=ReflectorMap(reflectors))
    parameters = with_field(project.parameters, "filter.consider", new=False)
    parameters = with_field(parameters, "association.gate_probability", probability)
    parameters = with_field(parameters, "observation.range_bias", bias)
    scanner = dataclasses.replace(project.scanners[0], mounting=np.zeros(3))
    return LocalizerSetup.of(dataclasses.replace(project, parameters=parameters, scanners=(scanner,)))


def one_scan(setup: LocalizerSetup, belief: Belief, *seen: tuple[float, float]) -> tuple[RunColumns, Estimate]:
    growing = GrowingRun(setup, belief)
    growing.push(Detections(belief.stamp_ns, np.array(seen).reshape(-1, 2)))
    assert growing.pull() is not None
    columns = growing.columns()
    return columns, columns.estimate(0)


def looked_at(setup: LocalizerSetup, columns: RunColumns, cycle: int, reflector: str = "") -> study.Association | None:
    estimate = columns.estimate(cycle)
    areas = validation_ellipses(setup, estimate.prior, scanner=estimate.scanner)
    return association(
        AssociationInput(columns=columns, cycle=cycle, estimate=estimate, covariances=areas, reflector=reflector)
    )


SURE = Belief(0, np.zeros(3), np.diag([0.03**2, 0.0, 0.0]))
"""At the origin, facing along x; only x is uncertain: 30 mm."""


def test_innovation_gate_and_distance_are_those_worked_out_by_hand() -> None:
    # Straight ahead at 5 m: S = 10^2 + 30^2 mm^2 along the ray, 2 mrad across it, which is 10 mm.
    setup = plain_setup(Reflector(id="ahead", x=5.0, y=0.0, radius=0.04))
    columns, _ = one_scan(setup, SURE, (5.02, 0.001))
    found = looked_at(setup, columns, 0, "ahead")
    assert found is not None
    assert found.detection is not None
    assert found.estimate.gate == pytest.approx(GATE)
    assert found.probability == PROBABILITY
    np.testing.assert_allclose(found.covariance, np.diag([0.03**2 + 0.01**2, 0.01**2]), rtol=1e-9)
    assert found.sigmas == pytest.approx((math.sqrt(0.001), 0.01))
    assert (found.detection.along, found.detection.across) == pytest.approx((0.02, 0.005))
    assert found.detection.bearing == pytest.approx(0.001)
    assert found.detection.length == pytest.approx(math.hypot(0.02, 0.005))
    assert found.detection.d2 == pytest.approx(0.02**2 / 0.001 + 0.5**2)
    assert found.predicted == pytest.approx((5.0, 0.0))
    assert found.detection.measured == pytest.approx((5.02, 0.001))
    assert found.detection.status is Status.INLIER
    # The gain along the ray is 900 / 1000; the detection itself, not its innovation, is moved.
    seen = 5.02 * np.array([math.cos(0.001), math.sin(0.001)])
    np.testing.assert_allclose(found.detection.corrected, seen - (5.0 + 0.9 * 0.02, 0.0), atol=1e-9)
    assert found.rivals == ()


@pytest.mark.parametrize(("along", "status"), [(0.0446, Status.INLIER), (0.0448, Status.OUTLIER_ASSOCIATION)])
def test_just_inside_and_just_outside_of_the_gate_are_told_apart(along: float, status: Status) -> None:
    # sqrt(2 * 0.001) = 44.72 mm.
    setup = plain_setup(Reflector(id="ahead", x=5.0, y=0.0, radius=0.04))
    columns, _ = one_scan(setup, SURE, (5.0 + along, 0.0))
    found = looked_at(setup, columns, 0)
    assert found is not None
    assert found.detection is not None
    assert found.is_worst
    assert found.detection.status is status
    assert (found.detection.d2 <= found.estimate.gate) == (status is Status.INLIER)


def test_offsets_lie_on_the_floor_as_the_vehicle_stands_and_without_the_known_bias() -> None:
    # Facing north at (1, 2), the reflector 4 m to the left is 4 m west: 30 mm too far is 30 mm farther west.
    setup = plain_setup(Reflector(id="left", x=-3.0, y=2.0, radius=0.04), bias=0.1)
    belief = Belief(0, np.array([1.0, 2.0, 0.5 * math.pi]), np.diag([1e-4, 1e-4, 1e-6]))
    columns, _ = one_scan(setup, belief, (4.03 + 0.1, 0.5 * math.pi + 0.002))
    found = looked_at(setup, columns, 0, "left")
    assert found is not None
    assert found.detection is not None
    np.testing.assert_allclose(found.along, (-1.0, 0.0), atol=1e-12)
    # Turning left by 2 mrad at 4 m: 8 mm south.
    np.testing.assert_allclose(found.detection.offset, (-0.03, -0.008), atol=1e-9)
    assert found.detection.measured[0] == pytest.approx(4.03)


def test_the_worst_is_the_detection_with_the_largest_distance_and_a_named_one_is_not_the_worst() -> None:
    setup = plain_setup(
        Reflector(id="ahead", x=5.0, y=0.0, radius=0.04), Reflector(id="left", x=0.0, y=5.0, radius=0.04)
    )
    columns, _ = one_scan(setup, SURE, (5.0, 0.0001), (5.011, 0.5 * math.pi))
    worst, named = looked_at(setup, columns, 0), looked_at(setup, columns, 0, "ahead")
    assert worst is not None
    assert named is not None
    assert (worst.reflector.id, worst.is_worst) == ("left", True)
    assert (named.reflector.id, named.is_worst) == ("ahead", False)
    assert named.others.shape == (1, 2)
    assert np.hypot(*named.others[0]) > 1.0, "the other one's detection lies elsewhere"


def test_a_rival_has_its_own_distance_and_its_share_of_the_likelihood() -> None:
    # Two posts 50 mm apart across the ray: what lies between them may be either.
    setup = plain_setup(
        Reflector(id="one", x=5.0, y=0.0, radius=0.02), Reflector(id="other", x=5.0, y=0.05, radius=0.02)
    )
    far = Reflector(id="far", x=5.0, y=1.0, radius=0.02)
    setup = plain_setup(*setup.reflectors.reflectors, far, probability=0.99)
    columns, _ = one_scan(setup, Belief(0, np.zeros(3), np.zeros((3, 3))), (5.0, 0.02 / 5.0))
    found = looked_at(setup, columns, 0, "one")
    assert found is not None
    assert found.detection is not None
    (rival,) = found.rivals
    assert rival.reflector.id == "other"
    distance = math.hypot(5.0, 0.05)
    along, across = (5.0 - distance) / 0.01, (0.004 - math.atan2(0.05, 5.0)) / 0.002
    assert found.detection.d2 == pytest.approx(2.0**2)
    assert rival.d2 == pytest.approx(along**2 + across**2, rel=1e-9)
    # Both have the same S: R alone.
    assert rival.likelihood == pytest.approx(math.exp(-0.5 * (along**2 + across**2 - 4.0)), rel=1e-6)
    np.testing.assert_allclose(rival.offset, (0.0, 0.05))


def test_what_nobody_was_taken_for_is_told_beside_the_nearest_reflector_if_it_is_near() -> None:
    setup = plain_setup(Reflector(id="ahead", x=5.0, y=0.0, radius=0.04))
    columns, _ = one_scan(setup, SURE, (9.0, 2.0))
    found = looked_at(setup, columns, 0, "ahead")
    assert found is not None
    assert found.detection is None
    assert len(found.others) == 1
    assert looked_at(setup, columns, 0) is None, "nothing near: there is no worst"
    assert looked_at(setup, columns, 0, "no such") is None


@pytest.fixture(scope="module", params=[True, False], ids=["considered", "white"])
def driven(request: pytest.FixtureRequest) -> tuple[Project, RunColumns]:
    project = dataclasses.replace(
        PROJECT, parameters=with_field(PROJECT.parameters, "filter.consider", bool(request.param))
    )
    return project, run(drive(40.0), LocalizerSetup.of(project), start())


def test_the_cloud_is_what_the_last_detections_differed_from_the_belief_before_them(
    driven: tuple[Project, RunColumns],
) -> None:
    project, columns = driven
    mounting, place = project.scanners[0].mounting, np.array((project.reflectors.reflectors[2].x, 7.0))
    cycle, expected, accepted = 300, list[tuple[float, float]](), 0
    for past in range(cycle + 1):
        estimate = columns.estimate(past)
        x, y, theta = estimate.prior.mean
        east = math.cos(theta) * mounting[0] - math.sin(theta) * mounting[1]
        north = math.sin(theta) * mounting[0] + math.cos(theta) * mounting[1]
        scanner = (x + east, y + north)
        distance = math.dist(scanner, place)
        toward = math.atan2(place[1] - scanner[1], place[0] - scanner[0]) - theta - mounting[2]
        for row in np.flatnonzero(estimate.reflector == 2):
            turn = math.remainder(estimate.detections[row, 1] - toward, 2.0 * math.pi)
            expected.append((estimate.detections[row, 0] - distance, distance * turn))
            accepted += estimate.status[row] == Status.INLIER
    assert len(expected) > study.CLOUD
    cloud = last_innovations(columns, cycle, "R2")
    last = np.array(expected[-study.CLOUD :])
    np.testing.assert_allclose(cloud.points, last, atol=1e-9)
    np.testing.assert_allclose(cloud.mean, last.mean(axis=0), atol=1e-9)
    centered = last - last.mean(axis=0)
    np.testing.assert_allclose(cloud.covariance, centered.T @ centered / (len(last) - 1), atol=1e-12)
    assert cloud.is_whole
    assert cloud.accepted <= accepted


def test_a_reflector_never_seen_has_no_cloud_and_one_at_the_start_all_there_is(
    driven: tuple[Project, RunColumns], monkeypatch: pytest.MonkeyPatch
) -> None:
    _, columns = driven
    nobody, few = last_innovations(columns, 30, "no such"), last_innovations(columns, 30, "R2")
    assert len(nobody.points) == 0
    assert np.isnan(nobody.mean).all()
    assert np.isnan(nobody.covariance).all()
    assert 0 < len(few.points) <= 31
    assert few.is_whole
    monkeypatch.setattr(study, "LOOKED_BACK", 10)
    short = last_innovations(columns, 30, "R2")
    assert len(short.points) <= 10
    assert not short.is_whole
    np.testing.assert_array_equal(short.points, few.points[-len(short.points) :])

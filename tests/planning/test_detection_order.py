"""What a prediction makes of detections that may be missing: the same in any order of the map, and near the mean.

The mean is over all sets of detections of a scan, each corrected at once by a Kalman filter of this file's own.
"""

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest

from commission.io.bundled import bundled_folder
from commission.io.project_file import load_project
from commission.planning.detection_noise import worth
from commission.planning.detection_order import farthest_first
from commission.planning.error_budget import predict_errors
from commission.planning.route_prediction import PlannedRoute, PredictionOptions, plan_route, predict_route
from commission.planning.visibility import VisibleReflectors
from commission.site.parameters import AssociationParameters, FilterParameters, Parameters
from commission.site.project import Project
from commission.site.reflectors import ReflectorMap
from commission.site.scanner import Scanner
from tests.planning.sites import open_field, surely_detected

START = (0.02, 0.02, 0.01)


@pytest.mark.parametrize("site", ["laboratory", "loading_bay"])
@pytest.mark.parametrize("seed", [1, 2])
def test_the_order_of_the_reflectors_in_the_map_changes_nothing(site: str, seed: int) -> None:
    project = load_project(bundled_folder("maps") / site)
    every = project.reflectors.reflectors
    order = np.random.default_rng(seed).permutation(len(every))
    shuffled = replace(project, reflectors=ReflectorMap(tuple(every[i] for i in order)))
    options = PredictionOptions(blocked_per_m=0.02)
    one, other = (plan_route(each, each.routes[0].name, options) for each in (project, shuffled))
    first, second = predict_route(one), predict_route(other)
    # What is left is the order in which numbers are added.
    np.testing.assert_allclose(second.covariances, first.covariances, rtol=1e-9, atol=1e-18)
    errors, again = predict_errors(one, first), predict_errors(other, second)
    np.testing.assert_allclose(again.squares, errors.squares, rtol=1e-9, atol=1e-18)
    np.testing.assert_allclose(again.inliers, errors.inliers, rtol=1e-9)
    assert np.array_equal(first.seen, second.seen)


def first_scan(places: np.ndarray, blocked_per_m: float) -> tuple[Project, PlannedRoute]:
    site = open_field(
        places.tolist(),
        scanner=Scanner(field_of_view_deg=(-180.0, 180.0), reflector_range=30.0),
        parameters=Parameters(
            filter=FilterParameters(consider=False), association=AssociationParameters(enabled=False)
        ),
    )
    return site, plan_route(site, "Line", PredictionOptions(start_sigmas=START, blocked_per_m=blocked_per_m))


def mean_over_all_sets(site: Project, planned: PlannedRoute) -> np.ndarray:
    """(3, 3) expected covariance after the first scan."""
    observation, model = site.parameters.observation, planned.model()
    blocks, chances = [], []
    for m in planned.visible.of(0).tolist():
        dx, dy = planned.places[m, :2]
        r = math.hypot(dx, dy)
        h = np.array([[-dx / r, -dy / r, 0.0], [dy / r**2, -dx / r**2, -1.0]])
        noise = np.diag([observation.range_sigma**2, observation.bearing_sigma**2])
        blocks.append(h.T @ np.linalg.inv(noise) @ h)
        chances.append(worth(model.noise, int(model.kinds[0, m]), r).probability * model.free_per_m**r)
    result = np.zeros((3, 3))
    for seen in itertools.product((False, True), repeat=len(blocks)):
        chance = math.prod(p if is_seen else 1.0 - p for p, is_seen in zip(chances, seen, strict=True))
        information = np.diag(np.square(START) ** -1.0) + sum(
            b for b, is_seen in zip(blocks, seen, strict=True) if is_seen
        )
        result += chance * np.linalg.inv(information)
    return result


@pytest.mark.parametrize("blocked_per_m", [0.002, 0.02])
def test_the_first_scan_is_at_least_the_mean_over_all_sets_of_detections_and_at_most_an_eighth_more(
    blocked_per_m: float,
) -> None:
    rng = np.random.default_rng(3)
    for count in (1, 2, 3, 4, 5, 6, 6, 6):
        distances = rng.uniform(2.0, 9.0, count)
        # One in each part of the circle, so that none is in the other's way.
        angles = (rng.permutation(count) + rng.uniform(0.1, 0.9, count)) * 2.0 * math.pi / count
        places = np.column_stack((distances * np.cos(angles), distances * np.sin(angles)))
        site, planned = first_scan(places, blocked_per_m)
        assert len(planned.visible.of(0)) == count
        mean = np.sqrt(np.diag(mean_over_all_sets(site, planned)))
        ratio = np.sqrt(np.diag(predict_route(planned).covariances[0])) / mean
        # A corrected covariance is concave in the one before: mixing one by one never promises too much.
        assert ratio.min() >= 1.0 - 1e-9
        assert ratio.max() <= 1.125
        if count == 1:
            assert ratio == pytest.approx(1.0, rel=1e-9)


@pytest.mark.parametrize("every", [1, 3])
def test_while_driving_the_prediction_is_the_mean_over_drives_whose_detections_are_drawn(every: int) -> None:
    """Forty drives of 1,800 scans: their own filters' variances, with each detection there or not."""
    site = load_project(bundled_folder("maps") / "laboratory")
    few = ReflectorMap(site.reflectors.reflectors[::every])
    blind = replace(site.parameters, association=AssociationParameters(enabled=False))
    site = replace(site, reflectors=few, parameters=blind)
    planned = plan_route(site, site.routes[0].name, PredictionOptions(blocked_per_m=0.05))
    chances, total, drives = detection_chances(planned), 0.0, 40
    certain = surely_detected(plan_route(site, site.routes[0].name))
    rng = np.random.default_rng(5)
    for _ in range(drives):
        drawn = replace(certain, visible=some_of(planned.visible, rng.random(len(chances)) < chances))
        total += np.diagonal(predict_route(drawn).covariances, axis1=1, axis2=2) / drives
    predicted = np.diagonal(predict_route(planned).covariances, axis1=1, axis2=2)
    ratio = np.sqrt(predicted / total)[planned.drive.sets_off + 25 :]
    assert 0.995 <= np.median(ratio) <= 1.01
    assert ratio.min() >= 0.98
    assert ratio.max() <= 1.03


def detection_chances(planned: PlannedRoute) -> np.ndarray:
    """Probability of each detection of a drive, in the order of `visible`."""
    model, chances = planned.model(), []
    for k in range(len(planned.drive)):
        for m in planned.visible.of(k).tolist():
            r = math.hypot(*(planned.places[m, :2] - planned.drive.poses[k, :2]))
            chances.append(worth(model.noise, int(model.kinds[0, m]), r).probability * model.free_per_m**r)
    return np.array(chances)


def some_of(visible: VisibleReflectors, kept: np.ndarray) -> VisibleReflectors:
    """Those detections of a drive that a mask keeps."""
    return VisibleReflectors(np.concatenate(([0], np.cumsum(kept)))[visible.offsets], visible.indices[kept])


def test_reflectors_are_sorted_from_the_scanner_and_by_direction_where_they_are_as_far() -> None:
    scanners = (Scanner(mounting=np.array([2.0, 0.0, 0.0])), Scanner(mounting=np.array([-2.0, 0.0, 0.0])))
    centers = np.array([[0.0, 1.0], [3.0, 0.0], [0.0, -1.0]])
    poses = np.zeros((2, 3))
    visible = VisibleReflectors(np.array([0, 3, 6]), np.array([0, 1, 2, 0, 1, 2]))
    found = farthest_first(visible, centers, poses, (scanners, np.array([0, 1])))
    assert found.of(0).tolist() == [2, 0, 1]
    assert found.of(1).tolist() == [1, 2, 0]

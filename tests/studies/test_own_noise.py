"""The noise that a scanner states itself acts in every study as the same noise stated for all scanners does."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from commission.site.project import Project
from commission.site.reflectors import Reflector, ReflectorMap
from commission.site.routes import Route, Segment
from commission.site.scanner import Scanner
from commission.studies.failures import FailuresInput, failures
from commission.studies.placement import PlacementInput, placement
from commission.studies.prediction import PredictionInput, PredictionResult, prediction
from tests.planning.sites import room

RANGE_SIGMA, BEARING_SIGMA = 0.05, math.radians(0.5)
SCANNERS = (
    Scanner(name="front", mounting=(0.4, 0.2, 0.3), field_of_view_deg=(-135.0, 135.0)),
    Scanner(name="rear", mounting=(-0.4, -0.2, 3.4), field_of_view_deg=(-135.0, 135.0)),
)


def hall(scanners: tuple[Scanner, ...]) -> Project:
    places = np.random.default_rng(8).uniform((1.0, 1.0), (13.0, 7.0), (9, 2)).tolist()
    reflectors = tuple(Reflector(id=f"R{i}", x=x, y=y, radius=0.05) for i, (x, y) in enumerate(places))
    line = Segment(control_points=np.array([[2.0, 4.0], [12.0, 4.0]]), degree=1)
    return Project(
        reflectors=ReflectorMap(reflectors),
        floor_map=room(14.0, 8.0),
        scanners=scanners,
        routes=(Route("Line", (line,), 1.0),),
    )


def said_by_the_scanners(scanners: tuple[Scanner, ...]) -> Project:
    own = {"detection_range_sigma": RANGE_SIGMA, "detection_bearing_sigma_deg": math.degrees(BEARING_SIGMA)}
    return hall(tuple(replace(scanner, **own) for scanner in scanners))


def said_for_all(scanners: tuple[Scanner, ...]) -> Project:
    project = hall(scanners)
    noise = replace(project.parameters.observation, range_sigma=RANGE_SIGMA, bearing_sigma=BEARING_SIGMA)
    return replace(project, parameters=replace(project.parameters, observation=noise))


def _middle(predicted: PredictionResult) -> float:
    """Variance of the position half way, both axes [m^2]."""
    covariances = predicted.prediction.covariances
    return float(np.trace(covariances[len(covariances) // 2, :2, :2]))


@pytest.mark.parametrize("scanners", [SCANNERS[:1], SCANNERS], ids=["one", "two"])
def test_a_prediction_takes_each_scanners_own_noise(scanners: tuple[Scanner, ...]) -> None:
    own, shared, usual = (
        prediction(PredictionInput.of(project, "Line"))
        for project in (said_by_the_scanners(scanners), said_for_all(scanners), hall(scanners))
    )
    np.testing.assert_allclose(own.prediction.covariances, shared.prediction.covariances, rtol=1e-12)
    assert _middle(own) > 1.2 * _middle(usual)


def test_one_coarse_scanner_of_two_lies_between_two_good_and_two_coarse_ones() -> None:
    coarse = said_by_the_scanners(SCANNERS)
    mixed = hall((coarse.scanners[0], SCANNERS[1]))
    good, between, bad = (
        _middle(prediction(PredictionInput.of(project, "Line"))) for project in (hall(SCANNERS), mixed, coarse)
    )
    assert 1.05 * good < between < bad / 1.05


def test_failures_and_suggested_layouts_take_each_scanners_own_noise() -> None:
    own, shared = said_by_the_scanners(SCANNERS), said_for_all(SCANNERS)
    ranks = [
        [(each.reflector, each.limit_share) for each in failures(FailuresInput.of(project)).ranking]
        for project in (own, shared)
    ]
    assert ranks[0] == ranks[1]
    layouts = [placement(PlacementInput.of(project)).placement.reflectors.centers for project in (own, shared)]
    np.testing.assert_array_equal(layouts[0], layouts[1])

"""Supervisor: limits of 2-sigma, along the axes or the ellipse, and hysteresis."""

from __future__ import annotations

import math

import pytest

from commission.localization.estimate import Mode
from commission.localization.pose_gaussian import PoseGaussian
from commission.localization.supervisor import SupervisorLimits, supervise

AXES = SupervisorLimits(True, True, 0.1, 0.05, 2.0)
LARGEST = AXES._replace(by_axes=False)

pytestmark = pytest.mark.parametrize("limits", [AXES, LARGEST], ids=["axes", "largest"])


def spread(x: float, y: float = 0.0, heading: float = 0.0) -> PoseGaussian:
    """Belief with these 2-sigma."""
    return PoseGaussian(0.0, 0.0, 0.0, x * x / 4.0, 0.0, 0.0, y * y / 4.0, 0.0, heading * heading / 4.0)


def test_each_two_sigma_above_its_limit_fails(limits: SupervisorLimits) -> None:
    assert supervise(Mode.OPERATIONAL, spread(0.099, 0.099, 0.049), limits) == Mode.OPERATIONAL
    for belief in (spread(0.101), spread(0.0, 0.101), spread(0.0, 0.0, 0.051)):
        assert supervise(Mode.OPERATIONAL, belief, limits) == Mode.FAIL


def test_recovers_only_when_every_two_sigma_is_below_its_limit_divided_by_the_ratio(limits: SupervisorLimits) -> None:
    for belief in (spread(0.051), spread(0.0, 0.051), spread(0.0, 0.0, 0.026)):
        assert supervise(Mode.FAIL, belief, limits) == Mode.FAIL
    assert supervise(Mode.FAIL, spread(0.049, 0.049, 0.024), limits) == Mode.OPERATIONAL


def test_covariance_that_is_not_a_number_fails(limits: SupervisorLimits) -> None:
    for belief in (spread(math.nan), spread(0.0, math.nan), spread(0.0, 0.0, math.nan)):
        assert supervise(Mode.OPERATIONAL, belief, limits) == Mode.FAIL
        assert supervise(Mode.FAIL, belief, limits) == Mode.FAIL
    assert supervise(Mode.OPERATIONAL, spread(math.inf), limits) == Mode.FAIL


def test_disabled_supervisor_is_always_operational(limits: SupervisorLimits) -> None:
    assert supervise(Mode.FAIL, spread(9.0), limits._replace(enabled=False)) == Mode.OPERATIONAL


@pytest.mark.parametrize("along", [0.25, 1.0, 2.0, -0.7])
@pytest.mark.parametrize(("longer", "shorter"), [(0.098, 0.01), (0.102, 0.01), (0.138, 0.0), (0.145, 0.1)])
def test_uncertainty_askew_counts_by_its_longest_axis_or_by_what_of_it_lies_along_x_and_y(
    limits: SupervisorLimits, longer: float, shorter: float, along: float
) -> None:
    c, s = math.cos(along), math.sin(along)
    xx, yy = (longer * c) ** 2 + (shorter * s) ** 2, (longer * s) ** 2 + (shorter * c) ** 2
    belief = PoseGaussian(
        0.0, 0.0, 0.0, xx / 4.0, c * s * (longer**2 - shorter**2) / 4.0, 0.0, yy / 4.0, 0.0, 0.0004 / 4.0
    )
    fails = math.sqrt(max(xx, yy)) > 0.1 if limits.by_axes else longer > 0.1
    assert supervise(Mode.OPERATIONAL, belief, limits) == (Mode.FAIL if fails else Mode.OPERATIONAL)

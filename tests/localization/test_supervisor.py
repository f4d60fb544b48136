"""Supervisor: limits of 2-sigma, and hysteresis."""

from __future__ import annotations

import math

from commission.localization.estimate import Mode
from commission.localization.pose_gaussian import PoseGaussian
from commission.localization.supervisor import SupervisorLimits, supervise

LIMITS = SupervisorLimits(True, 0.1, 0.05, 2.0)


def spread(x: float, y: float = 0.0, heading: float = 0.0) -> PoseGaussian:
    """Belief with these 2-sigma."""
    return PoseGaussian(0.0, 0.0, 0.0, x * x / 4.0, 0.0, 0.0, y * y / 4.0, 0.0, heading * heading / 4.0)


def test_each_two_sigma_above_its_limit_fails() -> None:
    assert supervise(Mode.OPERATIONAL, spread(0.099, 0.099, 0.049), LIMITS) == Mode.OPERATIONAL
    for belief in (spread(0.101), spread(0.0, 0.101), spread(0.0, 0.0, 0.051)):
        assert supervise(Mode.OPERATIONAL, belief, LIMITS) == Mode.FAIL


def test_recovers_only_when_every_two_sigma_is_below_its_limit_divided_by_the_ratio() -> None:
    for belief in (spread(0.051), spread(0.0, 0.051), spread(0.0, 0.0, 0.026)):
        assert supervise(Mode.FAIL, belief, LIMITS) == Mode.FAIL
    assert supervise(Mode.FAIL, spread(0.049, 0.049, 0.024), LIMITS) == Mode.OPERATIONAL


def test_covariance_that_is_not_a_number_fails() -> None:
    assert supervise(Mode.OPERATIONAL, spread(math.nan), LIMITS) == Mode.FAIL


def test_disabled_supervisor_is_always_operational() -> None:
    assert supervise(Mode.FAIL, spread(9.0), LIMITS._replace(enabled=False)) == Mode.OPERATIONAL

"""The field for where a vehicle starts says a pose so that it is read again as the same."""

from __future__ import annotations

import math

import pytest

from commission.app.live.live_panel import pose_text, start_pose


@pytest.mark.parametrize(
    "pose", [(4.0, 2.5, math.radians(90.0)), (5_412_345.679, -3_512_345.001, math.radians(-12.5)), (0.0, 0.001, 0.0)]
)
def test_a_pose_comes_back_to_the_millimetre_on_a_national_grid_too(pose):
    assert start_pose(pose_text(pose)) == pytest.approx(pose, abs=1e-6, rel=0.0)

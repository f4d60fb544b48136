"""A table of detection rates: what it says between its entries, and which tables are none."""

from __future__ import annotations

import numpy as np
import pytest

from commission.site.detection_rates import detection_rate
from commission.site.presets import SCANNERS, with_preset
from commission.site.scanner import Scanner

TABLE = ((5.0, 0.8), (15.0, 0.12))


def test_shares_are_linear_between_two_distances_and_constant_beyond_the_table():
    found = detection_rate(TABLE, np.array([0.0, 5.0, 10.0, 12.5, 15.0, 40.0]))
    # By hand: half way 0.46, three quarters of the way 0.29.
    assert found == pytest.approx([0.8, 0.8, 0.46, 0.29, 0.12, 0.12])


def test_without_a_table_every_reflector_in_sight_is_seen():
    assert detection_rate((), np.array([[0.0, 100.0]])).tolist() == [[1.0, 1.0]]
    assert Scanner().detection_rates == ()


@pytest.mark.parametrize(
    ("table", "message"),
    [
        (((5.0, 1.01),), r"holds \[5, 1.01\]; expected a distance \[m\], then a share of 0 to 1"),
        (((5.0, -0.01),), "then a share of 0 to 1"),
        (((5.0, float("nan")),), "then a share of 0 to 1"),
        (((-0.1, 0.5),), r"holds \[-0.1, 0.5\]; expected a distance of 0 m or more"),
        (((float("inf"), 0.5),), "expected a distance of 0 m or more"),
        (((5.0, 0.8), (5.0, 0.1)), r"holds \[5, 0.8\] before \[5, 0.1\]; expected distances that ascend"),
        (((5.0, 0.8), (4.0, 0.1)), "expected distances that ascend"),
        (((10_001.0, 0.5),), r"detection_rates\[0\]\[0\] is 10001"),
    ],
)
def test_a_table_that_cannot_be_is_refused(table, message):
    with pytest.raises(ValueError, match=message):
        Scanner(detection_rates=table)


def test_both_limits_of_distances_and_shares_are_allowed():
    Scanner(detection_rates=((0.0, 1.0), (10_000.0, 0.0)))


def test_rates_of_another_device_go_when_a_preset_is_chosen_for_none_is_published():
    for preset in SCANNERS:
        assert with_preset(Scanner(detection_rates=TABLE), preset.name).detection_rates == ()

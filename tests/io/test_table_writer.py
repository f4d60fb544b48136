"""Cells of tables that people read: places, angles and figures."""

import math

import pytest

from commission.io.table_writer import angle, figure, place


@pytest.mark.parametrize(
    ("value", "cell"),
    [
        (5.640000000000006, "5.64"),
        (-3e-17, "0.0"),
        (2.0, "2.0"),
        # A national grid: six significant digits would be ten metres.
        (5_412_345.678_91, "5412345.6789"),
        (math.inf, ""),
        (math.nan, ""),
    ],
)
def test_a_place_is_written_in_tenths_of_a_millimetre_wherever_it_is(value, cell):
    assert place(value) == cell


def test_an_angle_is_written_in_microradians():
    assert angle(math.pi) == "3.141593"
    assert angle(-1e-9) == "0.0"
    assert angle(math.nan) == ""


def test_a_figure_is_written_with_six_digits_however_small_it_is():
    assert figure(0.000_123_456_78) == "0.000123457"
    assert figure(0.1 + 0.2) == "0.3"
    assert figure(math.inf) == ""

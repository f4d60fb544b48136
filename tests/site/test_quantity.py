"""Bounds and units of a quantity: both sides of each limit, the page's unit, and what a file has of a number."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from commission.site.quantity import (
    AS_DEGREES,
    COORDINATE,
    DEGREES,
    MILLIMETRES,
    PERCENT,
    POSITIVE,
    Bounds,
    Quantity,
    Shown,
    number_text,
)

SIGMA = Quantity(label="Range 1σ", unit="m", shown=MILLIMETRES, bounds=POSITIVE, step=0.5)
X = Quantity(label="x", unit="m", bounds=COORDINATE, decimals=4)
GATE = Quantity(label="Gate", shown=PERCENT, bounds=Bounds.inside(0.0, 1.0), step=0.01)
TINY = 5e-324
"""The smallest number above 0."""


@pytest.mark.parametrize(
    ("bounds", "allowed", "refused"),
    [
        (Bounds.above(0.0), [TINY, 1.0, 1e9], [0.0, -0.0, -1.0, 1.0001e9, math.inf, math.nan]),
        (Bounds.at_least(1.0), [1.0, 1e9], [math.nextafter(1.0, 0.0), -math.inf, math.inf, math.nan]),
        (Bounds.between(-1.0, 2.0), [-1.0, 0.0, 2.0], [-1.001, 2.001, math.nan]),
        (Bounds.inside(0.0, 1.0), [TINY, math.nextafter(1.0, 0.0)], [0.0, 1.0, math.nan]),
        (Bounds(0.0, 1.0, excludes_low=True), [TINY, 1.0], [0.0, math.nextafter(1.0, 2.0)]),
        (Bounds(), [-1e9, 0.0, 1e9], [-1.001e9, 1.001e9, math.inf, -math.inf, math.nan]),
    ],
)
def test_bounds_hold_on_both_sides_of_each_limit(bounds, allowed, refused):
    assert [value for value in allowed if value not in bounds] == []
    assert [value for value in refused if value in bounds] == []


@pytest.mark.parametrize(
    ("bounds", "value", "message"),
    [
        (Bounds.above(0.0), -0.5, "way is -0.5; expected more than 0 m"),
        (Bounds.above(0.0), 1e10, r"way is 1e\+10; expected at most 1e\+09 m"),
        (Bounds.at_least(1.0), 0.5, "way is 0.5; expected 1 m or more"),
        (Bounds.between(-1.0, 2.0), 3.0, "way is 3; expected -1 to 2 m"),
        (Bounds.inside(0.0, 1.0), 1.0, "way is 1; expected more than 0 and less than 1 m"),
        (Bounds(0.0, 1.0, excludes_low=True), 2.0, "way is 2; expected more than 0 and at most 1 m"),
        (Bounds(0.0, 1.0, excludes_high=True), 2.0, "way is 2; expected 0 or more and less than 1 m"),
        (Bounds(high=3.0), 4.0, "way is 4; expected at most 3 m"),
        (Bounds(), math.nan, "way is nan; expected a finite number"),
    ],
)
def test_a_refusal_says_what_was_found_and_what_is_expected(bounds, value, message):
    with pytest.raises(ValueError, match=message):
        bounds.check(value, "way", "m")


def test_the_page_refuses_in_its_own_unit():
    assert SIGMA.refusal(0.02) == ""
    assert SIGMA.refusal(-0.002) == "Range 1σ is -2 mm; expected more than 0 mm"
    assert GATE.refusal(1.0) == "Gate is 100 %; expected more than 0 and less than 100 %"
    heading = Quantity(label="Faces", unit="rad", shown=DEGREES, bounds=Bounds.between(-math.pi, math.pi))
    assert heading.refusal(2.0 * math.pi) == "Faces is 360°; expected -180 to 180°"


@pytest.mark.parametrize(
    ("quantity", "said"),
    [
        (Quantity(label="Gate", shown=PERCENT, bounds=Bounds.between(0.1, 0.9999)), "10 to 99.99 %"),
        (Quantity(label="Speed", unit="m/s", bounds=Bounds.above(0.0)), "more than 0 m/s"),
        (Quantity(label="Range", unit="m", shown=MILLIMETRES, bounds=Bounds.at_least(0.001)), "1 mm or more"),
        (Quantity(label="Cell", unit="m", bounds=Bounds.above(0.0), entry=(0.05, 2.0)), "0.05 to 2 m"),
        (Quantity(label="Gate", shown=PERCENT, bounds=Bounds.inside(0.0, 1.0), slider=(50.0, 99.99)), "50 to 99.99 %"),
        (Quantity(label="Angle", unit="rad"), ""),
        (Quantity(label="x", unit="m", bounds=COORDINATE), ""),
    ],
)
def test_what_may_be_entered_is_said_in_the_unit_of_the_page(quantity, said):
    assert quantity.limits() == said


def test_numbers_are_shown_in_the_unit_of_the_page_and_written_with_the_decimals_of_their_step():
    assert SIGMA.on_page(0.01234) == 12.34
    assert SIGMA.on_page(0.012345678) == 12.3457
    assert X.on_page(5_412_345.678_91) == 5_412_345.679
    assert X.brief(5_412_345.678_91) == "5412345.679 m"
    assert SIGMA.text(0.02) == "20.0 mm"
    assert SIGMA.title == "Range 1σ [mm]"
    assert Quantity(label="Bearing", unit="rad", shown=DEGREES, step=0.01).text(math.radians(30.0)) == "30.00°"
    assert Quantity(label="Resolution", unit="deg", shown=AS_DEGREES, step=0.0001).text(1.0 / 6.0) == "0.1667°"
    assert Quantity(label="Beams", step=1).text(3) == "3"
    assert Quantity(label="Spacing", unit="m", step=0.25).text(1.5) == "1.50 m"
    assert Quantity(label="Every", unit="m", step=20.0).text(41.2) == "41 m"


@given(st.floats(1.0, 1e6))
def test_what_is_typed_on_the_page_comes_back_as_it_was_typed(number):
    typed = round(number, 1)
    assert SIGMA.on_page(SIGMA.of_page(typed)) == typed


@pytest.mark.parametrize(
    ("value", "written"),
    [
        (5.640000000000006, 5.64),
        (12.34567, 12.3457),
        (-3e-17, 0.0),
        (0.00004999, 0.0),
        (0.00005001, 0.0001),
        (1e6 + 1.0 / 3.0, 1000000.3333),
    ],
)
def test_a_coordinate_is_written_in_tenths_of_a_millimetre(value, written):
    assert X.in_file(value) == written
    assert math.copysign(1.0, X.in_file(value)) == math.copysign(1.0, written)


def test_a_sigma_is_written_with_six_digits_however_small_it_is():
    assert SIGMA.in_file(0.000_123_456_78) == 0.000_123_457
    assert SIGMA.in_file(0.1 + 0.2) == 0.3


def test_a_number_is_not_rounded_out_of_its_bounds():
    assert GATE.in_file(0.999_999_99) == 0.999_999_99
    radius = Quantity(label="Radius", unit="m", bounds=POSITIVE, decimals=4)
    assert radius.in_file(1e-5) == 1e-5


@given(st.floats(-1e7, 1e7), st.sampled_from([None, 0, 4, 9]), st.sampled_from([COORDINATE, POSITIVE, GATE.bounds]))
def test_rounding_for_a_file_twice_is_rounding_once_and_keeps_the_bounds(value, decimals, bounds):
    quantity = Quantity(label="any", bounds=bounds, decimals=decimals)
    once = quantity.in_file(value)
    assert quantity.in_file(once) == once
    assert (once in bounds) or (value not in bounds)


@pytest.mark.parametrize(
    ("value", "digits", "text"),
    [
        (0.0, 3, "0"),
        (0.012345, 3, "0.0123"),
        (9.996, 3, "10"),
        (999.7, 3, "1000"),
        (13_670.4, 4, "13670"),
        (65_535.0, 4, "65535"),
        (-5_412_345.6, 6, "-5412346"),
        (1e300, 3, "1e+300"),
        (math.inf, 3, "inf"),
        (math.nan, 3, "nan"),
    ],
)
def test_a_large_number_is_written_with_all_its_digits_and_no_exponent(value, digits, text):
    assert number_text(value, digits) == text
    assert Shown("mm", 1.0).text(value, f".{digits}g") == f"{text} mm"


def test_no_minus_stands_before_a_zero():
    length = Quantity(label="x", unit="m", step=0.001)
    assert length.text(-1e-9) == "0.000 m"
    assert length.digits(-0.0) == "0"
    assert not length.change_text(-1e-9, 1e-9)
    assert MILLIMETRES.text(-1e-9) == "0 mm"

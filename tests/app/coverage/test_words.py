"""Numbers of the step Plan carry the unit that belongs to what is measured."""

from __future__ import annotations

import math

from commission.app.coverage.settings import Figure
from commission.app.coverage.words import value_text
from commission.planning.dilution import Measurement


def test_position_dilution_of_bearings_alone_has_a_unit_and_that_of_ranges_has_none():
    assert value_text(Figure.POSITION_DOP, 4.2, Measurement.BEARING_ONLY) == "4.2 m/rad"
    assert value_text(Figure.POSITION_DOP, 4.2, Measurement.RANGE_BEARING) == "4.2"


def test_where_nothing_of_its_kind_is_in_sight_that_is_said():
    for figure in (Figure.VISIBLE, Figure.REELS):
        assert value_text(figure, 0.0, Measurement.RANGE_BEARING) == "none visible"
    assert value_text(Figure.TAG_POSITION, math.inf, Measurement.RANGE_BEARING) == "no tag in sight"

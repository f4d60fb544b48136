"""Numbers of the step Plan carry the unit that belongs to what is measured."""

from __future__ import annotations

from commission.app.coverage.settings import Figure
from commission.app.coverage.words import value_text
from commission.planning.dilution import Measurement


def test_position_dilution_of_bearings_alone_has_a_unit_and_that_of_ranges_has_none():
    assert value_text(Figure.POSITION_DOP, 4.2, Measurement.BEARING_ONLY) == "4.2 m/rad"
    assert value_text(Figure.POSITION_DOP, 4.2, Measurement.RANGE_BEARING) == "4.2"

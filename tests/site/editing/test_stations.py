from __future__ import annotations

import pytest

from commission.errors import UsageError
from commission.site.editing import stations as edits
from commission.site.stations import DOCKING, Station

DOCK, GATE = Station("Dock", 1.0, 2.0, 0.0, DOCKING), Station("Gate", 5.0, 0.0)


def test_removing_what_was_added_gives_back_what_was():
    assert edits.remove(edits.put((DOCK,), GATE), "Gate") == (DOCK,)


def test_a_station_keeps_its_place_when_it_is_renamed():
    assert edits.put((DOCK, GATE), Station("Pier", 1.0, 2.0), "Dock") == (Station("Pier", 1.0, 2.0), GATE)


def test_two_stations_never_get_one_name():
    with pytest.raises(UsageError, match="'Gate' is used already"):
        edits.put((DOCK, GATE), GATE, "Dock")
    assert edits.fresh_name((DOCK, GATE)) == "Station 1"


def test_an_unknown_station_is_answered_with_the_names_there_are():
    with pytest.raises(UsageError, match="no station is called 'X'; the project has: 'Dock'"):
        edits.remove((DOCK,), "X")

"""What is refused of vehicle and scanner, in the words of the fields that a person sees."""

from __future__ import annotations

import pytest

from commission.app.base.state import AppState
from commission.app.editing.actions import SetEquipment
from commission.app.editing.typed_lists import list_value
from tests.app.asking import after
from tests.app.sites import room


@pytest.fixture
def state() -> AppState:
    project = room()
    return AppState(project=project, saved=project)


@pytest.mark.parametrize(
    ("name", "value", "told"),
    [
        ("scanners[0].blind_sectors_deg", ((170.0, 190.0),), "Blind sectors have 170 to 190°"),
        ("scanners[0].blind_sectors_deg", ((170.0, 190.0),), "across its end it is two: 170 180, -180 -170"),
        ("scanners[0].mounting[0]", 100_000.0, "Mounted at x"),
        (
            "scanners[0].blind_sectors_deg",
            ((0.0, 10.0), (5.0, 20.0)),
            "Blind sectors have 0 to 10° and 5 to 20°; expected sectors that do not overlap",
        ),
        (
            "scanners[0].blind_sectors_deg",
            ((0.0, 10.0), (-400.0, 20.0)),
            "Blind sectors: first bearing of sector 2 is -400°; expected -360 to 360°",
        ),
        ("vehicle.outline", ((0.0, 0.0), (1.0, 0.0)), "Outline has 2 corners"),
        (
            "vehicle.outline",
            ((0.0, 0.0), (1.0, 1.0), (1e12, 0.0)),
            "Outline: x of corner 3 is 1e+12 m; expected at most 1e+09 m",
        ),
        (
            "vehicle.outline",
            ((0.0, 0.0), (1.0, 1.0), (1.0, 0.0), (0.0, 1.0)),
            "Outline crosses itself: the edge from corner 1 to 2 meets the one from corner 3 to 4",
        ),
    ],
)
def test_a_refusal_calls_the_field_as_its_widget_does(state: AppState, name: str, value: object, told: str) -> None:
    with pytest.raises(ValueError, match=r".") as refusal:
        after(state, SetEquipment(name, value))
    text = str(refusal.value)
    assert told.split(" ", maxsplit=1)[0] in text
    assert told in text or name.endswith("]")
    assert "_" not in text
    assert "[" not in text
    assert "scanner." not in text
    assert "vehicle." not in text


@pytest.mark.parametrize(("metres", "allowed"), [(50.0, True), (-50.0, True), (50.001, False), (100_000.0, False)])
def test_a_scanner_is_on_its_vehicle(state: AppState, metres: float, allowed: bool) -> None:
    if allowed:
        after(state, SetEquipment("scanners[0].mounting[1]", metres))
        return
    with pytest.raises(ValueError, match="-50 to 50 m"):
        after(state, SetEquipment("scanners[0].mounting[1]", metres))


def test_corners_in_their_order_around_the_vehicle_are_taken_whichever_way_they_go(state: AppState) -> None:
    concave = ((0.0, 0.0), (2.0, 0.0), (2.0, 2.0), (1.0, 0.5), (0.0, 2.0))
    for outline in (concave, concave[::-1]):
        assert after(state, SetEquipment("vehicle.outline", outline)).state.project.vehicle.outline == outline


def test_commas_that_are_missing_are_put_where_they_may_belong() -> None:
    with pytest.raises(ValueError, match=r"Blind sectors is '-135 -120 60 75'; .*; perhaps -135 -120, 60 75"):
        list_value("blind_sectors_deg", "-135 -120 60 75", "Blind sectors")
    with pytest.raises(ValueError, match=r"or nothing$"):
        list_value("blind_sectors_deg", "-135 -120 60", "Blind sectors")
    assert list_value("blind_sectors_deg", "-135 -120, 60 75") == ((-135.0, -120.0), (60.0, 75.0))

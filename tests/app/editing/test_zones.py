"""Zones drawn, named, typed and deleted on the page, without a browser."""

# pyright: reportPrivateUsage=false

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from commission.app.base.actions import Action, DragFloor, Envelope
from commission.app.base.effects import FlyTo
from commission.app.base.marks import NO_SEGMENTS
from commission.app.base.server import start_server
from commission.app.base.state import AppState
from commission.app.base.view import view_of
from commission.app.editing.actions import ChooseTool
from commission.app.editing.zone_actions import AddZone, CountKind, DeleteZone, SetZone, ShowZone
from commission.app.editing.zone_fields import ZoneFields
from commission.app.editing.zone_layer import ZoneLayer
from commission.app.editing.zone_reducer import shown_zone
from commission.app.editing.zone_tool import ZoneTool
from commission.errors import UsageError
from commission.site.zones import ObservationKind
from tests.app.asking import ME, OTHER, joined
from tests.app.asking import after as outcome
from tests.app.sites import room

REFLECTORS, CONTOURS, TAGS = ObservationKind


def after(state: AppState, *asked: Action | Envelope) -> AppState:
    return outcome(state, *asked).state


def drag(start: tuple[float, float], end: tuple[float, float]) -> tuple[DragFloor, ...]:
    return tuple(DragFloor(phase=phase, start=start, now=end, reach=0.15) for phase in ("start", "end"))


@pytest.fixture
def state() -> AppState:
    project = room()
    return joined(AppState(project=project, saved=project, folder=Path("hall")))


@pytest.fixture
def drawn(state: AppState) -> AppState:
    return after(state, ChooseTool(ZoneTool()), *drag((4.0, 1.0), (1.0, 3.0)))


def test_a_drag_draws_a_rectangle_in_which_all_kinds_count(drawn: AppState) -> None:
    (zone,) = drawn.project.zones
    assert (zone.name, zone.outline) == ("Zone 1", ((1.0, 1.0), (4.0, 1.0), (4.0, 3.0), (1.0, 3.0)))
    assert zone.kinds == (REFLECTORS, CONTOURS, TAGS)
    assert drawn.undo[-1].name == "draw Zone 1"
    flat = after(drawn, AddZone((1.0, 1.0, 1.0, 3.0)))
    assert flat.project.zones == drawn.project.zones


def test_kinds_are_counted_one_by_one_and_one_is_left(drawn: AppState) -> None:
    state = after(drawn, CountKind(REFLECTORS, counts=False), CountKind(TAGS, counts=False))
    assert state.project.zones[0].kinds == (CONTOURS,)
    again = after(state, CountKind(REFLECTORS, counts=True))
    assert again.project.zones[0].kinds == (REFLECTORS, CONTOURS)
    with pytest.raises(
        ValueError, match="zone 'Zone 1' is corrected by nothing; expected one of: reflectors, contours"
    ):
        after(state, CountKind(CONTOURS, counts=False))


def test_names_are_unique_corners_are_typed_and_one_is_deleted(drawn: AppState) -> None:
    state = after(drawn, AddZone((5.0, 5.0, 6.0, 6.0)), SetZone("name", "Hall"))
    assert [zone.name for zone in state.project.zones] == ["Zone 1", "Hall"]
    with pytest.raises(UsageError, match="zone name 'Zone 1' is used already"):
        after(state, SetZone("name", "Zone 1"))
    with pytest.raises(ValueError, match="encloses no floor"):
        after(state, SetZone("outline", ((0.0, 0.0), (1.0, 1.0), (2.0, 2.0))))
    with pytest.raises(ValueError, match="crosses itself"):
        after(state, SetZone("outline", ((0.0, 0.0), (1.0, 1.0), (1.0, 0.0), (0.0, 1.0))))
    corners = ((0.0, 0.0), (2.0, 0.0), (1.0, 2.0))
    typed = after(state, SetZone("outline", corners))
    assert typed.project.zones[1].outline == corners
    # Another browser shows another zone, and deletes that.
    found = outcome(typed, ShowZone("Zone 1"))
    assert found.effects == (FlyTo((2.5, 2.0)),)
    shown = shown_zone(found.state, ME)
    assert shown is not None
    assert shown.name == "Zone 1"
    gone = after(found.state, DeleteZone())
    assert [zone.name for zone in gone.project.zones] == ["Hall"]
    remaining = shown_zone(gone, OTHER)
    assert remaining is not None
    assert remaining.name == "Hall"
    with pytest.raises(UsageError, match="the project has no zone"):
        after(after(gone, DeleteZone()), DeleteZone())


def test_the_floor_shows_each_zone_with_its_name_and_kinds(drawn: AppState) -> None:
    layer = ZoneLayer(start_server("127.0.0.1", 0).scene)
    state = after(drawn, CountKind(TAGS, counts=False))
    layer.show_site(state.project)
    points, label = layer._outlines.points, layer._labels["Zone 1"]
    assert points.shape == (4, 2, 3)
    assert sorted({tuple(corner) for corner in points[:, 0, :2].tolist()}) == [(1, 1), (1, 3), (4, 1), (4, 3)]
    assert label.text == "Zone 1: reflectors, contours"
    assert tuple(label.position[:2]) == (1.0, 3.0)
    layer.show_site(after(state, DeleteZone()).project)
    assert len(layer.nodes()) == 2
    np.testing.assert_array_equal(layer._outlines.points, NO_SEGMENTS)


def test_the_panel_shows_the_zone_and_nothing_without_one(drawn: AppState) -> None:
    panel = ZoneFields(start_server("127.0.0.1", 0).gui, lambda _envelope: None, ME)
    panel.draw_slowly(view_of(after(drawn, CountKind(TAGS, counts=False))))
    widgets = {handle.label: handle for handle in panel._fields}
    assert {label: handle.value for label, handle in widgets.items()} == {
        "Called": "Zone 1",
        "Corners [m]": "1 1, 4 1, 4 3, 1 3",
        "By reflectors": True,
        "By contours": True,
        "By tags": False,
    }
    assert all(widget.visible for widget in widgets.values())
    panel.draw_slowly(view_of(after(drawn, DeleteZone())))
    assert not any(widget.visible for widget in widgets.values())


def test_what_was_refused_for_one_zone_is_not_left_in_the_field_of_the_next(
    drawn: AppState, monkeypatch: pytest.MonkeyPatch
) -> None:
    anew: list[object] = []
    monkeypatch.setattr("commission.app.base.inputs.write_anew", lambda _gui, widget: anew.append(widget))
    both = after(drawn, AddZone((5.0, 5.0, 6.0, 6.0)), SetZone("name", "Hall"), ShowZone("Zone 1"))
    panel = ZoneFields(start_server("127.0.0.1", 0).gui, lambda _envelope: None, ME)
    panel.draw_slowly(view_of(both))
    name = next(handle for handle in panel._fields if handle.label == "Called")
    # Typed for Zone 1 and refused, since it is the other's: the page shows what held, and this is the name here.
    name.value = "Hall"
    panel.draw_slowly(view_of(after(both, ShowZone("Hall"))))
    assert name.value == "Hall"
    assert name in anew

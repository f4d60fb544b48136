"""Tags placed, dragged, turned, typed and deleted on the page, and the camera that reads them; without a browser."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from commission.app.base import actions as page
from commission.app.base.actions import Action, ClickFloor, DragFloor, Envelope
from commission.app.base.effects import FlyTo
from commission.app.base.server import start_server
from commission.app.base.state import AppState
from commission.app.base.view import PageView
from commission.app.editing import actions
from commission.app.editing.camera_fields import CameraFields
from commission.app.editing.editor import Editor, PosedKey, PosedKind
from commission.app.editing.posed_actions import DeletePosed, MovePosed, SelectPosed, SetPosed
from commission.app.editing.posed_gestures import heading_tip
from commission.app.editing.route_table import RouteTable
from commission.app.editing.site_tools import StationTool, TagTool
from commission.app.editing.tool_hint import hint
from commission.errors import UsageError
from commission.site.tags import Tag
from tests.app.asking import ME, OTHER, by, joined
from tests.app.asking import after as outcome
from tests.app.sites import room

REACH = 0.15


def after(state: AppState, *asked: Action | Envelope) -> AppState:
    return outcome(state, *asked).state


def click(x: float, y: float) -> ClickFloor:
    return ClickFloor((x, y), REACH)


def drag(start: tuple[float, float], end: tuple[float, float], phase: str = "end") -> tuple[DragFloor, ...]:
    return DragFloor(phase="start", start=start, now=start, reach=REACH), DragFloor(
        phase=phase,  # type: ignore[arg-type]
        start=start,
        now=end,
        reach=REACH,
    )


@pytest.fixture
def placed() -> AppState:
    """One tag in the open, selected."""
    project = room()
    state = joined(AppState(project=project, saved=project, folder=Path("hall")))
    return after(state, actions.ChooseTool(TagTool()), click(3.0, 5.0), actions.ChooseTool(None))


def tag(state: AppState, index: int = -1) -> Tag:
    return state.project.tags[index]


def editor(state: AppState, browser: int = ME) -> Editor:
    return state.of_browser(browser, Editor)


def test_a_click_places_a_tag_and_the_next_one_is_like_it(placed: AppState) -> None:
    assert tag(placed) == Tag(id="T1", x=3.0, y=5.0)
    assert (editor(placed).posed, placed.undo[-1].name) == (PosedKey(PosedKind.TAG, "T1"), "place tag T1")
    better = after(placed, SetPosed(PosedKind.TAG, "sigma", 0.001), actions.ChooseTool(TagTool()), click(4.0, 6.0))
    assert tag(better) == Tag(id="T2", x=4.0, y=6.0, sigma=0.001)
    assert after(better, page.Undo(), page.Undo(), page.Undo()).project.tags == ()


def test_a_tag_is_dragged_and_turned_by_its_tip_as_one_step_each(placed: AppState) -> None:
    halfway = after(placed, *drag((3.05, 5.0), (4.0, 6.0), "update"))
    assert halfway.project is placed.project
    assert hint(halfway, ME) == "tag T1 to x 4.000 m, y 6.000 m, heading 0.0°"
    moved = after(placed, *drag((3.05, 5.0), (4.0, 6.0)))
    assert (tag(moved).x, tag(moved).y, moved.undo[-1].name) == (4.0, 6.0, "move tag T1")
    turned = after(moved, *drag(heading_tip(moved.project, tag(moved)), (4.0, 7.0)))
    assert tag(turned).heading == pytest.approx(math.pi / 2)
    assert (tag(turned).x, tag(turned).y, turned.undo[-1].name) == (4.0, 6.0, "turn tag T1")
    assert after(turned, page.Undo(), page.Undo()).project is placed.project


def test_all_of_a_tag_is_typed_and_typing_is_one_step(placed: AppState) -> None:
    typed = after(
        placed,
        SetPosed(PosedKind.TAG, "id", "dock 7"),
        SetPosed(PosedKind.TAG, "sigma", 0.002),
        by(ME, SetPosed(PosedKind.TAG, "sigma", 0.004), 0.4),
        by(ME, SetPosed(PosedKind.TAG, "heading", 1.0), 0.6),
        by(ME, SetPosed(PosedKind.TAG, "anonymous", True), 0.8),
    )
    assert tag(typed) == Tag(id="dock 7", x=3.0, y=5.0, heading=1.0, sigma=0.004, anonymous=True)
    names = ["rename tag T1", "set 1σ of the place of tag dock 7", "set heading of tag dock 7"]
    assert [step.name for step in typed.undo[1:4]] == names
    assert editor(typed).posed == PosedKey(PosedKind.TAG, "dock 7")
    with pytest.raises(ValueError, match="sigma"):
        after(typed, SetPosed(PosedKind.TAG, "sigma", -0.001))
    with pytest.raises(UsageError, match="tag id 'dock 7' is used already"):
        after(typed, actions.ChooseTool(TagTool()), click(1.0, 6.0), SetPosed(PosedKind.TAG, "id", "dock 7"))


def test_keys_move_and_delete_the_selected_tag(placed: AppState) -> None:
    nudged = after(placed, actions.Nudge((0.001, -0.01)))
    assert (tag(nudged).x, tag(nudged).y) == pytest.approx((3.001, 4.99))
    gone = after(nudged, actions.DeleteSelected())
    assert (gone.project.tags, editor(gone).posed) == ((), None)
    with pytest.raises(UsageError, match="no tag is selected"):
        after(gone, DeletePosed(PosedKind.TAG))


def test_a_click_selects_a_tag_and_nothing_else(placed: AppState) -> None:
    reflector = after(placed, click(0.25, 2.0))
    assert (editor(reflector).selected, editor(reflector).posed) == (("R1",), None)
    again = after(reflector, click(3.0, 5.0))
    assert (editor(again).selected, editor(again).posed) == ((), PosedKey(PosedKind.TAG, "T1"))
    assert not editor(after(again, actions.Cancel())).has_selection
    taken = after(again, by(OTHER, SelectPosed(PosedKey(PosedKind.TAG, "T1"))), by(OTHER, DeletePosed(PosedKind.TAG)))
    with pytest.raises(UsageError, match="no tag is selected"):
        after(taken, MovePosed(PosedKind.TAG, (1.0, 1.0), 0.0))


def test_a_field_of_a_station_sets_nothing_of_a_tag_that_was_selected_meanwhile(placed: AppState) -> None:
    state = after(
        placed, actions.ChooseTool(StationTool()), click(5.0, 5.0), SelectPosed(PosedKey(PosedKind.TAG, "T1"))
    )
    with pytest.raises(UsageError, match="no station is selected"):
        after(state, SetPosed(PosedKind.STATION, "x", 9.0))
    with pytest.raises(UsageError, match="no station is selected"):
        after(state, DeletePosed(PosedKind.STATION))


def test_the_table_lists_tags_and_a_row_selects_and_flies(placed: AppState) -> None:
    server = start_server("127.0.0.1", 0)
    table = RouteTable(server.gui, lambda _action: None, ME)
    state = after(placed, SetPosed(PosedKind.TAG, "heading", math.pi / 2))
    table.draw_slowly(PageView(state=state))
    listed = next(each for each in table.tables.shown if each.name == "tags")
    assert (listed.name, [each.title for each in listed.columns][:4]) == (
        "tags",
        ["Id", "x [m]", "y [m]", "Heading [°]"],
    )
    assert listed.rows[-1].cells[:4] == ("T1", "3", "5", "90")
    asked = table.tables.asked('{"n": 1, "do": "row", "table": "tags", "key": "T1", "how": "only"}')
    assert asked == SelectPosed(PosedKey(PosedKind.TAG, "T1"), fly=True)
    assert outcome(state, asked).effects == (FlyTo((3.0, 5.0)),)
    server.stop()


def test_the_camera_can_be_entered_where_there_are_tags(placed: AppState) -> None:
    server = start_server("127.0.0.1", 0)
    fields = CameraFields(server.gui, lambda _action: None, placed.project)
    for state, shown in ((after(placed, page.Undo()), False), (placed, True)):
        fields.draw_slowly(PageView(state=state))
        assert fields._folder.visible is shown
    turned = after(placed, actions.SetEquipment("tag_camera.mounting[2]", math.pi))
    np.testing.assert_allclose(turned.project.tag_camera.mounting, (0.0, 0.0, math.pi))
    assert turned.undo[-1].name == "change the tag camera"
    with pytest.raises(ValueError, match="smaller distance first"):
        after(placed, actions.SetEquipment("tag_camera.range[0]", 9.0))
    server.stop()

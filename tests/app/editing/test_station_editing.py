"""Stations placed, dragged, turned, typed and deleted on the page, without a browser."""

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
from commission.app.editing.editor import ControlPoint, Editor, PosedKey, PosedKind
from commission.app.editing.posed_actions import AlignStation, DeletePosed, SelectPosed, SetPosed
from commission.app.editing.posed_gestures import heading_tip
from commission.app.editing.route_table import RouteTable
from commission.app.editing.site_tools import StationTool
from commission.app.editing.station_layer import StationLayer
from commission.app.editing.tool_hint import hint
from commission.app.problems.actions import ShowProblem
from commission.errors import UsageError
from commission.site.stations import Station
from commission.studies.problems import Problem, Severity, Subject
from tests.app.asking import ME, OTHER, by, joined
from tests.app.asking import after as outcome
from tests.app.sites import room

REACH = 0.15
ROUTE = "There and back"


def after(state: AppState, *asked: Action | Envelope) -> AppState:
    return outcome(state, *asked).state


def click(x: float, y: float) -> ClickFloor:
    return ClickFloor((x, y), REACH)


def drag(start: tuple[float, float], end: tuple[float, float]) -> tuple[DragFloor, ...]:
    return DragFloor(phase="start", start=start, now=start, reach=REACH), DragFloor(
        phase="end", start=start, now=end, reach=REACH
    )


@pytest.fixture
def state() -> AppState:
    project = room()
    return after(
        joined(AppState(project=project, saved=project, folder=Path("hall"))), actions.ChooseTool(StationTool())
    )


@pytest.fixture
def placed(state: AppState) -> AppState:
    """One station in the open, selected."""
    return after(state, click(3.0, 5.0), actions.ChooseTool(None))


def station(state: AppState, index: int = -1) -> Station:
    return state.project.stations[index]


def editor(state: AppState, browser: int = ME) -> Editor:
    return state.of_browser(browser, Editor)


def test_a_click_places_a_station_and_near_a_route_it_stands_on_it_and_looks_along_it(state: AppState) -> None:
    result = after(state, click(3.0, 5.0), click(3.0, 2.1))
    free, on_route = result.project.stations
    assert (free.x, free.y, free.heading) == (3.0, 5.0, 0.0)
    curve = state.project.routes[0].segments[0].spline()
    u = curve.closest((3.0, 2.1), 0.5)
    assert (on_route.x, on_route.y) == pytest.approx(tuple(curve.point(u)), abs=1e-6)
    assert on_route.heading == pytest.approx(float(curve.heading(u)), abs=1e-6)
    assert [step.name for step in result.undo] == ["place Station 1", "place Station 2"]
    assert editor(result).posed == PosedKey(PosedKind.STATION, "Station 2")


def test_a_station_is_dragged_as_one_step_and_a_route_attracts_it(placed: AppState) -> None:
    begin, end = drag((3.05, 5.0), (4.0, 6.0))
    halfway = after(placed, begin)
    assert halfway.project is placed.project
    moved = after(halfway, end)
    assert (station(moved).x, station(moved).y) == (4.0, 6.0)
    assert moved.undo[-1].name == "move Station 1"
    assert after(moved, page.Undo()).project is placed.project
    on_route = after(placed, *drag((3.0, 5.0), (3.0, 2.1)))
    assert station(on_route).y == pytest.approx(2.0, abs=0.15)
    assert station(on_route).heading != 0.0


def test_the_tip_turns_a_station_and_leaves_its_place(placed: AppState) -> None:
    tip = heading_tip(placed.project, station(placed))
    turned = after(placed, *drag(tip, (3.0, 6.0)))
    assert station(turned).heading == pytest.approx(math.pi / 2)
    assert (station(turned).x, station(turned).y) == (3.0, 5.0)
    assert turned.undo[-1].name == "turn Station 1"


def test_while_it_is_dragged_the_page_says_where_it_would_stand(placed: AppState) -> None:
    begin, _ = drag((3.0, 5.0), (4.0, 6.0))
    on = DragFloor(phase="update", start=(3.0, 5.0), now=(4.0, 6.0), reach=REACH)
    dragging = after(placed, begin, on)
    assert hint(dragging, ME) == "Station 1 to x 4.000 m, y 6.000 m, heading 0.0°"


def test_name_pose_and_accuracy_are_typed_and_typing_is_one_step(placed: AppState) -> None:
    typed = after(
        placed,
        SetPosed(PosedKind.STATION, "name", "Dock"),
        SetPosed(PosedKind.STATION, "required_accuracy", 0.02),
        by(ME, SetPosed(PosedKind.STATION, "required_accuracy", 0.01), 0.4),
        by(ME, SetPosed(PosedKind.STATION, "heading", 1.0), 0.6),
    )
    assert station(typed) == Station(name="Dock", x=3.0, y=5.0, heading=1.0, required_accuracy=0.01)
    assert [step.name for step in typed.undo[1:]] == ["rename Station 1", "set accuracy of Dock", "set heading of Dock"]
    assert editor(typed).posed == PosedKey(PosedKind.STATION, "Dock")
    with pytest.raises(ValueError, match="required_accuracy"):
        after(typed, SetPosed(PosedKind.STATION, "required_accuracy", 0.0))
    with pytest.raises(UsageError, match="used already"):
        after(typed, actions.ChooseTool(StationTool()), click(1.0, 6.0), SetPosed(PosedKind.STATION, "name", "Dock"))


def test_a_new_station_is_as_accurate_as_the_one_before(placed: AppState) -> None:
    docks = after(
        placed, SetPosed(PosedKind.STATION, "required_accuracy", 0.01), actions.ChooseTool(StationTool()), click(5, 6)
    )
    assert station(docks).required_accuracy == 0.01


def test_a_station_goes_onto_the_nearest_route_when_that_is_asked_for(placed: AppState) -> None:
    aligned = after(placed, AlignStation())
    assert math.hypot(station(aligned).x - 3.0, station(aligned).y - 5.0) == pytest.approx(3.0, abs=0.3)
    assert aligned.undo[-1].name == "align Station 1"


def test_the_delete_key_deletes_the_selected_station(placed: AppState) -> None:
    gone = after(placed, actions.DeleteSelected())
    assert gone.project.stations == ()
    assert editor(gone).posed is None
    with pytest.raises(UsageError, match="no station is selected"):
        after(gone, DeletePosed(PosedKind.STATION))


def test_clicks_select_one_kind_of_thing_at_a_time(placed: AppState) -> None:
    reflector = after(placed, click(0.25, 2.0))
    assert (editor(reflector).selected, editor(reflector).posed) == (("R1",), None)
    assert editor(reflector, OTHER).posed is None
    again = after(reflector, click(3.0, 5.0))
    assert (editor(again).selected, editor(again).posed) == ((), PosedKey(PosedKind.STATION, "Station 1"))
    route = after(again, click(4.0, 2.1))
    assert editor(route).point is not None
    assert editor(route).posed is None
    assert not editor(after(route, actions.Cancel())).has_selection


def test_what_another_browser_deletes_is_not_selected_any_more(placed: AppState) -> None:
    gone = after(
        placed,
        by(OTHER, SelectPosed(PosedKey(PosedKind.STATION, "Station 1"))),
        by(OTHER, DeletePosed(PosedKind.STATION)),
    )
    with pytest.raises(UsageError, match="no station is selected"):
        after(gone, SetPosed(PosedKind.STATION, "x", 1.0))


def test_a_problem_of_a_station_selects_it_and_flies_there(placed: AppState) -> None:
    problem = Problem(
        severity=Severity.ERROR, text="cut", subject=Subject.STATION, ids=("Station 1",), place=(3.0, 5.0)
    )
    result = outcome(placed, by(OTHER, ShowProblem(problem)))
    assert editor(result.state, OTHER).posed == PosedKey(PosedKind.STATION, "Station 1")
    assert result.effects == (FlyTo((3.0, 5.0)),)


def test_the_table_lists_routes_and_stations_and_a_row_selects_and_flies(placed: AppState) -> None:
    server = start_server("127.0.0.1", 0)
    table = RouteTable(server.gui, lambda _action: None, ME)
    table.draw_slowly(PageView(state=placed))
    shown = {content.name: content for content in table.tables.shown}
    assert {name: [row.key for row in content.rows] for name, content in shown.items()} == {
        "routes": [ROUTE],
        "stations": ["Station 1"],
        "scanners": ["scanner"],
    }
    station = dict(
        zip([each.title for each in shown["stations"].columns], shown["stations"].rows[0].cells, strict=True)
    )
    assert station["Within [mm]"] == "100"
    route = dict(zip([each.title for each in shown["routes"].columns], shown["routes"].rows[0].cells, strict=True))
    assert (route["Segments"], route["Reverse"]) == ("2", "1")
    row = '{"n": 1, "do": "row", "table": "%s", "key": "%s", "how": "only"}'
    assert table.tables.asked(row % ("stations", "Station 1")) == SelectPosed(
        PosedKey(PosedKind.STATION, "Station 1"), fly=True
    )
    assert table.tables.asked(row % ("routes", ROUTE)) == actions.SelectControlPoint(ControlPoint(ROUTE), fly=True)
    cell = (
        '{"n": 2, "do": "cell", "table": "stations", "key": "Station 1", "column": "required_accuracy", "text": "%s"}'
    )
    assert table.tables.asked(cell % "12,5") == SetPosed(PosedKind.STATION, "required_accuracy", 0.0125, "Station 1")
    with pytest.raises(ValueError, match="Within is 0 mm; expected 1 to 10000 mm"):
        table.tables.asked(cell % "0")
    server.stop()


def test_each_station_is_drawn_with_its_outline_and_its_accuracy(placed: AppState) -> None:
    server = start_server("127.0.0.1", 0)
    layer = StationLayer(server.scene)
    layer.show_site(placed.project)
    outline = placed.project.vehicle.outline
    np.testing.assert_allclose(layer._outlines.points[:, 0, :2], np.array(outline) + np.array((3.0, 5.0)), atol=1e-6)
    label = layer._labels["Station 1"]
    assert label.text == "Station 1  100 mm"
    layer.show_site(after(placed, SetPosed(PosedKind.STATION, "required_accuracy", 0.01)).project)
    assert layer._labels["Station 1"] is label
    assert label.text == "Station 1  10 mm"
    layer.show_site(after(placed, DeletePosed(PosedKind.STATION)).project)
    assert layer._labels == {}
    server.stop()

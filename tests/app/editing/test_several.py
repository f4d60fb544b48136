"""Several stations, tags, routes, zones and scanners at once: selected row by row, set and deleted in one step."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import pytest
import viser

from commission.app.base.actions import Action, Undo
from commission.app.base.server import start_server
from commission.app.base.state import AppState
from commission.app.base.view import PageView
from commission.app.editing import actions
from commission.app.editing.editor import editor_of
from commission.app.editing.posed_actions import SetPosed
from commission.app.editing.posed_kinds import PosedKind
from commission.app.editing.reflector_table import ReflectorTable
from commission.app.editing.route_table import RouteTable
from commission.app.editing.selection_panel import SelectionPanel
from commission.app.editing.several import SEVERAL
from commission.app.editing.table_actions import ChooseRows, SetRows
from commission.app.editing.zone_actions import DeleteZone
from commission.errors import UsageError
from commission.site.scanner import Scanner
from commission.site.stations import Station
from commission.site.tags import Tag
from commission.site.zones import ObservationKind, Zone
from tests.app.asking import ME, joined
from tests.app.asking import after as outcome
from tests.app.sites import room

TRIANGLE = ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0))


@pytest.fixture(scope="module")
def server() -> Iterator[viser.ViserServer]:
    opened = start_server("127.0.0.1", 0)
    yield opened
    opened.stop()


@pytest.fixture
def state() -> AppState:
    """Three of each kind."""
    site = room()
    (route,) = site.routes
    project = replace(
        site,
        routes=tuple(replace(route, name=name) for name in "ABC"),
        stations=tuple(Station(name=f"S{n}", x=float(n), y=1.0) for n in range(3)),
        tags=tuple(Tag(id=f"T{n}", x=float(n), y=2.0) for n in range(3)),
        zones=tuple(Zone(name=f"Z{n}", outline=TRIANGLE) for n in range(3)),
        scanners=tuple(Scanner(name=name) for name in ("front", "rear", "top")),
    )
    return joined(AppState(project=project, saved=project))


def after(state: AppState, *asked: Action) -> AppState:
    return outcome(state, *asked).state


def asked(table: RouteTable | ReflectorTable, state: AppState, name: str, **what: Any) -> AppState:
    """What follows from a line of the script about a table as it shows a state."""
    table.draw_slowly(PageView(state=state))
    action = table.tables.asked(json.dumps({"n": 1, "table": name, **what}))
    assert isinstance(action, Action)
    return after(state, action)


def shown(table: RouteTable | ReflectorTable, state: AppState, name: str) -> Any:
    table.draw_slowly(PageView(state=state))
    return next(each for each in table.tables.shown if each.name == name)


def things(state: AppState, name: str) -> dict[str, Any]:
    """The things of a table by what they are told apart by."""
    return {getattr(each, "id", getattr(each, "name", "")): each for each in getattr(state.project, name)}


@pytest.mark.parametrize(
    ("name", "column", "text", "field", "value", "three"),
    [
        ("routes", "speed", "0.7", "speed", 0.7, "ABC"),
        ("stations", "required_accuracy", "12.5", "required_accuracy", 0.0125, ("S0", "S1", "S2")),
        ("tags", "sigma", "4", "sigma", 0.004, ("T0", "T1", "T2")),
        (
            "zones",
            "kinds:contours",
            "no",
            "kinds",
            (ObservationKind.REFLECTORS, ObservationKind.TAGS),
            ("Z0", "Z1", "Z2"),
        ),
        ("scanners", "rate", "12.5", "rate", 12.5, ("front", "rear", "top")),
        ("scanners", "sweep_direction", "clockwise", "sweep_direction", -1, ("front", "rear", "top")),
        ("scanners", "blind_sectors_deg", "60 75", "blind_sectors_deg", ((60.0, 75.0),), ("front", "rear", "top")),
    ],
)
def test_rows_add_to_each_other_and_one_entry_sets_all_that_are_selected(
    server: viser.ViserServer,
    state: AppState,
    name: str,
    column: str,
    text: str,
    field: str,
    value: Any,
    three: tuple[str, ...],
) -> None:
    table = RouteTable(server.gui, lambda _action: None, ME)
    first, second, third = three
    one = asked(table, state, name, do="row", key=first, how="only")
    assert SEVERAL[name].chosen(one, ME) == (first,)
    assert shown(table, one, name).every == (), "one thing needs no row for all"
    two = asked(table, one, name, do="row", key=third, how="toggle")
    assert set(SEVERAL[name].chosen(two, ME)) == {first, third}
    assert {row.key for row in shown(table, two, name).rows if row.is_selected} == {first, third}
    before = things(state, name)
    entered = asked(table, two, name, do="cell", key="", column=column, text=text)
    now = things(entered, name)
    assert [getattr(now[key], field) for key in (first, third)] == [value, value]
    assert now[second] == before[second]
    assert len(entered.undo) == len(state.undo) + 1
    assert set(SEVERAL[name].chosen(entered, ME)) == {first, third}
    content = shown(table, entered, name)
    index = [each.key for each in content.columns].index(column)
    assert content.every[index] == next(row for row in content.rows if row.key == first).cells[index]
    assert after(entered, Undo()).project == state.project
    every = asked(table, one, name, do="row", key=third, how="range", begin=first)
    assert set(SEVERAL[name].chosen(every, ME)) == set(three)
    fewer = asked(table, every, name, do="row", key=second, how="toggle")
    assert set(SEVERAL[name].chosen(fewer, ME)) == {first, third}


def test_what_they_do_not_share_is_left_open_and_names_are_never_shared(
    server: viser.ViserServer, state: AppState
) -> None:
    table = RouteTable(server.gui, lambda _action: None, ME)
    state = after(state, SetPosed(PosedKind.STATION, "required_accuracy", 0.01, "S1"))
    both = after(state, ChooseRows("stations", ("S0", "S1")))
    content = shown(table, both, "stations")
    cells = dict(zip((each.key for each in content.columns), content.every, strict=True))
    assert (cells["name"], cells["x"], cells["y"], cells["required_accuracy"]) == (None, None, None, "")
    assert cells["heading"] == "0"
    for name, several in SEVERAL.items():
        keys = tuple(things(state, name))
        chosen = after(state, ChooseRows(name, keys))
        for field in several.alone:
            with pytest.raises(UsageError, match="cannot share"):
                after(chosen, SetRows(name, field, "X"))
        with pytest.raises(UsageError, match="is selected; expected one"):
            after(state, ChooseRows(name, ()), SetRows(name, "heading", 0.0))


def test_what_one_of_them_refuses_changes_none(state: AppState) -> None:
    both = after(state, ChooseRows("zones", ("Z0", "Z1")))
    only = replace(both.project.zones[1], kinds=(ObservationKind.TAGS,))
    both = replace(both, project=replace(both.project, zones=(both.project.zones[0], only, both.project.zones[2])))
    before = both.project
    with pytest.raises(ValueError, match="corrected by nothing"):
        after(both, SetRows("zones", "kinds:tags", value=False))
    assert both.project is before
    assert after(both, SetRows("zones", "kinds:tags", value=True)).undo == both.undo, "nothing changes, no step"


def test_several_are_deleted_in_one_step_and_others_stay(state: AppState) -> None:
    for name, keys, left in (
        ("stations", ("S0", "S2"), ["S1"]),
        ("tags", ("T1", "T2"), ["T0"]),
        ("routes", "AC", ["B"]),
    ):
        gone = after(state, ChooseRows(name, tuple(keys)), actions.DeleteSelected())
        assert list(things(gone, name)) == left
        assert len(gone.undo) == len(state.undo) + 1
    gone = after(state, ChooseRows("zones", ("Z0", "Z1")), DeleteZone())
    assert (list(things(gone, "zones")), len(gone.undo)) == (["Z2"], len(state.undo) + 1)


def test_the_selection_says_how_many_and_its_fields_set_all(server: viser.ViserServer, state: AppState) -> None:
    panel = SelectionPanel(server.gui, lambda _action: None, ME)
    both = after(state, ChooseRows("stations", ("S0", "S2")))
    panel.draw_slowly(PageView(state=both))
    assert "<b>2 stations</b>" in panel._head.content
    assert {name for name, field in panel._posed[PosedKind.STATION]._fields.items() if not field.visible} == {
        "name",
        "x",
        "y",
    }
    turned = after(both, SetPosed(PosedKind.STATION, "heading", 1.0))
    assert [each.heading for each in turned.project.stations] == [1.0, 0.0, 1.0]
    # Whoever selects something else has selected that alone.
    alone = after(both, actions.SelectReflectors(("R1",)))
    assert editor_of(alone, ME).further == ()
    assert SEVERAL["stations"].chosen(alone, ME) == ()


def test_the_row_of_all_sets_the_selected_reflectors_on_whichever_page_they_are(
    server: viser.ViserServer, state: AppState
) -> None:
    table = ReflectorTable(server.gui, lambda _action: None, ME)
    both = after(state, actions.SelectReflectors(("R1", "R3")))
    content = shown(table, both, "reflectors")
    assert content.every[:3] == (None, None, None), "name and place are told apart"
    assert content.chosen == 2
    entered = asked(table, both, "reflectors", do="cell", key="", column="radius", text="52.5")
    radii = {each.id: each.radius for each in entered.project.reflectors.reflectors}
    assert (radii["R1"], radii["R3"]) == (0.0525, 0.0525)
    assert radii["R2"] == next(r.radius for r in state.project.reflectors.reflectors if r.id == "R2")


def test_every_field_of_a_zone_and_of_a_scanner_is_entered_in_its_row(
    server: viser.ViserServer, state: AppState
) -> None:
    table = RouteTable(server.gui, lambda _action: None, ME)
    entered = asked(table, state, "zones", do="cell", key="Z1", column="outline", text="0 0, 2 0, 2 2, 0 2")
    assert things(entered, "zones")["Z1"].outline == ((0.0, 0.0), (2.0, 0.0), (2.0, 2.0), (0.0, 2.0))
    entered = asked(table, state, "zones", do="cell", key="Z2", column="kinds:tags", text="no")
    assert [ObservationKind.TAGS in each.kinds for each in entered.project.zones] == [True, True, False]
    content = shown(table, state, "scanners")
    row = next(row for row in content.rows if row.key == "rear")
    for column, text in zip(content.columns, row.cells, strict=True):
        # What stands in a cell means what it was made from.
        again = asked(table, state, "scanners", do="cell", key="rear", column=column.key, text=text)
        assert again.project == state.project, column.key
    moved = asked(table, state, "scanners", do="cell", key="rear", column="mounting[2]", text="180")
    assert moved.project.scanners[1].mounting[2] == pytest.approx(3.14159265, abs=1e-6)
    assert moved.project.scanners[0] == state.project.scanners[0]
    with pytest.raises(UsageError, match="no scanner is called 'gone'"):
        after(state, actions.SetScannerField("rate", 10.0, "gone"))

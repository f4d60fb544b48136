"""Tables of the site without a browser: their cells, their order, and what a line of their script asks for."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from dataclasses import replace

import pytest
import viser

from commission.app.base.server import start_server
from commission.app.base.state import AppState
from commission.app.base.view import PageView
from commission.app.editing import actions
from commission.app.editing.data_table import TableColumn, TableRow, between, columns_of, sorted_rows
from commission.app.editing.editor import PosedKind, editor_of
from commission.app.editing.posed_actions import SetPosed
from commission.app.editing.reflector_table import ROWS, ReflectorTable
from commission.app.editing.table_actions import SortTable
from commission.app.editing.table_reducer import TableOrder
from commission.app.editing.zone_actions import SetZone
from commission.errors import CommissionError
from commission.site.quantity import counted_text
from commission.site.reflectors import Reflector, ReflectorKind, ReflectorMap
from commission.site.zones import Zone
from tests.app.asking import ME, joined
from tests.app.asking import after as outcome
from tests.app.sites import room

BY_KEY = {column.key: column for column in columns_of(Reflector)}


@pytest.fixture
def state() -> AppState:
    project = room()
    return joined(AppState(project=project, saved=project))


@pytest.fixture(scope="module")
def server() -> Iterator[viser.ViserServer]:
    opened = start_server("127.0.0.1", 0)
    yield opened
    opened.stop()


def after(state: AppState, *asked: object) -> AppState:
    return outcome(state, *asked).state


def said(table: ReflectorTable, **what: object) -> object:
    return table.tables.asked(json.dumps({"n": 1, "table": "reflectors", **what}))


def test_cells_are_in_the_units_of_the_page_and_lose_no_digit() -> None:
    reflector = Reflector(
        id="R1", x=1.2345, y=-0.5, radius=None, kind=ReflectorKind.FLAT, heading=math.pi / 2, sigma=0.0025
    )
    cells = {key: column.of_field(reflector) for key, column in BY_KEY.items()}
    assert cells == {
        "id": "R1",
        "x": "1.2345",
        "y": "-0.5",
        "radius": "unknown",
        "kind": "flat",
        "heading": "90",
        "height": "0.2",
        "sigma": "2.5",
        "layer": "",
        "note": "",
        "locked": "no",
    }
    # Words of a choice are told apart by spaces; what a person has written stays as it is.
    assert BY_KEY["id"].of_field(Reflector(id="A__1_b", x=0.0, y=0.0)) == "A__1_b"
    # What stands in a cell means what it was made from.
    for key, column in BY_KEY.items():
        means, value = column.means(cells[key]), getattr(reflector, key)
        assert means == (pytest.approx(value) if isinstance(value, float) else value), key


@pytest.mark.parametrize(
    ("key", "text", "told"),
    [
        ("x", "", 'found ""; expected a number'),
        ("x", "nan", "x is nan m; expected"),
        ("x", "1e8", r"x is 1e\+08 m; expected -1e\+07 to 1e\+07 m"),
        ("radius", "wide", "Radius .mm. is 'wide'; expected a number, or unknown"),
        ("sigma", "-1", "Survey 1σ is -1 mm; expected 0 mm or more"),
        ("kind", "round", "'round' is not a valid"),
    ],
)
def test_what_is_no_value_of_a_field_is_refused_in_its_own_unit(key: str, text: str, told: str) -> None:
    with pytest.raises(ValueError, match=told):
        BY_KEY[key].means(text)


def test_rows_sort_by_the_size_of_numbers_and_what_is_unknown_comes_last_both_ways() -> None:
    columns = (TableColumn(key="id", title="Name"), TableColumn(key="r", title="Radius", is_number=True))
    cells = (("R10", "9"), ("R2", "unknown"), ("R1", "45"), ("A", "unknown"), ("R3", "100"))
    rows = [TableRow(each[0], each) for each in cells]

    def names(column: str, *, is_down: bool = False) -> list[str]:
        return [row.key for row in sorted_rows(rows, columns, TableOrder(column, is_down))]

    assert names("id") == ["A", "R1", "R2", "R3", "R10"]
    assert names("id", is_down=True) == ["R10", "R3", "R2", "R1", "A"]
    assert names("r") == ["R10", "R1", "R3", "R2", "A"]
    assert names("r", is_down=True)[:3] == ["R3", "R1", "R10"]
    assert set(names("r", is_down=True)[3:]) == {"A", "R2"}
    assert names("") == [row.key for row in rows]


def test_a_range_holds_all_between_whichever_end_comes_first() -> None:
    keys = ("A", "B", "C", "D")
    assert between(keys, "B", "D") == between(keys, "D", "B") == ("B", "C", "D")
    assert between(keys, "gone", "C") == ("C",)


def test_a_range_goes_over_the_pages_of_the_table_in_its_order(server: viser.ViserServer, state: AppState) -> None:
    many = tuple(Reflector(id=f"W{index}", x=float(-index), y=0.0) for index in range(3 * ROWS))
    state = replace(state, project=replace(state.project, reflectors=ReflectorMap(many)))
    table = ReflectorTable(server.gui, lambda _action: None, ME)
    state = after(state, said(table, do="sort", column="x"))
    table.draw_slowly(PageView(state=state))
    (shown,) = table.tables.shown
    assert [row.key for row in shown.rows] == [f"W{3 * ROWS - 1 - index}" for index in range(ROWS)]
    asked = said(table, do="row", key="W1", how="range", begin=f"W{ROWS + 1}")
    assert asked == actions.SelectReflectors(tuple(f"W{index}" for index in range(ROWS + 1, 0, -1)))
    # What is selected elsewhere is turned to.
    table.draw_slowly(PageView(state=after(state, actions.SelectReflectors(("W5",)))))
    table.draw_slowly(PageView(state=after(state, actions.SelectReflectors(("W5",)))))
    assert [row.key for row in table.tables.shown[0].rows if row.is_selected] == ["W5"]


def test_of_thousands_of_reflectors_only_those_that_are_shown_are_written(
    server: viser.ViserServer, state: AppState, monkeypatch: pytest.MonkeyPatch
) -> None:
    many = tuple(Reflector(id=f"W{index}", x=float(index), y=0.0) for index in range(5_000))
    state = replace(state, project=replace(state.project, reflectors=ReflectorMap(many)))
    table, written, plain = ReflectorTable(server.gui, lambda _action: None, ME), [0], TableColumn.of_field

    def counting(column: TableColumn, value: object) -> str:
        written[0] += 1
        return plain(column, value)

    monkeypatch.setattr(TableColumn, "of_field", counting)
    table.draw_slowly(PageView(state=state))
    assert written[0] <= len(many) + ROWS * len(BY_KEY)
    written[0] = 0
    table.draw_slowly(PageView(state=after(state, actions.SelectReflectors(("W7",)))))
    assert [row.key for row in table.tables.shown[0].rows if row.is_selected] == ["W7"]
    assert written[0] <= ROWS * len(BY_KEY)


def test_what_no_script_of_the_page_says_is_refused(server: viser.ViserServer) -> None:
    table = ReflectorTable(server.gui, lambda _action: None, ME)
    for text in (
        "",
        "[]",
        '{"n": 1, "do": "drop", "table": "reflectors"}',
        '{"n": 1, "do": "sort", "table": "reflectors"}',
    ):
        with pytest.raises(ValueError, match="expected what its script says"):
            table.tables.asked(text)
    with pytest.raises(ValueError, match="no table is called 'walls'"):
        table.tables.asked('{"n": 1, "do": "sort", "table": "walls", "column": "x"}')
    with pytest.raises(ValueError, match="has no column 'beauty'"):
        said(table, do="cell", key="R1", column="beauty", text="1")
    assert said(table, do="sort", column="x") == SortTable("reflectors", "x")
    assert said(table, do="cell", key="R1", column="radius", text="52,5") == actions.SetReflector(
        "R1", "radius", 0.0525
    )


def test_a_cell_sets_its_reflector_whatever_else_is_selected(state: AppState) -> None:
    chosen = after(state, actions.SelectReflectors(("R1", "R2")))
    set_it = after(chosen, actions.SetReflector("R3", "radius", 0.05))
    changed = {r.id: r.radius for r in set_it.project.reflectors.reflectors}
    before = {r.id: r.radius for r in state.project.reflectors.reflectors}
    assert changed == {**before, "R3": 0.05}
    assert editor_of(set_it, ME).selected == ("R1", "R2")
    assert [step.name for step in set_it.undo] == ["set radius of R3"]
    renamed = after(set_it, actions.SetReflector("R2", "id", "Door"))
    assert editor_of(renamed, ME).selected == ("R1", "Door")
    with pytest.raises(CommissionError, match="used twice"):
        after(renamed, actions.SetReflector("R3", "id", "R1"))
    with pytest.raises(CommissionError, match="no reflector"):
        after(renamed, actions.SetReflector("gone", "x", 1.0))


def test_a_click_with_control_adds_to_the_selection_and_takes_from_it(state: AppState) -> None:
    one, both = actions.SelectReflectors(("R1",)), actions.SelectReflectors(("R2",), toggle=True)
    added = after(state, one, both)
    assert editor_of(added, ME).selected == ("R1", "R2")
    assert editor_of(after(added, both), ME).selected == ("R1",)


def test_routes_stations_tags_and_zones_are_set_by_their_names(state: AppState) -> None:
    name = state.project.routes[0].name
    faster = after(state, actions.SetRoute("speed", 0.7, name))
    assert (faster.project.routes[0].speed, faster.undo[-1].name) == (0.7, f"set speed of {name}")
    assert after(faster, actions.SetRoute("name", "Round", name)).project.routes[0].name == "Round"
    assert outcome(faster, actions.SetRoute("speed", 0.7, name)).state is faster
    with pytest.raises(CommissionError, match="no route is called 'gone'"):
        after(state, actions.SetRoute("speed", 0.7, "gone"))
    with pytest.raises(CommissionError, match="no station is called 'gone'"):
        after(state, SetPosed(PosedKind.STATION, "x", 1.0, "gone"))
    with pytest.raises(CommissionError, match="no tag is called 'gone'"):
        after(state, SetPosed(PosedKind.TAG, "x", 1.0, "gone"))
    zones = tuple(Zone(name=each, outline=((0.0, 0.0), (1.0, 0.0), (1.0, 1.0))) for each in ("A", "B"))
    zoned = replace(state, project=replace(state.project, zones=zones))
    assert [zone.name for zone in after(zoned, SetZone("name", "C", "B")).project.zones] == ["A", "C"]
    with pytest.raises(CommissionError, match="no zone is called 'gone'"):
        after(zoned, SetZone("name", "C", "gone"))


@pytest.mark.parametrize(("count", "told"), [(0, "0 routes"), (1, "1 route"), (2, "2 routes")])
def test_one_is_no_several(count: int, told: str) -> None:
    assert counted_text(count, "route") == told
    assert counted_text(count, "stretch", "stretches") == f"{count} stretch{'' if count == 1 else 'es'}"

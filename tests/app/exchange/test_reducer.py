"""What importing and exporting means, without a browser and without files."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from commission.app.base import actions as page
from commission.app.base.actions import Leave
from commission.app.base.effects import SendFile, Tell
from commission.app.base.parts import default_of
from commission.app.base.state import AppState
from commission.app.base.uploads import Upload
from commission.app.exchange import actions
from commission.app.exchange.effects import ExportProject, ReadFile, StopReading
from commission.app.exchange.pending import Exchange, Pasted, ServerFile
from commission.app.exchange.preview import compare
from commission.errors import UsageError
from commission.io.exports import Exported, Format
from commission.io.imk import ReflectorImport
from commission.io.imports import WHOLE, Imported, LayoutChoice
from commission.io.project_archive import ProjectImport
from commission.io.route_edges import RouteImport
from commission.site.reflectors import Reflector, ReflectorMap
from commission.site.routes import Route, Segment
from commission.site.stations import Station
from tests.app.asking import ME, OTHER, after, joined
from tests.app.sites import room

FILE = Upload("<b>hall.imk", b"")
COLUMNS = ("id", "x", "y", "radius")
NORTH, SOUTH = Reflector(id="N", x=6.0, y=7.8), Reflector(id="S", x=6.0, y=0.2)
DETOUR = Route("Detour", (Segment(control_points=np.array([[2.0, 2.0], [4.0, 6.0]]), degree=1),))


@pytest.fixture
def state() -> AppState:
    project = room()
    return joined(AppState(project=project, saved=project, folder=Path("hall")))


def table(*reflectors: Reflector, fields: tuple[str, ...] = COLUMNS) -> ReflectorImport:
    return ReflectorImport(ReflectorMap(reflectors), (), fields)


def looking_at(state: AppState, imported: Imported) -> AppState:
    """Return the state in which this was read."""
    asked = after(state, actions.ReadImport(FILE)).state
    return after(asked, read(asked, imported)).state


def read(state: AppState, imported: Imported) -> actions.ImportRead:
    """Return the answer to what was asked last."""
    return actions.ImportRead(exchange(state).number, WHOLE, imported, compare(state.project, imported))


def exchange(state: AppState, browser: int = ME) -> Exchange:
    return state.of_browser(browser, Exchange)


def ids(state: AppState) -> list[str]:
    return [r.id for r in state.project.reflectors.reflectors]


def test_reading_is_asked_for_and_changes_nothing(state: AppState) -> None:
    result = after(state, actions.ReadImport(FILE))
    assert result.effects == (ReadFile(1, FILE, WHOLE, state.project),)
    assert result.state.project is state.project
    assert exchange(result.state).reading is not None
    assert exchange(result.state, OTHER) is default_of(Exchange)


def test_accepted_table_is_one_undo_step_that_is_named_after_the_file(state: AppState) -> None:
    looking = looking_at(state, table(Reflector(id="R1", x=0.25, y=2.1), NORTH))
    assert looking.project is state.project
    result = after(looking, actions.AcceptImport())
    assert ids(result.state) == ["R1", "R2", "R3", "R4", "N"]
    assert result.state.project.reflectors.centers[0].tolist() == [0.25, 2.1]
    assert [step.name for step in result.state.undo] == ["import <b>hall.imk"]
    assert exchange(result.state).pending is None
    assert after(result.state, page.Undo()).state.project is state.project


def test_replacing_removes_what_is_not_in_the_file(state: AppState) -> None:
    looking = looking_at(state, table(NORTH, SOUTH))
    replaced = after(looking, actions.RemoveAbsent(True), actions.AcceptImport()).state
    assert ids(replaced) == ["N", "S"]
    kept = after(looking, actions.RemoveAbsent(True), actions.RemoveAbsent(False), actions.AcceptImport())
    assert ids(kept.state) == ["R1", "R2", "R3", "R4", "N", "S"]


def test_locked_reflectors_are_neither_moved_nor_removed(state: AppState) -> None:
    first, *rest = state.project.reflectors.reflectors
    locked = replace(first, locked=True)
    held = replace(state, project=replace(state.project, reflectors=ReflectorMap((locked, *rest))))
    looking = looking_at(held, table(replace(first, x=1.0), NORTH))
    result = after(looking, actions.RemoveAbsent(True), actions.AcceptImport()).state
    assert result.project.reflectors.reflectors == (locked, NORTH)


def test_what_the_file_has_no_column_for_stays(state: AppState) -> None:
    first, *rest = state.project.reflectors.reflectors
    noted = replace(first, note="pillar", height=1.8)
    held = replace(state, project=replace(state.project, reflectors=ReflectorMap((noted, *rest))))
    result = after(looking_at(held, table(replace(first, x=0.3))), actions.AcceptImport()).state
    assert result.project.reflectors.reflectors[0] == replace(noted, x=0.3)


def test_table_without_names_moves_no_reflector_that_happens_to_have_a_made_up_one(state: AppState) -> None:
    unnamed = table(Reflector(id="R1", x=6.0, y=7.8), Reflector(id="R2", x=0.25, y=2.0), fields=("x", "y"))
    result = after(looking_at(state, unnamed), actions.AcceptImport()).state
    assert ids(result) == ["R1", "R2", "R3", "R4", "R5"]
    assert result.project.reflectors.reflectors[:4] == state.project.reflectors.reflectors


def test_preview_is_of_the_project_as_it_is_when_it_is_accepted(state: AppState) -> None:
    looking = looking_at(state, table(NORTH))
    # Somebody else deletes R4 meanwhile.
    fewer = ReflectorMap(state.project.reflectors.reflectors[:3])
    edited = replace(looking, project=replace(looking.project, reflectors=fewer))
    assert ids(after(edited, actions.AcceptImport()).state) == ["R1", "R2", "R3", "N"]


def test_layout_changes_routes_and_stations_and_keeps_accuracies(state: AppState) -> None:
    dock = Station(name="Dock", x=2.0, y=2.0, required_accuracy=0.01)
    held = replace(state, project=replace(state.project, stations=(dock, Station(name="Old", x=0.0, y=0.0))))
    layout = RouteImport(
        routes=(DETOUR,),
        warnings=(),
        stations=(Station(name="Dock", x=2.5, y=2.0),),
        vehicle_types=("AGV",),
        layouts=("hall",),
    )
    merged = after(looking_at(held, layout), actions.AcceptImport()).state.project
    assert [route.name for route in merged.routes] == ["There and back", "Detour"]
    assert merged.stations[0] == Station(name="Dock", x=2.5, y=2.0, required_accuracy=0.01)
    looking = after(looking_at(held, layout), actions.RemoveAbsent(True)).state
    replaced = after(looking, actions.AcceptImport()).state.project
    assert replaced.routes == (DETOUR,)
    assert [station.name for station in replaced.stations] == ["Dock"]


def test_order_says_nothing_about_stations(state: AppState) -> None:
    dock = Station(name="Dock", x=2.0, y=2.0)
    held = replace(state, project=replace(state.project, stations=(dock,)))
    looking = after(looking_at(held, RouteImport(routes=(DETOUR,))), actions.RemoveAbsent(True)).state
    replaced = after(looking, actions.AcceptImport()).state.project
    assert replaced.routes == (DETOUR,)
    assert replaced.stations == (dock,)


def test_file_that_changes_nothing_makes_no_undo_step(state: AppState) -> None:
    same = ReflectorImport(state.project.reflectors, (), COLUMNS)
    result = after(looking_at(state, same), actions.AcceptImport())
    assert result.state.undo == ()
    assert result.effects == (Tell("<b>hall.imk changes nothing", failed=False),)


def test_dropped_import_is_gone_and_an_answer_that_was_on_its_way_is_too_late(state: AppState) -> None:
    asked = after(state, actions.ReadImport(FILE)).state
    dropped = after(asked, actions.DropImport())
    assert dropped.effects == (StopReading(),)
    late = after(dropped.state, read(asked, table(NORTH)), actions.ExchangeFailed("no", 1))
    assert exchange(late.state).pending is None
    assert exchange(late.state).problem == ""
    with pytest.raises(UsageError, match="no file was read"):
        after(late.state, actions.AcceptImport())


def test_another_part_of_the_same_layout_is_read_from_the_same_file(state: AppState) -> None:
    looking = looking_at(
        state, RouteImport(routes=(DETOUR,), warnings=(), stations=(), vehicle_types=("A", "B"), layouts=("hall",))
    )
    choice = LayoutChoice(vehicle_type="B")
    result = after(looking, actions.ChooseLayout(choice))
    assert result.effects == (ReadFile(2, FILE, choice, state.project),)


def test_problem_is_the_browsers_own_on_one_short_line(state: AppState) -> None:
    failed = after(state, actions.ExchangeFailed("hall.csv: line 1:\n" + "x" * 10_000)).state
    assert exchange(failed).problem.startswith("hall.csv: line 1: xxx")
    assert len(exchange(failed).problem) <= 500
    assert exchange(failed, OTHER) == default_of(Exchange)
    assert failed.faults == ()


def test_progress_is_shown_while_it_is_read_and_forgotten_afterwards(state: AppState) -> None:
    asked = after(state, actions.ReadImport(FILE)).state
    half = after(asked, actions.ExchangeProgressed(1, 0.5, "reading")).state
    reading = exchange(half).reading
    assert reading is not None
    assert (reading.fraction, reading.message) == (0.5, "reading")
    looking = looking_at(state, table(NORTH))
    assert after(looking, actions.ExchangeProgressed(1, 0.9, "late")).state is looking


def test_made_file_goes_to_the_browser_that_asked_and_its_losses_are_kept(state: AppState) -> None:
    asked = after(state, actions.MakeFile(Format.IMK))
    assert asked.effects == (ExportProject(Format.IMK, state.project),)
    made = after(state, actions.FileMade(Exported("Room.imk", b"1 2", ("heading is lost",))))
    assert made.effects == (SendFile("Room.imk", b"1 2"),)
    sent = exchange(made.state).sent
    assert sent is not None
    assert sent.losses == ("heading is lost",)


def test_answers_to_a_browser_that_has_left_change_nothing(state: AppState) -> None:
    asked = after(state, actions.ReadImport(FILE)).state
    left = after(asked, Leave()).state
    late = after(left, read(asked, table(NORTH)), actions.ExchangeFailed("no")).state
    assert late == left


@pytest.mark.parametrize(
    ("source", "title"),
    [(FILE, "<b>hall.imk"), (ServerFile(Path("/data/hall.csv")), "hall.csv"), (Pasted("1\t2"), "pasted text")],
)
def test_each_source_has_a_title(source: Upload | ServerFile | Pasted, title: str) -> None:
    assert source.title == title


def test_whole_project_replaces_all_in_one_step_that_is_undone_at_once(state: AppState) -> None:
    other = replace(room(), name="Other", reflectors=ReflectorMap((NORTH,)), routes=(DETOUR,))
    result = after(looking_at(state, ProjectImport(other)), actions.AcceptImport()).state
    assert result.project == other
    merged = after(looking_at(state, ProjectImport(other)), actions.RemoveAbsent(False), actions.AcceptImport())
    assert ids(merged.state) == ["R1", "R2", "R3", "R4", "N"]
    assert merged.state.project.name == "Other"
    assert after(result, page.Undo()).state.project is state.project

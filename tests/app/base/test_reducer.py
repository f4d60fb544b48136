from pathlib import Path

import pytest

from commission.app.base import actions
from commission.app.base.actions import ClearFaults
from commission.app.base.effects import Tell
from commission.app.base.reducer import Outcome
from commission.app.base.state import FAULTS_KEPT, AppState
from commission.app.project.actions import ProjectSaved, RenameProject, Save
from commission.app.project.effects import WriteProject
from commission.app.project.state import FilesState
from commission.app.run.actions import (
    ChooseSource,
    Cover,
    EditFromHereOn,
    Play,
    Restart,
    Seek,
    SetSpeed,
    StepScan,
    VirtualDrive,
)
from commission.app.run.effects import CoverFromHere, LoadSource, MoveByScans, PlayOn, RunAfresh
from commission.app.run.state import RunState
from commission.app.tune.actions import ParameterValue, ResetParameters, SetParameter
from commission.errors import UsageError
from commission.site.fields import get_field
from tests.app.asking import ME, OTHER, after, by, joined
from tests.app.sites import room

GATE = "association.gate_probability"


@pytest.fixture
def state() -> AppState:
    project = room()
    return AppState(project=project, saved=project, folder=Path("hall"))


def gate(state: AppState) -> ParameterValue:
    return get_field(state.project.parameters, GATE)


def test_a_parameter_change_edits_the_project(state: AppState) -> None:
    result = after(state, SetParameter(GATE, 0.99))
    assert gate(result.state) == 0.99
    assert result.state.is_changed


def test_changes_of_one_parameter_in_quick_succession_are_one_undo_step(state: AppState) -> None:
    drag = [by(ME, SetParameter(GATE, 0.9 + 0.01 * i), 0.1 * i) for i in range(1, 5)]
    assert len(after(state, *drag).state.undo) == 1
    assert gate(after(state, *drag, actions.Undo()).state) == 0.95


def test_what_is_changed_while_a_slider_is_held_is_one_undo_step_however_long_it_takes(state: AppState) -> None:
    held = by(ME, actions.HoldSlider(held=True), 0.0), by(ME, actions.HoldSlider(held=False), 31.0)
    drag = [by(ME, SetParameter(GATE, 0.9 + 0.01 * i), 10.0 * i) for i in range(1, 4)]
    result = after(joined(state), held[0], *drag, held[1]).state
    assert len(result.undo) == 1
    assert gate(after(result, actions.Undo()).state) == 0.95
    # Taken hold of again at once, it is another step; and so is what another browser does meanwhile.
    again = by(ME, actions.HoldSlider(held=True), 31.1), by(ME, SetParameter(GATE, 0.8), 31.2)
    assert len(after(result, *again).state.undo) == 2
    others = by(OTHER, SetParameter(GATE, 0.7), 31.3), by(ME, SetParameter(GATE, 0.6), 31.4)
    assert len(after(result, *again, *others).state.undo) == 4


def test_without_a_held_slider_time_alone_parts_the_steps(state: AppState) -> None:
    drag = [by(ME, SetParameter(GATE, 0.9 + 0.01 * i), 10.0 * i) for i in range(1, 4)]
    assert len(after(joined(state), *drag).state.undo) == 3


def test_a_later_change_of_the_same_parameter_is_its_own_undo_step(state: AppState) -> None:
    twice = (SetParameter(GATE, 0.9), by(ME, SetParameter(GATE, 0.99), 5.0))
    assert gate(after(state, *twice, actions.Undo()).state) == 0.9


def test_redo_brings_back_what_undo_took_away_until_something_else_changes(state: AppState) -> None:
    changed = after(state, SetParameter(GATE, 0.9), actions.Undo(), actions.Redo()).state
    assert gate(changed) == 0.9
    other = after(state, SetParameter(GATE, 0.9), actions.Undo(), SetParameter(GATE, 0.8)).state
    assert other.redo == ()


def test_undo_and_redo_with_nothing_to_do_change_nothing(state: AppState) -> None:
    assert after(state, actions.Undo(), actions.Redo()) == Outcome(state)


def test_reset_goes_back_to_the_saved_parameters_and_can_be_undone(state: AppState) -> None:
    changed = after(state, SetParameter(GATE, 0.9), ResetParameters())
    assert gate(changed.state) == 0.95
    assert gate(after(changed.state, actions.Undo()).state) == 0.9


def test_a_value_out_of_range_is_refused_with_what_is_expected(state: AppState) -> None:
    with pytest.raises(ValueError, match="expected more than 0 and less than 1"):
        after(state, SetParameter(GATE, 1.5))


@pytest.mark.parametrize("key", ["gate_probability", "association", "association.nothing", "no.gate", "", "a.b c"])
def test_an_unknown_parameter_is_refused_by_its_name(state: AppState, key: str) -> None:
    with pytest.raises(UsageError, match="no parameter is called"):
        after(state, SetParameter(key, 1.0))


def test_saving_writes_into_the_projects_folder_and_is_remembered_when_done(state: AppState) -> None:
    wish = after(state, SetParameter(GATE, 0.9), Save())
    assert wish.effects == (WriteProject(wish.state.project, Path("hall")),)
    done = after(wish.state, ProjectSaved(wish.state.project, Path("hall"), "12:03")).state
    assert not done.is_changed
    assert done.part(FilesState).saved_at == "12:03"


def test_a_bundled_project_is_not_written_without_a_folder(state: AppState) -> None:
    bundled = AppState(project=state.project, saved=state.project, folder=None)
    with pytest.raises(UsageError, match="bundled"):
        after(bundled, Save())
    assert after(bundled, Save(Path("copy"))).effects


def test_what_was_changed_while_a_save_was_under_way_still_counts_as_changed(state: AppState) -> None:
    first = after(state, SetParameter(GATE, 0.9)).state
    then = after(first, SetParameter(GATE, 0.8)).state
    assert after(then, ProjectSaved(first.project, Path("hall"), "12:03")).state.is_changed


def test_a_virtual_drive_needs_a_route_of_the_project(state: AppState) -> None:
    with pytest.raises(UsageError, match="There and back"):
        after(state, ChooseSource(VirtualDrive("Nowhere")))
    source = VirtualDrive("There and back", seed=3)
    assert after(state, ChooseSource(source)).effects == (LoadSource(source),)


@pytest.mark.parametrize(("back", "scans"), [(False, 1), (True, -1)])
def test_a_step_pauses_and_goes_by_one_scan(state: AppState, back: bool, scans: int) -> None:
    stepped = after(state, Play(playing=True), StepScan(back=back))
    assert not stepped.state.part(RunState).playing
    assert stepped.effects == (MoveByScans(scans),)


def test_play_runs_forward_or_backward_and_pauses_whatever_it_did(state: AppState) -> None:
    backward = after(state, Play(playing=True, backward=True))
    assert backward.state.part(RunState).playing
    assert backward.state.part(RunState).backward
    assert backward.effects == (PlayOn(backward=True),)
    paused = after(backward.state, Play())
    assert not paused.state.part(RunState).playing
    assert paused.effects == ()
    forward = after(paused.state, Play())
    assert not forward.state.part(RunState).backward
    assert forward.effects == (PlayOn(backward=False),)


def test_a_cover_acts_from_the_cursor_on_and_edits_where_they_are_asked_to(state: AppState) -> None:
    assert after(state, Cover(covered=True)).effects == (CoverFromHere(covered=True),)
    assert not state.part(RunState).from_here_on
    assert after(state, EditFromHereOn(from_here_on=True)).state.part(RunState).from_here_on


@pytest.mark.parametrize(
    "wish",
    [
        SetSpeed(0.0),
        SetSpeed(float("nan")),
        SetSpeed(1000.0),
        Seek(-1.0),
        Seek(float("nan")),
        actions.Magnify(0.0),
    ],
)
def test_impossible_numbers_are_refused(state: AppState, wish: actions.Action) -> None:
    with pytest.raises(ValueError, match="expected"):
        after(state, wish)


def test_a_restart_goes_to_the_start_afresh(state: AppState) -> None:
    assert after(state, Restart()).effects == (RunAfresh(),)


def test_a_hidden_layer_can_be_shown_again(state: AppState) -> None:
    hidden = after(state, actions.ShowLayer("Scan", visible=False)).state
    assert hidden.hidden == {"Scan"}
    assert after(hidden, actions.ShowLayer("Scan", visible=True)).state.hidden == frozenset()


def test_problems_are_listed_on_one_line_each_and_bounded(state: AppState) -> None:
    reported = after(state, *(actions.Report(f"a\nb {i}") for i in range(50)), browser=None).state
    assert len(reported.faults) == FAULTS_KEPT
    assert reported.faults[-1] == "a b 49"
    assert after(reported, ClearFaults()).state.faults == ()


def test_good_news_are_told_and_not_listed(state: AppState) -> None:
    told = after(state, actions.Report("saved", failed=False))
    assert told.state.faults == ()
    assert told.effects == (Tell("saved", failed=False),)


def test_a_project_gets_another_name_as_one_step_and_an_empty_one_is_refused(state: AppState) -> None:
    renamed = after(state, RenameProject("  Hall   7 ")).state
    assert renamed.project.name == "Hall 7"
    assert renamed.undo[-1].name == "rename the project"
    assert after(renamed, actions.Undo()).state.project == state.project
    with pytest.raises(UsageError, match="expected some letters"):
        after(state, RenameProject("  "))

"""The calibration on the page: what is asked, what becomes of the project, and what is shown of it."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import pytest

from commission.app.base.actions import PROGRAM, Action, Undo
from commission.app.base.shown_run import RunShown
from commission.app.base.state import AppState
from commission.app.run.actions import VirtualDrive
from commission.app.run.drives import Drive
from commission.app.run.effects import LoadSource
from commission.app.run.service import RunService
from commission.app.run.view import DrivenHall
from commission.app.tune.calibration_actions import AcceptFigure, CalibrateByDrive, DropCalibration, LookAtFigure
from commission.app.tune.calibration_service import CalibrationService
from commission.app.tune.calibration_state import CalibrationState
from commission.app.tune.calibration_texts import figure_text, gain_text, not_proposed_text, summary_text
from commission.app.tune.calibration_view import CalibrationView, calibration_view
from commission.errors import UsageError
from commission.localization.setup import LocalizerSetup
from commission.site.fields import get_field
from commission.site.project import Project
from commission.site.quantity import DEGREES
from commission.site.reflectors import ReflectorMap
from commission.studies.calibration import Calibration, CalibrationInput, calibrate
from commission.studies.calibration_values import CalibrationVerdict, Value, value_in, with_value
from commission.studies.calibration_words import change_of, label_of, stretches_of, text_of
from commission.studies.run import RunResult, judged_run
from tests.app.asking import after
from tests.app.bench import Bench
from tests.app.owning import Owner

RANGE, BEARING = "observation.range_sigma", "observation.bearing_sigma"


@pytest.fixture(scope="module")
def found(project: Project, drive: Drive) -> Calibration:
    return calibrate(CalibrationInput.of(project, drive.log, drive.start))


@pytest.fixture
def state(project: Project, result: RunResult) -> AppState:
    return after(AppState(project=project, saved=project), RunShown(result)).state


@pytest.fixture
def bench(project: Project, result: RunResult) -> Iterator[Bench[CalibrationService]]:
    bench = Bench(CalibrationService, project)
    bench.ask(RunShown(result))
    yield bench
    bench.close()


def shown(found: Calibration, state: AppState) -> CalibrationView:
    return calibration_view(found, state.project, state.part(CalibrationState))


def proposed(found: Calibration, key: str) -> Value:
    return next(each for each in found.proposed if each.key == key)


def test_it_is_calibrated_once_for_each_time_it_is_asked_and_dropped(bench: Bench[CalibrationService]) -> None:
    bench.ask(CalibrateByDrive())
    view = bench.found()
    assert view.is_of_drive
    assert {RANGE, BEARING} <= {each.value.key for each in view.proposed}
    assert view.chosen is view.proposed[0]
    bench.ask(LookAtFigure(BEARING))
    assert bench.view.chosen.value.key == BEARING
    assert bench.view.calibration is view.calibration
    bench.ask(DropCalibration())
    assert bench.view is None


def test_cancelled_it_leaves_nothing_behind(bench: Bench[CalibrationService]) -> None:
    bench.ask(CalibrateByDrive())
    bench.ask(DropCalibration())
    assert bench.found() is None


def test_without_a_drive_or_while_one_grows_it_says_what_is_missing(project: Project, state: AppState) -> None:
    for without in (AppState(project=project, saved=project), after(state, RunShown(None)).state):
        with pytest.raises(UsageError, match="no drive is shown that could be calibrated by; open a recording"):
            after(without, CalibrateByDrive())


def test_each_figure_is_accepted_alone_in_one_undo_step(found: Calibration, state: AppState, project: Project) -> None:
    wide, both = after(state, AcceptFigure(RANGE, found)).state, state
    assert wide.project.parameters.observation.range_sigma == proposed(found, RANGE).proposed
    assert wide.project.parameters.observation.bearing_sigma == project.parameters.observation.bearing_sigma
    both = after(wide, AcceptFigure(BEARING, found)).state
    assert [step.name for step in both.undo] == ["accept Range 1σ", "accept Bearing 1σ"]
    view = shown(found, both)
    assert sum(each.is_accepted for each in view.proposed) == 2
    assert f"{len(found.proposed)} figures proposed, 2 accepted." in summary_text(view)
    again = after(both, AcceptFigure(RANGE, found)).state
    assert again is both
    assert after(both, Undo()).state.project is wide.project
    assert after(both, Undo(), Undo()).state.project is project


def test_what_is_not_proposed_or_of_another_drive_or_gone_is_refused_by_name(
    found: Calibration, state: AppState, result: RunResult
) -> None:
    with pytest.raises(UsageError, match="Turn scale is not proposed"):
        after(state, AcceptFigure("odometry.turn_scale", found))
    other = replace(result, inputs=replace(result.inputs, log=replace(result.inputs.log)))
    with pytest.raises(UsageError, match="not the one that was calibrated by; calibrate again"):
        after(state, RunShown(other), AcceptFigure(RANGE, found))
    place = replace(proposed(found, RANGE), key="reflectors.R1.x")
    gone = replace(state, project=replace(state.project, reflectors=ReflectorMap(())))
    with pytest.raises(UsageError, match="R1: x: the project has no such scanner or reflector any more"):
        after(gone, AcceptFigure(place.key, replace(found, values=(place,))))


def test_a_figure_is_shown_with_before_proposed_sigma_stretches_and_words(found: Calibration, state: AppState) -> None:
    value = proposed(found, RANGE)
    text = figure_text(shown(found, after(state, LookAtFigure(RANGE)).state))
    sigma = 1000.0 * value.sigma
    digits = 1 - math.floor(math.log10(sigma))
    for number in (20.0, 1000.0 * value.proposed, sigma):
        assert f">{number:.{digits}f} mm<" in text
    assert f"{1000.0 * abs(value.proposed - 0.02) / sigma:.1f} 1-sigma" in text
    hidden = [each for each in found.values if each.verdict is CalibrationVerdict.NOT_SHOWN]
    told = not_proposed_text(shown(found, state))
    assert any(each.key.endswith("mounting.x") for each in hidden)
    assert "scanner: mounting x: mounting x needs turning on the spot; none, or hardly any, in this drive" in told
    assert "This drive cannot show:" in told
    heading = replace(value, key="scanners.front.mounting.heading", shown=DEGREES, before=0.0, proposed=0.0175)
    heading = replace(heading, sigma=0.0009, stretches=((12.2, 24.4), (60.0, 71.8)))
    assert label_of(heading.key) == "front: mounting heading"
    assert change_of(heading) == "0.000 → 1.003 ± 0.052°"
    assert stretches_of(heading) == "12–24 s, 60–72 s"
    assert text_of(replace(heading, sigma=math.nan), 0.0175) == "1.00°"


def test_figures_of_the_drive_are_shown_before_and_after_an_acceptance(
    found: Calibration, state: AppState, result: RunResult
) -> None:
    accepting = after(state, AcceptFigure(RANGE, found)).state
    assert "the drive is localized again" in gain_text(shown(found, accepting))
    now = judged_run(result.inputs.with_setup(LocalizerSetup.of(accepting.project)), earlier=result)
    told = gain_text(shown(found, after(accepting, RunShown(now)).state))
    for run in (result, now):
        assert f"<td>{run.consistency.nis_before_gate_mean:.2f}</td>" in told
        assert run.statistics is not None
        assert f"<td>{1000.0 * run.statistics.position_rmse:.1f} mm</td>" in told
    undone = after(accepting, RunShown(now), Undo()).state
    assert gain_text(shown(found, undone)) == ""


@pytest.mark.parametrize(
    "key", ["scanners.scanner.mounting.heading", "scanners.scanner.clock_offset", "reflectors.R2.y"]
)
def test_a_figure_is_read_where_it_is_written(project: Project, key: str) -> None:
    setup = with_value(LocalizerSetup.of(project), key, 0.0123)
    assert value_in(setup, key) == pytest.approx(0.0123, abs=1e-15)
    assert value_in(setup, key.replace("scanner.", "other.").replace("R2", "R9")) is None
    assert get_field(project.parameters, RANGE) == value_in(setup, RANGE)


def test_a_virtual_drive_stays_when_the_project_learns_from_it_and_when_that_is_undone(
    project: Project, drive: Drive, found: Calibration
) -> None:
    place = replace(proposed(found, RANGE), key="scanners.scanner.mounting.x", before=0.0, proposed=0.004)
    learning = AcceptFigure(place.key, replace(found, values=(place,)))
    drives: list[Drive] = []

    def prepare(*_: object) -> Drive:
        drives.append(drive)
        return drive

    state = AppState(project=project, saved=project)
    owner = Owner(lambda context: RunService(context, prepare=prepare, compile_all=lambda _progress: None), state)
    try:
        owner.service.carry_out(LoadSource(VirtualDrive(project.routes[0].name)), state, PROGRAM)
        owner.settle(state)
        (run,) = [each.result for each in owner.posted if isinstance(each, RunShown)]
        assert run is not None
        state = after(state, RunShown(run)).state
        asked: list[Action] = [learning, Undo(), learning]
        for action in asked:
            # Accepted again it is another setup, and the same hall.
            before, state = state, after(state, action).state
            owner.service.project_changed(action, before, state)
            owner.settle(state)
            view = owner.service.view()
            assert view is not None
            assert view.hall is DrivenHall.AS_DRIVEN
            assert view.result.inputs.log is drive.log
            assert view.result.inputs.segments[0].setup.scanners is state.project.scanners
        assert len(drives) == 1
    finally:
        owner.close()

"""The service behind the run: what an edit does to the run that is there, and that the newest one wins."""

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
import pytest

from commission.app.base.actions import PROGRAM, Action
from commission.app.base.effects import Effect
from commission.app.base.service import Context
from commission.app.base.shown_run import RunShown
from commission.app.base.state import AppState
from commission.app.base.view import Followed, LivedPath
from commission.app.run import service as service_module
from commission.app.run.actions import Play, SourceLoaded, VirtualDrive
from commission.app.run.drives import Drive
from commission.app.run.effects import CoverFromHere, LoadSource, LocateFromHere, MoveByScans, MoveTo, PlayOn, RunAfresh
from commission.app.run.service import RunService
from commission.app.run.state import RunState
from commission.app.run.view import RunView
from commission.errors import UsageError
from commission.localization.estimate import Mode
from commission.localization.run_columns import RunSegment
from commission.localization.setup import LocalizerSetup
from commission.progress import Progress
from commission.site.fields import with_field
from commission.site.project import Project
from commission.studies.events import EventKind, EventsInput, events, told
from commission.studies.run import RunInput, RunResult, judged_run
from tests.app.owning import Owner

GATE = "association.gate_probability"


class RunBench:
    """A run service whose owner the test plays, and whose clock it moves."""

    def __init__(self, project: Project, drive: Drive) -> None:
        self.now = 0.0
        self.drives = [drive]
        self.state = AppState(project=project, saved=project)
        self.owner = Owner(self._make, self.state)

    def _make(self, context: Context) -> RunService:
        context = replace(context, clock=lambda: self.now)
        return RunService(context, prepare=lambda *_: self.drives[-1], compile_all=lambda _progress: None)

    @property
    def service(self) -> RunService:
        return self.owner.service

    @property
    def view(self) -> RunView:
        view = self.service.view()
        assert view is not None
        return view

    def do(self, *effects: Effect, settle: bool = True) -> None:
        for effect in effects:
            self.service.carry_out(effect, self.state, PROGRAM)
        if settle:
            self.owner.settle(self.state)

    def ask(self, **changes: object) -> None:
        self.state = self.state.with_part(replace(self.state.part(RunState), **changes))

    def edit(self, change: Callable[[Project], Project], *, settle: bool = True) -> None:
        before, self.state = self.state, replace(self.state, project=change(self.state.project))
        self.service.project_changed(Action(), before, self.state)
        if settle:
            self.owner.settle(self.state)

    def play(self, seconds: float) -> None:
        """Play for a time, at 25 pictures a second."""
        for _ in range(round(seconds / 0.04)):
            self.now += 0.04
            self.service.follow(self.state)


@pytest.fixture
def bench(project: Project, drive: Drive) -> Iterator[RunBench]:
    bench = RunBench(project, drive)
    bench.do(LoadSource(VirtualDrive("There and back")))
    yield bench
    bench.owner.close()


def gate(probability: float) -> Callable[[Project], Project]:
    return lambda project: replace(project, parameters=with_field(project.parameters, GATE, probability))


def fresh(bench: RunBench, *segments: tuple[int, Project, bool]) -> RunResult:
    """The run that these segments make, computed on its own."""
    drive = bench.drives[-1]
    made = tuple(RunSegment(first, LocalizerSetup.of(project), covered) for first, project, covered in segments)
    return judged_run(RunInput(log=drive.log, start=drive.start, segments=made))


def assert_same(one: RunResult, other: RunResult) -> None:
    assert one.inputs == other.inputs
    for name in ("means", "covariances", "modes", "status", "d2"):
        assert getattr(one.columns, name).tobytes() == getattr(other.columns, name).tobytes(), name
    assert (one.statistics, one.episodes) == (other.statistics, other.episodes)


def test_a_new_drive_is_there_whole_at_its_start_and_plays(bench: RunBench, project: Project) -> None:
    driven = VirtualDrive(project.routes[0].name, seed=1)
    loaded, playing, shown = bench.owner.posted
    assert (loaded, playing) == (SourceLoaded(driven), Play(playing=True))
    assert isinstance(shown, RunShown)
    assert shown.result is bench.view.result
    assert bench.view.time == 0.0
    assert_same(bench.view.result, fresh(bench, (0, project, False)))


def test_an_edit_runs_the_whole_drive_again_and_the_cursor_stays(bench: RunBench, project: Project) -> None:
    bench.do(MoveTo(5.0))
    bench.edit(gate(0.6))
    assert bench.view.time == pytest.approx(5.0)
    assert_same(bench.view.result, fresh(bench, (0, gate(0.6)(project), False)))


@pytest.mark.parametrize("part", ["reflectors", "scanners", "parameters"])
def test_whatever_the_localizer_reads_runs_it_again(bench: RunBench, part: str) -> None:
    before = bench.view.result

    def change(project: Project) -> Project:
        match part:
            case "reflectors":
                one, *rest = project.reflectors.reflectors
                return replace(project, reflectors=replace(project.reflectors, reflectors=(replace(one, y=2.1), *rest)))
            case "scanners":
                return replace(project, scanners=(replace(project.scanners[0], mounting=[0.05, 0.0, 0.0]),))
            case _:
                return gate(0.6)(project)

    bench.edit(change)
    assert bench.view.result.columns.means.tobytes() != before.columns.means.tobytes()
    assert_same(bench.view.result, fresh(bench, (0, bench.state.project, False)))


def test_an_edit_of_something_else_leaves_the_run(bench: RunBench) -> None:
    before = bench.view.result
    bench.edit(lambda project: replace(project, name="Another"))
    bench.edit(lambda project: replace(project, parameters=replace(project.parameters)))
    assert bench.view.result is before


def test_from_here_on_an_edit_leaves_what_was_lived(bench: RunBench, project: Project) -> None:
    bench.do(MoveTo(5.0))
    cursor, before = bench.view.lived, bench.view.result
    bench.ask(from_here_on=True)
    bench.edit(gate(0.6))
    after = bench.view
    assert (after.lived, after.edits) == (cursor, (pytest.approx(5.1),))
    assert_same(after.result, fresh(bench, (0, project, False), (cursor, gate(0.6)(project), False)))
    assert after.result.columns.means[:cursor].tobytes() == before.columns.means[:cursor].tobytes()
    bench.ask(from_here_on=False)
    bench.edit(gate(0.7))
    assert bench.view.edits == ()


def test_covered_from_the_cursor_on_it_fails_and_uncovered_it_recovers(bench: RunBench, project: Project) -> None:
    bench.edit(lambda p: replace(p, parameters=with_field(p.parameters, "supervisor.position_limit", 0.03)))
    bench.do(MoveTo(1.45), CoverFromHere(covered=True))
    assert bench.view.covered
    assert bench.view.mode is Mode.OPERATIONAL
    bench.do(MoveTo(7.45))
    assert bench.view.mode is Mode.FAIL
    bench.do(CoverFromHere(covered=False))
    assert not bench.view.covered
    bench.do(MoveTo(9.0))
    assert bench.view.mode is Mode.OPERATIONAL
    assert len(bench.view.lived_episodes) == 1
    tight = bench.state.project
    assert_same(bench.view.result, fresh(bench, (0, tight, False), (15, tight, True), (75, tight, False)))
    # Back in time the cover is on again, as it was lived.
    bench.do(MoveTo(5.0))
    assert bench.view.covered
    # An edit from the start is made in the same world.
    bench.edit(gate(0.6))
    assert [segment.covered for segment in bench.view.result.inputs.segments] == [False, True, False]


def test_located_from_the_cursor_on_it_looks_where_it_is_and_a_later_edit_keeps_that(bench: RunBench) -> None:
    bench.do(MoveTo(1.45), LocateFromHere())
    first = bench.view.lived
    modes = bench.view.result.columns.modes
    assert (modes[:first] == Mode.OPERATIONAL).all()
    assert modes[first] == Mode.INITIALIZING
    bench.do(MoveByScans(5))
    assert bench.view.mode is Mode.INITIALIZING
    (best, *_) = bench.view.hypotheses
    reference = bench.view.result.reference_places(np.array([bench.view.newest]))[0]
    assert np.hypot(*(best.pose[:2] - reference)) < 0.1
    assert best.probability > 0.9
    listed = events(EventsInput(bench.view.result)).events
    (event,) = [each for each in listed if each.kind is EventKind.LOCATE]
    assert event.time == pytest.approx(bench.view.result.times[first])
    assert "asked for" in told(event)
    bench.edit(gate(0.9))
    assert bench.view.result.columns.modes[first] == Mode.INITIALIZING
    assert [segment.locate for segment in bench.view.result.inputs.segments] == [False, True]
    bench.do(RunAfresh())
    assert Mode.INITIALIZING not in bench.view.result.columns.modes


def test_afresh_the_drive_has_one_setup_and_nothing_covered(bench: RunBench) -> None:
    bench.ask(from_here_on=True)
    bench.do(MoveTo(3.0), CoverFromHere(covered=True))
    bench.edit(gate(0.6))
    bench.do(RunAfresh())
    assert bench.view.time == 0.0
    assert not bench.view.covered
    assert_same(bench.view.result, fresh(bench, (0, bench.state.project, False)))


def test_at_the_end_nothing_is_left_to_act_on(bench: RunBench) -> None:
    bench.do(MoveTo(1e9))
    before = bench.view.result
    bench.do(CoverFromHere(covered=True))
    assert "drive is over" in bench.owner.posted[-1].action.text
    bench.ask(from_here_on=True)
    bench.edit(gate(0.6))
    assert bench.view.result is before


def test_of_many_edits_the_newest_wins_and_the_old_run_stays_until_it_is_there(
    bench: RunBench, project: Project
) -> None:
    before = bench.view.result
    for probability in (0.5, 0.6, 0.7, 0.8):
        bench.edit(gate(probability), settle=False)
        assert bench.view.result is before
    bench.owner.settle(bench.state)
    assert_same(bench.view.result, fresh(bench, (0, gate(0.8)(project), False)))


def test_an_edit_taken_back_while_it_is_computed_leaves_what_was_there(bench: RunBench, project: Project) -> None:
    bench.edit(gate(0.5), settle=False)
    bench.edit(lambda p: replace(p, parameters=project.parameters))
    assert_same(bench.view.result, fresh(bench, (0, project, False)))


def test_an_edit_while_another_drive_is_localized_is_not_lost(bench: RunBench, project: Project) -> None:
    bench.do(MoveTo(5.0))
    bench.ask(from_here_on=True)
    old = bench.drives[-1]
    bench.drives.append(replace(old, log=replace(old.log)))
    bench.do(LoadSource(VirtualDrive("There and back")), settle=False)
    while bench.service._wanted.log is old.log:
        bench.owner.hear()
    # The cursor is one of the drive before; of the new one nothing is lived.
    bench.edit(gate(0.6))
    assert bench.view.time == 0.0
    assert_same(bench.view.result, fresh(bench, (0, gate(0.6)(project), False)))


def test_a_run_that_fails_leaves_the_one_before_and_can_be_asked_for_again(
    bench: RunBench, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = bench.view.result

    def failing(inputs: RunInput, progress: Progress, *, earlier: RunResult | None) -> RunResult:
        raise UsageError("no such thing")

    with monkeypatch.context() as patch:
        patch.setattr(service_module, "judged_run", failing)
        bench.edit(gate(0.6))
    assert "no such thing" in bench.owner.posted[-1].text
    assert bench.view.result is before
    bench.edit(lambda project: project)
    bench.do(RunAfresh())
    assert bench.view.result is not before
    assert_same(bench.view.result, fresh(bench, (0, bench.state.project, False)))


def test_playing_moves_the_cursor_at_its_speed_forward_and_back(bench: RunBench) -> None:
    bench.ask(playing=True, speed=2.0)
    bench.play(1.0)
    assert bench.view.time == pytest.approx(2.0)
    bench.ask(backward=True, speed=0.5)
    bench.play(1.0)
    assert bench.view.time == pytest.approx(1.5)
    bench.ask(playing=False)
    bench.play(1.0)
    assert bench.view.time == pytest.approx(1.5)


@pytest.mark.parametrize("backward", [False, True])
def test_where_the_drive_is_over_it_stops_or_begins_again(bench: RunBench, backward: bool) -> None:
    end = bench.view.duration
    near, beyond = (0.1, end) if backward else (end - 0.1, 0.0)
    bench.do(MoveTo(near))
    bench.ask(playing=True, backward=backward)
    bench.owner.posted.clear()
    bench.play(0.2)
    bench.ask(playing=False)
    bench.do(PlayOn(backward))
    assert set(bench.owner.posted) == {Play(playing=False)}
    assert bench.view.time == pytest.approx(beyond)
    bench.do(MoveTo(near))
    bench.ask(playing=True, repeat=True)
    bench.play(0.2)
    assert bench.view.time == pytest.approx(beyond, abs=0.2)


def test_playing_on_in_the_middle_stays_there(bench: RunBench) -> None:
    bench.do(MoveTo(3.0), PlayOn(backward=False), PlayOn(backward=True))
    assert bench.view.time == pytest.approx(3.0)


def test_steps_reach_the_cursor(bench: RunBench) -> None:
    bench.do(MoveTo(3.0), MoveByScans(1))
    assert bench.view.time == pytest.approx(3.1)
    bench.do(MoveByScans(-1), MoveByScans(-1))
    assert bench.view.time == pytest.approx(2.9)


def test_others_are_given_where_the_vehicle_is_and_was(bench: RunBench) -> None:
    bench.do(MoveTo(3.0))
    view, followed, lived, *_found = bench.service.parts(slowly=True)
    assert isinstance(view, RunView)
    assert followed == Followed((float(view.pose[0]), float(view.pose[1])))
    assert isinstance(lived, LivedPath)
    np.testing.assert_array_equal(lived.poses, view.result.columns.means[: view.lived])
    np.testing.assert_array_equal(lived.two_sigma, view.result.two_sigma[: view.lived])


def test_without_a_drive_nothing_moves_and_nothing_fails(project: Project, drive: Drive) -> None:
    bench = RunBench(project, drive)
    bench.do(MoveTo(1.0), MoveByScans(1), CoverFromHere(covered=True), RunAfresh(), PlayOn(backward=False))
    bench.edit(gate(0.6))
    bench.ask(playing=True)
    bench.play(0.2)
    assert bench.service.view() is None
    assert bench.service.parts(slowly=True) == ()
    bench.owner.close()

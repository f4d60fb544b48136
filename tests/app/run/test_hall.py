"""A virtual drive follows the hall, the vehicle and its scanners; unless only the map is to move."""

from __future__ import annotations

import itertools
import sys
from collections.abc import Callable, Iterator
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest

from commission.app.base.actions import PROGRAM, Action, Report
from commission.app.base.effects import Effect
from commission.app.base.service import Context
from commission.app.base.state import AppState
from commission.app.base.view import view_of
from commission.app.run import drives
from commission.app.run.actions import MoveOnlyTheMap, Play, RecordedDrive, Source, VirtualDrive
from commission.app.run.drives import Drive
from commission.app.run.edits_panel import HALLS, KEEPS, note
from commission.app.run.effects import CoverFromHere, DriveAgain, LoadSource, MoveTo
from commission.app.run.reducer import move_only_the_map
from commission.app.run.service import RunService
from commission.app.run.state import RunState
from commission.app.run.view import DrivenHall, RunView
from commission.app.run.world import World
from commission.errors import SourceError
from commission.localization.estimate import Mode
from commission.progress import Progress
from commission.simulation.scenario import records
from commission.site.fields import with_field
from commission.site.project import Project
from commission.site.routes import Segment
from commission.site.tags import Tag
from commission.studies.run import RunInput, judged_run
from tests.app.owning import Owner

SOURCE = VirtualDrive("There and back", seed=1)


class Hearing:
    """A run service on a project of which a test counts the drives."""

    def __init__(self, project: Project) -> None:
        self.driven: list[Project] = []
        self.refuse = False
        self.state = AppState(project=project, saved=project)
        self.owner = Owner(self._make, self.state)

    def _make(self, context: Context) -> RunService:
        return RunService(context, prepare=self._prepare, compile_all=lambda _progress: None)

    def _prepare(self, project: Project, source: Source, progress: Progress) -> Drive:
        if self.refuse:
            raise SourceError("the route is too steep")
        self.driven.append(project)
        if isinstance(source, RecordedDrive):
            source = SOURCE
        return drives.prepare(project, source, progress)

    @property
    def view(self) -> RunView:
        view = self.owner.service.view()
        assert view is not None
        return view

    @property
    def said(self) -> str:
        return note(view_of(self.state, self.view))

    def do(self, *effects: Effect, settle: bool = True) -> None:
        for effect in effects:
            self.owner.service.carry_out(effect, self.state, PROGRAM)
        if settle:
            self.owner.settle(self.state)

    def ask(self, **changes: bool) -> None:
        self.state = self.state.with_part(replace(self.state.part(RunState), **changes))

    def edit(self, change: Callable[[Project], Project], *, settle: bool = True) -> None:
        before, self.state = self.state, replace(self.state, project=change(self.state.project))
        self.owner.service.project_changed(Action(), before, self.state)
        if settle:
            self.owner.settle(self.state)


@pytest.fixture
def hearing(project: Project) -> Iterator[Hearing]:
    hearing = Hearing(project)
    hearing.do(LoadSource(SOURCE))
    hearing.do(MoveTo(5.0))
    yield hearing
    hearing.owner.close()


def moved(metres: float) -> Callable[[Project], Project]:
    """Move the first reflector across the route."""

    def change(project: Project) -> Project:
        one, *rest = project.reflectors.reflectors
        return replace(
            project, reflectors=replace(project.reflectors, reflectors=(replace(one, y=one.y + metres), *rest))
        )

    return change


def longer(project: Project) -> Project:
    route = project.routes[0]
    points = np.array([[1.0, 1.0], [4.0, 1.0]])
    return replace(
        project, routes=(replace(route, segments=(Segment(control_points=points, degree=1),)), *project.routes[1:])
    )


CHANGES: dict[str, Callable[[Project], Project]] = {
    "reflectors": moved(0.3),
    "scanner": lambda p: replace(p, scanners=(replace(p.scanners[0], mounting=(0.05, 0.0, 0.0)),)),
    "vehicle": lambda p: replace(p, vehicle=replace(p.vehicle, wheel_separation=0.6)),
    "walls": lambda p: replace(p, floor_map=None),
    "route": longer,
    "tags": lambda p: replace(p, tags=(Tag(id="T1", x=2.0, y=2.0),)),
    "faults": lambda p: replace(p, disturbances=replace(p.disturbances, glints_per_scan=0.5)),
}


def test_a_world_holds_all_that_a_drive_reads_of_the_project(project: Project) -> None:
    read: set[str] = set()

    class Reading(Project):
        """A project of which one sees what others than itself and a copy of it read."""

        __slots__ = ()

        def __getattribute__(self, name: str) -> object:
            if sys._getframe(1).f_globals["__name__"] not in ("dataclasses", Project.__module__):
                read.add(name)
            return super().__getattribute__(name)

    tags = (Tag(id="T1", x=2.0, y=2.0),)
    given = {each.name: getattr(project, each.name) for each in fields(Project)} | {"tags": tags}
    for _ in itertools.islice(records(Reading(**given), SOURCE.route, 1), 50):
        pass
    of_project = read & given.keys()
    assert {"tag_camera", "scanners", "disturbances"} <= of_project
    assert of_project <= {each.name for each in fields(World)}


@pytest.mark.parametrize("name", CHANGES)
def test_where_the_hall_changes_it_is_driven_again_at_the_same_time(hearing: Hearing, name: str) -> None:
    hearing.owner.posted.clear()
    hearing.edit(CHANGES[name])
    now = hearing.state.project
    assert hearing.driven[1:] == [now]
    drive = drives.prepare(now, SOURCE, lambda *_: None)
    expected = judged_run(RunInput.of(now, drive.log, drive.start))
    assert hearing.view.result.columns.means.tobytes() == expected.columns.means.tobytes()
    assert hearing.view.time == pytest.approx(min(5.0, expected.duration))
    assert Play(playing=True) not in hearing.owner.posted
    assert hearing.view.hall is DrivenHall.AS_DRIVEN
    assert HALLS[DrivenHall.AS_DRIVEN] in hearing.said


@pytest.mark.parametrize(
    "change",
    [
        lambda p: replace(p, parameters=with_field(p.parameters, "association.gate_probability", 0.7)),
        lambda p: replace(p, name="Another"),
        lambda p: replace(p, uncertainty=replace(p.uncertainty, survey=0.004)),
        lambda p: replace(p, routes=(*p.routes, replace(p.routes[0], name="Another"))),
    ],
    ids=["gate", "name", "uncertainty", "another route"],
)
def test_what_the_localizer_believes_and_other_routes_call_for_no_other_drive(hearing: Hearing, change) -> None:
    hearing.edit(change)
    assert len(hearing.driven) == 1


def test_a_survey_error_moves_only_the_map_until_the_hall_is_to_follow(hearing: Hearing) -> None:
    driven = hearing.view.result.inputs.log
    hearing.ask(only_the_map=True)
    assert KEEPS in hearing.said
    hearing.edit(moved(0.4))
    assert hearing.view.result.inputs.log is driven
    assert hearing.view.hall is DrivenHall.OTHER
    assert HALLS[DrivenHall.OTHER] in hearing.said
    assert hearing.view.result.consistency.rejected_fraction > 0.05
    hearing.ask(only_the_map=False)
    hearing.do(DriveAgain())
    assert hearing.driven[1:] == [hearing.state.project]
    assert hearing.view.hall is DrivenHall.AS_DRIVEN
    assert hearing.view.result.consistency.rejected_fraction < 0.05


def test_from_here_on_the_hall_stays(hearing: Hearing) -> None:
    hearing.ask(from_here_on=True)
    hearing.edit(moved(0.3))
    assert len(hearing.driven) == 1
    assert hearing.view.edits


def test_an_edit_taken_back_while_it_is_driven_again_leaves_the_drive_that_was_there(
    hearing: Hearing, project: Project
) -> None:
    driven = hearing.view.result.inputs.log
    hearing.edit(moved(0.3), settle=False)
    assert hearing.view.hall is DrivenHall.DRIVING_AGAIN
    hearing.edit(lambda _: project)
    assert hearing.view.result.inputs.log is driven
    assert hearing.view.hall is DrivenHall.AS_DRIVEN


def test_of_many_edits_the_newest_is_driven(hearing: Hearing) -> None:
    for _ in range(4):
        hearing.edit(moved(0.1), settle=False)
    hearing.edit(moved(0.1))
    assert hearing.driven[-1] == hearing.state.project
    assert hearing.view.hall is DrivenHall.AS_DRIVEN


def test_where_it_cannot_be_driven_again_the_drive_of_before_stays_and_why_is_said(hearing: Hearing) -> None:
    driven = hearing.view.result.inputs.log
    hearing.refuse = True
    hearing.edit(longer)
    assert hearing.view.result.inputs.log is driven
    assert hearing.view.hall is DrivenHall.OTHER
    (told,) = (each for each in hearing.owner.posted if isinstance(each, Report))
    assert "too steep" in told.text
    assert "of before" in told.text


def test_a_route_that_is_gone_leaves_its_drive(hearing: Hearing) -> None:
    hearing.edit(lambda p: replace(p, routes=()))
    assert len(hearing.driven) == 1
    assert hearing.view.hall is DrivenHall.OTHER


def test_a_recording_stays_what_it_is(hearing: Hearing, tmp_path: Path) -> None:
    hearing.state = replace(hearing.state, reach=hearing.state.reach)
    hearing.do(LoadSource(RecordedDrive(tmp_path)))
    count = len(hearing.driven)
    hearing.edit(moved(0.3))
    assert len(hearing.driven) == count
    assert hearing.view.hall is DrivenHall.RECORDED


def test_what_was_covered_is_covered_again_at_the_same_time(hearing: Hearing) -> None:
    hearing.do(CoverFromHere(covered=True))
    hearing.edit(lambda p: replace(p, scanners=(replace(p.scanners[0], rate=2.0 * p.scanners[0].rate),)))
    first, second = hearing.view.result.inputs.segments
    assert (first.covered, second.covered) == (False, True)
    assert hearing.view.result.times[second.first] == pytest.approx(5.0, abs=0.11)


def test_a_reflector_that_is_moved_by_metres_does_not_lose_the_vehicle(hearing: Hearing) -> None:
    hearing.edit(moved(2.5))
    assert np.all(hearing.view.result.columns.modes == Mode.OPERATIONAL)


def test_the_switch_asks_for_the_hall_to_follow(project: Project) -> None:
    outcome = move_only_the_map(MoveOnlyTheMap(True), AppState(project=project, saved=project), PROGRAM)
    assert outcome.state.part(RunState).only_the_map
    assert outcome.effects == (DriveAgain(),)

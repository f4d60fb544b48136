"""What the page finds out about the site by itself while it is edited."""

import queue
from dataclasses import replace

import numpy as np
import pytest

from commission.app.base import reducer
from commission.app.base.actions import Action
from commission.app.base.jobs import JobReport, Jobs
from commission.app.base.state import AppState
from commission.app.editing import actions
from commission.app.editing.editor import ControlPoint
from commission.app.problems.inspection import Inspection
from commission.site.vehicle import TricycleVehicle
from commission.studies.violations import ViolationKind
from tests.app.sites import room

ME, OTHER = 1, 2
NAME = "There and back"


class Watch:
    """An inspection with its queue."""

    def __init__(self) -> None:
        project = room()
        self.reports: queue.SimpleQueue[JobReport] = queue.SimpleQueue()
        self.inspection = Inspection(Jobs(self.reports.put))
        self.state = AppState(project, project)
        self.do(actions.Join(ME), actions.Join(OTHER))

    def do(self, *wishes: Action) -> None:
        for wish in wishes:
            self.state = reducer.reduce(wish, self.state).state
        self.settle()

    def settle(self) -> None:
        """Follow the state until nothing is under way."""
        self.inspection.follow(self.state)
        while self.inspection.is_busy:
            assert self.inspection.hear(self.reports.get(timeout=20.0))
            self.inspection.follow(self.state)


@pytest.fixture
def watch():
    watch = Watch()
    yield watch
    watch.inspection.close()


def test_nothing_is_looked_along_while_no_route_is_selected(watch: Watch) -> None:
    assert dict(watch.inspection.profiles) == {}
    watch.do(actions.SelectControlPoint(ME, ControlPoint(NAME)))
    assert list(watch.inspection.profiles) == [NAME]
    assert watch.inspection.profiles[NAME].stops == 1
    watch.do(actions.Cancel(ME))
    assert dict(watch.inspection.profiles) == {}


def test_an_edit_of_the_route_changes_its_profile_and_another_edit_does_not(watch: Watch) -> None:
    watch.do(actions.SelectControlPoint(ME, ControlPoint(NAME)))
    before = watch.inspection.profiles[NAME]
    watch.do(actions.SelectReflectors(OTHER, ("R1",)), actions.DeleteSelected(OTHER))
    assert watch.inspection.profiles[NAME] is before
    watch.do(actions.PlaceControlPoint(ME, (1.0, 2.0)))
    assert watch.inspection.profiles[NAME].length > before.length + 0.9


def test_violations_appear_with_the_edit_that_makes_them_and_go_with_its_undo(watch: Watch) -> None:
    assert watch.inspection.violations == ()
    route = watch.state.project.routes[0]
    # The pillar of the room begins at x 7.5 m, y 3.5 m.
    watch.do(
        actions.SelectControlPoint(ME, ControlPoint(NAME, 0, len(route.segments[0].control_points) - 1)),
        actions.PlaceControlPoint(ME, (7.6, 3.6)),
    )
    assert {v.kind for v in watch.inspection.violations} >= {ViolationKind.WALL}
    assert any("cuts a wall" in problem.text for problem in watch.inspection.problems)
    watch.state = replace(watch.state, project=watch.state.undo[0].project)
    watch.settle()
    assert watch.inspection.violations == ()


def test_another_vehicle_is_asked_whether_it_can_drive_the_curves(watch: Watch) -> None:
    watch.do(actions.SelectControlPoint(ME, ControlPoint(NAME)))
    assert np.isinf(watch.inspection.profiles[NAME].largest_curvature)
    watch.do(actions.SetVehicle(TricycleVehicle(wheelbase=4.0, max_steering_deg=30.0), ME))
    assert watch.inspection.profiles[NAME].largest_curvature == pytest.approx(np.tan(np.radians(30.0)) / 4.0)
    assert {v.kind for v in watch.inspection.violations} >= {ViolationKind.CURVE}

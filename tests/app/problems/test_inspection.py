"""What the page finds out about the site by itself while it is edited."""

from dataclasses import replace

import numpy as np
import pytest

from commission.app.base.actions import Action, Envelope
from commission.app.base.state import AppState
from commission.app.editing import actions
from commission.app.editing.editor import ControlPoint
from commission.app.problems.inspection import Inspection
from commission.site.vehicle import TricycleVehicle
from commission.studies.violations import ViolationKind
from tests.app.asking import OTHER, after, by, joined
from tests.app.owning import Owner
from tests.app.sites import room

NAME = "There and back"


class Watch(Owner[Inspection]):
    """An inspection with its queue."""

    def __init__(self) -> None:
        project = room()
        self.state = joined(AppState(project=project, saved=project))
        super().__init__(Inspection, self.state)
        self.do()

    @property
    def inspection(self) -> Inspection:
        return self.service

    def do(self, *asked: Action | Envelope) -> None:
        self.state = after(self.state, *asked).state
        self.settle(self.state)


@pytest.fixture
def watch():
    watch = Watch()
    yield watch
    watch.close()


def test_nothing_is_looked_along_while_no_route_is_selected(watch: Watch) -> None:
    assert dict(watch.inspection.profiles) == {}
    watch.do(actions.SelectControlPoint(ControlPoint(NAME)))
    assert list(watch.inspection.profiles) == [NAME]
    assert watch.inspection.profiles[NAME].stops == 1
    watch.do(actions.Cancel())
    assert dict(watch.inspection.profiles) == {}


def test_an_edit_of_the_route_changes_its_profile_and_another_edit_does_not(watch: Watch) -> None:
    watch.do(actions.SelectControlPoint(ControlPoint(NAME)))
    before = watch.inspection.profiles[NAME]
    watch.do(by(OTHER, actions.SelectReflectors(("R1",))), by(OTHER, actions.DeleteSelected()))
    assert watch.inspection.profiles[NAME] is before
    watch.do(actions.PlaceControlPoint((1.0, 2.0)))
    assert watch.inspection.profiles[NAME].length > before.length + 0.9


def test_violations_appear_with_the_edit_that_makes_them_and_go_with_its_undo(watch: Watch) -> None:
    assert watch.inspection.violations == ()
    route = watch.state.project.routes[0]
    # The pillar of the room begins at x 7.5 m, y 3.5 m.
    watch.do(
        actions.SelectControlPoint(ControlPoint(NAME, 0, len(route.segments[0].control_points) - 1)),
        actions.PlaceControlPoint((7.6, 3.6)),
    )
    assert {v.kind for v in watch.inspection.violations} >= {ViolationKind.WALL}
    assert any("cuts a wall" in problem.text for problem in watch.inspection.problems)
    watch.state = replace(watch.state, project=watch.state.undo[0].project)
    watch.do()
    assert watch.inspection.violations == ()


def test_another_vehicle_is_asked_whether_it_can_drive_the_curves(watch: Watch) -> None:
    watch.do(actions.SelectControlPoint(ControlPoint(NAME)))
    assert np.isinf(watch.inspection.profiles[NAME].largest_curvature)
    watch.do(actions.SetVehicle(TricycleVehicle(wheelbase=4.0, max_steering_deg=30.0)))
    assert watch.inspection.profiles[NAME].largest_curvature == pytest.approx(np.tan(np.radians(30.0)) / 4.0)
    assert {v.kind for v in watch.inspection.violations} >= {ViolationKind.CURVE}


def test_too_few_reflectors_in_sight_become_problems_with_their_place_and_go_with_the_undo(watch: Watch) -> None:
    def told() -> list[str]:
        return [each.text for each in watch.inspection.problems if "in sight" in each.text and each.place is not None]

    before = told()
    every = tuple(each.id for each in watch.state.project.reflectors.reflectors)
    watch.do(by(OTHER, actions.SelectReflectors(every[1:])), by(OTHER, actions.DeleteSelected()))
    assert any(f"Route {NAME!r}: 1 reflector in sight" in text or "no reflectors in sight" in text for text in told())
    watch.state = replace(watch.state, project=watch.state.undo[-1].project)
    watch.do()
    assert told() == before

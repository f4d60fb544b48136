"""The planner with jobs that run at once: what it starts, follows and drops."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from commission.app.base.state import AppState
from commission.app.editing.editor import Drag, Editor, Grab, Snapping
from commission.app.plan import work
from commission.app.plan.planner import Planner
from commission.app.plan.settings import Figure, PlanSettings
from commission.app.plan.view import PlanView
from commission.site.project import Project
from commission.site.reflectors import ReflectorMap
from tests.app.asking import ME, joined
from tests.app.owning import Owner


class Bench(Owner[Planner]):
    """A planner and the queue of its jobs."""

    def __init__(self, project: Project) -> None:
        self.state = joined(AppState(project, project))
        super().__init__(Planner, self.state)

    @property
    def view(self) -> PlanView:
        return self.service.view

    def ask(self, **settings: object) -> None:
        self.state = self.state.with_part(replace(self.state.part(PlanSettings), **settings))
        self.service.follow(self.state)

    def move(self, index: int, dx: float) -> None:
        reflectors = list(self.state.project.reflectors.reflectors)
        reflectors[index] = replace(reflectors[index], x=reflectors[index].x + dx)
        project = replace(self.state.project, reflectors=ReflectorMap(tuple(reflectors)))
        self.state = replace(self.state, project=project)
        self.service.follow(self.state)

    def found(self) -> PlanView:
        """Hear every job out; return what there is then."""
        self.settle(self.state)
        return self.view


@pytest.fixture
def bench(project: Project) -> Iterator[Bench]:
    bench = Bench(project)
    yield bench
    bench.close()


def test_nothing_is_computed_that_nobody_wants(bench: Bench) -> None:
    bench.service.follow(bench.state)
    assert not bench.jobs.unfinished()
    assert bench.view.heat is None


def test_a_heatmap_and_the_values_under_a_click(bench: Bench) -> None:
    bench.ask(figure=Figure.VISIBLE)
    heat = bench.found().heat
    assert heat is not None
    assert heat.shares.sum() == pytest.approx(1.0)
    x, y = (float(value) for value in bench.state.project.routes[0].segments[0].control_points[0])
    bench.ask(probe=(x, y))
    reading = bench.view.reading
    assert reading is not None
    assert reading.on_floor
    assert reading.values[Figure.VISIBLE] > 0


def test_another_figure_of_the_same_coverage_needs_no_job(bench: Bench) -> None:
    bench.ask(figure=Figure.VISIBLE)
    bench.found()
    bench.ask(figure=Figure.POSITION_DOP)
    assert not bench.jobs.unfinished()
    assert bench.view.heat is not None
    assert bench.view.heat.scale.figure is Figure.POSITION_DOP


def test_a_moved_reflector_is_followed_at_once_and_equals_a_new_computation(bench: Bench) -> None:
    bench.ask(figure=Figure.POSITION_SIGMA)
    before = bench.found().heat
    bench.move(0, 0.7)
    after = bench.view.heat
    assert not bench.jobs.unfinished()
    assert before is not None
    assert after is not None
    assert np.any(before.classes != after.classes)
    afresh = work.cover(bench.state.project, bench.state.part(PlanSettings), lambda _fraction, _message: None)
    floor = afresh.live.coverage.floor
    expected = after.scale.classes(afresh.live.coverage.fixes.position_sigma, afresh.floor & floor)
    assert np.array_equal(after.classes.ravel(), expected)


def test_the_heatmap_follows_a_drag_before_it_is_an_edit(bench: Bench) -> None:
    bench.ask(figure=Figure.POSITION_SIGMA)
    before = bench.found().heat
    name = bench.state.project.reflectors.reflectors[0].id
    drag = Drag(Grab.REFLECTORS, (0.0, 0.0), (0.7, 0.0))
    bench.state = bench.state.with_browser(ME, Editor(selected=(name,), drag=drag, snapping=Snapping(walls=False)))
    assert bench.service.follow(bench.state)
    during = bench.view.heat
    assert not bench.service.follow(bench.state)
    bench.state = bench.state.with_browser(ME, Editor())
    bench.service.follow(bench.state)
    after = bench.view.heat
    assert before is not None
    assert during is not None
    assert after is not None
    assert np.any(before.classes != during.classes)
    assert np.array_equal(before.classes, after.classes)
    assert not bench.jobs.unfinished()


def test_what_is_not_wanted_any_more_is_dropped_and_its_job_cancelled(bench: Bench) -> None:
    bench.ask(figure=Figure.VISIBLE)
    bench.ask(figure=Figure.NONE)
    assert bench.found().heat is None


def test_other_conditions_are_computed_anew(bench: Bench) -> None:
    bench.ask(figure=Figure.VISIBLE)
    bench.found()
    bench.ask(min_beams=3)
    assert bench.view.heat is not None
    assert bench.view.heat.outdated
    heat = bench.found().heat
    assert heat is not None
    assert not heat.outdated


def test_a_route_is_predicted_and_predicted_anew_after_an_edit(bench: Bench) -> None:
    bench.ask(route=bench.state.project.routes[0].name)
    first = bench.found().route
    assert first is not None
    assert len(first.loads) == len(first.metres.metre)
    bench.move(0, 0.5)
    assert bench.view.route is not None
    assert bench.view.route.outdated
    second = bench.found().route
    assert second is not None
    assert not second.outdated
    assert second.prediction is not first.prediction


def test_reflectors_are_ranked_once_until_asked_again(bench: Bench) -> None:
    bench.ask(ranking=1)
    failures = bench.found().failures
    assert failures is not None
    assert set(failures.names) <= {r.id for r in bench.state.project.reflectors.reflectors}
    bench.ask(failed=failures.names[0])
    assert bench.view.failures is not None
    assert bench.view.failures.place is not None
    bench.move(0, 0.5)
    assert not bench.jobs.unfinished()
    assert bench.view.failures.outdated
    bench.ask(ranking=2)
    again = bench.found().failures
    assert again is not None
    assert not again.outdated


def test_default_settings_want_nothing() -> None:
    assert PlanSettings() == PlanSettings(figure=Figure.NONE, route="", ranking=0)

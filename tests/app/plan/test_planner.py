"""The planner with jobs that run at once: what it starts, follows and drops."""

import time
from collections.abc import Iterator
from dataclasses import replace
from queue import SimpleQueue

import numpy as np
import pytest

from commission.app.base.jobs import JobReport, Jobs
from commission.app.base.state import AppState
from commission.app.editing.editor import Drag, Editor, Grab, Snapping
from commission.app.plan import work
from commission.app.plan.planner import Planner
from commission.app.plan.settings import Figure, PlanSettings
from commission.app.plan.view import PlanView
from commission.site.project import Project
from commission.site.reflectors import ReflectorMap


class Bench:
    """A planner and the queue of its jobs."""

    def __init__(self, project: Project) -> None:
        self.queue: SimpleQueue[JobReport] = SimpleQueue()
        self.jobs = Jobs(self.queue.put)
        self.planner = Planner(self.jobs, self.jobs)
        self.state = AppState(project, project)

    def ask(self, **settings: object) -> None:
        self.state = replace(self.state, plan=replace(self.state.plan, **settings))
        self.planner.follow(self.state)

    def move(self, index: int, dx: float) -> None:
        reflectors = list(self.state.project.reflectors.reflectors)
        reflectors[index] = replace(reflectors[index], x=reflectors[index].x + dx)
        project = replace(self.state.project, reflectors=ReflectorMap(tuple(reflectors)))
        self.state = replace(self.state, project=project)
        self.planner.follow(self.state)

    def settle(self) -> PlanView:
        """Hear every job out, at most a minute: compilation included."""
        end = time.monotonic() + 60.0
        while self.jobs.unfinished() or not self.queue.empty():
            assert time.monotonic() < end
            self.planner.hear(self.queue.get(timeout=60.0))
            self.planner.follow(self.state)
        return self.planner.view


@pytest.fixture
def bench(project: Project) -> Iterator[Bench]:
    bench = Bench(project)
    yield bench
    bench.jobs.close()


def test_nothing_is_computed_that_nobody_wants(bench: Bench) -> None:
    bench.planner.follow(bench.state)
    assert not bench.jobs.unfinished()
    assert bench.planner.view.heat is None


def test_a_heatmap_and_the_values_under_a_click(bench: Bench) -> None:
    bench.ask(figure=Figure.VISIBLE)
    heat = bench.settle().heat
    assert heat is not None
    assert heat.shares.sum() == pytest.approx(1.0)
    x, y = (float(value) for value in bench.state.project.routes[0].segments[0].control_points[0])
    bench.ask(probe=(x, y))
    reading = bench.planner.view.reading
    assert reading is not None
    assert reading.on_floor
    assert reading.values[Figure.VISIBLE] > 0


def test_another_figure_of_the_same_coverage_needs_no_job(bench: Bench) -> None:
    bench.ask(figure=Figure.VISIBLE)
    bench.settle()
    bench.ask(figure=Figure.POSITION_DOP)
    assert not bench.jobs.unfinished()
    assert bench.planner.view.heat is not None
    assert bench.planner.view.heat.scale.figure is Figure.POSITION_DOP


def test_a_moved_reflector_is_followed_at_once_and_equals_a_new_computation(bench: Bench) -> None:
    bench.ask(figure=Figure.POSITION_SIGMA)
    before = bench.settle().heat
    bench.move(0, 0.7)
    after = bench.planner.view.heat
    assert not bench.jobs.unfinished()
    assert before is not None
    assert after is not None
    assert np.any(before.classes != after.classes)
    afresh = work.cover(bench.state.project, bench.state.plan, lambda _fraction, _message: None)
    floor = afresh.live.coverage.floor
    expected = after.scale.classes(afresh.live.coverage.fixes.position_sigma, afresh.floor & floor)
    assert np.array_equal(after.classes.ravel(), expected)


def test_the_heatmap_follows_a_drag_before_it_is_an_edit(bench: Bench) -> None:
    bench.ask(figure=Figure.POSITION_SIGMA)
    before = bench.settle().heat
    name = bench.state.project.reflectors.reflectors[0].id
    drag = Drag(Grab.REFLECTORS, (0.0, 0.0), (0.7, 0.0))
    bench.state = bench.state.with_editor(1, Editor(selected=(name,), drag=drag, snapping=Snapping(walls=False)))
    assert bench.planner.follow(bench.state)
    during = bench.planner.view.heat
    assert not bench.planner.follow(bench.state)
    bench.state = bench.state.with_editor(1, Editor())
    bench.planner.follow(bench.state)
    after = bench.planner.view.heat
    assert before is not None
    assert during is not None
    assert after is not None
    assert np.any(before.classes != during.classes)
    assert np.array_equal(before.classes, after.classes)
    assert not bench.jobs.unfinished()


def test_what_is_not_wanted_any_more_is_dropped_and_its_job_cancelled(bench: Bench) -> None:
    bench.ask(figure=Figure.VISIBLE)
    bench.ask(figure=Figure.NONE)
    assert bench.settle().heat is None


def test_other_conditions_are_computed_anew(bench: Bench) -> None:
    bench.ask(figure=Figure.VISIBLE)
    bench.settle()
    bench.ask(min_beams=3)
    assert bench.planner.view.heat is not None
    assert bench.planner.view.heat.outdated
    heat = bench.settle().heat
    assert heat is not None
    assert not heat.outdated


def test_a_route_is_predicted_and_predicted_anew_after_an_edit(bench: Bench) -> None:
    bench.ask(route=bench.state.project.routes[0].name)
    first = bench.settle().route
    assert first is not None
    assert len(first.loads) == len(first.metres.metre)
    bench.move(0, 0.5)
    assert bench.planner.view.route is not None
    assert bench.planner.view.route.outdated
    second = bench.settle().route
    assert second is not None
    assert not second.outdated
    assert second.prediction is not first.prediction


def test_reflectors_are_ranked_once_until_asked_again(bench: Bench) -> None:
    bench.ask(ranking=1)
    failures = bench.settle().failures
    assert failures is not None
    assert set(failures.names) <= {r.id for r in bench.state.project.reflectors.reflectors}
    bench.ask(failed=failures.names[0])
    assert bench.planner.view.failures is not None
    assert bench.planner.view.failures.place is not None
    bench.move(0, 0.5)
    assert not bench.jobs.unfinished()
    assert bench.planner.view.failures.outdated
    bench.ask(ranking=2)
    again = bench.settle().failures
    assert again is not None
    assert not again.outdated


def test_default_settings_want_nothing() -> None:
    assert PlanSettings() == PlanSettings(figure=Figure.NONE, route="", ranking=0)

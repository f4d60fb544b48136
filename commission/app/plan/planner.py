"""Keeps what the step Plan shows in step with the page's state: starts jobs, follows moved reflectors, makes the view.

Called by the owner thread alone; knows no widget.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from commission.app.ambiguity.cold_start import Ambiguity, look_alike
from commission.app.base.jobs import Lane
from commission.app.base.service import Context, Due, Service
from commission.app.base.state import AppState
from commission.app.coverage.ellipses import ellipses
from commission.app.coverage.scale import Scale, scale_for
from commission.app.editing.editor import Editor, Grab, editors_of
from commission.app.editing.gestures import moved
from commission.app.placement.suggestion import LayoutWish, Suggestion, suggest
from commission.app.plan import work
from commission.app.plan.keys import changed_reflectors, cold_start_key, floor_key, ranking_key, route_key
from commission.app.plan.looks import cold_start_view, failure_view, heat_view, layout_view, reading_of, route_view
from commission.app.plan.remembered import Remembered
from commission.app.plan.settings import PlanSettings
from commission.app.plan.upkeep import Upkeep, is_same
from commission.app.plan.view import ColdStartView, EllipseView, FailureView, HeatView, LayoutView, PlanView, RouteView
from commission.app.plan.work import Covered, Predicted, Ranked
from commission.site.project import Project

COVERAGE, PREDICTION, RANKING = "Coverage", "Route prediction", "What if one fails"
LAYOUT = "Suggested layout"
COLD_START = "Ambiguous places"
JOBS = (COVERAGE, PREDICTION, RANKING, COLD_START, LAYOUT)
"""Names of the jobs, as the page shows them."""


class Planner(Service):
    """Coverage, prediction and ranking of the site as it is now."""

    def __init__(self, context: Context) -> None:
        super().__init__(context)
        jobs = context.jobs
        self._coverage = Upkeep[Covered](COVERAGE, jobs)
        self._prediction = Upkeep[Predicted](PREDICTION, jobs)
        self._ranking = Upkeep[Ranked](RANKING, jobs)
        self._cold_start = Upkeep[Ambiguity](COLD_START, jobs, Lane.PATIENT)
        self._layout = Upkeep[Suggestion](LAYOUT, jobs, Lane.PATIENT)
        self._scale: Scale | None = None
        self._scaled: Covered | None = None
        self._view = PlanView()
        self._ellipse_view = Remembered[EllipseView]()
        self._route_view = Remembered[RouteView]()
        self._failure_view = Remembered[FailureView]()
        self._cold_start_view = Remembered[ColdStartView]()
        self._layout_view = Remembered[LayoutView]()
        self._shown: tuple[object, ...] = ()
        self._moves = 0
        self._drag: tuple[Project, tuple[Editor, ...], Project] | None = None

    @property
    def view(self) -> PlanView:
        """What there is now; the same value as long as nothing changes."""
        return self._view

    def parts(self, *, slowly: bool) -> tuple[object, ...]:  # noqa: ARG002 - the protocol's
        """Return what there is now."""
        return (self._view,)

    def follow(self, state: AppState) -> Due:
        """Start what is wanted and not there, drop what is not wanted."""
        project, plan = state.project, state.part(PlanSettings)
        floor = self._dragged(state)
        self._keep_coverage(floor, plan)
        if plan.route and any(route.name == plan.route for route in project.routes):
            self._prediction.keep(route_key(project, plan), lambda progress: work.predict(project, plan, progress))
        else:
            self._prediction.drop()
        if plan.ranking:
            self._keep_ranking(project, plan)
        else:
            self._ranking.drop()
        self._keep_patiently(state)
        shown = (
            *(part for each in self._all() for part in (each.result, each.is_running)),
            self._moves,
            plan,
            state.part(LayoutWish),
            project,
            floor,
        )
        if len(shown) == len(self._shown) and all(a is b for a, b in zip(shown, self._shown, strict=True)):
            return Due.NEVER
        self._shown = shown
        self._view = self._look(floor, state)
        return Due.SOON

    def _dragged(self, state: AppState) -> Project:
        """Return the site with reflectors where they are being dragged to: the heatmap shows what a drag would do."""
        editors = tuple(e for e in editors_of(state) if e.drag is not None and e.drag.grab is Grab.REFLECTORS)
        if not editors:
            self._drag = None
            return state.project
        if self._drag is None or self._drag[0] is not state.project or self._drag[1] != editors:
            floor = state.project
            for editor in editors:
                floor = replace(floor, reflectors=moved(floor, editor))
            self._drag = (state.project, editors, floor)
        return self._drag[2]

    def _all(self) -> tuple[Upkeep[Any], ...]:
        return self._coverage, self._prediction, self._ranking, self._cold_start, self._layout

    def _keep_coverage(self, project: Project, plan: PlanSettings) -> None:
        """Follow moved reflectors at once, anything else by a job."""
        if not plan.figure:
            self._coverage.drop()
            self._scale = None
            return
        key = floor_key(project, plan)
        before, covered = self._coverage.key, self._coverage.result
        if covered is not None and is_same(key[1:], before[1:]) and key[0] is not before[0]:
            changed = changed_reflectors(covered.live.reflectors, project.reflectors)
            if changed is not None:
                self._coverage.key = key
                self._moves += 1
                for index in changed:
                    covered.live.move(index, project.reflectors.reflectors[index])
        self._coverage.keep(key, lambda progress: work.cover(project, plan, progress))

    def _keep_ranking(self, project: Project, plan: PlanSettings) -> None:
        """Rank once; after an edit the ranking is outdated until it is asked for again, since it takes long."""
        if self._ranking.result is None or self._ranking.key[-2:] != (plan.failure.value, plan.ranking):
            before = self._ranking.result
            known = None if before is None else before.drives
            self._ranking.keep(ranking_key(project, plan), lambda progress: work.rank(project, plan, progress, known))

    def _keep_patiently(self, state: AppState) -> None:
        """Do what takes long once: other wishes and other sites wait until it is asked for again."""
        project, plan, wish = state.project, state.part(PlanSettings), state.part(LayoutWish)
        if not plan.cold_start:
            self._cold_start.drop()
        elif self._cold_start.key[:1] != (plan.cold_start,):
            key = (plan.cold_start, *cold_start_key(project, plan))
            self._cold_start.keep(key, lambda progress: look_alike(project, plan, progress))
        if wish.wanted:
            self._layout.ask((wish.asked,), lambda progress: suggest(project, wish, progress))
        else:
            self._layout.drop()

    def _look(self, floor: Project, state: AppState) -> PlanView:
        """Put the view together; parts that did not change stay the same value."""
        project, plan = state.project, state.part(PlanSettings)
        covered, predicted, ranked = self._coverage.result, self._prediction.result, self._ranking.result
        ambiguity, suggestion = self._cold_start.result, self._layout.result
        old_route = not is_same(self._prediction.key, route_key(project, plan))
        old_ranking = not is_same(self._ranking.key[:-1], ranking_key(project, plan)[:-1])
        old_places = not is_same(self._cold_start.key[1:], cold_start_key(project, plan))
        return PlanView(
            heat=None if covered is None or not plan.figure else self._heat(covered, floor, plan),
            reading=None if covered is None or plan.probe is None else reading_of(covered, plan.probe),
            ellipses=self._ellipse_view.of(
                (covered, self._moves, plan.spots, plan.ellipse_grid, plan.ellipse_factor),
                lambda: covered and ellipses(covered, plan.spots, plan.ellipse_factor, grid=plan.ellipse_grid),
            ),
            route=self._route_view.of(
                (predicted, old_route), lambda: predicted and route_view(predicted, outdated=old_route)
            ),
            failures=self._failure_view.of(
                (ranked, plan.failed, old_ranking),
                lambda: ranked and failure_view(ranked, plan.failed, outdated=old_ranking),
            ),
            cold_start=self._cold_start_view.of(
                (ambiguity, plan.pair, bool(plan.figure), old_places),
                lambda: ambiguity and cold_start_view(ambiguity, plan, outdated=old_places),
            ),
            layout=self._layout_view.of(
                (suggestion, project, state.part(LayoutWish)),
                lambda: suggestion and layout_view(suggestion, project, state.part(LayoutWish)),
            ),
            waiting=any(each.is_running for each in self._all()),
        )

    def _heat(self, covered: Covered, floor: Project, plan: PlanSettings) -> HeatView:
        """The heatmap; its scale stays while reflectors move, so that colors compare."""
        if self._scale is None or self._scale.figure is not plan.figure or self._scaled is not covered:
            self._scaled = covered
            values = getattr(covered.live.coverage.fixes, plan.figure.value)
            self._scale = scale_for(plan.figure, values[covered.floor])
        return heat_view(covered, self._scale, outdated=not is_same(self._coverage.key, floor_key(floor, plan)))

"""Keeps what the step Plan shows in step with the page's state: starts jobs, follows moved reflectors, makes the view.

Called by the owner thread alone; knows no widget.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from commission.app.editing.editor import Editor, Grab
from commission.app.editing.gestures import moved
from commission.app.jobs import JobReport, Jobs
from commission.app.plan import work
from commission.app.plan.scale import FIRST, NO_FIX, QUANTITIES, Scale, scale_for
from commission.app.plan.settings import PlanSettings
from commission.app.plan.upkeep import Key, Upkeep, is_same
from commission.app.plan.view import FailureView, HeatView, PlanView, Reading, RouteView, stretches
from commission.app.plan.work import Covered, Predicted, Ranked
from commission.app.store import AppState
from commission.geometry.arrays import FloatArray
from commission.site.project import Project
from commission.site.reflectors import ReflectorMap

COVERAGE, PREDICTION, RANKING = "Coverage", "Route prediction", "What if one fails"
MOST_MOVED = 12
"""Reflectors that are moved one by one; the floor is computed anew when more have changed."""


class Planner:
    """Coverage, prediction and ranking of the site as it is now.

    Parameters
    ----------
    jobs : where they are computed.
    """

    def __init__(self, jobs: Jobs) -> None:
        self._coverage = Upkeep(COVERAGE, Covered, jobs)
        self._prediction = Upkeep(PREDICTION, Predicted, jobs)
        self._ranking = Upkeep(RANKING, Ranked, jobs)
        self._scale: Scale | None = None
        self._view = PlanView()
        self._shown: tuple[object, ...] = ()
        self._moves = 0
        self._drag: tuple[Project, tuple[Editor, ...], Project] | None = None

    @property
    def view(self) -> PlanView:
        """What there is now; the same value as long as nothing changes."""
        return self._view

    def hear(self, report: JobReport) -> bool:
        """Take the end of a job; return whether it was one of the planner's."""
        if self._coverage.hear(report):
            self._scale = None
            return True
        return self._prediction.hear(report) or self._ranking.hear(report)

    def follow(self, state: AppState) -> bool:
        """Start what is wanted and not there, drop what is not wanted; return whether the view is another one."""
        project, plan = state.project, state.plan
        floor = self._dragged(state)
        self._keep_coverage(floor, plan)
        if plan.route and any(route.name == plan.route for route in project.routes):
            self._prediction.keep(_route_key(project, plan), lambda progress: work.predict(project, plan, progress))
        else:
            self._prediction.drop()
        if plan.ranking:
            self._keep_ranking(project, plan)
        else:
            self._ranking.drop()
        shown = (
            *(part for each in self._all() for part in (each.result, each.is_running)),
            self._moves,
            plan,
            project,
            floor,
        )
        if len(shown) == len(self._shown) and all(a is b for a, b in zip(shown, self._shown, strict=True)):
            return False
        self._shown = shown
        self._view = self._look(project, floor, plan)
        return True

    def _dragged(self, state: AppState) -> Project:
        """Return the site with reflectors where they are being dragged to: the heatmap shows what a drag would do."""
        editors = tuple(e for e in state.editors.values() if e.drag is not None and e.drag.grab is Grab.REFLECTORS)
        if not editors:
            self._drag = None
            return state.project
        if self._drag is None or self._drag[0] is not state.project or self._drag[1] != editors:
            floor = state.project
            for editor in editors:
                floor = replace(floor, reflectors=moved(floor, editor))
            self._drag = (state.project, editors, floor)
        return self._drag[2]

    def _all(self) -> tuple[Upkeep[Covered], Upkeep[Predicted], Upkeep[Ranked]]:
        return self._coverage, self._prediction, self._ranking

    def _keep_coverage(self, project: Project, plan: PlanSettings) -> None:
        """Follow moved reflectors at once, anything else by a job."""
        if not plan.figure:
            self._coverage.drop()
            self._scale = None
            return
        key = _floor_key(project, plan)
        before, covered = self._coverage.key, self._coverage.result
        if covered is not None and is_same(key[1:], before[1:]) and key[0] is not before[0]:
            changed = _changed(covered.live.reflectors, project.reflectors)
            if changed is not None:
                self._coverage.key = key
                self._moves += 1
                for index in changed:
                    covered.live.move(index, project.reflectors.reflectors[index])
        self._coverage.keep(key, lambda progress: work.cover(project, plan, progress))

    def _keep_ranking(self, project: Project, plan: PlanSettings) -> None:
        """Rank once; after an edit the ranking is outdated until it is asked for again, since it takes long."""
        if self._ranking.result is None or self._ranking.key[-2:] != (plan.failure.value, plan.ranking):
            self._ranking.keep(_ranking_key(project, plan), lambda progress: work.rank(project, plan, progress))

    def _look(self, project: Project, floor: Project, plan: PlanSettings) -> PlanView:
        return PlanView(
            self._heat(floor, plan),
            self._reading(plan),
            self._route(project, plan),
            self._failures(project, plan),
            any(each.is_running for each in self._all()),
        )

    def _heat(self, project: Project, plan: PlanSettings) -> HeatView | None:
        """Sort the figure into its classes; the scale stays while reflectors move, so that colors compare."""
        covered = self._coverage.result
        if covered is None or not plan.figure:
            return None
        lattice = covered.live.coverage.lattice
        values = getattr(covered.live.coverage.fixes, plan.figure.value)
        if self._scale is None or self._scale.figure is not plan.figure:
            self._scale = scale_for(plan.figure, values[covered.floor])
        classes = self._scale.classes(values, covered.floor)
        counts = np.bincount(classes, minlength=FIRST + len(self._scale.bounds) + 1)[NO_FIX:]
        return HeatView(
            lattice,
            self._scale,
            classes.reshape(lattice.rows, lattice.columns),
            counts / max(1, counts.sum()),
            not is_same(self._coverage.key, _floor_key(project, plan)),
        )

    def _reading(self, plan: PlanSettings) -> Reading | None:
        covered = self._coverage.result
        if covered is None or plan.probe is None:
            return None
        index = covered.live.coverage.lattice.index_near(*plan.probe)
        if index is None:
            return None
        fixes = covered.live.coverage.fixes
        values = {figure: float(getattr(fixes, figure.value)[index]) for figure in QUANTITIES}
        return Reading(plan.probe, values, bool(covered.floor[index]))

    def _route(self, project: Project, plan: PlanSettings) -> RouteView | None:
        predicted = self._prediction.result
        if predicted is None:
            return None
        prediction = predicted.prediction
        metres = prediction.per_metre()
        outdated = not is_same(self._prediction.key, _route_key(project, plan))
        return RouteView(
            str(self._prediction.key[-1]),
            prediction,
            metres,
            np.maximum.reduceat(prediction.load, metres.first),
            outdated,
        )

    def _failures(self, project: Project, plan: PlanSettings) -> FailureView | None:
        ranked = self._ranking.result
        if ranked is None:
            return None
        reflectors = ranked.reflectors
        names = tuple(reflectors.reflectors[each.reflector].id for each in ranked.ranking)
        chosen = ranked.ranking[names.index(plan.failed)] if plan.failed in names else None
        place, failing = None, list[FloatArray]()
        if chosen is not None:
            reflector = reflectors.reflectors[chosen.reflector]
            place = (reflector.x, reflector.y)
            for planned, part in zip(ranked.planned, chosen.routes, strict=True):
                fails = np.isin(planned.drive.metres.astype(np.int64), part.metres)
                failing.extend(stretches(planned.drive.poses[:, :2], fails))
        outdated = not is_same(self._ranking.key[:-1], _ranking_key(project, plan)[:-1])
        return FailureView(ranked.ranking, names, chosen, place, tuple(failing), outdated)


def _floor_key(project: Project, plan: PlanSettings) -> Key:
    return (
        project.reflectors,
        project.floor_map,
        project.scanner,
        project.parameters.observation,
        project.parameters.odometry,
        plan.heading.value,
        plan.given_heading,
        plan.measurement.value,
        plan.on_odometry,
        plan.blocked_per_m,
        plan.min_beams,
    )


def _site_key(project: Project, plan: PlanSettings) -> Key:
    """What predictions depend on besides the route."""
    return (
        project.reflectors,
        project.floor_map,
        project.scanner,
        project.vehicle,
        project.parameters,
        project.routes,
        plan.blocked_per_m,
        plan.min_beams,
    )


def _route_key(project: Project, plan: PlanSettings) -> Key:
    return (*_site_key(project, plan), plan.route)


def _ranking_key(project: Project, plan: PlanSettings) -> Key:
    return (*_site_key(project, plan), plan.failure.value, plan.ranking)


def _changed(before: ReflectorMap, after: ReflectorMap) -> list[int] | None:
    """Indices of the reflectors that changed; none when there are other ones, or too many."""
    if len(before) != len(after):
        return None
    pairs = zip(before.reflectors, after.reflectors, strict=True)
    changed = [index for index, (old, new) in enumerate(pairs) if old != new]
    return changed if len(changed) <= MOST_MOVED else None

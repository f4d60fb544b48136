"""Keeps the heatmap in step with the page's state: starts its job, follows moved reflectors, makes the view."""

from __future__ import annotations

from dataclasses import replace

from commission.app.base.conditions import Conditions
from commission.app.base.kept import Kept
from commission.app.base.memo import Memo
from commission.app.base.service import Context, Due, Service
from commission.app.base.state import AppState
from commission.app.coverage.ellipses import ellipses
from commission.app.coverage.following import Covered, cover
from commission.app.coverage.scale import Scale, scale_for
from commission.app.coverage.settings import CoverageSettings, Figure, shown_figure
from commission.app.coverage.view import CoverageView, EllipseView, HeatView, heat_view, reading_of
from commission.app.editing.editor import Editor, Grab, editors_of
from commission.app.editing.gestures import moved
from commission.site.project import Project
from commission.studies.coverage import CoverageInput

COVERAGE = "Coverage"
"""Name of the job."""


class CoverageService(Service):
    """Coverage of the site as it is now, or as a drag would make it."""

    def __init__(self, context: Context) -> None:
        super().__init__(context)
        self._kept = Kept[CoverageInput, Covered](COVERAGE, context.jobs)
        self._scale: Scale | None = None
        self._scaled: Covered | None = None
        self._moves = 0
        self._drag: tuple[Project, tuple[Editor, ...], Project] | None = None
        self._heat = Memo[HeatView]()
        self._ellipses = Memo[EllipseView]()
        self._memo = Memo[CoverageView]()
        self.view = CoverageView()
        """What there is now; the same value as long as nothing changes."""

    def parts(self, *, slowly: bool) -> tuple[object, ...]:  # noqa: ARG002 - the protocol's
        """Return what there is now."""
        return (self.view,)

    def follow(self, state: AppState) -> Due:
        """Start what is wanted and not there, drop what is not wanted."""
        figure, settings = shown_figure(state), state.part(CoverageSettings)
        if figure:
            outdated = not self._kept_up(
                CoverageInput.of(self._dragged(state), settings.options(state.part(Conditions)))
            )
        else:
            self._kept.drop()
            outdated = False
        before, covered = self.view, self._kept.result
        key = (covered, self._moves, figure, outdated, settings)
        self.view = self._memo.of(key, lambda: self._look(figure, settings, outdated=outdated)) or before
        return Due.NEVER if self.view is before else Due.SOON

    def _kept_up(self, inputs: CoverageInput) -> bool:
        """Follow moved reflectors at once, anything else by a job; return whether the figures are of now."""
        covered, before = self._kept.result, self._kept.inputs
        if covered is not None and before is not None and before != inputs and covered.follow(before, inputs):
            self._kept.follow(inputs)
            self._moves += 1
        self._kept.keep(inputs, lambda progress: cover(inputs, progress))
        return self._kept.is_of(inputs)

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

    def _look(self, figure: Figure, settings: CoverageSettings, *, outdated: bool) -> CoverageView:
        """Put the view together; parts that did not change stay the same value."""
        covered = self._kept.result
        if covered is None:
            return CoverageView()
        return CoverageView(
            heat=self._heat.of(
                (covered, self._moves, figure, outdated),
                lambda: heat_view(covered, self._scale_of(covered, figure), outdated=outdated),
            ),
            reading=None if settings.probe is None else reading_of(covered, settings.probe),
            ellipses=self._ellipses.of(
                (covered, self._moves, settings.spots, settings.ellipse_grid, settings.ellipse_factor),
                lambda: ellipses(covered, settings.spots, settings.ellipse_factor, grid=settings.ellipse_grid),
            ),
        )

    def _scale_of(self, covered: Covered, figure: Figure) -> Scale:
        """The scale stays while reflectors move, so that colors compare."""
        if self._scale is None or self._scale.figure is not figure or self._scaled is not covered:
            self._scaled = covered
            self._scale = scale_for(figure, covered.values(figure)[covered.floor])
        return self._scale

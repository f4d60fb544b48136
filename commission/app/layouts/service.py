"""Finds out what the layout of now and the one beside it come to, in the background, and makes the view."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

from commission.app.base.actions import Report
from commission.app.base.conditions import Conditions
from commission.app.base.floor_picture import FloorPicture
from commission.app.base.jobs import Job, Lane
from commission.app.base.memo import Memo
from commission.app.base.service import Context, Due, Service
from commission.app.base.state import AppState
from commission.app.layouts.difference import DifferenceView, difference_view
from commission.app.layouts.state import NAME, KeptLayout, LayoutsState, ShownDifference
from commission.app.layouts.view import LayoutsView
from commission.errors import UsageError
from commission.progress import Progress
from commission.studies.layouts import FloorFigure, LayoutInput, LayoutResult, floor_difference, layout

Found: TypeAlias = tuple[LayoutResult | None, LayoutResult | None]
"""What the kept layout comes to, and the one of now; none where that is not known yet."""
COMPARING = "Comparing layouts"
"""Name of the job."""
MOST_RESULTS = 8
"""Results that are remembered: switching and undoing bring back what is known already."""


class LayoutsService(Service):
    """What was found out of each layout, by the input of its study."""

    def __init__(self, context: Context) -> None:
        super().__init__(context)
        self._results: dict[LayoutInput, LayoutResult] = {}
        self._failed: set[LayoutInput] = set()
        self._running: LayoutInput | None = None
        self._looked_up: tuple[tuple[LayoutInput, LayoutInput], Found] | None = None
        self._inputs = Memo[tuple[LayoutInput, LayoutInput]]()
        self._newest: LayoutResult | None = None
        self._difference = Memo[tuple[DifferenceView | None, str]]()
        self._memo = Memo[LayoutsView]()
        self.view: LayoutsView | None = None
        """What there is now; the same value as long as nothing changes."""

    def parts(self, *, slowly: bool) -> tuple[object, ...]:  # noqa: ARG002 - the protocol's
        """Return what there is now."""
        return () if self.view is None else (self.view,)

    def follow(self, state: AppState) -> Due:
        """Study the layout that is not known yet, the kept one first; forget everything where none is compared."""
        before, part = self.view, state.part(LayoutsState)
        kept = part.compared(state.project.reflectors)
        if kept is None:
            self._forget()
        else:
            self.view = self._compared(state, kept, part.figure)
        return Due.NEVER if self.view is before else Due.SOON

    def _compared(self, state: AppState, kept: KeptLayout, figure: ShownDifference) -> LayoutsView | None:
        """Put the view together; parts that did not change stay the same value."""
        conditions, project = state.part(Conditions), state.project

        def inputs() -> tuple[LayoutInput, LayoutInput]:
            given = conditions.prediction, conditions.visibility
            return LayoutInput.of(project, kept.reflectors, *given), LayoutInput.of(project, None, *given)

        wanted = self._inputs.of((project, kept, conditions), inputs)
        if wanted is None:
            return None
        before, now = self._known(wanted)
        self._newest = after = now or self._newest
        outdated = (before is None or now is None) and self._running is not None
        asked = figure if state.part(FloorPicture).is_free_for(NAME) else ShownDifference.NONE
        shown = self._difference.of((before, after, asked), lambda: _difference(before, after, asked))
        difference, no_floor = shown or (None, "")
        return self._memo.of(
            (kept, project.reflectors, before, after, outdated, difference, no_floor),
            lambda: LayoutsView(
                kept=kept,
                now=project.reflectors,
                before=before,
                after=after,
                outdated=outdated,
                difference=difference,
                no_floor=no_floor,
            ),
        )

    def _known(self, wanted: tuple[LayoutInput, LayoutInput]) -> Found:
        """Return what is known of both, and study what is not; a job under way goes on, and another one follows.

        To find a result takes 20 ms with 120 reflectors, since its input is its key; a picture has no time for that.
        """
        if self._looked_up is not None and self._looked_up[0] is wanted:
            return self._looked_up[1]
        found = self._results.get(wanted[0]), self._results.get(wanted[1])
        missing = next((each for each in wanted if each not in self._results and each not in self._failed), None)
        if missing is not None and self._running is None:
            self._study(missing)
        self._looked_up = wanted, found
        return found

    def _study(self, missing: LayoutInput) -> None:
        """Start the job; few results are remembered."""
        self._running = missing
        kept = [*self._results][-MOST_RESULTS:]
        self._results = {inputs: self._results[inputs] for inputs in kept}
        self.context.jobs.start(
            COMPARING,
            _work(missing),
            then=lambda result: self._take(missing, result),
            failed=lambda job: self._fail(missing, job),
            stopped=lambda: self._stop(missing),
            lane=Lane.PATIENT,
        )

    def _take(self, inputs: LayoutInput, result: LayoutResult) -> None:
        self._running, self._looked_up = None, None
        self._results[inputs] = result

    def _stop(self, inputs: LayoutInput) -> None:
        """What was stopped or has failed is not tried again until something changes."""
        self._running, self._looked_up = None, None
        self._failed = {inputs}

    def _fail(self, inputs: LayoutInput, job: Job) -> Report:
        self._stop(inputs)
        return Report(f"{job.name}: {job.error}")

    def _forget(self) -> None:
        """Nothing is compared: stop the job and free the memory."""
        if self._running is not None:
            self.context.jobs.cancel(COMPARING)
        self._results, self._running, self._newest, self.view = {}, None, None, None
        self._failed, self._looked_up = set(), None


def _work(inputs: LayoutInput) -> Callable[[Progress], LayoutResult]:
    return lambda progress: layout(inputs, progress)


def _difference(
    before: LayoutResult | None, after: LayoutResult | None, asked: ShownDifference
) -> tuple[DifferenceView | None, str]:
    """What the floor shows, or why it cannot."""
    if before is None or after is None or asked is ShownDifference.NONE:
        return None, ""
    try:
        return difference_view(floor_difference(after, before, FloorFigure(asked.value))), ""
    except UsageError as error:
        return None, str(error)

"""Looks for a layout when it is asked for, and makes the view."""

from __future__ import annotations

import threading

from commission.app.base.jobs import Lane
from commission.app.base.kept import Kept
from commission.app.base.memo import Memo
from commission.app.base.service import Context, Due, Service
from commission.app.base.state import AppState
from commission.app.placement.view import LayoutView, layout_view
from commission.app.placement.wish import LayoutWish
from commission.errors import JobCancelled
from commission.progress import Progress
from commission.studies.placement import PlacementInput, PlacementResult, placement

LAYOUT = "Suggested layout"
"""Name of the job."""


class PlacementService(Service):
    """The layout that was asked for last."""

    def __init__(self, context: Context) -> None:
        super().__init__(context)
        self._kept = Kept[PlacementInput, PlacementResult](LAYOUT, context.jobs, Lane.PATIENT)
        self._asked = 0
        self._enough = threading.Event()
        self._memo = Memo[LayoutView]()
        self.view: LayoutView | None = None
        """What there is now; the same value as long as nothing changes."""

    def parts(self, *, slowly: bool) -> tuple[object, ...]:  # noqa: ARG002 - the protocol's
        """Return what there is now."""
        return () if self.view is None else (self.view,)

    def follow(self, state: AppState) -> Due:
        """Look once for each time that it is asked for; what was found before is dropped then."""
        wish, before = state.part(LayoutWish), self.view
        inputs = wish.inputs
        if inputs is None or wish.asked != self._asked:
            self._asked = wish.asked
            self._kept.drop()
            self._enough = threading.Event()
        if inputs is not None:
            enough = self._enough
            self._kept.ask(wish.asked, inputs, lambda progress: placement(inputs, _until(enough, progress)))
            if wish.enough == wish.asked:
                enough.set()
        found, project = self._kept.result, state.project
        self.view = self._memo.of((found, project, wish), lambda: found and layout_view(found, project, wish))
        return Due.NEVER if self.view is before else Due.SOON


def _until(enough: threading.Event, progress: Progress) -> Progress:
    """Progress that ends the search, which then gives the best layout that it has, when somebody has had enough."""

    def of_search(fraction: float, message: str, /) -> None:
        if enough.is_set():
            raise JobCancelled("the search was ended")
        progress(fraction, message)

    return of_search

"""Looks for ambiguous places when it is asked for, and makes the view."""

from __future__ import annotations

from commission.app.ambiguity.cold_start import AmbiguousFloor, look_alike
from commission.app.ambiguity.settings import NAME, AmbiguitySettings
from commission.app.ambiguity.view import ColdStartView, cold_start_view
from commission.app.base.conditions import Conditions
from commission.app.base.floor_picture import FloorPicture
from commission.app.base.jobs import Lane
from commission.app.base.kept import Kept
from commission.app.base.memo import Memo
from commission.app.base.service import Context, Due, Service
from commission.app.base.state import AppState
from commission.planning.ambiguity import AmbiguityOptions
from commission.studies.ambiguity import AmbiguityInput

COLD_START = "Ambiguous places"
"""Name of the job."""


class AmbiguityService(Service):
    """The places that were asked for last: after an edit they are outdated until they are asked for again."""

    def __init__(self, context: Context) -> None:
        super().__init__(context)
        self._kept = Kept[AmbiguityInput, AmbiguousFloor](COLD_START, context.jobs, Lane.PATIENT)
        self._memo = Memo[ColdStartView]()
        self.view: ColdStartView | None = None
        """What there is now; the same value as long as nothing changes."""

    def parts(self, *, slowly: bool) -> tuple[object, ...]:  # noqa: ARG002 - the protocol's
        """Return what there is now."""
        return () if self.view is None else (self.view,)

    def follow(self, state: AppState) -> Due:
        """Look once for each time that it is asked for."""
        settings, before, outdated = state.part(AmbiguitySettings), self.view, False
        if settings.asked:
            inputs = _inputs(state, settings)
            self._kept.ask(settings.asked, inputs, lambda progress: look_alike(inputs, progress))
            outdated = not self._kept.is_of(inputs)
        else:
            self._kept.drop()
        found, is_drawn = self._kept.result, state.part(FloorPicture).is_free_for(NAME)
        self.view = self._memo.of(
            (found, settings.pair, is_drawn, outdated),
            lambda: found and cold_start_view(found, settings.pair, is_drawn=is_drawn, outdated=outdated),
        )
        return Due.NEVER if self.view is before else Due.SOON


def _inputs(state: AppState, settings: AmbiguitySettings) -> AmbiguityInput:
    """Return what ambiguous places depend on."""
    options = AmbiguityOptions(tolerance=settings.tolerance)
    return AmbiguityInput.of(state.project, options, visibility=state.part(Conditions).visibility)

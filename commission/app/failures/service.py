"""Ranks the reflectors when it is asked for, and makes the view."""

from __future__ import annotations

from commission.app.base.conditions import Conditions
from commission.app.base.kept import Kept
from commission.app.base.memo import Memo
from commission.app.base.service import Context, Due, Service
from commission.app.base.state import AppState
from commission.app.failures.settings import FailureSettings
from commission.app.failures.view import FailureView, failure_view
from commission.studies.failures import FailuresInput, FailuresResult, failures

RANKING = "What if one fails"
"""Name of the job."""


class FailureService(Service):
    """The ranking that was asked for last: after an edit it is outdated until it is asked for again."""

    def __init__(self, context: Context) -> None:
        super().__init__(context)
        self._kept = Kept[FailuresInput, FailuresResult](RANKING, context.jobs)
        self._memo = Memo[FailureView]()
        self.view: FailureView | None = None
        """What there is now; the same value as long as nothing changes."""

    def parts(self, *, slowly: bool) -> tuple[object, ...]:  # noqa: ARG002 - the protocol's
        """Return what there is now."""
        return () if self.view is None else (self.view,)

    def follow(self, state: AppState) -> Due:
        """Rank once for each time that it is asked for."""
        settings, before, outdated = state.part(FailureSettings), self.view, False
        if settings.ranking:
            inputs, known = _inputs(state, settings), self._kept.result and self._kept.result.drives
            request = (settings.failure, settings.ranking)
            self._kept.ask(request, inputs, lambda progress: failures(inputs, progress, known))
            outdated = not self._kept.is_of(inputs)
        else:
            self._kept.drop()
        found = self._kept.result
        self.view = self._memo.of(
            (found, settings.failed, outdated),
            lambda: found and failure_view(found, settings.failed, outdated=outdated),
        )
        return Due.NEVER if self.view is before else Due.SOON


def _inputs(state: AppState, settings: FailureSettings) -> FailuresInput:
    """Return what a ranking depends on."""
    conditions = state.part(Conditions)
    return FailuresInput.of(
        state.project,
        settings.failure,
        settings.fallen,
        prediction=conditions.prediction,
        visibility=conditions.visibility,
    )

"""Keeps the prediction along the chosen route in step with the page's state: starts its job, makes the view."""

from __future__ import annotations

from commission.app.base.conditions import Conditions
from commission.app.base.kept import Kept
from commission.app.base.memo import Memo
from commission.app.base.service import Context, Due, Service
from commission.app.base.state import AppState
from commission.app.prediction.settings import PredictionSettings
from commission.app.prediction.view import RouteView, route_view
from commission.studies.prediction import PredictionInput, PredictionResult, prediction

PREDICTION = "Route prediction"
"""Name of the job."""


class PredictionService(Service):
    """The prediction of the site as it is now."""

    def __init__(self, context: Context) -> None:
        super().__init__(context)
        self._kept = Kept[PredictionInput, PredictionResult](PREDICTION, context.jobs)
        self._memo = Memo[RouteView]()
        self.view: RouteView | None = None
        """What there is now; the same value as long as nothing changes."""

    def parts(self, *, slowly: bool) -> tuple[object, ...]:  # noqa: ARG002 - the protocol's
        """Return what there is now."""
        return () if self.view is None else (self.view,)

    def follow(self, state: AppState) -> Due:
        """Predict the route anew whenever what its prediction depends on has changed."""
        inputs = _inputs(state)
        if inputs is None:
            self._kept.drop()
        else:
            self._kept.keep(inputs, lambda progress: prediction(inputs, progress))
        before, found = self.view, self._kept.result
        outdated = inputs is not None and not self._kept.is_of(inputs)
        self.view = self._memo.of((found, outdated), lambda: found and route_view(found, outdated=outdated))
        return Due.NEVER if self.view is before else Due.SOON


def _inputs(state: AppState) -> PredictionInput | None:
    """Return what the prediction depends on; none where none is wanted, or its route is gone."""
    name, conditions = state.part(PredictionSettings).route, state.part(Conditions)
    if not any(route.name == name for route in state.project.routes):
        return None
    return PredictionInput.of(state.project, name, conditions.prediction, conditions.visibility)

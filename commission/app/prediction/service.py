"""Keeps the prediction along the chosen route in step with the page's state: starts its job, makes the view."""

from __future__ import annotations

from commission.app.base.conditions import Conditions
from commission.app.base.kept import Kept
from commission.app.base.memo import Memo
from commission.app.base.service import Context, Due, Service
from commission.app.base.state import AppState
from commission.app.prediction.settings import PredictionSettings
from commission.app.prediction.view import RouteView, route_view
from commission.studies.kinds_prediction import KindsInput, KindsPrediction, kinds_beside_ranges, kinds_prediction
from commission.studies.prediction import PredictionInput, PredictionResult, prediction

PREDICTION, BY_EVERY_KIND = "Route prediction", "Prediction by every kind"
"""Names of the jobs."""


class PredictionService(Service):
    """The prediction of the site as it is now."""

    def __init__(self, context: Context) -> None:
        super().__init__(context)
        self._kept = Kept[PredictionInput, PredictionResult](PREDICTION, context.jobs)
        self._driven = Kept[KindsInput, KindsPrediction](BY_EVERY_KIND, context.jobs)
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
            self._driven.drop()
        else:
            self._kept.keep(inputs, lambda progress: prediction(inputs, progress))
        before, found = self.view, self._kept.result
        outdated = inputs is not None and not self._kept.is_of(inputs)
        driven = self._follow_kinds(state if found is not None and not outdated else None)
        self.view = self._memo.of(
            (found, outdated, driven), lambda: found and route_view(found, driven, outdated=outdated)
        )
        return Due.NEVER if self.view is before else Due.SOON

    def _follow_kinds(self, state: AppState | None) -> KindsPrediction | None:
        """Drive the route by every kind once it is predicted, where there is one beside ranges of reflectors.

        Parameters
        ----------
        state : the page's; none while the route is being predicted: what was driven stays until it is driven anew.
        """
        if state is None:
            return self._driven.result
        if not kinds_beside_ranges(state.project):
            self._driven.drop()
            return None
        inputs = KindsInput.of(state.project, state.part(PredictionSettings).route)
        self._driven.keep(inputs, lambda progress: kinds_prediction(inputs, progress))
        return self._driven.result if self._driven.is_of(inputs) else None


def _inputs(state: AppState) -> PredictionInput | None:
    """Return what the prediction depends on; none where none is wanted, or its route is gone."""
    name, conditions = state.part(PredictionSettings).route, state.part(Conditions)
    if not any(route.name == name for route in state.project.routes):
        return None
    return PredictionInput.of(state.project, name, conditions.prediction, conditions.visibility)

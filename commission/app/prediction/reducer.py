"""What the actions about a prediction mean. Pure; importing it registers them with `reduce`."""

from __future__ import annotations

from commission.app.base.actions import Sender
from commission.app.base.reducer import Outcome, reduce
from commission.app.base.state import AppState
from commission.app.prediction.settings import PredictionSettings, PredictRoute


@reduce.register
def predict_route(action: PredictRoute, state: AppState, _sender: Sender) -> Outcome:
    """Choose the route, which must exist."""
    if action.name:
        state.project.route(action.name)
    return Outcome(state.with_part(PredictionSettings(action.name)))

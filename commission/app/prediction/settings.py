"""What is asked of a prediction: one frozen value in the page's state, and the action that changes it."""

from __future__ import annotations

from dataclasses import dataclass

from commission.app.base.actions import Action


@dataclass(frozen=True, slots=True)
class PredictionSettings:
    """Which route is predicted; without one, nothing is computed."""

    route: str = ""
    """Name of the route; empty: none."""


@dataclass(frozen=True, slots=True)
class PredictRoute(Action):
    """Predict the localizer along another route."""

    name: str
    """Name of the route; empty: along none any more."""

"""What the studies of the step Plan expect of hall and scanner: said once, in the page's state, for all of them."""

from __future__ import annotations

from dataclasses import dataclass

from commission.app.base.actions import Action, Sender
from commission.app.base.reducer import Outcome, reduce
from commission.app.base.state import AppState
from commission.planning.route_prediction import PredictionOptions
from commission.planning.visibility import VisibilityOptions
from commission.site.checks import between
from commission.site.fields import with_field


@dataclass(frozen=True, slots=True)
class Conditions:
    """Conditions under which coverage, prediction, failures and ambiguous places are computed."""

    blocked_per_m: float = 0.0
    """Probability per metre of ray that a person stands in it [1/m]."""
    min_beams: int = 1
    """Beams that a reflector must get for certain to count as visible [beams]."""

    def __post_init__(self) -> None:
        between(self.blocked_per_m, (0.0, 1.0), "blocked", "per metre")
        between(self.min_beams, (1, 20), "beams at least")

    @property
    def visibility(self) -> VisibilityOptions:
        """What counts as visible."""
        return VisibilityOptions(min_beams=self.min_beams)

    @property
    def prediction(self) -> PredictionOptions:
        """What a prediction expects of the hall."""
        return PredictionOptions(blocked_per_m=self.blocked_per_m)


@dataclass(frozen=True, slots=True)
class SetCondition(Action):
    """Change one of the conditions."""

    name: str
    """Field of `Conditions`."""
    value: object
    """New value, SI."""


@reduce.register
def set_condition(action: SetCondition, state: AppState, _sender: Sender) -> Outcome:
    """Change one condition for all studies."""
    return Outcome(state.with_part(with_field(state.part(Conditions), action.name, action.value, "condition")))

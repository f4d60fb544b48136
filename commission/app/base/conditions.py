"""What the studies of the step Plan expect of hall and scanner: said once, in the page's state, for all of them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from commission.app.base.actions import Action, Sender
from commission.app.base.reducer import Outcome, reduce
from commission.app.base.state import AppState
from commission.planning.route_prediction import PredictionOptions
from commission.planning.visibility import VisibilityOptions
from commission.site.checks import check_fields
from commission.site.fields import with_field
from commission.site.quantity import BARE, SHARE, Bounds, Quantity, Shown


@dataclass(frozen=True, slots=True)
class Conditions:
    """Conditions under which coverage, prediction, failures and ambiguous places are computed."""

    blocked_per_m: Annotated[
        float,
        Quantity(label="People", unit="1/m", shown=Shown("%/m", 100.0), bounds=SHARE, step=0.1, entry=(0.0, 50.0)),
    ] = 0.0
    """Chance that somebody stands in a metre of the way from scanner to reflector."""
    min_beams: Annotated[
        int, Quantity(label="Beams at least", unit="beams", shown=BARE, bounds=Bounds.between(1, 20), step=1)
    ] = 1
    """Beams that must hit a reflector for certain, so that it passes the detector filter (equation 3)."""

    def __post_init__(self) -> None:
        check_fields(self, "conditions.")

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

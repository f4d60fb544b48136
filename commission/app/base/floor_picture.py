"""Which feature colors the floor: several can, one at a time."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated

from commission.app.base.actions import Action, Sender
from commission.app.base.reducer import Outcome, reduce
from commission.app.base.state import AppState
from commission.site.checks import check_fields
from commission.site.quantity import PERCENT, SHARE, Quantity


@dataclass(frozen=True, slots=True)
class FloorPicture:
    """The picture on the floor."""

    owner: str = ""
    """Name of the feature whose picture it is; empty: of none that asks to be alone."""
    opacity: Annotated[
        float, Quantity(label="Opacity", shown=PERCENT, bounds=SHARE, step=5.0, slider=(10.0, 100.0))
    ] = 0.8
    """How much of the floor map it hides."""

    def __post_init__(self) -> None:
        check_fields(self)

    def is_free_for(self, feature: str) -> bool:
        """Whether no other feature has the floor."""
        return self.owner in ("", feature)

    def taken_by(self, feature: str) -> FloorPicture:
        """The picture when a feature takes the floor."""
        return replace(self, owner=feature)

    def left_by(self, feature: str) -> FloorPicture:
        """The picture when a feature leaves the floor; another one's stays."""
        return replace(self, owner="") if self.owner == feature else self


@dataclass(frozen=True, slots=True)
class SetOpacity(Action):
    """Draw the picture on the floor more or less opaque."""

    opacity: float
    """New value [0..1]."""


@reduce.register
def set_opacity(action: SetOpacity, state: AppState, _sender: Sender) -> Outcome:
    """Change the opacity of whichever picture is there."""
    return Outcome(state.with_part(replace(state.part(FloorPicture), opacity=float(action.opacity))))

"""What the actions about ambiguous places mean. Pure; importing it registers them with `reduce`."""

from __future__ import annotations

from dataclasses import replace

from commission.app.ambiguity.settings import NAME, AmbiguitySettings, DropPlaces, FindPlaces, SetAmbiguity, ShowPair
from commission.app.base.actions import Sender
from commission.app.base.floor_picture import FloorPicture
from commission.app.base.reducer import Outcome, reduce
from commission.app.base.state import AppState
from commission.site.fields import with_field


@reduce.register
def set_ambiguity(action: SetAmbiguity, state: AppState, _sender: Sender) -> Outcome:
    """Change one setting; what was found is outdated until it is asked for again."""
    settings = with_field(state.part(AmbiguitySettings), action.name, action.value, "setting of the ambiguous places")
    return Outcome(state.with_part(settings))


@reduce.register
def find_places(_action: FindPlaces, state: AppState, _sender: Sender) -> Outcome:
    """Ask once more; the map takes the floor."""
    settings = state.part(AmbiguitySettings)
    asked = state.with_part(replace(settings, asked=settings.asked + 1, pair=-1))
    return Outcome(asked.with_part(state.part(FloorPicture).taken_by(NAME)))


@reduce.register
def drop_places(_action: DropPlaces, state: AppState, _sender: Sender) -> Outcome:
    """Want them no more; the map leaves the floor."""
    dropped = state.with_part(replace(state.part(AmbiguitySettings), asked=0, pair=-1))
    return Outcome(dropped.with_part(state.part(FloorPicture).left_by(NAME)))


@reduce.register
def show_pair(action: ShowPair, state: AppState, _sender: Sender) -> Outcome:
    """Show another pair, or none."""
    settings = state.part(AmbiguitySettings)
    pair = -1 if action.index == settings.pair else action.index
    return Outcome(state.with_part(replace(settings, pair=pair)))

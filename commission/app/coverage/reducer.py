"""What the actions about the heatmap mean. Pure; importing it registers them with `reduce`."""

from __future__ import annotations

from dataclasses import replace

from commission.app.base.actions import Sender
from commission.app.base.floor_picture import FloorPicture
from commission.app.base.reducer import Outcome, reduce
from commission.app.base.state import AppState
from commission.app.coverage.actions import ClearEllipses, ReadFloor, SetCoverage
from commission.app.coverage.settings import NAME, CoverageSettings, shown_figure
from commission.app.editing.editor import editor_of
from commission.app.editing.gestures import reflector_at
from commission.site.fields import with_field

MOST_SPOTS = 60
"""Ellipses that are kept: nobody tells more apart."""


@reduce.register
def set_coverage(action: SetCoverage, state: AppState, _sender: Sender) -> Outcome:
    """Change one setting; a figure takes the floor for its picture."""
    settings = with_field(state.part(CoverageSettings), action.name, action.value, "setting of the heatmap")
    if action.name == "figure":
        picture = state.part(FloorPicture)
        state = state.with_part(picture.taken_by(NAME) if settings.figure else picture.left_by(NAME))
    return Outcome(state.with_part(settings))


@reduce.register
def read_floor(action: ReadFloor, state: AppState, sender: Sender) -> Outcome:
    """Read values where there is a heatmap; each click beside the reflectors leaves an ellipse."""
    if editor_of(state, sender.browser).tool is not None:
        return Outcome(state)
    settings = state.part(CoverageSettings)
    if not shown_figure(state):
        return Outcome(state.with_part(replace(settings, probe=None)))
    on_reflector = reflector_at(state.project.reflectors, action.place, action.reach) is not None
    spots = settings.spots if on_reflector else (*settings.spots, action.place)[-MOST_SPOTS:]
    return Outcome(state.with_part(replace(settings, probe=action.place, spots=spots)))


@reduce.register
def clear_ellipses(_action: ClearEllipses, state: AppState, _sender: Sender) -> Outcome:
    """Drop the ellipses of clicks; those of a grid stay."""
    return Outcome(state.with_part(replace(state.part(CoverageSettings), spots=())))

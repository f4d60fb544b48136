"""What is asked of the raw-sensor view. Pure; importing it registers the handlers with `reduce`."""

from __future__ import annotations

from dataclasses import replace

from commission.app.base.actions import Sender
from commission.app.base.effects import FlyTo
from commission.app.base.reducer import Outcome, reduce
from commission.app.base.state import AppState, Edit, edited
from commission.app.editing.editor import editor_of
from commission.app.live.actions import FindShiny, MarkSeen, SetThreshold, WatchSensor
from commission.app.live.state import SensorWatch, ShinyAsked
from commission.site.fields import with_field

KEY = "detector.intensity_threshold"


@reduce.register
def set_threshold(action: SetThreshold, state: AppState, sender: Sender) -> Outcome:
    """Set the threshold: one undo step for a dragged line."""
    parameters = with_field(state.project.parameters, KEY, action.value, "parameter")
    if parameters == state.project.parameters:
        return Outcome(state)
    edit = Edit("set intensity threshold", sender, KEY)
    return Outcome(edited(state, replace(state.project, parameters=parameters), edit))


@reduce.register
def watch_sensor(action: WatchSensor, state: AppState, sender: Sender) -> Outcome:
    """Take note of who looks at scans."""
    watch = state.of_browser(sender.browser, SensorWatch)
    return Outcome(state.with_browser(sender.browser, replace(watch, seen=action.seen)))


@reduce.register
def find_shiny(action: FindShiny, state: AppState, _sender: Sender) -> Outcome:
    """Look at what a live vehicle has seen so far; of a drive that is over the list comes by itself."""
    return Outcome(state.with_part(ShinyAsked(action.drive)))


@reduce.register
def mark_seen(action: MarkSeen, state: AppState, sender: Sender) -> Outcome:
    """Mark a place and go there; a reflector that stands for it is selected, else nothing is."""
    known = any(each.id == action.reflector for each in state.project.reflectors.reflectors)
    watch = replace(state.of_browser(sender.browser, SensorWatch), marked=action.place)
    editor = editor_of(state, sender.browser).selecting((action.reflector,) if known else ())
    marked = state.with_browser(sender.browser, watch).with_browser(sender.browser, editor)
    return Outcome(marked, (FlyTo(action.place),))

"""What the actions that no feature owns mean: undo, layers, cameras, jobs, browsers. Registers them with `reduce`."""

from __future__ import annotations

from dataclasses import replace

from commission.app.base import actions
from commission.app.base.actions import Sender
from commission.app.base.effects import CancelJob, FlyTo, PlaceCamera, Tell
from commission.app.base.reducer import Outcome, reduce
from commission.app.base.state import AppState, Holding, Step, refuse_read_only, with_maps_packed

LONGEST_NAME = 64
"""Letters of the name of a window."""


@reduce.register
def join(_action: actions.Join, state: AppState, sender: Sender) -> Outcome:
    """A browser begins with the defaults of every feature."""
    greeting = (Tell(state.greeting, failed=False),) if state.greeting else ()
    return Outcome(state if sender.browser is None else state.joined(sender.browser), greeting)


@reduce.register
def name_window(action: actions.NameWindow, state: AppState, sender: Sender) -> Outcome:
    """Give a window that has come back what it had."""
    if not 0 < len(action.name) <= LONGEST_NAME:
        raise ValueError(f"the window's name has {len(action.name)} letters; expected 1 to {LONGEST_NAME}")
    return Outcome(state if sender.browser is None else state.named(sender.browser, action.name))


@reduce.register
def leave(_action: actions.Leave, state: AppState, sender: Sender) -> Outcome:
    """Forget what belonged to a browser."""
    return Outcome(state if sender.browser is None else state.left(sender.browser))


@reduce.register
def undo(_action: actions.Undo, state: AppState, sender: Sender) -> Outcome:
    """Take back the newest step, unless it is another browser's."""
    if not state.undo:
        return Outcome(state)
    refuse_read_only(state)
    step = state.undo[-1]
    if _is_anothers(step, sender, state):
        return Outcome(state, (_in_the_way(step, "undo"),))
    taken_back = Step(state.project, step.name, step.browser)
    redo = with_maps_packed((*state.redo, taken_back))
    return Outcome(replace(state, project=step.whole, undo=state.undo[:-1], redo=redo, last_edit=None))


@reduce.register
def redo(_action: actions.Redo, state: AppState, sender: Sender) -> Outcome:
    """Make the step that was taken back last again, unless it is another browser's."""
    if not state.redo:
        return Outcome(state)
    refuse_read_only(state)
    step = state.redo[-1]
    if _is_anothers(step, sender, state):
        return Outcome(state, (_in_the_way(step, "redo"),))
    made_again = Step(state.project, step.name, step.browser)
    undo = with_maps_packed((*state.undo, made_again))
    return Outcome(replace(state, project=step.whole, undo=undo, redo=state.redo[:-1], last_edit=None))


def _is_anothers(step: Step, sender: Sender, state: AppState) -> bool:
    """Whether a step belongs to another browser that is still there: only that one takes it back."""
    return sender.browser is not None and step.browser not in (None, sender.browser) and step.browser in state.browsers


def _in_the_way(step: Step, what: str) -> Tell:
    return Tell(
        f"nothing to {what} here: the newest step, {step.name}, is that of browser {step.browser}; "
        f"{what} it there, or here once that browser is closed",
        failed=False,
    )


@reduce.register
def hold_slider(action: actions.HoldSlider, state: AppState, sender: Sender) -> Outcome:
    """What follows is another step than what was before, be it as quick as it may."""
    return Outcome(replace(state.with_browser(sender.browser, Holding(action.held)), last_edit=None))


@reduce.register
def show_layer(action: actions.ShowLayer, state: AppState, _sender: Sender) -> Outcome:
    """Show or hide a layer for everybody."""
    hidden = state.hidden - {action.name} if action.visible else state.hidden | {action.name}
    return Outcome(replace(state, hidden=hidden))


@reduce.register
def magnify(action: actions.Magnify, state: AppState, _sender: Sender) -> Outcome:
    """Draw ellipses at another factor."""
    if not 1.0 <= action.factor <= 100.0:
        raise ValueError(f"ellipse scale is {action.factor:g}; expected 1 to 100")
    return Outcome(replace(state, magnify=action.factor))


@reduce.register
def set_camera(action: actions.SetCamera, state: AppState, _sender: Sender) -> Outcome:
    """Let the browser look at something else."""
    return Outcome(state, (PlaceCamera(action.camera),))


@reduce.register
def look_at(action: actions.LookAt, state: AppState, _sender: Sender) -> Outcome:
    """Bring a place into the browser's view."""
    return Outcome(state, (FlyTo(action.place),))


@reduce.register
def stop_job(action: actions.StopJob, state: AppState, _sender: Sender) -> Outcome:
    """Stop a piece of background work."""
    return Outcome(state, (CancelJob(action.number),))


@reduce.register
def report(action: actions.Report, state: AppState, sender: Sender) -> Outcome:
    """Tell who asked, or everybody; what failed is listed where it concerns everybody."""
    text = " ".join(action.text.split())
    told = (Tell(text, action.failed),)
    listed = text if sender.browser is None else action.listed
    if not action.failed or not listed:
        return Outcome(state, told)
    return Outcome(state.with_faults(listed), told)


@reduce.register
def look_again(_action: actions.LookAgain, state: AppState, _sender: Sender) -> Outcome:
    """Change nothing: whatever arrives is followed by a picture."""
    return Outcome(state)


@reduce.register
def clear_faults(_action: actions.ClearFaults, state: AppState, _sender: Sender) -> Outcome:
    """Empty the list of what went wrong."""
    return Outcome(replace(state, faults=()))

"""What the actions of a calibration mean. Pure; importing it registers them with `reduce`."""

from __future__ import annotations

from dataclasses import replace

from commission.app.base.actions import Sender
from commission.app.base.reducer import Outcome, reduce
from commission.app.base.shown_run import RunShown, ShownRun
from commission.app.base.state import AppState, Edit, edited
from commission.app.tune.calibration_actions import AcceptFigure, CalibrateByDrive, DropCalibration, LookAtFigure
from commission.app.tune.calibration_state import CalibrationState
from commission.app.tune.calibration_view import ProposedFigure
from commission.errors import UsageError
from commission.localization.setup import LocalizerSetup
from commission.studies.calibration import accepted
from commission.studies.calibration_values import CalibrationInput, value_in
from commission.studies.calibration_words import label_of


@reduce.register
def run_shown(action: RunShown, state: AppState, _sender: Sender) -> Outcome:
    """Take note of what a calibration would be of, and any other study of the run that is shown."""
    noted = state.with_part(ShownRun(action.result))
    return Outcome(noted.with_part(replace(noted.part(CalibrationState), shown=action.result)))


@reduce.register
def calibrate(_action: CalibrateByDrive, state: AppState, _sender: Sender) -> Outcome:
    """Calibrate by the drive that is shown, with the project as it is now; raises UsageError where there is none."""
    asked = state.part(CalibrationState)
    if asked.shown is None:
        raise UsageError("no drive is shown that could be calibrated by; open a recording, or drive a route, first")
    of = asked.shown.inputs
    inputs = CalibrationInput.of(state.project, of.log, of.start)
    changed = replace(asked, inputs=inputs, asked=asked.asked + 1, chosen="", accepted="", before=None)
    return Outcome(state.with_part(changed))


@reduce.register
def drop_calibration(_action: DropCalibration, state: AppState, _sender: Sender) -> Outcome:
    """Forget what was found; what was accepted of it stays."""
    return Outcome(
        state.with_part(replace(state.part(CalibrationState), inputs=None, chosen="", accepted="", before=None))
    )


@reduce.register
def look_at_figure(action: LookAtFigure, state: AppState, _sender: Sender) -> Outcome:
    """Show all that was found of one figure."""
    return Outcome(state.with_part(replace(state.part(CalibrationState), chosen=action.key)))


@reduce.register
def accept_figure(action: AcceptFigure, state: AppState, sender: Sender) -> Outcome:
    """Take one proposed figure in one undo step; raises UsageError where it is none, or no longer the project's."""
    asked, label = state.part(CalibrationState), label_of(action.key)
    value = next((each for each in action.calibration.proposed if each.key == action.key), None)
    if value is None:
        raise UsageError(f"{label} is not proposed; expected one of the figures that the drive speaks for")
    if asked.shown is None or asked.shown.inputs.log is not action.calibration.inputs.log:
        raise UsageError("the drive shown is not the one that was calibrated by; calibrate again")
    now = value_in(LocalizerSetup.of(state.project), value.key)
    if now is None:
        raise UsageError(f"{label}: the project has no such scanner or reflector any more; calibrate again")
    if ProposedFigure(value, now).is_accepted:
        return Outcome(state)
    after = edited(state, accepted(state.project, (value,)), Edit(f"accept {label}", sender))
    return Outcome(after.with_part(replace(asked, chosen="", accepted=value.key, before=asked.shown)))

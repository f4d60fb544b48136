"""The residuals of the run that is shown: asked for, studied in the background whenever the run changes, and drawn."""

from __future__ import annotations

from dataclasses import dataclass

from viser import GuiApi

from commission.app.base.actions import Action, Sender
from commission.app.base.inputs import Inputs, Text, WorkBar
from commission.app.base.jobs import Lane
from commission.app.base.kept import Kept
from commission.app.base.memo import Memo
from commission.app.base.panel import BasePanel, Post, escaped
from commission.app.base.reducer import Outcome, reduce
from commission.app.base.service import Context, Due, Service
from commission.app.base.state import AppState
from commission.app.base.view import PageView
from commission.app.tune.calibration_state import CalibrationState
from commission.io.residual_charts import charts
from commission.studies.residual_study import ResidualInput, ResidualStudy, residual_study
from commission.studies.residual_words import residual_lines

RESIDUALS = "Residuals"
"""Name of the job."""


@dataclass(frozen=True, slots=True)
class ShowResiduals(Action):
    """Study the residuals of the run that is shown, or stop doing so."""

    wanted: bool
    """Whether they are."""


@dataclass(frozen=True, slots=True)
class DiagnosisState:
    """What is asked for."""

    wanted: bool = False
    """Whether residuals are studied."""


@dataclass(frozen=True, slots=True, eq=False)
class ResidualView:
    """What was found."""

    study: ResidualStudy
    """Residuals of a run."""
    outdated: bool
    """Whether another run is shown by now."""


@reduce.register
def show_residuals(action: ShowResiduals, state: AppState, _sender: Sender) -> Outcome:
    """Study them from now on, or no longer."""
    return Outcome(state.with_part(DiagnosisState(action.wanted)))


class DiagnosisService(Service):
    """The residuals of the newest run, while they are wanted."""

    def __init__(self, context: Context) -> None:
        super().__init__(context)
        self._kept = Kept[ResidualInput, ResidualStudy](RESIDUALS, context.jobs, Lane.PATIENT)
        self._memo = Memo[ResidualView]()
        self.view: ResidualView | None = None
        """What there is now; the same value as long as nothing changes."""

    def parts(self, *, slowly: bool) -> tuple[object, ...]:  # noqa: ARG002 - the protocol's
        """Return what there is now."""
        return () if self.view is None else (self.view,)

    def follow(self, state: AppState) -> Due:
        """Study the run that is shown; a job under way goes on when the run changes, and another one follows."""
        before, run = self.view, state.part(CalibrationState).shown
        if run is None or not state.part(DiagnosisState).wanted:
            self._kept.drop()
            self.view = None
            return Due.NEVER if before is None else Due.SOON
        inputs = ResidualInput(run=run, floor_map=state.project.floor_map)
        self._kept.keep(inputs, lambda progress: residual_study(inputs, progress))
        found = self._kept.result
        outdated = found is not None and found.inputs.run is not run
        self.view = self._memo.of((found, outdated), lambda: None if found is None else ResidualView(found, outdated))
        return Due.NEVER if self.view is before else Due.SOON


class DiagnosisPanel(BasePanel):
    """A switch, progress, words and plots.

    Parameters
    ----------
    gui, post : where the widgets are made, what takes their actions.
    """

    def __init__(self, gui: GuiApi, post: Post) -> None:
        self._inputs = Inputs(
            gui,
            post,
            lambda _name, value: ShowResiduals(bool(value)),
            lambda state, _name: state.part(DiagnosisState).wanted,
        )
        switch = gui.add_checkbox(
            "Study residuals", False, hint="Size, likeness in time, and what they go with; again at every change."
        )
        self._inputs.connect("wanted", switch, bool, lambda state: state.part(DiagnosisState).wanted)
        self._work = WorkBar(gui, post, RESIDUALS, ShowResiduals(wanted=False))
        self._text = Text(gui)

    def draw_slowly(self, view: PageView) -> None:
        """Follow the switch, progress and what was found."""
        self._inputs.follow(view.state)
        self._work.follow(view)
        found, wanted = view.part(ResidualView), view.state.part(DiagnosisState).wanted
        idle = wanted and view.state.part(CalibrationState).shown is None
        self._text.write((found, idle), lambda: residual_text(found, idle=idle))


def residual_text(found: ResidualView | None, *, idle: bool) -> str:
    """Return words and plots as html.

    Parameters
    ----------
    found : what was found.
    idle : whether there is no run that could be studied.
    """
    if found is None:
        note = "No drive is shown that is over." if idle else ""
        return note and f"<div class='c-note' style='padding:2px 6px'>{note}</div>"
    items = "".join(f"<li>{escaped(line)}</li>" for line in residual_lines(found.study))
    note = "<div class='c-note'>Of the run before; that of now is under way.</div>" if found.outdated else ""
    plots = "".join(charts(found.study))
    return f"<div style='padding:2px 8px 4px 4px'>{note}<ul class='c-list'>{items}</ul>{plots}</div>"

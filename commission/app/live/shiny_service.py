"""Shiny things of the drive that is shown, looked for in the background while a browser has the raw-sensor view."""

from __future__ import annotations

from dataclasses import dataclass

from commission.app.base.kept import Kept
from commission.app.base.memo import Memo
from commission.app.base.service import Context, Due, Service
from commission.app.base.shown_run import ShownRun
from commission.app.base.state import AppState
from commission.app.live.state import SensorWatch, ShinyAsked
from commission.studies.shiny import ShinyInput, ShinyThing, shiny_things

SHINY = "Shiny things"
"""Name of the job."""


@dataclass(frozen=True, slots=True, eq=False)
class ShinyView:
    """What was found."""

    things: tuple[ShinyThing, ...] | None
    """The one that was seen most often first; none: it is looked for."""
    outdated: bool
    """Whether it is of the run, or of the settings, before those of now."""
    seconds: float
    """Length of the drive that it is of [s]."""


class ShinyService(Service):
    """The list of the newest run; an edit of reflectors or threshold makes another run, and another list."""

    def __init__(self, context: Context) -> None:
        super().__init__(context)
        self._kept = Kept[ShinyInput, tuple[ShinyThing, ...]](SHINY, context.jobs)
        self._memo = Memo[ShinyView]()
        self.view: ShinyView | None = None
        """What there is now; the same value as long as nothing changes."""

    def parts(self, *, slowly: bool) -> tuple[object, ...]:  # noqa: ARG002 - the protocol's
        """Return what there is now."""
        return () if self.view is None else (self.view,)

    def follow(self, state: AppState) -> Due:
        """Look for them where somebody sees the list; a job under way goes on when the run changes."""
        before, inputs = self.view, inputs_of(state)
        if inputs is None:
            self._kept.drop()
            self.view = None
            return Due.NEVER if before is None else Due.SLOWLY
        if any(state.of_browser(browser, SensorWatch).seen for browser in state.browsers):
            self._kept.keep(inputs, lambda progress: shiny_things(inputs, progress))
        found, outdated = self._kept.result, not self._kept.is_of(inputs)
        log = inputs.log
        self.view = self._memo.of(
            (found, outdated, log), lambda: ShinyView(found, outdated, (log.last_ns - log.first_ns) * 1e-9)
        )
        return Due.NEVER if self.view is before else Due.SLOWLY


def inputs_of(state: AppState) -> ShinyInput | None:
    """Return what the list depends on: the drive that is over, else the live one that somebody asked for."""
    shown, asked = state.part(ShownRun).result, state.part(ShinyAsked).drive
    if shown is not None:
        log, columns = shown.inputs.log, shown.columns
    elif asked is not None:
        log, columns = asked.inputs.log, asked.columns
    else:
        return None
    return ShinyInput(log=log, columns=columns, setup=columns.segments[-1].setup)

"""What the instruments below the floor compute in the background: events, figures of reflectors, tables to save."""

from __future__ import annotations

from dataclasses import replace

from commission.app.base.actions import Envelope, Sender
from commission.app.base.jobs import Lane
from commission.app.base.service import Context
from commission.app.run.actions import CurvesMade
from commission.app.run.charts import BY_TITLE
from commission.app.run.curve_table import curve_table
from commission.app.run.found_table import Found
from commission.app.run.state import PlotWindow
from commission.progress import Progress, part
from commission.site.floor_map import FloorMap
from commission.studies.displaced import misplaced_findings
from commission.studies.events import EventsInput, events
from commission.studies.integrity import protection
from commission.studies.reflector_figures import ReflectorFiguresInput, reflector_figures
from commission.studies.run import RunResult


class Instruments:
    """Background work for the instruments; called by the owner thread alone.

    Parameters
    ----------
    context : what the service of the run is made with.
    """

    def __init__(self, context: Context) -> None:
        self._jobs = context.jobs
        self.found: Found | None = None
        """What was found on the newest drive for which that is done; none before the first."""

    def take(self, result: RunResult, floor_map: FloorMap | None) -> None:
        """Find what happened on a drive and what each reflector contributed; then how large its error can be at most.

        Parameters
        ----------
        result : the whole drive.
        floor_map : walls, by which reflectors are expected to be seen.
        """
        figures = ReflectorFiguresInput.of(result, floor_map)

        def look(progress: Progress) -> Found:
            happened = events(EventsInput(result), part(progress, 0.0, 0.4))
            contributed = reflector_figures(figures, part(progress, 0.4, 0.9))
            progress(0.9, "where reflectors stand to each other")
            return Found(happened, contributed, misplaced_findings(result, contributed))

        self._jobs.start("Events and reflectors", look, then=self._keep, is_shown=False)

    def _keep(self, found: Found) -> None:
        """Show what was found, and compute the levels: on a drive of hours they take longer than all the rest."""
        self.found = found
        self._jobs.start(
            "Protection levels",
            lambda progress: replace(found, levels=protection(found.events.inputs.run.columns, progress=progress)),
            then=lambda whole: self._complete(found, whole),
            lane=Lane.PATIENT,
            is_shown=False,
        )

    def _complete(self, found: Found, whole: Found) -> None:
        if self.found is found:
            self.found = whole

    def save(self, result: RunResult, window: PlotWindow, sender: Sender) -> None:
        """Write what a browser's plots show, and let it save that.

        Parameters
        ----------
        result : the whole drive.
        window : what they show.
        sender : the browser.
        """
        charts, span = [BY_TITLE[title] for title in window.titles], window.span or (0.0, result.duration)
        self._jobs.start(
            "Saving curves",
            lambda progress: curve_table(result, charts, span, progress),
            then=lambda content: Envelope(CurvesMade("curves.csv", content), sender),
            key=("curves", sender.browser),
            lane=Lane.FILES,
        )

"""What the instruments below the floor have computed in the background: tables to save."""

from __future__ import annotations

from commission.app.base.actions import Envelope, Sender
from commission.app.base.jobs import Lane
from commission.app.base.service import Context
from commission.app.run.actions import CurvesMade
from commission.app.run.charts import BY_TITLE
from commission.app.run.curve_table import curve_table
from commission.app.run.state import PlotWindow
from commission.studies.run import RunResult


class Instruments:
    """Background work for the instruments; called by the owner thread alone.

    Parameters
    ----------
    context : what the service of the run is made with.
    """

    def __init__(self, context: Context) -> None:
        self._jobs = context.jobs

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

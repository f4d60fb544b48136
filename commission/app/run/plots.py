"""The instruments below the floor: curves over the drive, drawn by a script of the page (`web_assets/plots.js`).

What changes with the run, the zoom or the choice of plots is sent once; with each picture only the cursor and the
values there. What is lived is drawn solid, what is computed behind the cursor pale; that is the script's business.
"""

from __future__ import annotations

from viser import GuiApi

from commission.app.base import theme, viser_private
from commission.app.base.carrier import Carrier
from commission.app.base.panel import BasePanel, Post, posting
from commission.app.base.view import PageView
from commission.app.run.asked import action_of
from commission.app.run.charts import BY_TITLE
from commission.app.run.drawn_curves import drawn, values_at
from commission.app.run.found_table import Found, message_of
from commission.app.run.state import PlotWindow, RunState
from commission.app.run.variant_reducer import VariantsState
from commission.app.run.variant_table import variants_message
from commission.app.run.view import RunView
from commission.studies.variants import VariantsResult

EDIT = theme.css(theme.EDIT)
"""Where an edit acts from, or reflectors are covered."""


class Plots(BasePanel):
    """One browser's plots.

    Parameters
    ----------
    gui, post : where the widgets are made, what takes their actions.
    browser : number of its connection.
    """

    def __init__(self, gui: GuiApi, post: Post, browser: int) -> None:
        self._browser = browser
        inbox = gui.add_text("Instruments", "", visible=False)
        inbox.on_update(posting(post, lambda event: action_of(event.target.value)))
        self.inbox = inbox
        gui.add_html(f"<div class='c-instruments' data-inbox='{viser_private.identifier(inbox)}'></div>")
        self._curves, self._cursor, self._found = (Carrier(gui, kind) for kind in ("curves", "cursor", "found"))
        self._variants = Carrier(gui, "variants")
        self._listed: tuple[object, ...] = ()
        self._shown: tuple[object, ...] = ()

    def draw(self, view: PageView) -> None:
        """Move the cursor."""
        run = view.part(RunView)
        if run is None or run.duration <= 0.0:
            return
        charts = [BY_TITLE[title] for title in self._window(view).titles]
        values = values_at(run.result, charts, run.newest, run.kept)
        self._cursor.write({"time": round(run.time, 4), "values": values})

    def draw_slowly(self, view: PageView) -> None:
        """Send curves and lists where they are others."""
        self._list(view)
        self._variants.write(variants_message(view.part(VariantsResult), view.state.part(VariantsState)))
        run = view.part(RunView)
        if run is None or run.duration <= 0.0:
            return
        window = self._window(view)
        shown = (id(run.result), window, tuple((each.letter, id(each.run)) for each in run.kept))
        if shown == self._shown:
            return
        self._shown = shown
        span = window.span or (0.0, run.duration)
        message = drawn(run.result, [BY_TITLE[title] for title in window.titles], span, run.kept)
        message |= {
            "titles": list(BY_TITLE),
            "fails": [list(stretch) for stretch in run.episodes],
            "edits": list(run.edits),
            "editColor": EDIT,
        }
        self._curves.write(message)

    def _list(self, view: PageView) -> None:
        """Send the events and reflectors of the newest drive for which they are known."""
        found, figure = view.part(Found), view.state.part(RunState).figure
        if found is not None and self._listed != (found, figure):
            self._listed = found, figure
            self._found.write(message_of(found, figure))

    def _window(self, view: PageView) -> PlotWindow:
        return view.state.of_browser(self._browser, PlotWindow)

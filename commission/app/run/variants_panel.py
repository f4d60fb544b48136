"""In the step Tune: keeps the run of now as a variant, and says which are kept and what they differ in."""

from __future__ import annotations

from viser import GuiApi

from commission.app.base.inputs import Text
from commission.app.base.panel import BasePanel, Post, escaped, posting
from commission.app.base.view import PageView
from commission.app.run.charts import color_of
from commission.app.run.variant_actions import KeepVariant
from commission.app.run.view import RunView
from commission.studies.run import RunResult
from commission.studies.variant_settings import differing_settings

MOST_TOLD = 3
"""Settings that are told of one variant; the table below has all."""


class VariantsPanel(BasePanel):
    """The button, and a line for each variant."""

    def __init__(self, gui: GuiApi, post: Post) -> None:
        keep = gui.add_button(
            "Keep as a variant",
            color="gray",
            hint="Keep this run as variant A, B or C beside what is tried next; *Variants* below the floor compares.",
        )
        keep.on_click(posting(post, lambda _event: KeepVariant()))
        self._html = Text(gui)

    def draw_slowly(self, view: PageView) -> None:
        """Follow what is kept and what is set."""
        run = view.part(RunView)
        if run is None:
            return
        key = (id(run.result), *(id(each.run) for each in run.kept))
        self._html.write(key, lambda: "".join(_line(run.result, each.letter, each.run) for each in run.kept))


def _line(now: RunResult, letter: str, kept: RunResult) -> str:
    """Say in what a variant differs from now."""
    settings = differing_settings([kept, now])
    told = "; ".join(f"{escaped(each.label)} {escaped(each.texts[0])}" for each in settings[:MOST_TOLD])
    more = f" and {len(settings) - MOST_TOLD} more" if len(settings) > MOST_TOLD else ""
    return (
        f"<div class='c-note' style='padding:1px 6px'><b style='color:{color_of(letter)}'>{letter}</b> "
        f"{told + more if settings else 'as now'}</div>"
    )

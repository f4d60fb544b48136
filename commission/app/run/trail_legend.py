"""What the colors of the trail mean, where it is colored by how well detections fit."""

from __future__ import annotations

from viser import GuiApi

from commission.app.base import theme
from commission.app.base.inputs import write_html
from commission.app.base.panel import BasePanel, escaped
from commission.app.base.ramp import ramp_html, scales_html
from commission.app.base.view import PageView
from commission.app.run.state import RunState
from commission.app.run.trail_colors import COLORINGS, TrailBy, palette


class TrailLegend(BasePanel):
    """Scale of the trail; nothing while it has one color."""

    def __init__(self, gui: GuiApi) -> None:
        self._html = gui.add_html("", visible=False)

    def draw_slowly(self, view: PageView) -> None:
        """Follow what is drawn."""
        write_html(self._html, scales_html(trail_scale(view.state.part(RunState).trail_by)))


def trail_scale(by: TrailBy) -> str:
    """Return the colors of the trail; empty where it has one color."""
    if by is TrailBy.NOTHING:
        return ""
    coloring = COLORINGS[by]
    ramp = [theme.css(color) for color in palette()[:-1]]
    bounds = [f"{bound:g}" for bound in coloring.bounds]
    title = f"<div style='padding-top:8px'><b>Trail: {escaped(coloring.title)}</b></div>"
    return title + ramp_html(ramp, bounds) + f"<div class='c-note'>{escaped(coloring.note)}</div>"

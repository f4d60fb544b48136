"""What the colors of the map of ambiguous places mean."""

from __future__ import annotations

from viser import GuiApi

from commission.app.ambiguity.ambiguity_layer import MAP_COLORS
from commission.app.ambiguity.cold_start import EVERY, SOME, TOO_FEW, UNIQUE
from commission.app.ambiguity.view import ColdStartView
from commission.app.base import theme
from commission.app.base.inputs import write_html
from commission.app.base.panel import BasePanel, escaped
from commission.app.base.ramp import scales_html
from commission.app.base.view import PageView
from commission.site.quantity import PERCENT

COLD_START_TEXTS = {
    UNIQUE: "every heading tells the place",
    TOO_FEW: "fewer than 2 visible at some headings",
    SOME: "a look-alike at some headings",
    EVERY: "no heading tells the place",
}


class AmbiguityLegend(BasePanel):
    """Classes of the map; nothing while it is not drawn."""

    def __init__(self, gui: GuiApi) -> None:
        self._html = gui.add_html("", visible=False)

    def draw_slowly(self, view: PageView) -> None:
        """Follow what is drawn."""
        found = view.part(ColdStartView)
        write_html(self._html, scales_html("" if found is None or not found.is_drawn else cold_start_scale(found)))


def cold_start_scale(cold: ColdStartView) -> str:
    """Return the classes of the ambiguous places with the share of the floor in each."""
    shares = cold.ambiguity.shares()
    rows = "".join(
        "<div style='display:flex;align-items:center;gap:8px'><span style='width:18px;height:12px;"
        f"background:{theme.css(MAP_COLORS[index])}'></span><span style='flex:1'>{escaped(text)}</span>"
        f"<span>{PERCENT.text(shares[index - UNIQUE], '.1f')}</span></div>"
        for index, text in COLD_START_TEXTS.items()
    )
    note = "<div class='c-note'>the site has changed since</div>" if cold.outdated else ""
    title = "<b>Ambiguous cold start</b> [% of the floor]"
    spots = f"<div class='c-note'>a spot every {cold.ambiguity.lattice.spacing:g} m</div>"
    return f"<div class='c-cold-start'>{title}{spots}{rows}{note}</div>"

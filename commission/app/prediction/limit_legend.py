"""What the colors of the ribbon along a route mean."""

from __future__ import annotations

from viser import GuiApi

from commission.app.base import theme
from commission.app.base.inputs import write_html
from commission.app.base.panel import BasePanel, escaped
from commission.app.base.ramp import ramp_html, scales_html
from commission.app.base.view import PageView
from commission.app.prediction.limit_colors import BOUNDS, palette
from commission.app.prediction.view import RouteView
from commission.site.quantity import PERCENT


class LimitLegend(BasePanel):
    """Scale of the ribbon; nothing while there is none."""

    def __init__(self, gui: GuiApi) -> None:
        self._html = gui.add_html("", visible=False)

    def draw_slowly(self, view: PageView) -> None:
        """Follow what is drawn."""
        route = view.part(RouteView)
        write_html(self._html, scales_html("" if route is None else limit_scale(route)))


def limit_scale(route: RouteView) -> str:
    """Return the colors of the ribbon."""
    colors = [theme.css(color) for color in palette()]
    bounds = [PERCENT.number(bound) for bound in BOUNDS]
    title = f"<div style='padding-top:8px'><b>2σ along {escaped(route.name)}</b> [% of limit]</div>"
    return title + ramp_html(colors, bounds) + "<div class='c-note'>red: the supervisor stops the vehicle</div>"

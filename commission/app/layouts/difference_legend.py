"""What the colors of the difference heatmap mean, and on how much of the floor it is better or worse."""

from __future__ import annotations

from viser import GuiApi

from commission.app.base import theme
from commission.app.base.inputs import write_html
from commission.app.base.panel import BasePanel, escaped
from commission.app.base.ramp import cell_html, ramp_html, scales_html
from commission.app.base.view import PageView
from commission.app.layouts.difference import GAINED, LOST, NEITHER, SAME, STEPS, DifferenceView, class_colors
from commission.app.layouts.view import LayoutsView
from commission.app.layouts.words import FIGURE_NAMES
from commission.site.quantity import PERCENT, number_text

HATCH_CSS = "repeating-linear-gradient(135deg,{0} 0 3px,{1} 3px 6px)"
WITHOUT = {GAINED: "a fix only now", LOST: "a fix no more", NEITHER: "no fix with either"}


class DifferenceLegend(BasePanel):
    """Scale of the difference heatmap; nothing while it is not drawn."""

    def __init__(self, gui: GuiApi) -> None:
        self._html = gui.add_html("", visible=False)

    def draw_slowly(self, view: PageView) -> None:
        """Follow what is drawn."""
        found = view.part(LayoutsView)
        shown = None if found is None else found.difference
        write_html(self._html, scales_html("" if found is None or shown is None else difference_scale(shown, found)))


def difference_scale(shown: DifferenceView, found: LayoutsView) -> str:
    """Return title, colors with their bounds, the share of the floor in each, and what has no number.

    Parameters
    ----------
    shown : what the floor shows.
    found : which layouts are compared.
    """
    colors = class_colors()
    bounds = [number_text(bound) for bound in shown.bounds]
    signed = [f"-{bound}" for bound in reversed(bounds)] + [f"+{bound}" for bound in bounds]
    title = f"<b>Now against layout {found.kept.number}: {escaped(FIGURE_NAMES[shown.figure.value])}</b>"
    ends = (
        "<div class='c-note' style='display:flex;justify-content:space-between'>"
        "<span>worse now</span><span>same</span><span>better now</span></div>"
    )
    shares = [PERCENT.number(share) for share in shown.shares[SAME - STEPS - 1 : SAME + STEPS]]
    lines = [
        ramp_html([theme.css(colors[index]) for index in range(SAME - STEPS, SAME + STEPS + 1)], signed),
        f"<div style='display:flex;justify-content:space-between;font-size:10px;opacity:.7'>"
        f"{''.join(cell_html(share) for share in shares)}</div>",
        "<div class='c-note'>second row: % of the floor</div>",
        *(_without(index, text, float(shown.shares[index - 1])) for index, text in WITHOUT.items()),
    ]
    note = "<div class='c-note'>computing anew …</div>" if found.outdated else ""
    return title + ends + "".join(lines) + note


def _without(index: int, text: str, share: float) -> str:
    """A hatched square, what it means, and its share of the floor; nothing where there is none of it."""
    if share <= 0.0:
        return ""
    hatch = HATCH_CSS.format(theme.css(class_colors()[index]), theme.css(theme.NO_FIX_DARK))
    return (
        f"<div style='display:flex;align-items:center;gap:8px;padding-top:3px'><span style='width:18px;height:12px;"
        f"background:{hatch}'></span><span>{text}: {PERCENT.text(share, '.1f')} of the floor</span></div>"
    )

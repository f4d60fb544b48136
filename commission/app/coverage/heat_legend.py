"""What the colors of the step Plan mean: the heatmap's scale and that of the ribbon along a route."""

from __future__ import annotations

import math

from viser import GuiApi

from commission.app.ambiguity.ambiguity_layer import MAP_COLORS
from commission.app.ambiguity.cold_start import EVERY, SOME, TOO_FEW, UNIQUE
from commission.app.base import theme
from commission.app.base.panel import BasePanel, escaped, table
from commission.app.base.state import AppState
from commission.app.base.view import PageView
from commission.app.coverage.scale import NO_FIX_COLORS
from commission.app.coverage.words import FIGURE_NAMES, HEADING_NAMES, MEASUREMENT_NAMES, number_text, value_text
from commission.app.plan.settings import Figure, PlanSettings
from commission.app.plan.view import ColdStartView, EllipseView, HeatView, Reading, RouteView, plan_of
from commission.app.prediction.load_colors import BOUNDS, palette

AMONG_PEOPLE = (Figure.EXPECTED_VISIBLE, Figure.TWO_OR_MORE, Figure.THREE_OR_MORE)
COLD_START_TEXTS = {
    UNIQUE: "every heading tells the place",
    TOO_FEW: "fewer than 2 visible at some headings",
    SOME: "a look-alike at some headings",
    EVERY: "no heading tells the place",
}
HATCH_CSS = "repeating-linear-gradient(135deg,{0} 0 3px,{1} 3px 6px)"


class HeatLegend(BasePanel):
    """Scales of heatmap and ribbon; nothing while there is neither."""

    def __init__(self, gui: GuiApi) -> None:
        self._html = gui.add_html("", visible=False)
        self._shown = ""

    def draw_slowly(self, view: PageView) -> None:
        """Follow what is drawn."""
        plan = plan_of(view)
        heat, cold, route = plan.heat, plan.cold_start, plan.route
        content = "" if heat is None else heat_scale(heat, view.state)
        content += "" if cold is None or not cold.is_drawn else cold_start_scale(cold)
        content += "" if plan.ellipses is None or heat is None else ellipse_note(plan.ellipses)
        content += "" if plan.reading is None else reading_table(plan.reading, view.state.part(PlanSettings))
        content += "" if route is None else load_scale(route)
        if content != self._shown:
            self._shown = content
            self._html.content = f"<div class='c-scales' style='font-size:12px;padding:2px 6px 6px'>{content}</div>"
            self._html.visible = bool(content)


def heat_scale(heat: HeatView, state: AppState) -> str:
    """Return title, colors with their bounds, the share of the floor in each, and what it is held against."""
    quantity, plan = heat.scale.quantity, state.part(PlanSettings)
    tuples = [(int(r), int(g), int(b)) for r, g, b in heat.scale.colors()]
    bounds = [number_text(bound) for bound in heat.scale.bounds]
    head = f"<b>{escaped(quantity.label)}</b><div class='c-note'>{_conditions(state)}</div>"
    shares = [f"{100 * share:.0f}" for share in heat.shares[1:]]
    none = "none visible" if plan.figure is Figure.VISIBLE else "no fix"
    hatch = HATCH_CSS.format(*(theme.css(color) for color in NO_FIX_COLORS))
    counts = _count_labels(heat) if heat.scale.figure is Figure.VISIBLE else None
    lines = [
        _ramp([theme.css(color) for color in tuples], bounds, counts),
        f"<div style='display:flex;justify-content:space-between;font-size:10px;opacity:.7'>"
        f"{''.join(_cell(share) for share in shares)}</div>",
        "<div class='c-note'>second row: % of the floor</div>",
        f"<div style='display:flex;align-items:center;gap:8px;padding-top:3px'><span style='width:18px;height:12px;"
        f"background:{hatch}'></span><span>{none}: {100 * heat.shares[0]:.1f} % of the floor</span></div>",
    ]
    limit = _limit(heat, state)
    if limit:
        lines.append(f"<div class='c-note'>{limit}</div>")
    if heat.outdated:
        lines.append("<div class='c-note'>computing anew …</div>")
    return head + "".join(lines)


def ellipse_note(found: EllipseView) -> str:
    """Say how much larger than they are the ellipses on the heatmap are drawn."""
    if not len(found.centers) and not found.without_fix and not found.too_large:
        return ""
    left_out = [f"{found.without_fix} places without a fix"] if found.without_fix else []
    left_out += [f"{found.too_large} too large for the grid"] if found.too_large else []
    note = f"; left out: {', '.join(left_out)}" if left_out else ""
    return f"<div class='c-note'>ellipses: 1σ of a fix, drawn {found.factor:g}x{note}</div>"


def cold_start_scale(cold: ColdStartView) -> str:
    """Return the classes of the ambiguous places with the share of the floor in each."""
    shares = cold.ambiguity.shares()
    rows = "".join(
        "<div style='display:flex;align-items:center;gap:8px'><span style='width:18px;height:12px;"
        f"background:{theme.css(MAP_COLORS[index])}'></span><span style='flex:1'>{escaped(text)}</span>"
        f"<span>{100 * shares[index - UNIQUE]:.1f} %</span></div>"
        for index, text in COLD_START_TEXTS.items()
    )
    note = "<div class='c-note'>the site has changed since</div>" if cold.outdated else ""
    title = "<b>Ambiguous cold start</b> [% of the floor]"
    spots = f"<div class='c-note'>a spot every {cold.ambiguity.lattice.spacing:g} m</div>"
    return f"<div class='c-cold-start'>{title}{spots}{rows}{note}</div>"


def reading_table(reading: Reading, plan: PlanSettings) -> str:
    """Return every figure at the place that was clicked; those among people only where there are some."""
    x, y = reading.place
    rows = [("<b>Clicked at x, y</b>", f"{x:.2f}, {y:.2f} m")]
    if not reading.on_floor:
        rows.append(("", "no floor that is known to be free"))
    for figure, value in reading.values.items() if reading.on_floor else ():
        if plan.blocked_per_m > 0.0 or figure not in AMONG_PEOPLE:
            rows.append((escaped(FIGURE_NAMES[figure].split(" [")[0]), value_text(figure, value, plan.measurement)))
    return f"<div class='c-reading' style='padding:6px 6px 0 0'>{table(rows)}</div>"


def load_scale(route: RouteView) -> str:
    """Return the colors of the ribbon."""
    colors = [theme.css(color) for color in palette()]
    bounds = [f"{100 * bound:.0f}" for bound in BOUNDS]
    title = f"<div style='padding-top:8px'><b>2σ along {escaped(route.name)}</b> [% of limit]</div>"
    return title + _ramp(colors, bounds) + "<div class='c-note'>red: the supervisor stops the vehicle</div>"


def _conditions(state: AppState) -> str:
    """Say under which conditions the heatmap holds."""
    plan = state.part(PlanSettings)
    parts = [HEADING_NAMES[plan.heading], MEASUREMENT_NAMES[plan.measurement]]
    if plan.blocked_per_m > 0.0:
        parts.append(f"people {100 * plan.blocked_per_m:.1f} %/m")
    elif plan.figure in AMONG_PEOPLE:
        parts.append("nobody about: set People [%/m]")
    return escaped("; ".join(parts))


def _limit(heat: HeatView, state: AppState) -> str:
    """Say where the supervisor's limit lies on the scale."""
    limits = state.project.parameters.supervisor
    if heat.scale.figure is Figure.POSITION_SIGMA:
        return f"limit of 2σ {1000 * limits.position_limit:.0f} mm: 1σ {500 * limits.position_limit:.0f} mm"
    if heat.scale.figure is Figure.HEADING_SIGMA:
        degrees = math.degrees(limits.heading_limit)
        return f"limit of 2σ {degrees:.1f}°: 1σ {0.5 * degrees:.2f}°"
    return ""


def _cell(text: str) -> str:
    return f"<span style='flex:1;text-align:center'>{text}</span>"


def _count_labels(heat: HeatView) -> list[str]:
    """Whole numbers in each class: 1, 2, 3, 4-5, ..."""
    starts = [1, *(int(bound) for bound in heat.scale.bounds)]
    ends = [start - 1 for start in starts[1:]]
    ranges = [str(start) if start == end else f"{start}-{end}" for start, end in zip(starts, ends, strict=False)]
    return [*ranges, f"{starts[-1]}+"]


def _ramp(colors: list[str], bounds: list[str], names: list[str] | None = None) -> str:
    """Return a row of colors; under it the bounds where they meet, or the name of each."""
    share = 100.0 / len(colors)
    blocks = "".join(f"<span style='flex:1;height:14px;background:{color}'></span>" for color in colors)
    labels = "".join(
        f"<span style='position:absolute;left:{(index + 1) * share:.2f}%;transform:translateX(-50%)'>{bound}</span>"
        for index, bound in enumerate(bounds)
    )
    if names is not None:
        labels = f"<div style='display:flex'>{''.join(_cell(name) for name in names)}</div>"
    return (
        f"<div style='display:flex;padding-top:4px'>{blocks}</div>"
        f"<div style='position:relative;height:13px;font-size:10px;opacity:.9'>{labels}</div>"
    )

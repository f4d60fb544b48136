"""What the colors of the heatmap mean, under which conditions, and what was read on it."""

from __future__ import annotations

from viser import GuiApi

from commission.app.base import theme
from commission.app.base.conditions import Conditions
from commission.app.base.inputs import write_html
from commission.app.base.panel import BasePanel, escaped, table
from commission.app.base.ramp import cell_html, ramp_html, scales_html
from commission.app.base.state import AppState
from commission.app.base.view import PageView
from commission.app.coverage.scale import NO_FIX_COLORS
from commission.app.coverage.settings import BY_CONTOURS, BY_TAGS, COUNTED, CoverageSettings, Figure
from commission.app.coverage.view import EllipseView, FloorReading, HeatView, coverage_of
from commission.app.coverage.words import FIGURE_NAMES, HEADING_NAMES, MEASUREMENT_NAMES, none_text, value_text
from commission.planning.error_budget import CONTRIBUTIONS
from commission.site.quantity import DEGREES, MILLIMETRES, PERCENT, Shown, counted_text, number_text

AMONG_PEOPLE = (Figure.EXPECTED_VISIBLE, Figure.TWO_OR_MORE, Figure.THREE_OR_MORE)
HATCH_CSS = "repeating-linear-gradient(135deg,{0} 0 3px,{1} 3px 6px)"


class HeatLegend(BasePanel):
    """Scale of the heatmap and what was read on it; nothing while there is none."""

    def __init__(self, gui: GuiApi) -> None:
        self._html = gui.add_html("", visible=False)

    def draw_slowly(self, view: PageView) -> None:
        """Follow what is drawn."""
        found = coverage_of(view)
        content = "" if found.heat is None else heat_scale(found.heat, view.state)
        content += "" if found.ellipses is None or found.heat is None else ellipse_note(found.ellipses)
        content += "" if found.reading is None else reading_table(found.reading, view.state)
        write_html(self._html, scales_html(content))


def heat_scale(heat: HeatView, state: AppState) -> str:
    """Return title, colors with their bounds, the share of the floor in each, and what it is held against."""
    quantity = heat.scale.quantity
    tuples = [(int(r), int(g), int(b)) for r, g, b in heat.scale.colors()]
    bounds = [number_text(bound) for bound in heat.scale.bounds]
    head = f"<b>{escaped(quantity.label)}</b><div class='c-note'>{_conditions(state, heat.scale.figure)}</div>"
    shares = [PERCENT.number(share) for share in heat.shares[1:]]
    none = none_text(heat.scale.figure)
    hatch = HATCH_CSS.format(*(theme.css(color) for color in NO_FIX_COLORS))
    counts = _count_labels(heat) if heat.scale.figure in COUNTED else None
    lines = [
        ramp_html([theme.css(color) for color in tuples], bounds, counts),
        f"<div style='display:flex;justify-content:space-between;font-size:10px;opacity:.7'>"
        f"{''.join(cell_html(share) for share in shares)}</div>",
        "<div class='c-note'>second row: % of the floor</div>",
        f"<div style='display:flex;align-items:center;gap:8px;padding-top:3px'><span style='width:18px;height:12px;"
        f"background:{hatch}'></span><span>{none}: {PERCENT.text(heat.shares[0], '.1f')} of the floor</span></div>",
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
    left_out = (
        [counted_text(found.without_fix, "place without a fix", "places without a fix")] if found.without_fix else []
    )
    left_out += [f"{found.too_large} too large for the grid"] if found.too_large else []
    note = f"; left out: {', '.join(left_out)}" if left_out else ""
    return f"<div class='c-note'>ellipses: 1σ of a fix, drawn {found.factor:g}x{note}</div>"


def reading_table(reading: FloorReading, state: AppState) -> str:
    """Return every figure at the place that was clicked; those among people only where there are some."""
    x, y = reading.place
    measurement, people = state.part(CoverageSettings).measurement, state.part(Conditions).blocked_per_m > 0.0
    rows = [("<b>Clicked at x, y</b>", f"{x:.2f}, {y:.2f} m")]
    if not reading.on_floor:
        rows.append(("", "no floor that is known to be free"))
    for figure, value in reading.values.items() if reading.on_floor else ():
        if people or figure not in AMONG_PEOPLE:
            rows.append((escaped(FIGURE_NAMES[figure].split(" [")[0]), value_text(figure, value, measurement)))
    if reading.on_floor and any(reading.shares):
        named = sorted(zip(reading.shares, CONTRIBUTIONS, strict=True), reverse=True)
        rows.append(("… of its square", ", ".join(f"{name} {PERCENT.text(share)}" for share, name in named)))
    return f"<div class='c-reading' style='padding:6px 6px 0 0'>{table(rows)}</div>"


def _conditions(state: AppState, figure: Figure) -> str:
    """Say under which conditions the heatmap holds."""
    settings, blocked_per_m = state.part(CoverageSettings), state.part(Conditions).blocked_per_m
    heading = HEADING_NAMES[settings.heading.seen_by(state.project.scanners)]
    if figure in BY_CONTOURS:
        has_map = state.project.floor_map is not None
        walls = "the floor map alone and exact, nobody about" if has_map else "there is no floor map"
        return escaped("; ".join((heading, walls, *_zones(state))))
    if figure in BY_TAGS:
        return escaped("; ".join((heading, "one frame of the camera", *_zones(state))))
    if figure is Figure.REELS:
        return "all round; those that stand there when a drive begins"
    parts = [heading, MEASUREMENT_NAMES[settings.measurement]]
    if blocked_per_m > 0.0:
        parts.append(f"people {PERCENT.number(blocked_per_m, '.1f')} %/m")
    elif figure in AMONG_PEOPLE:
        parts.append("nobody about: set People [%/m]")
    return escaped("; ".join((*parts, *_zones(state))))


def _zones(state: AppState) -> tuple[str, ...]:
    """Say that zones count, where there are any."""
    return ("as zones say",) if state.project.zones else ()


def _limit(heat: HeatView, state: AppState) -> str:
    """Say where the supervisor's limit lies on the scale."""
    limits = state.project.parameters.supervisor
    if heat.scale.figure in {Figure.POSITION_SIGMA, Figure.TOTAL_SIGMA, Figure.CONTOUR_POSITION, Figure.TAG_POSITION}:
        return _limit_text(MILLIMETRES, limits.position_limit, (".0f", ".0f"))
    if heat.scale.figure in {Figure.HEADING_SIGMA, Figure.CONTOUR_HEADING, Figure.TAG_HEADING}:
        return _limit_text(DEGREES, limits.heading_limit, (".1f", ".2f"))
    return ""


def _limit_text(unit: Shown, limit: float, forms: tuple[str, str]) -> str:
    """The limit of 2-sigma, and half of it, which is that of the 1-sigma shown."""
    return f"limit of 2σ {unit.text(limit, forms[0])}: 1σ {unit.text(0.5 * limit, forms[1])}"


def _count_labels(heat: HeatView) -> list[str]:
    """Whole numbers in each class: 1, 2, 3, 4-5, ..."""
    starts = [1, *(int(bound) for bound in heat.scale.bounds)]
    ends = [start - 1 for start in starts[1:]]
    ranges = [str(start) if start == end else f"{start}-{end}" for start, end in zip(starts, ends, strict=False)]
    return [*ranges, f"{starts[-1]}+"]

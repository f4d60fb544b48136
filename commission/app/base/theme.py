"""Colors and style of the page: one place for both the scene and the panels. The legend is made from it, too.

The colors follow Sobreira et al. 2016, Fig. 12, as far as a dark page allows: the paper's dark blue reflectors are a
lighter blue here, its dark scan points are grey, because both would vanish on a dark floor.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import TypeAlias

Color: TypeAlias = tuple[int, int, int]

BACKGROUND: Color = (16, 18, 21)
UNKNOWN: Color = (24, 26, 30)
FREE: Color = (37, 40, 45)
WALL: Color = (112, 118, 128)
# Dark around what lies on any color of the floor: a heatmap is as bright as a reflector.
CASING: Color = BACKGROUND
GRID: Color = (50, 53, 59)
GRID_METER: Color = (62, 66, 73)
ROUTE: Color = (116, 128, 150)
STATION: Color = (92, 214, 220)
REFLECTOR: Color = (48, 108, 255)
GATE: Color = (96, 176, 255)
POSE: Color = (255, 82, 82)
INLIER: Color = (255, 214, 10)
OFFSET: Color = (150, 132, 52)
OUTLIER_ASSOCIATION: Color = (255, 59, 48)
OUTLIER_DETECTOR: Color = (196, 74, 60)
SCAN: Color = (190, 197, 206)
FURTHER_SCAN: Color = (206, 172, 140)
VEHICLE: Color = (236, 239, 244)
FIELD: Color = (150, 160, 120)
FAR_FIELD: Color = (78, 84, 64)
TRAIL: Color = (64, 200, 150)
REFERENCE: Color = (196, 140, 255)
SELECTED: Color = (255, 159, 28)
LINE: Color = (38, 41, 46)
SELECTED_LINE: Color = (124, 76, 10)
CHOSEN_LINE: Color = (34, 66, 108)
WARNING_LINE: Color = (98, 70, 18)
ERROR_LINE: Color = (112, 34, 32)
DEPENDENT: Color = (255, 92, 205)
OVER_LIMIT: Color = (255, 59, 48)
RECOVERY: Color = (64, 200, 150)
RISK: Color = (255, 140, 40)
SUGGESTED: Color = (92, 240, 214)
TAKEN_DOWN: Color = (255, 138, 101)
FIRST_TWIN: Color = (120, 220, 255)
SECOND_TWIN: Color = (255, 120, 220)
KEEP_OUT: Color = (222, 150, 70)
TOO_LITTLE: Color = (240, 132, 52)
REFUSED: Color = (255, 122, 110)
# Variants of a drive, on the floor and in the plots: neither lived nor computed nor true.
VARIANTS: tuple[Color, Color, Color] = ((255, 128, 214), (168, 230, 92), (250, 170, 120))
# A layout that was kept beside the one of now: its reflectors, and how much better or worse the floor is now, from
# little to much. Orange and blue are told apart by color-blind people.
KEPT: Color = (166, 190, 255)
WORSE: tuple[Color, Color, Color] = ((140, 92, 52), (204, 112, 42), (255, 148, 40))
BETTER: tuple[Color, Color, Color] = ((46, 92, 124), (44, 132, 186), (92, 190, 250))
NO_DIFFERENCE: Color = (66, 70, 78)
NO_FIX_NEITHER: Color = (104, 108, 116)
NO_FIX_DARK: Color = (30, 30, 34)
# What an error comes from: apart from each other, and from the ramp of the share of a limit.
FROM_NOISE: Color = (138, 148, 164)
FROM_MAP: Color = (74, 134, 255)
FROM_MOUNTING: Color = (222, 110, 206)
FROM_RANGE: Color = (255, 190, 70)
FROM_CLOCK: Color = (60, 200, 180)

OPERATIONAL_COLOR = "#1c7c3c"
FAIL_COLOR = "#c5221f"
IDLE_COLOR = "#4a4f57"
BRAND: Color = (60, 120, 200)


class Height:
    """Height above the floor at which flat things are drawn [m]: what matters more lies on top.

    A centimetre apart: less flickers, because from far above the depth of two neighbors is rounded to the same.
    """

    FLOOR = -0.01
    HEAT = 0.0
    GRID = 0.01
    ROUTE = 0.02
    ACCUMULATED = 0.03
    SCAN = 0.04
    REFERENCE = 0.05
    TRAIL = 0.06
    REFLECTOR = 0.07
    GATE = 0.08
    DETECTION = 0.09
    VEHICLE = 0.10
    POSE = 0.11
    LABEL = 0.12
    DRAFT = 0.13
    EDITING = 0.14


class Mark(StrEnum):
    """How the legend draws an entry."""

    LINE = "line"
    DOT = "dot"
    RING = "ring"
    SQUARE = "square"
    DIAMOND = "diamond"
    CROSS = "cross"


@dataclass(frozen=True, slots=True)
class Legend:
    """One entry of the legend."""

    text: str
    """What it is."""
    color: Color
    """Its color in the scene."""
    mark: Mark
    """Its shape in the scene."""


def css(color: Color) -> str:
    """Return a color as CSS writes it."""
    return f"#{color[0]:02x}{color[1]:02x}{color[2]:02x}"


TOP_BAR_PX = 44
BOTTOM_PX = 248
FOLDED_PX = 46
"""Height of the bottom strip when its plots are folded away [pixels]."""
LOW_BOTTOM_PX = 200
"""The same where the window is low."""
TABS_PX = 138
LEFT_PX = 300
RIGHT_PX = 290

WIDE = "<div class='c-wide'></div>"
"""An html element that lets the widget behind it, which has no label, take the label's room, too."""

LIVE = "<div class='c-live'></div>"
"""An html element that lets the text field behind it tell of every key: one that seeks, and changes nothing."""

# viser docks panels to the left and right only. The rules below turn its main panel into a bar at the top and the
# floating panel of the time line into a strip at the bottom, and take their space from the floor. Where a rule does not
# match (another viser), the panels float and everything still works.
STYLE = f"""<style>
:root{{--c-selected-line:rgb{SELECTED_LINE};--c-top:{TOP_BAR_PX}px;--c-bottom:{BOTTOM_PX}px;--c-tabs:{TABS_PX}px}}
[data-dock-root]{{height:calc(100% - var(--c-top) - var(--c-bottom))!important;top:var(--c-top);
 overflow:visible!important}}
[data-dock-region] .mantine-ScrollArea-viewport>div{{padding-right:6px}}
[data-floating-window]:has(.c-bottom),[data-floating-window]:has(.c-top){{position:fixed!important;left:0!important;
 right:0!important;width:100vw!important;max-width:none!important;border-radius:0!important;box-shadow:none!important}}
[data-floating-window]:has(.c-bottom){{top:auto!important;bottom:0!important;height:var(--c-bottom)!important;
 border-top:1px solid #3a3a3a}}
[data-floating-window]:has(.c-top){{top:0!important;height:var(--c-top)!important;border-bottom:1px solid #3a3a3a}}
[data-floating-window]:has(.c-bottom) :is([data-dock-griphandle],[data-dock-resize])
 {{display:none!important}}
[data-floating-window]:has(.c-bottom) [data-dock-group]{{position:relative}}
[data-floating-window]:has(.c-bottom) [data-dock-strip]{{position:absolute;top:3px;left:4px;z-index:2;
 background:none!important}}
[data-floating-window]:has(.c-top) :is([data-dock-resize],[data-dock-minimize]){{display:none!important}}
[data-floating-window]:has(.c-top) .mantine-Stack-root{{display:none!important}}
[data-dock-unmergeable-header]{{position:fixed!important;top:0;right:0;height:var(--c-top)!important;width:146px;
 background:none!important;pointer-events:none}}
[data-dock-unmergeable-header] button{{display:none!important}}
[data-dock-region-handle],[data-dock-leaf] [data-dock-griphandle]{{display:none!important}}
div:has(>div>.c-top){{display:flex;align-items:center;height:var(--c-top);padding:0 152px 0 0!important;gap:6px}}
div:has(>div>.c-top)>div{{padding:0!important;margin:0!important}}
div:has(>div>.c-top)>:first-child{{flex:1;min-width:0}}
div:has(>div>.c-top) button{{height:26px!important;padding:0 10px!important;font-size:12px!important}}
div:has(>div>.c-bottom){{display:grid;grid-template-columns:repeat(24,minmax(0,1fr));align-items:center;
 padding-top:2px!important}}
div:has(>div>.c-bottom)>:nth-child(-n+5){{grid-row:1}}
div:has(>div>.c-bottom)>:nth-child(1){{grid-column:13}}
div:has(>div>.c-bottom)>:nth-child(2){{grid-column:1/span 7;padding-left:var(--c-tabs)!important}}
div:has(>div>.c-bottom)>:nth-child(2) button{{padding:0 5px!important}}
div:has(>div>.c-bottom)>:nth-child(3){{grid-column:8/span 2}}
div:has(>div>.c-bottom)>:nth-child(4){{grid-column:10/span 3}}
div:has(>div>.c-bottom)>:nth-child(5){{grid-column:14/span 11}}
div:has(>div>.c-bottom)>:nth-child(6){{grid-column:14/span 11;margin:-9px 0 2px!important;
 padding:0 67px 0 18px!important}}
div:has(>div>.c-bottom)>:nth-child(n+7){{grid-column:span 24;padding:0!important;margin:0!important}}
div:has(>.c-carried){{display:none!important}}
.c-instruments{{height:calc(var(--c-bottom) - 50px)}}
.c-plots{{display:flex;flex-direction:column;height:100%;font-size:12px}}
.c-plots-bar{{display:flex;align-items:center;gap:10px;height:24px;padding:0 8px;overflow:hidden;white-space:nowrap}}
.c-plots-bar button{{background:none;border:1px solid transparent;border-radius:3px;color:inherit;font:inherit;
 padding:1px 7px;cursor:pointer;opacity:.7}}
.c-plots-bar button:hover,.c-plots-bar button:focus-visible{{opacity:1;border-color:#555}}
.c-plots-bar button:disabled{{opacity:.3;cursor:default;border-color:transparent}}
.c-chips{{flex:1;min-width:0;overflow:hidden;font-size:11px}}
.c-plots-bar [aria-pressed=true]{{opacity:1;background:#2c3036}}
.c-plots-bar [aria-pressed=false]{{opacity:.5}}
.c-plots-end button{{border-color:#44484f;margin-left:4px;font-size:11px}}
.c-plots-body{{flex:1;min-height:0;position:relative;overflow:hidden}}
.c-list-view{{position:absolute;inset:0;overflow:auto;padding:0 8px;display:none}}
.c-plots[data-view=events] .c-events,.c-plots[data-view=reflectors] .c-reflectors,
.c-plots[data-view=variants] .c-variants{{display:block}}
.c-plots:not([data-view=plots]) :is(canvas,.c-whole,.c-png){{display:none!important}}
.c-list-view table{{border-collapse:collapse;width:100%;font-variant-numeric:tabular-nums}}
.c-events table{{width:auto;min-width:480px}}
.c-list-view th{{position:sticky;top:0;background:#242424;text-align:right;font-weight:400;white-space:nowrap;
 padding:1px 8px}}
.c-list-view th button{{background:none;border:none;color:inherit;font:inherit;cursor:pointer;padding:0;opacity:.75}}
.c-list-view th button:is(:hover,:focus-visible){{opacity:1;text-decoration:underline}}
.c-list-view th .c-color{{padding-left:5px;color:{css(SELECTED)}}}
.c-list-view td{{padding:1px 8px;text-align:right;white-space:nowrap;border-top:1px solid #2f3237}}
.c-list-view :is(td,th):first-child,.c-events :is(td,th){{text-align:left}}
.c-list-view tbody tr{{cursor:pointer}}
.c-list-view tbody tr:is(:hover,:focus-visible){{background:#2c3036;outline:none}}
.c-variants>div{{display:flex;gap:22px;align-items:flex-start}}
.c-variants table{{width:auto;flex:none}}
.c-variants tbody tr{{cursor:default}}
.c-variants .c-moments tbody tr{{cursor:pointer}}
.c-moments td{{text-align:left}}
.c-better{{color:#58d68d;font-style:normal}}
.c-worse{{color:#ff7a6e;font-style:normal}}
.c-different{{color:#ffd34d;font-style:normal}}
.c-variants td small{{opacity:.6;padding-left:5px}}
.c-variants .c-setting td{{color:#b9c0ca;font-style:italic}}
.c-variants th button{{padding-left:7px}}
.c-floor-scale i{{display:inline-block;width:16px;height:9px}}
.c-plots-body canvas{{display:block;position:absolute;inset:0;cursor:crosshair;touch-action:none}}
:root.c-higher{{--c-bottom:62vh!important}}
:root:has(.c-fold input:checked){{--c-bottom:{FOLDED_PX}px}}
[data-floating-window]:has(.c-fold input:checked){{overflow:hidden!important}}
.c-fold{{display:block;text-align:center;font-size:11px;opacity:.7;cursor:pointer;white-space:nowrap}}
.c-fold:hover,.c-fold:focus-within{{opacity:1;text-decoration:underline}}
.c-fold input{{position:absolute;opacity:0;width:0;height:0}}
.c-fold:not(:has(:checked))::after{{content:"plots ▾"}}
.c-fold:has(:checked)::after{{content:"plots ▴"}}
div:has(>div>.c-bottom)>:nth-child(-n+3) [style*="7.25em"]{{display:none}}
div:has(>div>.c-bottom)>:nth-child(5) [style*="7.25em"]{{display:none}}
div:has(>div>.c-route){{display:grid;grid-template-columns:repeat(3,minmax(0,1fr));padding-top:2px!important}}
div:has(>div>.c-route)>:nth-child(1){{grid-column:span 3;padding-left:var(--c-tabs)}}
.c-route{{font-size:12px;height:44px;display:flex;align-items:center;white-space:nowrap;overflow:hidden}}
div:has(>:is(.c-wide,.c-live)){{display:none}}
div:has(>.c-wide)+*>.mantine-Flex-root>[style*="flex-shrink: 0"]{{display:none}}
div:has(>.c-tools)+* .mantine-Button-root{{padding:0 4px!important;font-size:11px!important;min-width:0!important;
 flex:1 1 auto!important}}
div:has(>.c-rows){{display:none}}
div:has(>.c-rows)~div{{padding-top:0!important;padding-bottom:1px!important}}
div:has(>.c-rows)~div button{{height:auto!important;min-height:22px;padding:2px 6px!important;
 font-size:12px!important;font-weight:400!important}}
div:has(>.c-rows)~div .mantine-Button-inner{{justify-content:flex-start}}
div:has(>.c-rows)~div .mantine-Button-label{{white-space:pre-wrap;text-align:left;line-height:1.3;
 font-variant-numeric:tabular-nums}}
.c-table{{width:100%;border-collapse:collapse;font-size:12px;font-variant-numeric:tabular-nums}}
.c-table td{{padding:1px 0;vertical-align:top}}
.c-table td:first-child{{opacity:.65;padding-right:10px;white-space:nowrap}}
.c-table td:last-child{{text-align:right}}
.c-before-after{{width:100%;border-collapse:collapse;font-size:12px;font-variant-numeric:tabular-nums;margin-top:4px}}
.c-before-after td{{padding:1px 0 1px 8px;text-align:right;white-space:nowrap}}
.c-before-after td:first-child{{padding-left:0;text-align:left;opacity:.65;white-space:normal}}
.c-before-after td[colspan]{{padding-top:5px;opacity:1}}
.c-before-after tr:first-child td{{opacity:.65}}
@media (max-width:1500px){{.c-beside{{white-space:normal;width:88px;min-width:0!important;font-size:11px!important;
 line-height:1.25}}}}
@media (max-width:1270px){{.c-plots-bar{{gap:6px;padding:0 4px}} .c-plots-bar button{{padding:1px 4px}}
 .c-chips{{font-size:10.5px}} .c-whole:disabled{{display:none}} .c-plots-end button{{margin-left:2px}}
 div:has(>div>.c-bottom)>:nth-child(2){{grid-column:1/span 9}}
 div:has(>div>.c-bottom)>:nth-child(2) button{{padding:0 3px!important;font-size:11px!important}}
 div:has(>div>.c-bottom)>:nth-child(2) .mantine-Flex-root{{flex-wrap:nowrap!important;gap:3px!important}}
 div:has(>div>.c-bottom)>:nth-child(3){{grid-column:10/span 2;min-width:70px}}
 div:has(>div>.c-bottom)>:nth-child(4){{grid-column:12/span 4;padding-left:6px!important}}
 div:has(>div>.c-bottom)>:nth-child(1){{grid-column:16}}
 div:has(>div>.c-bottom)>:nth-child(n+5):nth-child(-n+6){{grid-column:17/span 8}}}}
@media (max-width:1150px){{.c-beside{{width:78px;font-size:10px!important}}
 .c-badge{{font-size:12px!important;padding:3px 7px!important;letter-spacing:.02em!important}}
 .c-top>b{{display:none}} .c-top{{padding:0 6px!important;gap:8px!important}}}}
.c-list{{margin:1px 0 2px;padding-left:15px;font-size:12px;line-height:1.4;overflow-wrap:anywhere;
 font-variant-numeric:tabular-nums}}
@media (max-height:800px){{:root{{--c-bottom:{LOW_BOTTOM_PX}px}}
 div:has(>div>.c-route)>:nth-child(n+2){{zoom:.78}}}}
.c-note{{font-size:11.5px;opacity:.7;line-height:1.35}}
[data-draft] :is(input,textarea):focus{{border-color:{css(SELECTED)}!important;box-shadow:0 0 0 1px {css(SELECTED)}}}
[data-refused]{{flex-wrap:wrap}}
[data-refused] :is(input,textarea){{border-color:{css(REFUSED)}!important}}
[data-refused]::after{{content:attr(data-refused);flex-basis:100%;color:{css(REFUSED)};font-size:11.5px;
 line-height:1.3;padding-top:2px;overflow-wrap:anywhere}}
.c-status{{position:fixed;z-index:1;display:flex;align-items:center;gap:8px;padding:2px 8px;border-radius:3px;
 background:rgba(16,18,21,.8);color:{css(SCAN)};font-size:12px;pointer-events:none;white-space:pre;
 font-variant-numeric:tabular-nums}}
.c-ruler{{height:6px;border:1.5px solid {css(VEHICLE)};border-top:none}}
.c-length{{font-weight:400}}
.c-place:not(:empty){{padding-left:10px}}
.c-scale{{position:fixed;left:{LEFT_PX + 16}px;top:calc(var(--c-top) + 10px);padding:1px 8px;border-radius:3px;
 background:rgba(16,18,21,.8);color:{css(INLIER)};font-size:12px;pointer-events:none;white-space:nowrap}}
[data-dock-region=right] [role=tab]{{padding:0 .62em!important}}
[data-shows~=c-association] [data-dock-scroll]>div:has(.c-association){{flex-grow:2!important}}
.c-association{{padding:0 12px 0 4px}}
@media (max-height:800px){{.c-a-picture{{max-width:216px!important}}}}
.mantine-Slider-markWrapper:only-child .mantine-Slider-mark{{background:{css(SELECTED)};border:none;width:2px;
 height:12px;border-radius:0;transform:translateY(-3px)!important}}
div:has(>div>.c-bottom):has(.c-no-run) button{{opacity:.35;pointer-events:none}}
:root:has(.c-no-run):not(:has([role=tab][title=Route][aria-selected=true])){{--c-bottom:{FOLDED_PX}px}}
:root:has(.c-no-run) .c-plots{{display:none}}
div:has(>.c-tail){{display:none}}
.c-tail-plain{{opacity:0;pointer-events:none}}
.c-tail-slider{{position:absolute;top:2px;margin:0;height:16px;color-scheme:dark;accent-color:{css(BRAND)};
 cursor:pointer}}
.c-tail-tick{{position:absolute;top:2px;width:2px;margin-left:-1px;height:16px;background:{css(SELECTED)};pointer-events:none}}
.c-a-head{{font-size:12.5px;display:flex;gap:6px;padding:0 2px}}
.c-a-head span{{margin-left:auto;white-space:nowrap;opacity:.7;font-variant-numeric:tabular-nums}}
.c-a-verdict{{font-size:12px;padding:0 2px 3px;font-variant-numeric:tabular-nums}}
.c-a-picture{{display:block;width:100%;max-width:420px;margin:auto;background:{css(BACKGROUND)};fill:none;
 border-radius:3px}}
.c-a-picture *{{vector-effect:non-scaling-stroke}}
.c-a-fine{{stroke:#22252b;stroke-width:1}}
.c-a-line{{stroke:#353a43;stroke-width:1}}
.c-a-ray{{stroke:#6b7482;stroke-width:1;stroke-dasharray:2 4}}
.c-a-gate{{stroke:{css(GATE)};stroke-width:1.6}}
.c-a-rival{{stroke:{css(GATE)};stroke-width:1;opacity:.45}}
.c-a-ring{{stroke-width:1.6}}
.c-a-cloud{{stroke-width:2.4;stroke-linecap:round;opacity:.75}}
.c-a-spread{{stroke:#c3ccd8;stroke-width:1.2;stroke-dasharray:4 3}}
.c-a-vector{{stroke-width:1.4}}
.c-a-detection,.c-a-mean,.c-a-other{{stroke-width:1.8}}
.c-a-after{{stroke:#e8eaee;stroke-width:1.3}}
.c-a-bar{{stroke:{css(VEHICLE)};stroke-width:1.5}}
.c-a-word,.c-a-length{{fill:#d5dae2;font-size:11px;font-variant-numeric:tabular-nums}}
.c-a-length{{font-weight:600}}
.c-a-rows{{padding:0 14px 2px 6px}}
.c-a-legend{{padding-top:4px}}
.c-stale .c-badge{{background:{IDLE_COLOR}!important;font-size:0!important;letter-spacing:0!important}}
.c-stale .c-badge::after{{content:var(--c-stale);font-size:13px}}
.c-stale .c-beside{{visibility:hidden}}
</style>"""

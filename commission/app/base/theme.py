"""Colors by the name of what they are for, and the style of the page: both are said in the dark theme.

What each color means, and what it is in the light theme, is in `paints`; `relight` puts that in its place.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from commission.app.base.paints import Color, Floor, Plan, Run, Surface, Worded

BACKGROUND = Floor.BACKGROUND.dark
UNKNOWN = Floor.UNKNOWN.dark
FREE = Floor.FREE.dark
WALL = Floor.WALL.dark
WALL_3D = Floor.WALL_3D.dark
# Dark around what lies on any color of the floor: a heatmap is as bright as a reflector.
CASING = BACKGROUND
RIM = Floor.RIM.dark
GRID_METER = Floor.GRID_METER.dark
ROUTE = Floor.ROUTE.dark
STATION = Floor.STATION.dark
REFLECTOR = Floor.REFLECTOR.dark
ZONE = Floor.ZONE.dark
TAG = Floor.TAG.dark
PREVIEW = Floor.PREVIEW.dark
GATE = Run.GATE.dark
POSE = Run.POSE.dark
HEADING = Run.HEADING.dark
INLIER = Run.INLIER.dark
OFFSET = Run.OFFSET.dark
OUTLIER_ASSOCIATION = Run.OUTLIER.dark
OUTLIER_DETECTOR = Run.OUTLIER_DETECTOR.dark
SCAN = Run.SCAN.dark
FURTHER_SCAN = Run.FURTHER_SCAN.dark
MATCHED = Run.MATCHED.dark
UNMATCHED = Run.UNMATCHED.dark
VEHICLE = Floor.VEHICLE.dark
TRUCK = Floor.TRUCK.dark
FIELD = Run.FIELD.dark
FAR_FIELD = Run.FAR_FIELD.dark
TRAIL = Run.TRAIL.dark
REFERENCE = Run.REFERENCE.dark
CAMERA_BY_LASER = Run.CAMERA_BY_LASER.dark
CAMERA_BY_CONTOUR = Run.CAMERA_BY_CONTOUR.dark
HYPOTHESIS = Run.HYPOTHESIS.dark
GOODS = Run.GOODS.dark
GOODS_SIGMA = Run.GOODS_SIGMA.dark
CLOUD = Run.CLOUD.dark
NOT_KNOWN = Run.NOT_KNOWN.dark
EDIT = Run.EDIT.dark
SELECTED = Floor.SELECTED.dark
LINE = Surface.LINE.dark
SELECTED_LINE = Surface.SELECTED_LINE.dark
CHOSEN_LINE = Surface.CHOSEN_LINE.dark
WARNING_LINE = Surface.WARNING_LINE.dark
ERROR_LINE = Surface.ERROR_LINE.dark
DEPENDENT = Plan.DEPENDENT.dark
OVER_LIMIT = Plan.OVER_LIMIT.dark
RECOVERY = Plan.RECOVERY.dark
RISK = Plan.RISK.dark
SUGGESTED = Plan.SUGGESTED.dark
TAKEN_DOWN = Plan.TAKEN_DOWN.dark
FIRST_TWIN = Plan.FIRST_TWIN.dark
SECOND_TWIN = Plan.SECOND_TWIN.dark
KEEP_OUT = Plan.KEEP_OUT.dark
TOO_LITTLE = Plan.TOO_LITTLE.dark
REFUSED = Worded.REFUSED.dark
DOUBTFUL = Worded.DOUBTFUL.dark
BETTER_NUMBER = Worded.BETTER.dark
WORSE_NUMBER = Worded.WORSE.dark
# Variants of a drive, on the floor and in the plots: neither lived nor computed nor true.
VARIANTS = Run.VARIANT_A.dark, Run.VARIANT_B.dark, Run.VARIANT_C.dark
# A layout that was kept beside the one of now: its reflectors, and how much better or worse the floor is now, from
# little to much. Orange and blue are told apart by color-blind people.
KEPT = Plan.KEPT.dark
WORSE = Plan.WORSE_1.dark, Plan.WORSE_2.dark, Plan.WORSE_3.dark
BETTER = Plan.BETTER_1.dark, Plan.BETTER_2.dark, Plan.BETTER_3.dark
NO_DIFFERENCE = Plan.NO_DIFFERENCE.dark
NO_FIX_NEITHER = Plan.NO_FIX_NEITHER.dark
NO_FIX_DARK = Plan.NO_FIX_DARK.dark
# What an error comes from: apart from each other, and from the ramp of the share of a limit.
FROM_NOISE = Plan.FROM_NOISE.dark
FROM_MAP = Plan.FROM_MAP.dark
FROM_MOUNTING = Plan.FROM_MOUNTING.dark
FROM_RANGE = Plan.FROM_RANGE.dark
FROM_CLOCK = Plan.FROM_CLOCK.dark
BRAND = Worded.BRAND.dark


def css(color: Color) -> str:
    """Return a color as CSS writes it."""
    return f"#{color[0]:02x}{color[1]:02x}{color[2]:02x}"


OPERATIONAL_COLOR = css(Run.OPERATIONAL.dark)
FAIL_COLOR = css(Run.FAIL.dark)
IDLE_COLOR = css(Run.IDLE.dark)


class Height:
    """Height above the floor at which flat things are drawn [m]: what matters more lies on top.

    A centimetre apart: less flickers, because from far above the depth of two neighbors is rounded to the same.
    """

    FLOOR = -0.01
    HEAT = 0.0
    GRID = 0.01
    CASING = 0.02
    ROUTE = 0.03
    ACCUMULATED = 0.04
    SCAN = 0.05
    REFERENCE = 0.06
    TRAIL = 0.07
    REFLECTOR = 0.08
    GATE = 0.09
    AROUND_DETECTION = 0.10
    DETECTION = 0.11
    AROUND_VEHICLE = 0.12
    VEHICLE = 0.13
    POSE = 0.14
    LABEL = 0.15
    DRAFT = 0.16
    EDITING = 0.17


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


TOP_BAR_PX = 44
BOTTOM_PX = 248
FOLDED_PX = 46
"""Height of the bottom strip when its plots are folded away [pixels]."""
LOW_BOTTOM_PX = 200
"""The same where the window is low."""
TABS_PX = 138
RAIL_PX = 46
"""Width of the rail of tools at the floor's edge [pixels]."""
LEFT_PX = 300 + RAIL_PX
"""Where the floor begins, unless somebody drags its edge elsewhere."""
RIGHT_PX = 290

WIDE = "<div class='c-wide'></div>"
"""An html element that lets the widget behind it, which has no label, take the label's room, too."""


def whole_line(widget: str) -> str:
    """Return an html element that puts a widget's label above it, so that a list of numbers has the whole line.

    Parameters
    ----------
    widget : its identifier.
    """
    row = f".mantine-Flex-root:has(label[for='{widget}']):not(:has(.mantine-Flex-root label[for='{widget}']))"
    return f"<div class='c-list-line'><style>{row}{{flex-wrap:wrap}}{row}>*{{flex:1 0 100%!important}}</style></div>"


def path_mark(kind: str) -> str:
    """Return an html element that lets the text field behind it look into folders (web_assets/files.js).

    Parameters
    ----------
    kind : whose files of before are offered: `recording`, `map`, `file` or `folder`; of the first and the last a folder
        can be chosen.
    """
    return f"<div class='c-path' data-path='{kind}'></div>"


LABEL = "[data-dock-region] .mantine-Flex-root>[style*='flex-shrink: 0']:has(>p>label)"
"""Where the label of a widget stands: wide enough for most in one line; one of a check box has the line to itself."""
SLIDER = ":has(+* :is(.mantine-Slider-track,.c-tail-slider))"
"""Of a label: before a slider, which needs the room more than words need one line."""
LIVE = "<div class='c-live'></div>"
"""An html element that lets the text field behind it tell of every key: one that seeks, and changes nothing."""

# viser docks panels to the left and right only. The rules below turn its main panel into a bar at the top and the
# floating panel of the time line into a strip at the bottom, and take their space from the floor. Where a rule does not
# match (another viser), the panels float and everything still works.
STYLE = f"""<style>
:root.c-light [data-variant=outline]{{--button-color:{css(BRAND)}!important}}
:root{{--mantine-primary-color-filled:{css(BRAND)}!important;
 --mantine-primary-color-filled-hover:{css(Worded.PRESS.dark)}!important;
 --c-selected-line:rgb{SELECTED_LINE};--c-top:{TOP_BAR_PX}px;--c-bottom:{BOTTOM_PX}px;--c-tabs:{TABS_PX}px;
 --c-floor:{LEFT_PX + 4}px;--c-right:{RIGHT_PX + 4}px}}
[data-dock-root]{{height:calc(100% - var(--c-top) - var(--c-bottom))!important;top:var(--c-top);
 overflow:visible!important}}
[data-dock-region] .mantine-ScrollArea-viewport>div{{padding-right:6px}}
[data-floating-window]:has(.c-bottom),[data-floating-window]:has(.c-top){{position:fixed!important;left:0!important;
 right:0!important;width:100vw!important;max-width:none!important;border-radius:0!important;box-shadow:none!important}}
[data-floating-window]:has(.c-bottom){{top:auto!important;bottom:0!important;height:var(--c-bottom)!important;
 border-top:1px solid {css(Surface.EDGE.dark)}}}
[data-floating-window]:has(.c-top){{top:0!important;height:var(--c-top)!important;
 border-bottom:1px solid {css(Surface.EDGE.dark)}}}
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
div:has(>div>.c-top) .mantine-Flex-root{{flex-wrap:nowrap!important}}
div:has(>div>.c-top)>div>.mantine-Flex-root>[style*="flex-shrink: 0"]{{display:none}}
div:has(>div>.c-top) .mantine-Button-label{{display:block;height:auto;line-height:1.4;
 overflow:hidden;text-overflow:ellipsis}}
div:has(>div>.c-bottom){{display:grid;grid-template-columns:repeat(24,minmax(0,1fr));align-items:center;
 padding-top:2px!important}}
div:has(>div>.c-bottom)>:nth-child(-n+5){{grid-row:1}}
div:has(>div>.c-bottom)>:nth-child(1){{grid-column:13}}
div:has(>div>.c-bottom)>:nth-child(2){{grid-column:1/span 7;padding-left:var(--c-tabs)!important}}
div:has(>div>.c-bottom)>:nth-child(2) button{{padding:0 5px!important}}
[role=tab][aria-selected=true]{{color:var(--mantine-color-text)!important}}
[data-floating-window]:has(.c-bottom) [role=tab]{{padding-left:3px!important;padding-right:3px!important}}
div:has(>div>.c-bottom)>:nth-child(3){{grid-column:8/span 2}}
div:has(>div>.c-bottom)>:nth-child(4){{grid-column:10/span 3}}
div:has(>div>.c-bottom)>:nth-child(5){{grid-column:14/span 11}}
div:has(>div>.c-bottom)>:nth-child(6){{grid-column:14/span 11;margin:-9px 0 2px!important;
 padding:0 83px 0 18px!important}}
div:has(>div>.c-bottom)>:nth-child(n+7){{grid-column:span 24;padding:0!important;margin:0!important}}
div:has(>.c-carried){{display:none!important}}
.c-instruments{{height:calc(var(--c-bottom) - 50px)}}
.c-plots{{display:flex;flex-direction:column;height:100%;font-size:12px}}
.c-plots-bar{{display:flex;align-items:center;gap:10px;height:24px;padding:0 8px;overflow:hidden;white-space:nowrap}}
.c-plots-bar button{{background:none;border:1px solid transparent;border-radius:3px;color:inherit;font:inherit;
 padding:1px 7px;cursor:pointer;opacity:.7}}
.c-plots-bar button:hover,.c-plots-bar button:focus-visible{{opacity:1;border-color:{css(Surface.EDGE_HOVER.dark)}}}
.c-plots-bar button:disabled{{opacity:.3;cursor:default;border-color:transparent}}
.c-chips{{flex:1;min-width:0;overflow:hidden;font-size:11px}}
.c-plots-bar [aria-pressed=true]{{opacity:1;background:{css(Surface.PRESSED.dark)}}}
.c-plots-bar [aria-pressed=false]{{opacity:.65}}
.c-plots-end button{{border-color:{css(Surface.EDGE_QUIET.dark)};margin-left:4px;font-size:11px}}
.c-plots-body{{flex:1;min-height:0;position:relative;overflow:hidden}}
.c-list-view{{position:absolute;inset:0;overflow:auto;padding:0 8px;display:none}}
.c-plots[data-view=events] .c-events,.c-plots[data-view=reflectors] .c-reflectors,
.c-plots[data-view=variants] .c-variants{{display:block}}
.c-plots:not([data-view=plots]) :is(canvas,.c-whole,.c-png){{display:none!important}}
:is(.c-list-view,.c-data) table{{border-collapse:collapse;width:100%;font-variant-numeric:tabular-nums}}
.c-events table{{width:auto;min-width:480px}}
:is(.c-list-view,.c-data) th{{position:sticky;top:0;background:{css(Surface.HEAD.dark)};text-align:right;
 font-weight:400;white-space:nowrap;
 padding:1px 8px}}
:is(.c-list-view,.c-data) th button{{background:none;border:none;color:inherit;
 font:inherit;cursor:pointer;padding:0;opacity:.75}}
:is(.c-list-view,.c-data) th button:is(:hover,:focus-visible){{opacity:1;text-decoration:underline}}
.c-list-view th .c-color{{padding-left:5px;color:{css(SELECTED)}}}
:is(.c-list-view,.c-data) td{{padding:1px 8px;text-align:right;white-space:nowrap;
 border-top:1px solid {css(Surface.RULE.dark)}}}
:is(.c-list-view,.c-data) :is(td,th):first-child,.c-events :is(td,th){{text-align:left}}
:is(.c-list-view,.c-data) tbody tr{{cursor:pointer}}
:is(.c-list-view,.c-data) tbody tr:is(:hover,:focus-visible){{background:{css(Surface.PRESSED.dark)};outline:none}}
.c-variants>div{{display:flex;flex-wrap:wrap;gap:2px 22px;align-items:flex-start}}
.c-variants table{{width:auto;flex:none}}
.c-variants tbody tr{{cursor:default}}
.c-variants .c-moments tbody tr{{cursor:pointer}}
.c-moments td{{text-align:left}}
.c-better{{color:{css(BETTER_NUMBER)};font-style:normal}}
.c-worse{{color:{css(WORSE_NUMBER)};font-style:normal}}
.c-different{{color:{css(Worded.DIFFERENT.dark)};font-style:normal}}
.c-variants td small{{opacity:.7;padding-left:5px}}
.c-variants .c-setting td{{color:{css(Worded.SETTING.dark)};font-style:italic}}
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
div:has(>:is(.c-wide,.c-live,.c-path,.c-list-line)){{display:none}}
input:not(:focus){{text-overflow:ellipsis}}
{LABEL}:not({SLIDER}){{width:130px!important;padding-right:4px!important}}
{LABEL} .mantine-Text-root{{letter-spacing:-.4px!important;font-size:12px!important}}
{LABEL}{SLIDER}{{width:128px!important;padding-right:4px!important}}
{LABEL}{SLIDER} .mantine-Text-root{{letter-spacing:-.5px!important;font-size:11.5px!important}}
{LABEL}{SLIDER}+* .mantine-NumberInput-root{{width:58px!important;margin-left:8px!important}}
.mantine-Flex-root:has(>div input[type=checkbox])>:has(>p>label){{flex:1 1 auto!important}}
.mantine-Flex-root:has(>div input[type=checkbox])>:not(:has(label)){{flex:none!important;order:-1;margin-right:8px;
 transform:translateY(2.5px)}}
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
.c-table td:first-child{{opacity:.65;padding-right:10px;width:62%}}
.c-table td:last-child{{text-align:right}}
.c-table .c-one td:last-child{{white-space:nowrap}}
.c-before-after{{width:100%;border-collapse:collapse;font-size:12px;font-variant-numeric:tabular-nums;margin-top:4px}}
.c-before-after td{{padding:1px 0 1px 8px;text-align:right;white-space:nowrap}}
.c-before-after td:first-child{{padding-left:0;text-align:left;opacity:.65;white-space:normal}}
.c-before-after td[colspan]{{padding-top:5px;opacity:1}}
.c-before-after tr:first-child td{{opacity:.65}}
@media (max-width:1500px){{.c-beside{{white-space:normal;width:88px;min-width:0!important;font-size:11px!important;
 line-height:1.25}}}}
@media (max-width:1290px){{.c-plots-bar{{gap:6px;padding:0 4px}} .c-plots-bar button{{padding:1px 4px}}
 .c-chips{{font-size:10.5px}} .c-whole:disabled{{display:none}} .c-plots-end button{{margin-left:2px}}
 div:has(>div>.c-bottom)>:nth-child(2){{grid-column:1/span 9}}
 div:has(>div>.c-bottom)>:nth-child(2) button{{padding:0 3px!important;font-size:11px!important}}
 div:has(>div>.c-bottom)>:nth-child(2) .mantine-Flex-root{{flex-wrap:nowrap!important;gap:3px!important}}
 div:has(>div>.c-bottom)>:nth-child(3){{grid-column:10/span 2;min-width:70px}}
 div:has(>div>.c-bottom)>:nth-child(4){{grid-column:12/span 4;padding-left:6px!important}}
 div:has(>div>.c-bottom)>:nth-child(1){{grid-column:16}}
 div:has(>div>.c-bottom)>:nth-child(n+5):nth-child(-n+6){{grid-column:17/span 8}}}}
@media (max-width:1150px){{div:has(>div>.c-top) .mantine-Button-label{{max-width:84px}}
 .c-beside{{width:78px;font-size:10px!important}}
 .c-badge{{font-size:12px!important;padding:3px 7px!important;letter-spacing:.02em!important}}
 .c-top>b{{display:none}} .c-top{{padding:0 6px!important;gap:8px!important}}}}
.c-list{{margin:1px 0 2px;padding-left:15px;font-size:12px;line-height:1.4;overflow-wrap:anywhere;
 font-variant-numeric:tabular-nums}}
@media (max-height:800px){{:root{{--c-bottom:{LOW_BOTTOM_PX}px}}
 div:has(>div>.c-route)>:nth-child(n+2){{zoom:.78}}}}
.c-hypotheses{{padding:2px 6px;font-size:12px}}
.c-hypotheses table{{width:100%;border-collapse:collapse;font-variant-numeric:tabular-nums;white-space:nowrap}}
.c-hypotheses th{{font-weight:400;opacity:.7;text-align:right;padding:0 0 0 5px;font-size:11px}}
.c-hypotheses td{{text-align:right;padding:1px 0 1px 5px}}
.c-note{{font-size:11.5px;opacity:.7;line-height:1.35}}
[data-draft] :is(input,textarea):focus{{border-color:{css(SELECTED)}!important;box-shadow:0 0 0 1px {css(SELECTED)}}}
[data-refused]{{flex-wrap:wrap}}
[data-refused] :is(input,textarea){{border-color:{css(REFUSED)}!important}}
[data-refused]::after{{content:attr(data-refused);flex-basis:100%;color:{css(REFUSED)};font-size:11.5px;
 line-height:1.3;padding-top:2px;overflow-wrap:anywhere}}
.c-status{{position:fixed;z-index:1;display:flex;flex-wrap:wrap;align-items:center;gap:0 8px;padding:2px 8px;
 border-radius:3px;
 background:rgba(16,18,21,.8);color:{css(Worded.STATUS.dark)};font-size:12px;pointer-events:none;white-space:pre;
 font-variant-numeric:tabular-nums}}
.c-ruler{{height:6px;border:1.5px solid {css(Worded.STATUS.dark)};border-top:none}}
.c-length{{font-weight:400}}
.c-status span:not(:empty){{padding-left:10px}}
.c-scale{{position:fixed;left:{LEFT_PX + 16}px;top:calc(var(--c-top) + 10px);padding:1px 8px;border-radius:3px;
 background:rgba(16,18,21,.8);color:{css(Worded.NOTE.dark)};font-size:12px;pointer-events:none;white-space:nowrap}}
[data-dock-region=right] [role=tab]{{padding:0 .62em!important}}
[data-shows~=c-association] [data-dock-scroll]>div:has(.c-association){{flex-grow:1!important}}
.c-association{{padding:0 12px 0 4px}}
@media (max-height:800px){{.c-a-picture{{max-width:130px!important}}
 :root:not([data-shows~=c-association]) [data-dock-region=right] [data-dock-scroll]>div:has([role=tab][title=Selection])
 {{flex-grow:1.5!important}}}}
.mantine-Slider-markWrapper:only-child .mantine-Slider-mark{{background:{css(SELECTED)};border:none;width:2px;
 height:12px;border-radius:0;transform:translateY(-3px)!important}}
div:has(>div>.c-bottom):has(.c-no-run) button{{opacity:.35;pointer-events:none}}
:root:has(.c-no-run):not(:has([role=tab][title=Route][aria-selected=true])){{--c-bottom:{FOLDED_PX}px}}
:root:has(.c-no-run) .c-plots{{display:none}}
div:has(>.c-tail){{display:none}}
.c-tail-plain{{opacity:0;pointer-events:none}}
.c-tail-slider{{position:absolute;top:2px;margin:0;height:16px;accent-color:{css(BRAND)};
 cursor:pointer}}
.c-tail-tick{{position:absolute;top:2px;width:2px;margin-left:-1px;height:16px;background:{css(SELECTED)};
 pointer-events:none}}
.c-a-head{{font-size:12.5px;display:flex;gap:6px;padding:0 2px}}
.c-a-head span{{margin-left:auto;white-space:nowrap;opacity:.7;font-variant-numeric:tabular-nums}}
.c-a-verdict{{font-size:12px;padding:0 2px 3px;font-variant-numeric:tabular-nums}}
.c-a-picture{{display:block;width:100%;max-width:420px;margin:auto;background:{css(BACKGROUND)};fill:none;
 border-radius:3px}}
.c-a-picture *{{vector-effect:non-scaling-stroke}}
.c-a-fine{{stroke:{css(Surface.FINE.dark)};stroke-width:1}}
.c-a-line{{stroke:{css(Surface.COARSE.dark)};stroke-width:1}}
.c-a-ray{{stroke:{css(Surface.RAY.dark)};stroke-width:1;stroke-dasharray:2 4}}
.c-a-gate{{stroke:{css(GATE)};stroke-width:1.6}}
.c-a-rival{{stroke:{css(GATE)};stroke-width:1;opacity:.45}}
.c-a-ring{{stroke-width:1.6}}
.c-a-cloud{{stroke-width:2.4;stroke-linecap:round;opacity:.75}}
.c-a-spread{{stroke:{css(Run.SPREAD.dark)};stroke-width:1.2;stroke-dasharray:4 3}}
.c-a-vector{{stroke-width:1.4}}
.c-a-detection,.c-a-mean,.c-a-other{{stroke-width:1.8}}
.c-a-after{{stroke:{css(Run.AFTER.dark)};stroke-width:1.3}}
.c-a-bar{{stroke:{css(Worded.WORD.dark)};stroke-width:1.5}}
.c-a-word,.c-a-length{{fill:{css(Worded.WORD.dark)};font-size:11px;font-variant-numeric:tabular-nums}}
.c-a-length{{font-weight:600}}
.c-a-rows{{padding:0 14px 2px 6px}}
.c-a-legend{{padding-top:4px}}
.c-sensor{{box-sizing:border-box;height:calc(var(--c-bottom) - 12px);padding:0 10px 2px 8px;display:flex;
 flex-direction:column}}
.c-s-head{{font-size:12px;line-height:26px;padding-left:calc(var(--c-tabs) + 70px);white-space:nowrap;overflow:hidden;
 text-overflow:ellipsis;font-variant-numeric:tabular-nums}}
.c-s-plots{{flex:1;min-height:0;display:grid;grid-template-columns:5fr 2fr;gap:12px;padding-bottom:15px}}
.c-s-plot{{position:relative;background:{css(BACKGROUND)};border-radius:3px;font-size:11px;color:{css(Surface.AXIS.dark)}}}
.c-s-plot svg{{position:absolute;inset:0;width:100%;height:100%;fill:none}}
.c-s-plot svg *{{vector-effect:non-scaling-stroke}}
.c-s-none{{display:flex;align-items:center;justify-content:center;font-size:12px;padding:8px;text-align:center}}
.c-s-grid{{stroke:{css(Surface.AXIS_GRID.dark)};stroke-width:1}}
.c-s-curve{{stroke:{css(Surface.RAY.dark)};stroke-width:1}}
.c-s-lit{{stroke:{css(SCAN)};stroke-width:1.6}}
.c-s-far{{stroke:{css(OVER_LIMIT)};stroke-width:2;stroke-linecap:round;opacity:.6}}
.c-s-mark{{stroke-width:8;stroke-linecap:round}}
.c-s-band{{fill:{css(GATE)};fill-opacity:.16;stroke:{css(GATE)};stroke-width:1}}
.c-s-passed,.c-s-failed{{stroke-width:3;stroke-linecap:round;opacity:.55;stroke:{css(GATE)}}}
.c-s-failed{{stroke:{css(OUTLIER_DETECTOR)};opacity:.9}}
.c-s-plot span{{position:absolute;pointer-events:none;white-space:nowrap;font-variant-numeric:tabular-nums}}
.c-s-x{{top:100%;transform:translateX(-50%);line-height:14px}}
.c-s-end{{right:0;transform:none}}
.c-s-top{{left:3px;top:1px}}
.c-s-y{{left:3px;line-height:13px}}
.c-s-title{{right:5px;top:1px}}
.c-s-name{{bottom:0;transform:translateX(-50%);color:{css(GATE)};font-size:10px;line-height:12px;padding-bottom:1px;
 text-shadow:0 0 3px {css(BACKGROUND)},0 0 3px {css(BACKGROUND)}}}
.c-s-line{{position:absolute;left:0;right:0;top:calc(var(--c-at) - 6px);height:12px;cursor:ns-resize;touch-action:none}}
.c-s-line::before{{content:"";position:absolute;left:0;right:0;top:5px;border-top:2px solid {css(OVER_LIMIT)}}}
.c-s-line b{{position:absolute;right:6px;bottom:8px;color:{css(OVER_LIMIT)};font-style:normal;font-size:12px}}
.c-holds-threshold .c-s-line{{top:calc(var(--c-held) - 6px)}}
.c-holds-threshold .c-s-line b{{font-size:0}}
.c-holds-threshold .c-s-line b::after{{content:var(--c-held-value);font-size:12px}}
.c-stale .c-badge{{background:{IDLE_COLOR}!important;font-size:0!important;letter-spacing:0!important}}
.c-stale .c-badge::after{{content:var(--c-stale);font-size:13px}}
.c-stale .c-beside{{visibility:hidden}}
</style>"""

"""The style of the bar at the top, of the steps and of what stands on the floor; colors are in `theme`."""

from __future__ import annotations

from commission.app.base.actions import Camera
from commission.app.base.icons import mask
from commission.app.base.paints import Surface, Worded
from commission.app.base.theme import BACKGROUND, LEFT_PX, RAIL_PX, RIGHT_PX, css

TOOLS = 10
"""On the rail at the floor's edge, which share its height."""
OPEN_EYE, SHUT_EYE = (
    mask(path)
    for path in (
        "M2 12c3-5 6.5-7 10-7s7 2 10 7c-3 5-6.5 7-10 7s-7-2-10-7zM12 9a3 3 0 1 0 0 6a3 3 0 1 0 0-6",
        "M2 12c3-5 6.5-7 10-7s7 2 10 7c-3 5-6.5 7-10 7s-7-2-10-7zM4 21L20 3",
    )
)
NO_RUN_PX = 34
"""Height of the strip below the floor while there is no run [pixels]."""

NOW_LINE_PX = 17
"""Height of a line of the numbers of now [pixels]."""
NOW_PX, LOW_NOW_PX, HIGH_NOW_PX = (6 + lines * NOW_LINE_PX for lines in (11, 6, 15))
"""Height of the numbers of now [pixels], and where the window is low or high: whole lines, so that none is cut."""
LESS_NOW_PX, LEAST_NOW_PX = (6 + lines * NOW_LINE_PX for lines in (8, 4))
"""Beside the picture of the association, and where the window is low: the selection needs the room."""
LIT_CAMERA = ",".join(
    f":root[data-camera~='{camera.value}'] div:has(>.c-cameras)+div button:nth-child({place})"
    for place, camera in enumerate(Camera, start=1)
)

# Ticks are drawn, not written: the name of a tab stays what it is.
BAR_AND_GUIDE = f"""<style>
div:has(>div>.c-top)>div:has(.c-badge){{order:-1}}
.c-badge{{display:inline-block;min-width:9.2em;text-align:center;font-size:13px!important;padding:4px 10px!important;
 letter-spacing:.05em!important;margin-left:8px}}
.c-beside{{white-space:nowrap!important;width:auto!important;min-width:118px!important;
 line-height:1.25;font-size:11px!important}}
.c-since{{min-width:34px;font-size:12px;font-variant-numeric:tabular-nums}}
.c-share{{display:block;height:3px;border-radius:2px;background:{css(Surface.SHARE.dark)};overflow:hidden}}
.c-share i{{display:block;height:3px}}
[role=tab][data-lacks]::before{{content:"";display:inline-block;width:7px;height:7px;border-radius:50%;
 margin-right:6px;border:1.5px solid {css(Worded.LACKING.dark)};box-sizing:border-box}}
[role=tab][data-lacks=""]::before{{width:4px;height:8px;border-radius:0;border-width:0 2px 2px 0;
 border-color:{css(Worded.DONE.dark)};transform:rotate(42deg) translateY(-1px)}}
[role=tab][data-count]:not([data-count=""])::after{{content:attr(data-count) / "";margin-left:5px;padding:0 5px;
 border-radius:7px;background:{css(Worded.LACKING.dark)};color:{css(Worded.ON_LACKING.dark)};font-size:10.5px;
 font-weight:700}}
.c-lacks{{margin:2px 6px 4px;padding:3px 8px;border-left:3px solid {css(Worded.LACKING.dark)};font-size:12px;
 line-height:1.35}}
.c-card{{position:fixed;z-index:2;left:calc({LEFT_PX}px + (100vw - {LEFT_PX + RIGHT_PX}px) / 2);top:50%;
 transform:translate(-50%,-60%);width:min(390px,100vw - {LEFT_PX + RIGHT_PX + 24}px);box-sizing:border-box;
 padding:14px 18px;border-radius:5px;background:{css(Surface.CARD.dark)};
 border:1px solid {css(Surface.CARD_EDGE.dark)};font-size:13px}}
.c-card ol{{list-style:none;margin:0;padding:0;counter-reset:task}}
.c-card li{{counter-increment:task;padding:8px 0 0 26px;position:relative;line-height:1.35}}
.c-card li::before{{content:counter(task);position:absolute;left:0;top:9px;width:18px;height:18px;line-height:18px;
 border-radius:50%;text-align:center;font-size:11px;background:{css(Surface.BADGE.dark)}}}
.c-card li.c-done::before{{content:"";background:none;width:5px;height:10px;left:5px;border-radius:0;
 border:solid {css(Worded.DONE.dark)};border-width:0 2px 2px 0;transform:rotate(42deg)}}
.c-card button{{background:{css(Worded.PRESS.dark)};color:#fff;border:none;border-radius:3px;padding:3px 10px;
 font:inherit;
 cursor:pointer}}
.c-card button:disabled{{background:{css(Surface.DISABLED.dark)};color:{css(Surface.ON_DISABLED.dark)};cursor:default}}
.c-card li span{{display:block;font-size:11.5px;opacity:.75;padding-top:2px}}
.c-card-line{{top:calc(var(--c-top) + 44px);transform:translateX(-50%);width:auto;
 max-width:calc(100vw - {LEFT_PX + RIGHT_PX + 12}px); padding:4px 8px;font-size:11.5px}}
.c-card-line ol{{display:flex;flex-wrap:wrap;gap:2px 3px;align-items:baseline}}
.c-card-line li{{padding:1px 0 1px 20px;white-space:nowrap}}
.c-card-line li::before{{top:3px;width:15px;height:15px;line-height:15px;font-size:10px}}
.c-card-line li.c-done::before{{top:4px;left:7px;width:4px;height:8px}}
.c-card-line button{{padding:1px 7px}}
.c-card-line .c-done button{{background:none;color:inherit;opacity:.75}}
.c-card-line li span{{display:inline;padding-left:6px;color:{css(Worded.NOTE.dark)};opacity:1}}
div:has(>div>.c-bottom):has(.c-no-run)>div:not(:has(>.c-no-run)){{display:none}}
div:has(>div>.c-bottom):has(.c-no-run)>:nth-child(4){{grid-column:1/span 24!important;
 padding:5px 0 0 var(--c-tabs)!important}}
:root:has(.c-no-run):not(:has([role=tab][title=Route][aria-selected=true])){{--c-bottom:{NO_RUN_PX}px!important}}
.c-no-run{{opacity:1!important}}
.c-daylight{{position:fixed;z-index:1;right:{RIGHT_PX + 14}px;bottom:calc(var(--c-bottom) + 10px);width:26px;
 height:26px;padding:0;border-radius:3px;border:1px solid {css(Surface.EDGE_QUIET.dark)};
 background:{css(Surface.CARD.dark)};color:inherit;font-size:15px;line-height:1;cursor:pointer}}
.c-daylight:is(:hover,:focus-visible){{border-color:{css(Worded.BRAND.dark)}}}
:root{{--c-now:{NOW_PX}px}}
@media (max-height:800px){{:root{{--c-now:{LOW_NOW_PX}px}}}}
@media (min-height:1000px){{:root{{--c-now:{HIGH_NOW_PX}px}}}}
:root[data-shows~=c-association]{{--c-now:{LESS_NOW_PX}px}}
@media (max-height:800px){{:root[data-shows~=c-association]{{--c-now:{LEAST_NOW_PX}px}}}}
@media (min-height:1000px){{:root[data-shows~=c-association]{{--c-now:{NOW_PX}px}}}}
:root:has(.c-no-run){{--c-now:34px}}
[data-dock-region=right]{{box-sizing:border-box;padding-top:var(--c-now)}}
div:has(>div>.c-top)>div:has(.c-now){{position:absolute}}
.c-now{{position:fixed;z-index:1;top:var(--c-top);right:0;width:var(--c-right);height:var(--c-now);
 box-sizing:border-box;overflow:hidden auto;overflow-anchor:none;scrollbar-width:thin;padding:0 14px 0 8px;
 scroll-snap-type:y mandatory;border-top:5px solid transparent;border-bottom:1px solid {css(Surface.EDGE.dark)}}}
.c-now .c-table{{line-height:{NOW_LINE_PX}px}}
.c-now .c-table td{{padding-top:0;padding-bottom:0}}
.c-now tr{{scroll-snap-align:start}}
.c-now .c-table :is(table,tbody){{display:block}}
.c-now .c-table tr{{display:flex;justify-content:space-between}}
.c-now .c-table tr:not(.c-one){{flex-wrap:wrap}}
.c-now .c-table tr:not(.c-one) td:last-child{{flex:1 0 auto;max-width:100%}}
.c-now .c-table td:first-child{{width:auto;white-space:nowrap}}
{LIT_CAMERA}{{background:{css(Worded.PRESS.dark)}!important;border-color:{css(Worded.PRESS.dark)}!important;
 color:#fff!important}}
.c-s-plots{{margin-right:calc(34vw + 8px)}}
.c-s-head{{margin-right:34vw}}
.c-s-plot .c-s-title{{max-width:calc(100% - 66px);background:{css(BACKGROUND)};padding-left:3px;
 overflow:hidden;text-overflow:ellipsis}}
.c-s-beams .c-s-top{{background:{css(BACKGROUND)};z-index:1}}
.c-s-plot [data-at]{{cursor:pointer;pointer-events:all}}
.c-s-chosen{{stroke:{css(Worded.LACKING.dark)};stroke-width:16;stroke-linecap:round}}
.c-s-plot .c-s-said{{color:{css(Worded.LACKING.dark)}}}
.c-s-list{{position:fixed;right:10px;bottom:14px;width:34vw;height:calc(var(--c-bottom) - 24px);box-sizing:border-box;
 display:flex;flex-direction:column;font-size:12px}}
.c-s-list-head{{line-height:26px;white-space:nowrap;overflow:hidden;text-overflow:ellipsis;flex:none}}
.c-s-list-body{{flex:1;min-height:0;overflow:auto;scrollbar-width:thin}}
.c-s-list table{{border-collapse:collapse;width:100%;font-variant-numeric:tabular-nums;white-space:nowrap}}
.c-s-list th{{position:sticky;top:0;background:{css(Surface.HEAD.dark)};font-weight:400;padding:1px 6px;
 text-align:right}}
.c-s-list td{{padding:1px 6px;text-align:right;border-top:1px solid {css(Surface.RULE.dark)}}}
.c-s-list :is(td,th):first-child{{text-align:left}}
.c-s-list tbody tr{{cursor:pointer}}
.c-s-list tbody tr:is(:hover,:focus-visible){{background:{css(Surface.PRESSED.dark)};outline:none}}
.c-s-list tbody tr[aria-selected]{{background:var(--c-selected-line)}}
.c-s-find{{margin-left:10px;padding:0 8px;border-radius:3px;border:1px solid {css(Surface.EDGE_QUIET.dark)};
 background:none;color:inherit;font:inherit;cursor:pointer}}
@media (max-width:1290px){{.c-s-list :is(td,th){{padding:1px 4px}} .c-s-list :is(td,th):last-child{{display:none}}
 .c-s-list{{font-size:11px;height:calc(var(--c-bottom) - 48px)}} .c-s-head{{margin-right:0}}}}
[data-dock-region=right] [data-dock-scroll]>div:has(.c-points){{flex-grow:1.3!important}}
:root[data-mantine-color-scheme]{{--mantine-color-dimmed:{css(Surface.AXIS.dark)}!important}}
[data-mantine-color-scheme=light] .mantine-Button-root:is([style*=gray-filled],[style*=dark-filled]):not(:disabled){{
 background:{css(Surface.BADGE.dark)};color:{css(Worded.INK.dark)};border-color:{css(Surface.EDGE_QUIET.dark)};
 &:hover{{background:{css(Surface.PRESSED.dark)}}}}}
[data-with-border]:has(>.mantine-Paper-root+[aria-hidden=true]){{border-width:1px 0 0!important;border-radius:0;
 padding-top:6px}}
[data-with-border]>.mantine-Paper-root+[aria-hidden=true]+*{{display:none!important}}
[data-dock-region] .mantine-Slider-root~.mantine-NumberInput-root{{width:68px!important;margin-left:6px!important}}
.c-reflectors :is(td,th):first-child{{position:sticky;left:-8px;z-index:1;background:{css(Surface.HEAD.dark)}}}
.c-reflectors th:first-child{{z-index:2}}
@media (max-height:1000px){{.c-a-picture{{max-width:186px}} .c-a-picture :is(.c-a-word,.c-a-length){{font-size:16px}}}}
@media (max-height:800px){{.c-a-picture :is(.c-a-word,.c-a-length){{font-size:22px}}}}
.mantine-Button-label{{text-box:normal!important}}
.c-data{{overflow:auto;font-size:12px;margin:0 2px 0 4px;scrollbar-width:thin}}
.c-data h4{{margin:6px 0 1px;font-size:11px;font-weight:600;opacity:.65;position:sticky;left:0}}
.c-data :is(th,td){{text-align:left;padding:1px 6px}}
.c-data .c-right{{text-align:right}}
.c-data th{{z-index:1}}
.c-data :is(td,th):first-child{{position:sticky;left:0;z-index:1;background:{css(Surface.HEAD.dark)}}}
.c-data th:first-child{{z-index:2}}
.c-data td{{height:20px;box-sizing:border-box;max-width:180px;overflow:hidden;text-overflow:ellipsis}}
.c-data td input[type=checkbox]{{margin:0;vertical-align:middle;accent-color:{css(Worded.BRAND.dark)}}}
.c-data tr[data-tint=warning] td{{background:{css(Surface.WARNING_LINE.dark)}}}
.c-data tr[data-tint=error] td{{background:{css(Surface.ERROR_LINE.dark)}}}
.c-data tbody tr[aria-selected=true] td{{background:var(--c-selected-line)}}
.c-data .c-every td{{position:sticky;top:20px;z-index:1;background:{css(Surface.CARD.dark)};font-weight:600}}
.c-data .c-every td:first-child{{z-index:2}}
.c-data [data-edits]:hover{{text-decoration:underline dotted}}
.c-data [data-due]{{opacity:.6}}
.c-data .c-cell{{width:100%;min-width:6.5em;box-sizing:border-box;margin:-1px 0;padding:0 2px;font:inherit;
 color:inherit;background:{css(Surface.CARD.dark)};border:1px solid {css(Worded.BRAND.dark)};border-radius:2px;
 text-align:inherit}}
.c-data td[data-refused]{{box-shadow:inset 0 0 0 1px {css(Worded.REFUSED.dark)}}}
.c-data td[data-refused]::after{{display:none}}
.c-data .c-refusal td{{padding:0;max-width:none;overflow:visible;cursor:default}}
.c-refusal div{{position:sticky;left:0;width:{RIGHT_PX - 34}px;padding:1px 6px 3px;white-space:normal;
 color:{css(Worded.REFUSED.dark)};font-size:11.5px;line-height:1.3}}
div:has(>div>.c-bottom)>:nth-child(5) .mantine-NumberInput-root{{width:60.4px!important}}
div:has(>div>.c-bottom)>:nth-child(5) .mantine-NumberInput-input{{padding-right:15px!important}}
div:has(>div>.c-bottom)>:nth-child(5) .mantine-NumberInput-wrapper::after{{content:"s" / "";position:absolute;
 right:7px;top:50%;transform:translateY(-50%);font-size:11px;opacity:.7;pointer-events:none;z-index:2}}
.c-layers{{padding:0 8px 4px;font-size:12px}}
.c-layers h4{{margin:6px 0 1px;font-size:11px;font-weight:600;opacity:.65;
 border-bottom:1px solid {css(Surface.EDGE.dark)}}}
.c-layer{{display:flex;align-items:center;gap:8px;min-height:21px}}
.c-layer [type=checkbox]{{appearance:none;flex:none;width:16px;height:16px;margin:0;cursor:pointer;
 background:currentColor;opacity:.9;mask:{SHUT_EYE} center/contain no-repeat}}
.c-layer [type=checkbox]:checked{{mask-image:{OPEN_EYE}}}
.c-layer>:focus-visible{{outline:1px solid {css(Worded.BRAND.dark)}}}
.c-layer>span{{flex:1;min-width:0;cursor:pointer}}
.c-layer>:not(:checked)+span{{opacity:.5}}
.c-layer [type=range]{{flex:none;width:64px;height:14px;margin:0;accent-color:{css(Worded.BRAND.dark)};cursor:pointer;
 opacity:.55}}
.c-layer [type=range]:is(:hover,:focus-visible){{opacity:1}}
.c-mark{{display:flex;align-items:center;gap:8px;min-height:17px;padding-left:23px;font-size:11.5px;opacity:.85}}
.c-mark svg{{flex:none}}
[data-dock-region=left] [data-dock-column]{{padding-right:{RAIL_PX}px}}
:root{{--c-tool:clamp(18px,(100vh - var(--c-top) - var(--c-bottom) - 20px)/{TOOLS},38px)}}
div:has(>.c-rail)+div :is(div,.mantine-Flex-root){{width:100%!important;flex-direction:column!important;
 flex-wrap:nowrap!important;gap:0!important}}
div:has(>.c-top) div:has(>.c-rail)+div button,div:has(>div>.c-top) div:has(>.c-rail)+div button{{box-sizing:border-box;
 display:block;position:relative;width:{RAIL_PX - 4}px;height:var(--c-tool)!important;margin:0 2px;padding:0!important;
 flex:none!important;border:none;border-radius:4px;background:none;color:{css(Worded.WORD.dark)};overflow:hidden}}
div:has(>.c-rail)+div button:is(:hover,:focus-visible){{background:{css(Surface.PRESSED.dark)}}}
div:has(>.c-rail)+div button::before{{content:"";position:absolute;left:12px;top:min(5px,(var(--c-tool) - 18px)/2);
 width:18px;height:18px;background:currentColor;mask:var(--c-icon) center/contain no-repeat;transform:none;filter:none;
 opacity:1;border-radius:0}}
div:has(>.c-rail)+div button::after{{content:var(--c-key) / "";position:absolute;right:3px;top:1px;font-size:9px;
 line-height:11px;opacity:.75}}
div:has(>.c-rail)+div .mantine-Button-inner{{position:absolute;left:0;right:0;top:24px;height:12px}}
div:has(>.c-rail)+div .mantine-Button-label{{font-size:9.5px;line-height:12px;max-width:none!important}}
.c-hint{{position:fixed;z-index:40;top:calc(var(--c-top) + 8px);width:max-content;box-sizing:border-box;
 left:calc((100vw + var(--c-floor) - {RIGHT_PX}px)/2);max-width:calc(100vw - var(--c-floor) - {RIGHT_PX + 24}px);
 transform:translateX(-50%);pointer-events:none;text-align:center;font-size:12.5px;padding:3px 14px;border-radius:3px;
 background:{css(Surface.CARD.dark)};border:1px solid {css(Worded.LACKING.dark)}}}
@media (max-width:1500px){{:root:has(.c-hint) .c-scale{{top:auto;bottom:calc(var(--c-bottom) + 40px)}}}}
.c-browse{{position:absolute;right:2px;top:2px;bottom:2px;width:24px;border:none;border-radius:3px;cursor:pointer;
 background:{css(Surface.PRESSED.dark)};color:inherit;font:inherit;font-size:12px;line-height:1}}
.c-browse:is(:hover,:focus-visible){{background:{css(Worded.PRESS.dark)};color:#fff}}
:has(>.c-browse)>input{{padding-right:28px!important}}
.c-files{{position:fixed;z-index:400;left:50%;top:50%;transform:translate(-50%,-50%);width:min(560px,100vw - 32px);
 max-height:min(560px,100vh - 64px);display:flex;flex-direction:column;border-radius:5px;font-size:13px;
 background:{css(Surface.CARD.dark)};border:1px solid {css(Surface.CARD_EDGE.dark)};
 box-shadow:0 6px 24px rgba(0,0,0,.35)}}
.c-files[hidden]{{display:none}}
.c-files[data-waits]{{opacity:.7}}
.c-files-head{{padding:10px 14px 6px;overflow-wrap:anywhere}}
.c-files-list{{flex:1;overflow:auto;padding:0 8px}}
.c-files-title{{padding:5px 6px 2px;font-size:11.5px;opacity:.7}}
.c-files-problem{{padding:6px;color:{css(Worded.REFUSED.dark)};overflow-wrap:anywhere}}
.c-file{{display:flex;gap:12px;width:100%;padding:3px 6px;border:none;border-radius:3px;background:none;color:inherit;
 font:inherit;text-align:left;cursor:pointer}}
.c-file span{{flex:1;overflow-wrap:anywhere}}
.c-file small{{opacity:.7;white-space:nowrap;font-variant-numeric:tabular-nums}}
.c-folder span{{font-weight:600}}
.c-folder:not(.c-up) span::after{{content:" /";opacity:.7}}
.c-file:is(:hover,:focus-visible){{background:{css(Surface.PRESSED.dark)};outline:none}}
.c-files-foot{{display:flex;justify-content:flex-end;gap:8px;padding:8px 14px 10px}}
.c-files-foot button{{padding:3px 12px;border-radius:3px;border:1px solid {css(Surface.CARD_EDGE.dark)};background:none;
 color:inherit;font:inherit;cursor:pointer}}
.c-files-foot .c-files-take{{background:{css(Worded.PRESS.dark)};color:#fff}}
.c-drop{{position:fixed;z-index:300;left:50%;bottom:calc(var(--c-bottom) + 46px);transform:translateX(-50%);
 max-width:min(520px,100vw - 32px);padding:8px 14px;border-radius:4px;font-size:13px;pointer-events:none;
 background:{css(Surface.CARD.dark)};border:1px solid {css(Worded.LACKING.dark)}}}
.c-drop[hidden]{{display:none}}
:root[data-hints=left] .mantine-Tooltip-tooltip{{left:{LEFT_PX + 8}px!important;right:auto!important}}
:root[data-hints=right] .mantine-Tooltip-tooltip{{left:auto!important;right:{RIGHT_PX + 8}px!important}}
:root:is([data-hints=left],[data-hints=right]) .mantine-Tooltip-arrow{{display:none}}
@media print{{.c-daylight{{display:none}}}}
</style>"""

"""The supervisor's badge in the bar at the top: operational, fail or lost, and 2-sigma or level against its limits."""

from __future__ import annotations

import math

from viser import GuiApi

from commission.app.base import theme
from commission.app.base.inputs import write_html
from commission.app.base.paints import Surface
from commission.app.base.panel import BasePanel, clock, escaped
from commission.app.base.view import PageView
from commission.app.run.view import RunView
from commission.localization.estimate import Mode
from commission.site.quantity import DEGREES, MILLIMETRES


def badge_text(view: PageView) -> tuple[str, str, str]:
    """Return the badge's word, what stands beside it, and its color."""
    run = view.part(RunView)
    if run is None or run.estimate is None:
        under_way = [escaped(job.line) for job in view.jobs]
        return ("PREPARING" if under_way else "NO RUN"), "; ".join(under_way), theme.IDLE_COLOR
    limits = run.segment.setup.parameters.supervisor
    held, position, heading = run.result.held(run.newest)
    beside = (
        f"{held} {MILLIMETRES.against(position, limits.position_limit, ('.0f', '.0f'))}"
        f"{_share(position, limits.position_limit)}"
        f"{DEGREES.against(heading, limits.heading_limit, ('.2f', '.1f'))}"
        f"{_share(heading, limits.heading_limit)}"
    )
    beside = beside if math.isfinite(position) else f"{held}: no level"
    lived = run.lived_episodes
    if run.mode is not Mode.OPERATIONAL:
        since = f" {run.time - lived[-1][0]:.0f} s" if lived else ""
        return f"{run.mode.name}{since}", beside, theme.FAIL_COLOR
    return "OPERATIONAL", beside, theme.OPERATIONAL_COLOR


def operational_since(view: PageView) -> str:
    """Return for how long the supervisor has been content; empty while it is not."""
    run = view.part(RunView)
    if run is None or run.estimate is None or run.mode is not Mode.OPERATIONAL:
        return ""
    lived = run.lived_episodes
    return clock(run.time - (lived[-1][1] if lived else 0.0))


def _share(value: float, limit: float) -> str:
    """Return a value as a bar against its limit: full where it reaches it."""
    share = min(value / limit, 1.0)
    color = theme.FAIL_COLOR if share >= 1.0 else theme.css(Surface.SHARE_BAR.dark)
    return f"<span class='c-share'><i style='width:{share:.0%};background:{color}'></i></span>"


class Badge(BasePanel):
    """The badge, and the numbers beside it."""

    def __init__(self, gui: GuiApi) -> None:
        self._badge = gui.add_html("")
        self._scale = gui.add_html("", visible=False)
        self._shown = ("", "")

    def draw(self, view: PageView) -> None:
        """Show the supervisor's state without delay."""
        word, beside, color = badge_text(view)
        if (word, color) == self._shown:
            return
        self._shown = (word, color)
        self._show_badge(word, beside, color, operational_since(view))
        self._show_scale(view)

    def _show_scale(self, view: PageView) -> None:
        """Say on the floor by how much gates and offsets are drawn larger than they are, where there is a run."""
        magnify = 1.0 if view.part(RunView) is None else view.state.magnify
        write_html(
            self._scale,
            "" if magnify == 1.0 else f"<div class='c-scale'>gates, 2σ and offsets {magnify:g}x</div>",
        )

    def _show_badge(self, word: str, beside: str, color: str, since: str) -> None:
        """Write the badge: in the row with the buttons, because above them it would cover them on a small screen."""
        self._badge.content = (
            "<div style='display:flex;align-items:center;gap:8px;margin-right:8px;white-space:nowrap'>"
            f"<span class='c-badge' style='background:{color};color:#fff;font-weight:700;font-size:15px;"
            f"letter-spacing:.1em;padding:3px 20px;border-radius:3px'>{word}</span>"
            f"<span class='c-since' title='operational for'>{since}</span>"
            "<span class='c-beside' style='font-size:12px;opacity:.8;font-variant-numeric:tabular-nums;"
            "min-width:130px'>"
            f"{beside}</span></div>"
        )

    def draw_slowly(self, view: PageView) -> None:
        """Show the numbers beside the badge."""
        self._show_badge(*badge_text(view), operational_since(view))
        self._show_scale(view)

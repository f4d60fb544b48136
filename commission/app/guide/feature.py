"""The way from an empty project to a driving vehicle: a card on the floor, ticks at the steps, what each one lacks."""

from __future__ import annotations

from commission.app.base.feature import PLAN, RUN, SITE, TUNE, Docked, Feature, Tab
from commission.app.guide.guide_panel import GuidePanel, LackingPanel


def _lacking(tab: Tab) -> Docked:
    """Return the line on top of a step."""
    return Docked(make=lambda at: LackingPanel(at.gui, tab.name), tab=tab, rank=-100)


FEATURE = Feature(
    name="guide",
    panels=(
        Docked(make=lambda at: GuidePanel(at.gui, at.browser), tab=None, rank=95, own=True),
        *(_lacking(tab) for tab in (SITE, PLAN, RUN, TUNE)),
    ),
)
"""Panels only: it posts nothing itself, its script leads to the widgets that do."""

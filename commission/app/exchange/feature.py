"""Imports and exports of one browser: what a file would change, shown before anything does."""

from __future__ import annotations

from commission.app.base.feature import SITE, Docked, Feature
from commission.app.exchange import reducer
from commission.app.exchange.exchange_panel import ExchangePanel
from commission.app.exchange.import_overlay import ImportOverlay
from commission.app.exchange.work import ExchangeService

FEATURE = Feature(
    name="exchange",
    reducers=(reducer,),
    services=(ExchangeService,),
    panels=(
        Docked(make=lambda at: ExchangePanel(at.gui, at.post, at.browser), tab=SITE, rank=50, own=True),
        Docked(make=lambda at: ImportOverlay(at.scene, at.browser), tab=None, rank=50, own=True),
    ),
)

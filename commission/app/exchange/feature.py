"""Imports and exports of one browser: what a file would change, shown before anything does."""

from __future__ import annotations

from commission.app.base.feature import SITE, Docked, Feature
from commission.app.exchange import reducer
from commission.app.exchange.exchange_panel import ExchangePanel
from commission.app.exchange.import_overlay import ImportOverlay
from commission.app.exchange.work import ExchangeService

FEATURE = Feature(
    "exchange",
    reducers=(reducer,),
    services=(ExchangeService,),
    panels=(
        Docked(lambda at: ExchangePanel(at.gui, at.post, at.browser), SITE, 50, own=True),
        Docked(lambda at: ImportOverlay(at.scene, at.browser), None, 50, own=True),
    ),
)

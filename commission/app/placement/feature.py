"""A suggested layout: few reflectors that meet the demands of the routes."""

from __future__ import annotations

from commission.app.base.feature import PLAN, Docked, Feature
from commission.app.placement import reducer
from commission.app.placement.placement_panel import LayoutPanel
from commission.app.placement.service import PlacementService
from commission.app.placement.suggestion_layer import SuggestionLayer

FEATURE = Feature(
    name="placement",
    reducers=(reducer,),
    services=(PlacementService,),
    layers=(SuggestionLayer,),
    panels=(Docked(make=lambda at: LayoutPanel(at.gui, at.post), tab=PLAN, rank=50, folder="Suggested layout"),),
)

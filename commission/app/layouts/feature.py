"""Layouts compared: kept ones, the table of two, the difference over the floor, a switch between them."""

from __future__ import annotations

from commission.app.base.feature import LAYERS, PLAN, Docked, Feature
from commission.app.layouts import reducer
from commission.app.layouts.difference_layer import DifferenceLayer, KeptLayoutLayer
from commission.app.layouts.difference_legend import DifferenceLegend
from commission.app.layouts.layouts_panel import LayoutsPanel
from commission.app.layouts.service import LayoutsService

FEATURE = Feature(
    name="layouts",
    reducers=(reducer,),
    services=(LayoutsService,),
    layers=(DifferenceLayer, KeptLayoutLayer),
    panels=(
        Docked(make=lambda at: LayoutsPanel(at.gui, at.post), tab=PLAN, rank=60, folder="Compare layouts"),
        Docked(make=lambda at: DifferenceLegend(at.gui), tab=LAYERS, rank=15),
    ),
)

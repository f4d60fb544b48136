"""What is expected along a route: uncertainty against the supervisor's limits, events, neighbors."""

from __future__ import annotations

from commission.app.base.feature import LAYERS, PLAN, Docked, Feature
from commission.app.prediction import reducer
from commission.app.prediction.event_layer import EventLayer
from commission.app.prediction.limit_legend import LimitLegend
from commission.app.prediction.ribbon_layer import RibbonLayer
from commission.app.prediction.route_panel import RoutePanel
from commission.app.prediction.service import PredictionService

FEATURE = Feature(
    name="prediction",
    reducers=(reducer,),
    services=(PredictionService,),
    layers=(RibbonLayer, EventLayer),
    panels=(
        Docked(
            make=lambda at: RoutePanel(at.gui, at.post, at.container),
            tab=PLAN,
            rank=20,
            folder="Prediction along a route",
        ),
        Docked(make=lambda at: LimitLegend(at.gui), tab=LAYERS, rank=14),
    ),
)

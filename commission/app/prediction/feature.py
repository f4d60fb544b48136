"""What is expected along a route: uncertainty against the supervisor's limits, events, neighbors."""

from __future__ import annotations

from commission.app.base.feature import PLAN, Docked, Feature
from commission.app.prediction.event_layer import EventLayer
from commission.app.prediction.ribbon_layer import RibbonLayer
from commission.app.prediction.route_panel import RoutePanel

FEATURE = Feature(
    "prediction",
    layers=(RibbonLayer, EventLayer),
    panels=(Docked(lambda at: RoutePanel(at.gui, at.post, at.container), PLAN, 20, folder="Along a route"),),
)

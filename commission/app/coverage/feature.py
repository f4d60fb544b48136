"""Coverage of the floor: a heatmap with its scale, values at a place, ellipses of a fix."""

from __future__ import annotations

from commission.app.base.feature import LAYERS, PLAN, Docked, Feature
from commission.app.base.pointer import FloorClicks
from commission.app.coverage import reducer
from commission.app.coverage.actions import ReadFloor
from commission.app.coverage.ellipse_layer import FixEllipseLayer
from commission.app.coverage.heat_layer import HeatLayer
from commission.app.coverage.heat_legend import HeatLegend
from commission.app.coverage.heatmap_panel import HeatmapPanel
from commission.app.coverage.service import CoverageService

FEATURE = Feature(
    name="coverage",
    reducers=(reducer,),
    services=(CoverageService,),
    layers=(HeatLayer, FixEllipseLayer),
    panels=(
        Docked(
            make=lambda at: HeatmapPanel(at.gui, at.post),
            tab=PLAN,
            rank=10,
            folder="Heatmap of the floor",
            is_open=True,
        ),
        Docked(make=lambda at: HeatLegend(at.gui), tab=LAYERS, rank=10),
        Docked(make=lambda at: FloorClicks(at.scene, at.post, ReadFloor), tab=None, rank=90),
    ),
)

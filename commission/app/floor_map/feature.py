"""The floor map: loaded from files, drawn, edited by tools on the floor."""

from __future__ import annotations

from commission.app.base.feature import SELECTION, SITE, Docked, Feature
from commission.app.floor_map import reducer
from commission.app.floor_map.draft_layer import MapDraftLayer
from commission.app.floor_map.floor_layer import FloorLayer
from commission.app.floor_map.floor_map_panel import FloorMapPanel, MapTroublePanel
from commission.app.floor_map.tool_fields import MapToolButtons, MapToolFields
from commission.app.floor_map.wall_layer import WallLayer
from commission.app.floor_map.work import MapService

FEATURE = Feature(
    name="floor_map",
    reducers=(reducer,),
    services=(MapService,),
    layers=(FloorLayer, WallLayer, MapDraftLayer),
    panels=(
        Docked(make=lambda at: FloorMapPanel(at.gui, at.post, at.state.project), tab=SITE, rank=20),
        Docked(make=lambda at: MapTroublePanel(at.gui, at.browser), tab=SITE, rank=20, own=True),
        Docked(make=lambda at: MapToolButtons(at.gui, at.post, at.browser), tab=None, rank=92, own=True),
        Docked(make=lambda at: MapToolFields(at.gui, at.post, at.browser), tab=SELECTION, rank=40, own=True),
    ),
)

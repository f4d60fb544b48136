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
    "floor_map",
    reducers=(reducer,),
    services=(MapService,),
    layers=(FloorLayer, WallLayer, MapDraftLayer),
    panels=(
        Docked(lambda at: FloorMapPanel(at.gui, at.post, at.state.project), SITE, 20),
        Docked(lambda at: MapTroublePanel(at.gui, at.browser), SITE, 20, own=True),
        Docked(lambda at: MapToolButtons(at.gui, at.post), SELECTION, 20, own=True),
        Docked(lambda at: MapToolFields(at.gui, at.post, at.browser), SELECTION, 40, own=True),
    ),
)

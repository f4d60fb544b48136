"""Editing on the floor: tools, selection, reflectors, routes, stations, tags, vehicle, scanner and camera."""

from __future__ import annotations

from commission.app.base.feature import REFLECTORS, ROUTES, SELECTION, SITE, Docked, Feature
from commission.app.editing import posed_reducer, reducer, site_reducer, table_reducer, zone_reducer
from commission.app.editing.camera_fields import CameraFields
from commission.app.editing.equipment_fields import EquipmentFields
from commission.app.editing.overlay import Overlay
from commission.app.editing.reflector_layer import ReflectorLayer, ReflectorNameLayer
from commission.app.editing.reflector_table import ReflectorTable
from commission.app.editing.route_layer import RouteLayer
from commission.app.editing.route_table import RouteTable
from commission.app.editing.selection_panel import SelectionPanel
from commission.app.editing.station_layer import StationLayer
from commission.app.editing.tag_layer import TagLayer
from commission.app.editing.tool_hint import ToolHint
from commission.app.editing.tool_panel import FinishButton, SnappingPanel, ToolButtons
from commission.app.editing.zone_fields import ZoneFields
from commission.app.editing.zone_layer import ZoneLayer

FEATURE = Feature(
    name="editing",
    reducers=(reducer, site_reducer, posed_reducer, zone_reducer, table_reducer),
    layers=(ZoneLayer, TagLayer, RouteLayer, StationLayer, ReflectorLayer, ReflectorNameLayer),
    panels=(
        Docked(make=lambda at: EquipmentFields(at.gui, at.post, at.state.project), tab=SITE, rank=30),
        Docked(make=lambda at: CameraFields(at.gui, at.post, at.state.project), tab=SITE, rank=35),
        Docked(make=lambda at: ZoneFields(at.gui, at.post, at.browser), tab=SITE, rank=40, folder="Zones", own=True),
        Docked(make=lambda at: Overlay(at.scene, at.post, at.browser), tab=None, rank=10, own=True),
        Docked(make=lambda at: ToolButtons(at.gui, at.post, at.browser), tab=None, rank=91, own=True),
        Docked(make=lambda at: FinishButton(at.gui, at.post, at.browser), tab=SELECTION, rank=30, own=True),
        Docked(make=lambda at: SelectionPanel(at.gui, at.post, at.browser), tab=SELECTION, rank=50, own=True),
        Docked(
            make=lambda at: SnappingPanel(at.gui, at.post, at.browser),
            tab=SELECTION,
            rank=70,
            folder="Snapping",
            own=True,
        ),
        Docked(make=lambda at: ToolHint(at.gui, at.browser), tab=SELECTION, rank=90, own=True),
        Docked(make=lambda at: ReflectorTable(at.gui, at.post, at.browser), tab=REFLECTORS, own=True),
        Docked(make=lambda at: RouteTable(at.gui, at.post, at.browser), tab=ROUTES, own=True),
    ),
)

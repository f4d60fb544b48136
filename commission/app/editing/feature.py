"""Editing on the floor: tools, selection, reflectors, routes, stations, vehicle and scanner."""

from __future__ import annotations

from commission.app.base.feature import REFLECTORS, ROUTES, SELECTION, SITE, Docked, Feature
from commission.app.editing import reducer, site_reducer, station_reducer
from commission.app.editing.equipment_fields import EquipmentFields
from commission.app.editing.overlay import Overlay
from commission.app.editing.reflector_layer import ReflectorLayer, ReflectorNameLayer
from commission.app.editing.reflector_table import ReflectorTable
from commission.app.editing.route_layer import RouteLayer
from commission.app.editing.route_table import RouteTable
from commission.app.editing.selection_panel import SelectionPanel
from commission.app.editing.station_layer import StationLayer
from commission.app.editing.tool_hint import ToolHint
from commission.app.editing.tool_panel import FinishButton, SnappingPanel, ToolButtons

FEATURE = Feature(
    "editing",
    reducers=(reducer, site_reducer, station_reducer),
    layers=(RouteLayer, StationLayer, ReflectorLayer, ReflectorNameLayer),
    panels=(
        Docked(lambda at: EquipmentFields(at.gui, at.post, at.state.project), SITE, 30),
        Docked(lambda at: Overlay(at.scene, at.post, at.browser), None, 10, own=True),
        Docked(lambda at: ToolButtons(at.gui, at.post), SELECTION, 10, own=True),
        Docked(lambda at: FinishButton(at.gui, at.post, at.browser), SELECTION, 30, own=True),
        Docked(lambda at: SelectionPanel(at.gui, at.post, at.browser), SELECTION, 50, own=True),
        Docked(lambda at: SnappingPanel(at.gui, at.post, at.browser), SELECTION, 70, folder="Snapping", own=True),
        Docked(lambda at: ToolHint(at.gui, at.browser), SELECTION, 90, own=True),
        Docked(lambda at: ReflectorTable(at.gui, at.post, at.browser, at.container), REFLECTORS, own=True),
        Docked(lambda at: RouteTable(at.gui, at.post, at.browser, at.container), ROUTES, own=True),
    ),
)

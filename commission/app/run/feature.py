"""The run: what drives, the localizer over it, its time line, curves and marks on the floor."""

from __future__ import annotations

from commission.app.base.feature import ASSOCIATION, LAYERS, RUN, TIME, TUNE, Docked, Feature
from commission.app.run import reducer, variant_reducer
from commission.app.run.accumulated_layer import AccumulatedLayer
from commission.app.run.association_panel import AssociationPanel
from commission.app.run.badge import Badge
from commission.app.run.bearing_layer import BearingLayer
from commission.app.run.camera_layer import CameraLayer
from commission.app.run.camera_panel import CameraPanel
from commission.app.run.detection_layer import DetectionLayer
from commission.app.run.edits_panel import EditsPanel
from commission.app.run.figure_layer import FigureLayer
from commission.app.run.gate_layer import GateLayer
from commission.app.run.hypothesis_layer import HypothesisLayer
from commission.app.run.now_panel import NowPanel
from commission.app.run.plots import Plots
from commission.app.run.run_panel import RunPanel
from commission.app.run.scan_layer import ScanLayer
from commission.app.run.service import RunService
from commission.app.run.sighting_layer import SightingLayer
from commission.app.run.state import RunState
from commission.app.run.summary_panel import SummaryPanel
from commission.app.run.temporary_layer import TemporaryLayer
from commission.app.run.time_line import TimeLine
from commission.app.run.trail_layers import ConsistencyLayer, ReferenceLayer, TrailLayer, VariantLayer
from commission.app.run.trail_legend import TrailLegend
from commission.app.run.uncertainty_layer import UncertaintyLayer
from commission.app.run.variants_panel import VariantsPanel
from commission.app.run.vehicle_layer import VehicleLayer
from commission.app.run.wall_layers import WallPointLayer, WallTableLayer
from commission.app.run.world_panel import WorldPanel

FEATURE = Feature(
    name="run",
    reducers=(reducer, variant_reducer),
    services=(RunService,),
    layers=(
        GateLayer,
        ScanLayer,
        WallTableLayer,
        WallPointLayer,
        DetectionLayer,
        BearingLayer,
        SightingLayer,
        AccumulatedLayer,
        VehicleLayer,
        UncertaintyLayer,
        HypothesisLayer,
        TemporaryLayer,
        TrailLayer,
        VariantLayer,
        ConsistencyLayer,
        CameraLayer,
        ReferenceLayer,
        FigureLayer,
    ),
    panels=(
        Docked(make=lambda at: Badge(at.gui), tab=None, rank=10),
        Docked(make=lambda at: NowPanel(at.gui), tab=None, rank=12),
        Docked(make=lambda at: AssociationPanel(at.gui, at.post, at.browser), tab=ASSOCIATION, own=True),
        Docked(make=lambda at: RunPanel(at.gui, at.post, at.state), tab=RUN),
        Docked(make=lambda at: SummaryPanel(at.gui), tab=RUN, rank=5),
        Docked(make=lambda at: CameraPanel(at.gui), tab=RUN, rank=7),
        Docked(make=lambda at: EditsPanel(at.gui, at.post, at.state), tab=RUN, rank=10),
        Docked(make=lambda at: WorldPanel(at.gui, at.post, at.state), tab=RUN, rank=20, folder="Virtual world"),
        Docked(make=lambda at: EditsPanel(at.gui, at.post, at.state), tab=TUNE, rank=-10),
        Docked(make=lambda at: VariantsPanel(at.gui, at.post), tab=TUNE, rank=-5),
        Docked(make=lambda at: TrailLegend(at.gui), tab=LAYERS, rank=16),
        Docked(make=lambda at: TimeLine(at.gui, at.post, at.state.part(RunState).speed), tab=TIME, rank=10),
        Docked(make=lambda at: Plots(at.gui, at.post, at.browser), tab=TIME, rank=20, own=True),
    ),
)

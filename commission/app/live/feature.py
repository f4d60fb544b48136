"""Live: connections to a vehicle that drives now. What they say is shown by the run, as any other drive is."""

from __future__ import annotations

from commission.app.base.feature import RUN, SENSOR, Docked, Feature
from commission.app.live import clock_reducer, reducer, sensor_reducer
from commission.app.live.clock_panel import ClockPanel
from commission.app.live.clock_service import ClockService
from commission.app.live.drive_writer import DriveWriter
from commission.app.live.live_panel import LivePanel
from commission.app.live.sensor_panel import SensorPanel
from commission.app.live.service import LiveService
from commission.app.live.shiny_list import SeenMark
from commission.app.live.shiny_service import ShinyService

FEATURE = Feature(
    name="live",
    reducers=(reducer, clock_reducer, sensor_reducer),
    services=(LiveService, ClockService, DriveWriter, ShinyService),
    panels=(
        Docked(
            make=lambda at: LivePanel(at.gui, at.post, at.state), tab=RUN, rank=3, folder="Live vehicle", is_open=True
        ),
        Docked(make=lambda at: ClockPanel(at.gui, at.post, at.state), tab=RUN, rank=4),
        Docked(make=lambda at: SensorPanel(at.gui, at.post, at.browser), tab=SENSOR, own=True),
        Docked(make=lambda at: SeenMark(at.scene, at.browser), tab=None, own=True),
    ),
)
"""A vehicle that drives now."""

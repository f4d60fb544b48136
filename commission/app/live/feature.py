"""Live: connections to a vehicle that drives now. What they say is shown by the run, as any other drive is."""

from __future__ import annotations

from commission.app.base.feature import RUN, Docked, Feature
from commission.app.live import reducer
from commission.app.live.live_panel import LivePanel
from commission.app.live.service import LiveService

FEATURE = Feature(
    name="live",
    reducers=(reducer,),
    services=(LiveService,),
    panels=(
        Docked(
            make=lambda at: LivePanel(at.gui, at.post, at.state), tab=RUN, rank=3, folder="Live vehicle", is_open=True
        ),
    ),
)
"""A vehicle that drives now."""

"""The virtual world: true noise, constant errors and faults of the drives that the page simulates."""

from __future__ import annotations

from commission.app.base.feature import RUN, Docked, Feature
from commission.app.world import reducer
from commission.app.world.world_panel import WorldPanel

FEATURE = Feature(
    name="world",
    reducers=(reducer,),
    panels=(Docked(make=lambda at: WorldPanel(at.gui, at.post, at.state), tab=RUN, rank=20, folder="Virtual world"),),
)

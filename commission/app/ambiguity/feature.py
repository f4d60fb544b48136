"""Where a vehicle that is switched on could take its place for another one."""

from __future__ import annotations

from commission.app.ambiguity import reducer
from commission.app.ambiguity.ambiguity_layer import AmbiguityLayer
from commission.app.ambiguity.ambiguity_legend import AmbiguityLegend
from commission.app.ambiguity.ambiguity_panel import ColdStartPanel
from commission.app.ambiguity.service import AmbiguityService
from commission.app.base.feature import LAYERS, PLAN, Docked, Feature

FEATURE = Feature(
    name="ambiguity",
    reducers=(reducer,),
    services=(AmbiguityService,),
    layers=(AmbiguityLayer,),
    panels=(
        Docked(
            make=lambda at: ColdStartPanel(at.gui, at.post, at.container), tab=PLAN, rank=40, folder="Ambiguous places"
        ),
        Docked(make=lambda at: AmbiguityLegend(at.gui), tab=LAYERS, rank=12),
    ),
)

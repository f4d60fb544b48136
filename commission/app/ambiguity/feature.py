"""Where a vehicle that is switched on could take its place for another one."""

from __future__ import annotations

from commission.app.ambiguity import reducer
from commission.app.ambiguity.ambiguity_layer import AmbiguityLayer
from commission.app.ambiguity.ambiguity_legend import AmbiguityLegend
from commission.app.ambiguity.ambiguity_panel import ColdStartPanel
from commission.app.ambiguity.service import AmbiguityService
from commission.app.base.feature import LEGEND, PLAN, Docked, Feature

FEATURE = Feature(
    "ambiguity",
    reducers=(reducer,),
    services=(AmbiguityService,),
    layers=(AmbiguityLayer,),
    panels=(
        Docked(lambda at: ColdStartPanel(at.gui, at.post, at.container), PLAN, 40, folder="Ambiguous places"),
        Docked(lambda at: AmbiguityLegend(at.gui), LEGEND, 12),
    ),
)

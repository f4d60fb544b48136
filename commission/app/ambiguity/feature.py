"""Where a vehicle that is switched on could take its place for another one."""

from __future__ import annotations

from commission.app.ambiguity.ambiguity_layer import AmbiguityLayer
from commission.app.ambiguity.ambiguity_panel import ColdStartPanel
from commission.app.base.feature import PLAN, Docked, Feature

FEATURE = Feature(
    "ambiguity",
    layers=(AmbiguityLayer,),
    panels=(Docked(lambda at: ColdStartPanel(at.gui, at.post, at.container), PLAN, 40, folder="Ambiguous places"),),
)

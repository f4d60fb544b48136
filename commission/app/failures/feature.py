"""What depends on each reflector: a ranking, and the metres that fail with one."""

from __future__ import annotations

from commission.app.base.feature import PLAN, Docked, Feature
from commission.app.failures import reducer
from commission.app.failures.click_reader import FailureClicks
from commission.app.failures.failure_layer import FailingLayer
from commission.app.failures.failure_panel import FailurePanel
from commission.app.failures.service import FailureService

FEATURE = Feature(
    name="failures",
    reducers=(reducer,),
    services=(FailureService,),
    layers=(FailingLayer,),
    panels=(
        Docked(make=lambda at: FailurePanel(at.gui, at.post), tab=PLAN, rank=30, folder="What if one reflector fails"),
        Docked(make=lambda at: FailureClicks(at.scene, at.post), tab=None, rank=91),
    ),
)

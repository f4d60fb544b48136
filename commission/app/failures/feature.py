"""What depends on each reflector: a ranking, and the metres that fail with one."""

from __future__ import annotations

from commission.app.base.feature import PLAN, Docked, Feature
from commission.app.base.pointer import FloorClicks
from commission.app.failures import reducer
from commission.app.failures.actions import ClickReflector
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
        Docked(make=lambda at: FloorClicks(at.scene, at.post, ClickReflector), tab=None, rank=91),
    ),
)

"""What depends on each reflector: a ranking, and the metres that fail with one."""

from __future__ import annotations

from commission.app.base.feature import PLAN, Docked, Feature
from commission.app.failures.failure_layer import FailingLayer
from commission.app.failures.failure_panel import FailurePanel

FEATURE = Feature(
    "failures",
    layers=(FailingLayer,),
    panels=(Docked(lambda at: FailurePanel(at.gui, at.post), PLAN, 30, folder="What if one reflector fails"),),
)

"""What the features of the step Plan share until each has its own service, state and view."""

from __future__ import annotations

from commission.app.base.feature import PLAN, Docked, Feature
from commission.app.plan import reducer
from commission.app.plan.plan_panel import PlanNote
from commission.app.plan.planner import Planner

FEATURE = Feature(
    "plan",
    reducers=(reducer,),
    services=(Planner,),
    panels=(Docked(lambda at: PlanNote(at.gui), PLAN, 0),),
)

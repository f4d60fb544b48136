"""What is wrong with the site while it is edited, and what went wrong in this session."""

from __future__ import annotations

from commission.app.base.feature import PROBLEMS, Docked, Feature
from commission.app.problems.inspection import Inspection
from commission.app.problems.problems_panel import ProblemsPanel
from commission.app.problems.violation_layer import ViolationLayer

FEATURE = Feature(
    "problems",
    services=(Inspection,),
    layers=(ViolationLayer,),
    panels=(Docked(lambda at: ProblemsPanel(at.gui, at.post, at.container), PROBLEMS),),
)

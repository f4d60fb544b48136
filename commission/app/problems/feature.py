"""What is wrong with the site while it is edited, and what went wrong in this session."""

from __future__ import annotations

from commission.app.base.feature import PROBLEMS, ROUTE, Docked, Feature
from commission.app.problems import reducer
from commission.app.problems.face_panel import FacePanel, FacingOverlay
from commission.app.problems.inspection import Inspection
from commission.app.problems.problem_count import ProblemCount
from commission.app.problems.problems_panel import ProblemsPanel
from commission.app.problems.route_plots import RoutePlots
from commission.app.problems.violation_layer import ViolationLayer

FEATURE = Feature(
    name="problems",
    reducers=(reducer,),
    services=(Inspection,),
    layers=(ViolationLayer,),
    panels=(
        Docked(make=lambda at: ProblemCount(at.gui), tab=None, rank=94),
        Docked(make=lambda at: ProblemsPanel(at.gui, at.post, at.container), tab=PROBLEMS),
        Docked(make=lambda at: FacePanel(at.gui, at.post, at.browser), tab=PROBLEMS, rank=10, own=True),
        Docked(make=lambda at: FacingOverlay(at.scene, at.browser), tab=None, own=True),
        Docked(make=lambda at: RoutePlots(at.gui, at.browser), tab=ROUTE, own=True),
    ),
)

"""What the actions about problems mean. Pure; importing it registers them with `reduce`."""

from __future__ import annotations

from dataclasses import replace

from commission.app.base.actions import Sender
from commission.app.base.effects import FlyTo
from commission.app.base.reducer import Outcome, reduce
from commission.app.base.state import AppState
from commission.app.editing.editor import editor_of
from commission.app.editing.route_gestures import control_point_at
from commission.app.problems.actions import ShowProblem
from commission.studies.problems import Subject


@reduce.register
def show_problem(action: ShowProblem, state: AppState, sender: Sender) -> Outcome:
    problem = action.problem
    editor = replace(editor_of(state, sender.browser), tool=None).selecting()
    if problem.subject is Subject.REFLECTOR:
        editor = editor.selecting(problem.ids)
    elif problem.subject is Subject.STATION and problem.ids:
        editor = editor.selecting(station=problem.ids[0])
    elif problem.subject is Subject.ROUTE and problem.ids:
        near = problem.place or (0.0, 0.0)
        editor = editor.selecting(point=control_point_at(state.project, problem.ids[0], near, float("inf")))
    there = () if problem.place is None else (FlyTo(problem.place),)
    return Outcome(state.with_browser(sender.browser, editor), there)

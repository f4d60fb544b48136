"""What the actions about problems mean. Pure; importing it registers them with `reduce`."""

from __future__ import annotations

from dataclasses import replace

from commission.app.base.actions import Sender
from commission.app.base.effects import FlyTo, Tell
from commission.app.base.reducer import Outcome, reduce
from commission.app.base.state import AppState, Edit
from commission.app.editing.editor import PosedKey, PosedKind, editor_of
from commission.app.editing.reducer import with_reflectors
from commission.app.editing.route_gestures import control_point_at
from commission.app.editing.zone_reducer import ShownZone
from commission.app.problems.actions import AcceptFacing, DropFacing, FaceFromWalls, ShowProblem
from commission.app.problems.facing import Facing
from commission.errors import UsageError
from commission.site.editing.facing import faced_from_walls, said_of
from commission.studies.problems import Subject


@reduce.register
def face_from_walls(_action: FaceFromWalls, state: AppState, sender: Sender) -> Outcome:
    floor_map = state.project.floor_map
    if floor_map is None:
        raise UsageError("the project has no floor map to take directions from; expected one")
    faced = faced_from_walls(state.project.reflectors, floor_map)
    if not faced.turned:
        return Outcome(state, (Tell(said_of(faced), failed=True),))
    return Outcome(state.with_browser(sender.browser, Facing(faced, state.project)))


@reduce.register
def accept_facing(_action: AcceptFacing, state: AppState, sender: Sender) -> Outcome:
    faced = state.of_browser(sender.browser, Facing).of(state.project)
    if faced is None:
        raise UsageError("no directions of plates wait for the site as it is now; expected to find them first")
    edit = Edit(f"face {len(faced.turned)} plates from walls", sender)
    outcome = with_reflectors(state.with_browser(sender.browser, Facing()), faced.reflectors, edit)
    return replace(outcome, effects=(*outcome.effects, Tell(said_of(faced), failed=False)))


@reduce.register
def drop_facing(_action: DropFacing, state: AppState, sender: Sender) -> Outcome:
    return Outcome(state.with_browser(sender.browser, Facing()))


@reduce.register
def show_problem(action: ShowProblem, state: AppState, sender: Sender) -> Outcome:
    problem = action.problem
    editor = editor_of(state, sender.browser).using(None, state).selecting()
    if problem.subject is Subject.REFLECTOR:
        editor = editor.selecting(problem.ids)
    elif problem.subject is Subject.STATION and problem.ids:
        editor = editor.selecting(posed=PosedKey(PosedKind.STATION, problem.ids[0]))
    elif problem.subject is Subject.ROUTE and problem.ids:
        near = problem.place or (0.0, 0.0)
        editor = editor.selecting(point=control_point_at(state.project, problem.ids[0], near, float("inf")))
    elif problem.subject is Subject.ZONE and problem.ids:
        state = state.with_browser(sender.browser, ShownZone(problem.ids[0]))
    there = () if problem.place is None else (FlyTo(problem.place),)
    return Outcome(state.with_browser(sender.browser, editor), there)

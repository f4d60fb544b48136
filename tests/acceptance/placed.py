"""A suggested layout put to the test: demands of the hand-made one, and virtual drives with a reflector blocked."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from commission.localization.estimate import Mode
from commission.planning.placement import Demands, Placement, PlacementOptions, place
from commission.planning.route_prediction import NO_DAMAGE, Damage, plan_route, predict_route
from commission.planning.visibility import visibility_model
from commission.simulation.scenario import virtual_drive
from commission.site.disturbances import Disturbances
from commission.site.project import Project
from commission.site.reflectors import ReflectorMap
from commission.studies.metrics import reference_at
from tests.acceptance.judged import judge


def demands_met_by(project: Project) -> Demands:
    """The hardest demands that a project's own reflectors meet on all routes, whichever single one is blocked.

    Limits are rounded up to whole tenths of a millimetre and thousandths of a degree.
    """
    model = visibility_model(project)
    visible, worst = math.inf, np.zeros(3)
    for route in project.routes:
        planned = plan_route(project, route.name, model=model)
        visible = min(visible, planned.visible.counts().min())
        damages = [NO_DAMAGE, *(Damage(blocked=(each,)) for each in np.unique(planned.visible.indices).tolist())]
        for damage in damages:
            worst = np.maximum(worst, predict_route(planned, damage).two_sigma.max(axis=0))
    assert visible >= 2, "the hand-made layout does not survive a failure"
    position, heading = (
        math.ceil(1e4 * worst[:2].max()) * 1e-4,
        math.radians(math.ceil(1e3 * math.degrees(worst[2])) * 1e-3),
    )
    return Demands(int(visible) - 1, survive_failure=True, position_limit=position, heading_limit=heading)


def suggested(project: Project, demands: Demands) -> tuple[Project, Placement]:
    """The project with a layout from nothing in place of its own, and the layout."""
    found = place(project, options=PlacementOptions(demands, extend=False))
    return replace(project, reflectors=found.reflectors), found


@dataclass(frozen=True, slots=True, eq=False)
class BlockedDrive:
    """One drive during which one reflector of the map is nowhere to be seen."""

    operational: bool
    """Whether the supervisor let the vehicle drive from the first cycle to the last."""
    errors: np.ndarray
    """(K, 3) estimate minus truth [m, m, rad]."""
    two_sigma: np.ndarray
    """(K, 3) what the filter says [m, m, rad]."""
    metres: np.ndarray
    """(K,) way driven [m]."""
    visible: np.ndarray
    """(K,) reflectors that are visible from the true pose, without the blocked one."""


def blocked_drive(project: Project, route: str, seed: int, disturbances: Disturbances | None = None) -> BlockedDrive:
    """Drive a route with a random reflector missing in the hall; the localizer's map still has it.

    Parameters
    ----------
    project : with the layout that is put to the test.
    route : which route.
    seed : of the drive, and of the choice of the reflector.
    disturbances : what else happens; nothing when None.
    """
    reflectors = project.reflectors.reflectors
    gone = int(np.random.default_rng((seed, 17)).integers(len(reflectors)))
    hall = replace(
        project,
        reflectors=ReflectorMap(reflectors[:gone] + reflectors[gone + 1 :]),
        disturbances=disturbances or Disturbances(),
    )
    log = virtual_drive(hall, route, seed)
    judged = judge(project, route, log)
    truth = reference_at(judged.run.stamps_ns, log.reference_stamps_ns, log.reference_poses)
    steps = np.hypot(*np.diff(truth[:, :2], axis=0, prepend=truth[:1, :2]).T)
    return BlockedDrive(
        bool(np.all(judged.run.modes == Mode.OPERATIONAL)),
        judged.errors,
        2.0 * np.sqrt(np.diagonal(judged.run.covariances, axis1=1, axis2=2)),
        np.cumsum(steps),
        visibility_model(hall).visible_from_poses(truth).counts(),
    )

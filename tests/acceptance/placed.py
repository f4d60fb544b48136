"""A suggested layout put to the test: demands of the hand-made one, and virtual drives with a reflector blocked."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from commission.localization.estimate import Mode
from commission.planning.error_budget import two_sigma_of
from commission.planning.placement import Demands, Placement, PlacementOptions, place
from commission.planning.route_prediction import plan_route, restricted
from commission.planning.vehicle_visibility import vehicle_visibility
from commission.simulation.drive import DriveOptions
from commission.simulation.scenario import virtual_drive
from commission.site.disturbances import Disturbances
from commission.site.layout_brief import CandidateOptions
from commission.site.project import Project
from commission.site.reflectors import ReflectorMap
from commission.studies.metrics import reference_at
from tests.acceptance.judged import judge


def demands_met_by(project: Project) -> Demands:
    """The hardest demands that a project's own reflectors meet on all routes, whichever single one is blocked.

    Limits are those of 2-sigma, of the filter and of the error, rounded up to tenths of a millimetre and to
    thousandths of a degree.
    """
    models = vehicle_visibility(project).models
    visible, worst = [], np.zeros(3)
    for route in project.routes:
        planned = plan_route(project, route.name, models=models)
        visible.append(int(planned.sees().sum(axis=1).min()))
        everyone = np.arange(len(project.reflectors))
        for gone in (-1, *np.unique(planned.visible.indices).tolist()):
            worst = np.maximum(worst, two_sigma_of(restricted(planned, everyone != gone)).max(axis=0))
    assert min(visible) >= 2, "the hand-made layout does not survive a failure"
    position = math.ceil(1e4 * worst[:2].max()) / 1e4
    heading = math.radians(math.ceil(1e3 * math.degrees(worst[2])) / 1e3)
    return Demands(visible=min(visible) - 1, survive_failure=True, position_limit=position, heading_limit=heading)


def suggested(project: Project, demands: Demands, spacing: float = 1.0) -> tuple[Project, Placement]:
    """The project with a layout from nothing in place of its own, and the layout; candidates at a spacing [m]."""
    found = place(
        project, options=PlacementOptions(demands=demands, candidates=CandidateOptions(spacing=spacing), extend=False)
    )
    return replace(project, reflectors=found.reflectors), found


@dataclass(frozen=True, slots=True, eq=False)
class BlockedDrive:
    """One drive during which one reflector of the map is nowhere to be seen."""

    operational: bool
    """Whether the supervisor let the vehicle drive from the first cycle to the last."""
    errors: np.ndarray
    """(K, 3) estimate minus truth [m, m, rad]."""
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
        disturbances=disturbances or project.disturbances.undisturbed(),
    )
    log = virtual_drive(hall, route, seed, options=DriveOptions(whole_scans=False))
    judged = judge(project, route, log)
    truth = reference_at(judged.run.stamps_ns, log.reference_stamps_ns, log.reference_poses)
    steps = np.hypot(*np.diff(truth[:, :2], axis=0, prepend=truth[:1, :2]).T)
    return BlockedDrive(
        bool(np.all(judged.run.modes == Mode.OPERATIONAL)),
        judged.errors,
        np.cumsum(steps),
        vehicle_visibility(hall).visible_from_poses(truth).counts(),
    )


@dataclass(frozen=True, slots=True)
class RouteVerdict:
    """What many drives along one route show of the demands."""

    operational: int
    """Drives during which the supervisor never stopped the vehicle."""
    within: float
    """Share of the cycles with the error of x, y and heading each within its limit, of the worst axis [0..1]."""
    worst_metre: float
    """Largest 2-sigma of any metre, measured over the drives, as a share of its limit [1]."""
    largest: np.ndarray
    """(3,) largest error of x [m], y [m] and heading [rad]."""
    visible: int
    """Fewest reflectors visible at any time."""


def verdict(project: Project, demands: Demands, drives: Sequence[BlockedDrive]) -> RouteVerdict:
    """Hold the errors of drives along one route against the demands.

    A limit of 2-sigma is kept when twice the RMS of the error is below it at every metre, and the error itself is below
    it in the 95.4 % of the cycles that 2-sigma promises.
    """
    supervisor = project.parameters.supervisor
    position = demands.position_limit or supervisor.position_limit
    limits = np.array([position, position, demands.heading_limit or supervisor.heading_limit])
    errors = np.concatenate([drive.errors for drive in drives])
    # By their share of the way: no two drives are equally long to the millimetre.
    length = np.median([drive.metres[-1] for drive in drives]) - 1e-6
    metre = np.concatenate([drive.metres / drive.metres[-1] * length for drive in drives]).astype(int)
    two_rms = [2.0 * np.sqrt(np.mean(errors[metre == each] ** 2, axis=0)) for each in np.unique(metre)]
    return RouteVerdict(
        sum(drive.operational for drive in drives),
        float(np.mean(np.abs(errors) <= limits, axis=0).min()),
        float((np.array(two_rms) / limits).max()),
        np.abs(errors).max(axis=0),
        min(int(drive.visible.min()) for drive in drives),
    )

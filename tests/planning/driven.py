"""Virtual drives held against the prediction along their route, metre by metre: for tests and a benchmark."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from commission.io.bundled import bundled_folder
from commission.io.project_file import load_project
from commission.localization import whole_run
from commission.localization.estimate import Belief, Mode
from commission.localization.setup import LocalizerSetup
from commission.planning.error_budget import predict_errors
from commission.planning.route_prediction import PlannedRoute, PredictionOptions, plan_route, predict_route
from commission.simulation.drive import DriveOptions
from commission.simulation.scenario import start_of, virtual_drive
from commission.site.project import Project
from commission.site.reflectors import ReflectorMap
from commission.site.uncertainty import Uncertainty
from commission.studies.metrics import pose_errors, reference_at

QUICK = DriveOptions(whole_scans=False)
"""Without beams that can meet no reflector: the same detections to the last bit."""
EXACT = Uncertainty(survey=0.0, mounting_position=0.0, mounting_heading=0.0, range_bias=0.0, clock=0.0)
SITES = ("laboratory", "shop_floor", "warehouse")
AXES = {"position": [0, 1], "heading": [2]}


@dataclass(frozen=True, slots=True, eq=False)
class PerMetre:
    """Mean squared error of x [m^2], y [m^2] and heading [rad^2] in each of B metres, and where the vehicle stops."""

    squares: np.ndarray
    """(B, 3)."""
    stops: np.ndarray
    """(B,) whether the supervisor is in fail mode anywhere in the metre, or the share of the drives of which it is."""


@dataclass(frozen=True, slots=True, eq=False)
class Comparison:
    """A route as predicted and as driven."""

    predicted: PerMetre
    driven: PerMetre
    drives: int

    def __len__(self) -> int:
        """Return the number of metres."""
        return len(self.predicted.stops)

    def ratio(self, of: str) -> np.ndarray:
        """(B,) predicted 1-sigma over RMS error of the drives, of the position or the heading."""
        axes = AXES[of]
        return np.sqrt(self.predicted.squares[:, axes].sum(axis=1) / self.driven.squares[:, axes].sum(axis=1))

    def inside(self, of: str) -> float:
        """Share of metres with a ratio between 0.8 and 1.25."""
        ratio = self.ratio(of)
        return float(np.mean((ratio >= 0.8) & (ratio <= 1.25)))

    @property
    def agreement(self) -> float:
        """Share of metres of all drives in which the supervisor stops the vehicle, or does not, as predicted."""
        return float(1.0 - np.abs(self.predicted.stops - self.driven.stops).mean())


def undisturbed(site: str) -> Project:
    """A bundled site without people, glints and tilted floor, whose constants are exact and known to be."""
    project = load_project(bundled_folder("maps") / site)
    return replace(project, disturbances=project.disturbances.undisturbed(), uncertainty=EXACT)


def thinned(project: Project, keep: int) -> Project:
    """The site with every so many reflectors left, so that the supervisor has reasons to stop the vehicle."""
    return replace(project, reflectors=ReflectorMap(project.reflectors.reflectors[::keep]))


def planned_route(project: Project, route: str) -> PlannedRoute:
    """Plan a drive from a start as well known as that of the virtual drives."""
    x, y, theta = (float(sigma) for sigma in start_of(project, route).sigmas)
    return plan_route(project, route, PredictionOptions(start_sigmas=(x, y, theta)))


def predicted_along(planned: PlannedRoute) -> PerMetre:
    """Gather the prediction by metres."""
    prediction = predict_route(planned)
    squares = np.square(predict_errors(planned, prediction).sigmas)
    metre = np.minimum(planned.drive.metres, planned.drive.length - 1e-6).astype(int)
    return _gather(metre, squares, prediction.modes)


def driven_along(project: Project, route: str, length: float, seed: int) -> PerMetre:
    """One virtual drive, localized, and its errors gathered by the metres of a way of the planned length [m]."""
    start = start_of(project, route)
    log = virtual_drive(project, route, seed, options=QUICK)
    run = whole_run.run(log, LocalizerSetup.of(project), Belief(0, start.pose, np.diag(start.sigmas**2)))
    truth = reference_at(run.stamps_ns, log.reference_stamps_ns, log.reference_poses)
    # Scans of a clock that is off are stamped before the first or after the last pose that is known.
    known = np.isfinite(truth[:, 0])
    truth, means, modes = truth[known], run.means[known], run.modes[known]
    steps = np.hypot(*np.diff(truth[:, :2], axis=0, prepend=truth[:1, :2]).T)
    # The follower's way is not exactly the planned one: by its share, so that both end together.
    metre = (np.cumsum(steps) / steps.sum() * (length - 1e-6)).astype(int)
    return _gather(metre, pose_errors(means, truth) ** 2, modes)


def compare(planned: PlannedRoute, drives: Iterable[PerMetre]) -> Comparison:
    """Hold drives against the prediction of their route."""
    together = tuple(drives)
    driven = PerMetre(
        np.mean([drive.squares for drive in together], axis=0), np.mean([drive.stops for drive in together], axis=0)
    )
    return Comparison(predicted_along(planned), driven, len(together))


def _gather(metre: np.ndarray, squares: np.ndarray, modes: np.ndarray) -> PerMetre:
    """Means of the scans in each metre, rests included, and whether any of them fails."""
    first = np.unique(metre, return_index=True)[1]
    counts = np.diff(np.append(first, len(metre)))[:, np.newaxis]
    return PerMetre(np.add.reduceat(squares, first) / counts, np.maximum.reduceat(modes == Mode.FAIL, first))

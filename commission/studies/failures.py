"""What if a reflector fails: which reflectors the routes depend on, one at a time and one after the other.

The figures themselves come from `planning.dependence`; files and pictures are elsewhere.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from commission.compiled import warm_up
from commission.planning.dependence import Dependence, Failure, FailureOptions, dependences
from commission.planning.dependence import worst_failures as worst_of
from commission.planning.route_prediction import Damage, PlannedRoute, PredictionOptions
from commission.planning.visibility import VisibilityOptions
from commission.progress import Progress, part, silent
from commission.site.project import Project
from commission.site.reflectors import ReflectorMap
from commission.studies.drives import DrivesInput, PlannedDrives, plan_drives
from commission.studies.inputs import StudyInput
from commission.studies.kernels import DRIVES

COMPILING, PLANNING = 0.2, 0.4
"""Shares of the time until which kernels are compiled, and drives planned."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class FailuresInput(StudyInput):
    """What a ranking of the reflectors by what depends on them depends on."""

    drives: DrivesInput
    """The site and the routes that are asked about."""
    failure: Failure = Failure.BLOCKED
    """What happens to each reflector in turn."""
    fallen: tuple[int, ...] = ()
    """Indices of the reflectors that are blocked already, in the order of failing."""

    @staticmethod
    def of(
        project: Project,
        failure: Failure = Failure.BLOCKED,
        fallen: Iterable[str] = (),
        *,
        prediction: PredictionOptions | None = None,
        visibility: VisibilityOptions | None = None,
    ) -> FailuresInput:
        """Take what the study reads from a project, on all its routes.

        Parameters
        ----------
        project : the site.
        failure : what happens to each reflector in turn.
        fallen : ids of the reflectors that are blocked already; one that is no more does not count.
        prediction, visibility : how the routes are predicted, and what counts as visible.
        """
        names = [reflector.id for reflector in project.reflectors.reflectors]
        return FailuresInput(
            drives=DrivesInput.of(project, None, prediction, visibility),
            failure=failure,
            fallen=tuple(names.index(name) for name in fallen if name in names),
        )


@dataclass(frozen=True, slots=True, eq=False)
class FailuresResult:
    """Reflectors ranked by what depends on them."""

    drives: PlannedDrives
    """The routes, in the order of each dependence's parts."""
    fallen: tuple[int, ...]
    """Indices of the reflectors that have failed before, in their order."""
    ranking: tuple[Dependence, ...]
    """The one on which most depends first."""

    @property
    def planned(self) -> tuple[PlannedRoute, ...]:
        """The drives along the routes."""
        return self.drives.planned

    @property
    def reflectors(self) -> ReflectorMap:
        """The reflectors that were ranked."""
        return self.drives.inputs.reflectors


def failures(inputs: FailuresInput, progress: Progress = silent, known: PlannedDrives | None = None) -> FailuresResult:
    """Let each reflector in turn fail on every route, beside those that have failed already.

    Parameters
    ----------
    inputs : the site, the routes and which failure.
    progress : told how far it is; may raise to cancel.
    known : drives that are at hand; they are planned anew unless they are of this very site.
    """
    warm_up(DRIVES, part(progress, 0.0, COMPILING))
    drives = plan_drives(inputs.drives, part(progress, COMPILING, PLANNING), known)
    options = FailureOptions(inputs.failure, given=Damage(blocked=inputs.fallen))
    ranking = dependences(drives.planned, options, part(progress, PLANNING, 1.0))
    return FailuresResult(drives, inputs.fallen, ranking)


def worst_failures(
    inputs: DrivesInput, count: int, progress: Progress = silent, known: PlannedDrives | None = None
) -> FailuresResult:
    """Block reflectors one after the other, each time the one on which most depends then.

    Parameters
    ----------
    inputs : the site and the routes.
    count : number of failures.
    progress, known : as for `failures`.

    Returns
    -------
    result : its ranking is in the order of failing.
    """
    warm_up(DRIVES, part(progress, 0.0, COMPILING))
    drives = plan_drives(inputs, part(progress, COMPILING, PLANNING), known)
    return FailuresResult(drives, (), worst_of(drives.planned, count, progress=part(progress, PLANNING, 1.0)))

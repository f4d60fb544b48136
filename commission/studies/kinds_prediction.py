"""What the filter will say along a route by all that corrects it: walls, tags, bearings and goods beside reflectors.

`prediction` goes by ranges and bearings of reflectors, in closed form and quickly. Other kinds depend on whole scans
and on where a camera looks, so that here the route is driven a few times in a virtual hall without people or faults.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from commission.geometry.arrays import FloatArray, IntArray, read_only
from commission.localization.estimate import Belief, Mode
from commission.localization.run_columns import RunColumns
from commission.localization.setup import LocalizerSetup
from commission.localization.supervisor import position_two_sigma
from commission.localization.whole_run import run
from commission.progress import Progress, part, silent
from commission.simulation.scenario import start_of, virtual_drive
from commission.site.disturbances import Disturbances, Reel, WheelNoise
from commission.site.floor_map import FloorMap
from commission.site.parameters import Parameters
from commission.site.project import Project
from commission.site.record_log import RecordLog
from commission.site.reflectors import ReflectorMap
from commission.site.routes import Route
from commission.site.scanner import Scanner
from commission.site.tags import Tag, TagCamera
from commission.site.uncertainty import Uncertainty
from commission.site.vehicle import Vehicle
from commission.site.zones import Zone
from commission.studies.inputs import StudyInput
from commission.studies.kinds import BEARINGS, CONTOURS, KINDS, REFLECTORS, TAGS, TEMPORARY, corrected_by

DRIVES = 3
"""Drives whose covariances are averaged: which beams and bearings pass a gate is chance, and little depends on it."""
FIGURES = 6
"""Of a metre, before the cycles that each kind corrects: 2-sigma of position and heading, three variances, stops."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class KindsInput(StudyInput):
    """All that the drives along one route depend on."""

    reflectors: ReflectorMap
    """The reflector map."""
    floor_map: FloorMap | None
    """Walls, and their contours."""
    vehicle: Vehicle
    """Wheels and outline."""
    scanners: tuple[Scanner, ...]
    """Lasers, and a goniometer where there is one."""
    tags: tuple[Tag, ...]
    """Tags of the site."""
    tag_camera: TagCamera
    """The camera that sees them."""
    zones: tuple[Zone, ...]
    """Where which kinds correct the pose."""
    parameters: Parameters
    """Tunables of the localizer."""
    uncertainty: Uncertainty
    """How well the constants of the site and the vehicle are known."""
    wheels: WheelNoise
    """True noise of the wheels."""
    reels: tuple[Reel, ...]
    """Goods that stand in the virtual hall, come and go."""
    route: Route
    """What is driven."""

    @staticmethod
    def of(project: Project, route: str) -> KindsInput:
        """Take what the study reads from a project.

        Parameters
        ----------
        project : the site.
        route : name of the route.

        Raises
        ------
        UsageError
            unknown route.
        """
        return KindsInput(
            reflectors=project.reflectors,
            floor_map=project.floor_map,
            vehicle=project.vehicle,
            scanners=project.scanners,
            tags=project.tags,
            tag_camera=project.tag_camera,
            zones=project.zones,
            parameters=project.parameters,
            uncertainty=project.uncertainty,
            wheels=project.disturbances.wheels,
            reels=project.disturbances.reels if project.parameters.temporary.enabled else (),
            route=project.route(route),
        )

    def site(self) -> Project:
        """Return the virtual hall: nobody in it, constants as they are taken to be."""
        return Project(
            reflectors=self.reflectors,
            floor_map=self.floor_map,
            vehicle=self.vehicle,
            scanners=self.scanners,
            tags=self.tags,
            tag_camera=self.tag_camera,
            zones=self.zones,
            parameters=self.parameters,
            uncertainty=self.uncertainty,
            disturbances=Disturbances(wheels=self.wheels, reels=self.reels),
            routes=(self.route,),
        )


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class KindsPrediction:
    """What is to be expected in each of B metres of a route."""

    inputs: KindsInput
    """The route."""
    kinds: tuple[str, ...]
    """Those of `KINDS` that correct the pose of this vehicle."""
    length: float
    """Length of the route [m]."""
    metre: IntArray
    """(B,) number of the metre."""
    position: FloatArray
    """(B,) 2-sigma of the position that the supervisor holds against its limit [m]: the largest of the metre, as the
    mean of the drives."""
    heading: FloatArray
    """(B,) the same of the heading [rad]."""
    variances: FloatArray
    """(B, 3) mean variance of x [m^2], y [m^2] and heading [rad^2] over the cycles of the metre."""
    stops: FloatArray
    """(B,) share of the drives that the supervisor stops in the metre [0..1]."""
    corrections: FloatArray
    """(B, 5) cycles of the metre in which each of `KINDS` corrects the pose, as the mean of the drives."""


def kinds_beside_ranges(project: Project | KindsInput) -> tuple[str, ...]:
    """Kinds with which a vehicle localizes besides ranges and bearings of reflectors; none where there are no others.

    Parameters
    ----------
    project : the site.
    """
    parameters = project.parameters
    temporary = parameters.temporary
    reels = project.reels if isinstance(project, KindsInput) else project.disturbances.reels
    has_goods = bool(reels) or (temporary.corners and project.floor_map is not None)
    there = {
        CONTOURS: parameters.contour.seen_of(project.floor_map) is not None,
        TAGS: parameters.tag.enabled and bool(project.tags),
        BEARINGS: parameters.bearing.enabled and any(each.is_goniometer for each in project.scanners),
        TEMPORARY: temporary.enabled and temporary.most > 0 and has_goods,
    }
    return tuple(kind for kind, is_there in there.items() if is_there)


def kinds_prediction(inputs: KindsInput, progress: Progress = silent) -> KindsPrediction:
    """Drive a route and gather what the filter says of itself, metre by metre.

    Parameters
    ----------
    inputs : the site and the route.
    progress : told how far it is; may raise to cancel.
    """
    site, name = inputs.site(), inputs.route.name
    setup, start = LocalizerSetup.of(site), start_of(site, name)
    rows: list[tuple[IntArray, FloatArray, float]] = []
    for number in range(DRIVES):
        log = virtual_drive(site, name, number, progress=part(progress, number / DRIVES, (number + 0.8) / DRIVES))
        columns = run(log, setup, Belief(0, start.pose, np.diag(start.sigmas**2)))
        metres, length = metres_of(columns, log)
        rows.append((*_per_metre(columns, metres, inputs.parameters), length))
    progress(1.0, "driving")
    known = np.unique(np.concatenate([metre for metre, _, _ in rows]))
    # A metre that one drive has no cycle in, as a vehicle is fast or the last metre short, is the mean of the others.
    table = np.full((DRIVES, len(known), FIGURES + len(KINDS)), np.nan)
    for number, (metre, figures, _) in enumerate(rows):
        table[number, np.searchsorted(known, metre)] = figures
    mean = np.nanmean(table, axis=0)
    ranging = () if all(scanner.is_goniometer for scanner in inputs.scanners) else (REFLECTORS,)
    return KindsPrediction(
        inputs=inputs,
        kinds=(*ranging, *kinds_beside_ranges(inputs)),
        length=float(np.mean([length for _, _, length in rows])),
        metre=read_only(known),
        position=read_only(mean[:, 0]),
        heading=read_only(mean[:, 1]),
        variances=read_only(mean[:, 2:5]),
        stops=read_only(mean[:, 5]),
        corrections=read_only(mean[:, FIGURES:]),
    )


def metres_of(columns: RunColumns, log: RecordLog) -> tuple[FloatArray, float]:
    """(K,) way that a virtual vehicle has driven at each cycle [m], and the whole way [m].

    Parameters
    ----------
    columns : the run.
    log : its records, with the truth.
    """
    way = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(log.reference_poses[:, :2], axis=0).T))))
    metres = np.interp(columns.stamps_ns.astype(np.float64), log.reference_stamps_ns.astype(np.float64), way)
    return metres, float(way[-1])


def _per_metre(columns: RunColumns, metres: FloatArray, parameters: Parameters) -> tuple[IntArray, FloatArray]:
    """(B,) metres of a drive and (B, 11) its figures in each, in the order of `KindsPrediction`."""
    metre, first = np.unique(metres.astype(np.int64), return_index=True)
    counts = np.diff(np.append(first, len(metres)))[:, np.newaxis]
    variances = np.diagonal(columns.covariances, axis1=1, axis2=2)
    largest, total = np.maximum.reduceat, np.add.reduceat
    position = position_two_sigma(columns.covariances, parameters.supervisor)
    figures = (
        largest(position, first)[:, np.newaxis],
        largest(2.0 * np.sqrt(variances[:, 2]), first)[:, np.newaxis],
        total(variances, first) / counts,
        largest((columns.modes != Mode.OPERATIONAL).astype(np.float64), first)[:, np.newaxis],
        total(corrected_by(columns).astype(np.float64), first),
    )
    return metre, np.concatenate(figures, axis=1)

"""Coverage of a site: what its scanners see over the floor and how well it can localize there, with a summary.

The figures themselves come from `planning`; files and images are elsewhere.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from commission.compiled import warm_up
from commission.geometry.arrays import BoolArray, FloatArray, IntArray
from commission.geometry.gaussian import ellipse_axes
from commission.localization.zones import counts_at
from commission.planning.contour_coverage import WHOLE_POSE, ContourCoverage, contour_coverage
from commission.planning.coverage import Coverage, Lattice, lattice_of
from commission.planning.coverage import coverage as over_lattice
from commission.planning.dilution import FixOptions, Heading, Measurement, fix_options, odometry_prior
from commission.planning.error_budget import CONTRIBUTIONS
from commission.planning.fix_ellipses import every_nth, position_covariances
from commission.planning.floor_budget import BudgetSite, FloorBudget, floor_budget
from commission.planning.tag_coverage import TagCoverage, tag_coverage
from commission.planning.temporary_coverage import reels_in_sight
from commission.planning.vehicle_visibility import VehicleVisibility, vehicle_visibility
from commission.planning.visibility import VisibilityOptions
from commission.progress import Progress, part, silent
from commission.site.disturbances import Reel
from commission.site.floor_map import FREE, FloorMap
from commission.site.parameters import ContourParameters, Parameters, SupervisorParameters, TemporaryParameters
from commission.site.parts import HasFloorMap
from commission.site.project import Project
from commission.site.reflectors import ReflectorMap
from commission.site.routes import Route
from commission.site.scanner import Scanner
from commission.site.tags import Tag, TagCamera
from commission.site.uncertainty import Uncertainty
from commission.site.zones import ObservationKind, Zone
from commission.studies.inputs import StudyInput
from commission.studies.kernels import CONTOURS, DILUTION, SEVERAL_SCANNERS, SIGHT

Number = int | float | None

FINEST = 0.1
"""Smallest distance between points, where it is not chosen [m]."""
FINEST_OF_WALLS = 0.2
"""The same where walls are looked at by several scanners, each of which stands elsewhere in every heading [m]."""
LONGEST_SIDE = 400
"""Points along the longer side of the floor then: as many as it has pixels on a small screen."""
ROUND_SPACINGS = (0.1, 0.2, 0.25, 0.5, 1.0, 2.0)
"""Distances between points then [m], and whatever is needed beyond them."""
USUAL_SPEED = 0.5
"""Of the vehicle, where there is no route to take it from [m/s]."""
LEAST_PRIOR = 1e-6
"""1-sigma of what odometry promises where its noise is zero [m, rad]."""
COMPILING, PREPARING = 0.3, 0.4
"""Shares of the time until which kernels are compiled, and walls and reflectors prepared."""


ADDING = 0.7
"""Share of the time after which constants are added, where that is asked for."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CoverageOptions:
    """What is asked of every point of the floor."""

    measurement: Measurement = Measurement.RANGE_BEARING
    """What one scan measures of each reflector."""
    heading: Heading = Heading.BY_SCANNER
    """Heading of the vehicle at each point: the worst, unless a scanner sees all around."""
    given_heading: float = 0.0
    """Heading of the vehicle where it is given [rad], map frame."""
    on_odometry: float = 1.0
    """Way driven on odometry since the last fix [m]; read with odometry as a prior only."""
    blocked_per_m: float = 0.0
    """Probability per metre of ray that a person blocks it [1/m]."""
    visibility: VisibilityOptions = field(default_factory=VisibilityOptions)
    """What counts as visible."""
    spacing: float | None = None
    """Distance between neighboring points [m]. None: a round one that keeps the picture small."""
    with_constants: bool = False
    """Whether it is told what constants that are not known exactly add to the error of a fix."""
    with_contours: bool = False
    """Whether it is told what the contours of the floor map tell, too."""
    with_tags: bool = False
    """Whether it is told what tags tell, too."""
    with_temporary: bool = False
    """Whether it is told how many temporary landmarks are in sight, too."""

    def fix(self, parameters: Parameters, scanners: tuple[Scanner, ...], speed: float) -> FixOptions:
        """What is asked of a fix, with the noise that the localizer assumes.

        Parameters
        ----------
        parameters : noise of a measurement, growth of odometry's uncertainty.
        scanners : of the vehicle.
        speed : of the vehicle [m/s].
        """
        position, heading = odometry_prior(parameters.odometry, self.on_odometry, speed)
        return fix_options(
            parameters.observation,
            measurement=self.measurement,
            heading=self.heading.seen_by(scanners),
            given_heading=self.given_heading,
            blocked_per_m=self.blocked_per_m,
            prior_position_sigma=max(position, LEAST_PRIOR),
            prior_heading_sigma=max(heading, LEAST_PRIOR),
        )


@dataclass(frozen=True, slots=True)
class Constants:
    """What a budget of the error depends on besides."""

    uncertainty: Uncertainty
    """How well the constants of the site and the vehicle are known."""
    speed: float
    """Of the vehicle [m/s]."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class CoverageInput(StudyInput):
    """What the coverage of a floor depends on."""

    reflectors: ReflectorMap
    """The reflector map."""
    floor_map: FloorMap | None
    """Walls and free floor."""
    scanners: tuple[Scanner, ...]
    """The laser scanners."""
    routes: tuple[Route, ...]
    """Planned routes, where there is no map: they say how far the floor reaches. Else none."""
    fix: FixOptions
    """Measurement model, noise and headings."""
    visibility: VisibilityOptions
    """What counts as visible."""
    spacing: float | None
    """Distance between neighboring points [m]. None: a round one that keeps the picture small."""
    constants: Constants | None
    """How well constants are known; None where they do not matter."""
    contours: ContourParameters | None = None
    """How contours are matched; None where they do not matter."""
    zones: tuple[Zone, ...] = ()
    """Where which kinds of observation correct the pose."""
    tags: tuple[Tag, ...] | None = None
    """Tags of the site; None where they do not matter."""
    tag_camera: TagCamera | None = None
    """The camera that sees them; None where they do not matter."""
    reels: tuple[Reel, ...] = ()
    """Goods that stand in the hall; none where they do not matter."""
    temporary: TemporaryParameters | None = None
    """What of them is a landmark; None where they do not matter."""

    @staticmethod
    def of(project: Project, options: CoverageOptions | None = None) -> CoverageInput:
        """Take what the study reads from a project.

        Raises
        ------
        ValueError
            an option is out of range.
        """
        options = options or CoverageOptions()
        speed = project.routes[0].speed if project.routes else USUAL_SPEED
        return CoverageInput(
            reflectors=project.reflectors,
            floor_map=project.floor_map,
            scanners=project.scanners,
            routes=project.routes if project.floor_map is None else (),
            fix=options.fix(project.parameters, project.scanners, speed),
            visibility=replace(options.visibility, detector=project.parameters.detector),
            spacing=options.spacing,
            constants=Constants(project.uncertainty, speed) if options.with_constants else None,
            contours=project.parameters.contour if options.with_contours else None,
            tags=project.tags if options.with_tags else None,
            tag_camera=project.tag_camera if options.with_tags else None,
            reels=project.disturbances.reels if options.with_temporary else (),
            temporary=project.parameters.temporary if options.with_temporary else None,
            zones=project.zones,
        )

    def lattice(self) -> Lattice:
        """The points that are looked at."""
        if self.spacing is not None:
            return lattice_of(self, self.spacing)
        coarse = lattice_of(self, 1.0)
        several = self.contours is not None and len(self.scanners) > 1
        least = max(FINEST_OF_WALLS if several else FINEST, max(coarse.rows, coarse.columns) / LONGEST_SIDE)
        return lattice_of(self, next((spacing for spacing in ROUND_SPACINGS if spacing >= least), least))


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class CoverageResult:
    """Visibility and dilution over a floor."""

    coverage: Coverage
    """The figures at each of N points."""
    visible: VehicleVisibility
    """What is visible from where."""
    drivable: BoolArray
    """(N,) whether each point lies on floor that the map knows to be free; all of it without a map."""
    budget: FloorBudget | None = None
    """The error of a fix with all constants, and what it comes from, where that was asked for."""
    contours: ContourCoverage | None = None
    """What contours tell, where that was asked for and there is a map."""
    tags: TagCoverage | None = None
    """What tags tell, where that was asked for."""
    reels: IntArray | None = None
    """(N,) reels in sight of a scanner that looks all round, where that was asked for."""


def coverage(inputs: CoverageInput, progress: Progress = silent) -> CoverageResult:
    """Visibility and dilution over the floor of a site.

    Parameters
    ----------
    inputs : the site and what is asked.
    progress : told how far it is; may raise to cancel.

    Raises
    ------
    ValueError
        the spacing is not above 0.
    """
    lattice = inputs.lattice()
    several = (SEVERAL_SCANNERS,) if len(inputs.scanners) > 1 else ()
    walls = (CONTOURS,) if inputs.contours is not None else ()
    warm_up((SIGHT, DILUTION, *several, *walls), part(progress, 0.0, COMPILING))
    progress(COMPILING, "sight of each reflector")
    visible = vehicle_visibility(inputs, inputs.visibility)
    told = contours_of(inputs, lattice, part(progress, PREPARING, ADDING))
    begin = PREPARING if told is None else ADDING
    until = 1.0 if inputs.constants is None else ADDING + 0.5 * (1.0 - ADDING)
    counts = counts_at(inputs.zones, ObservationKind.REFLECTORS, lattice.points())
    found = over_lattice(visible, lattice, inputs.fix, part(progress, begin, until), counts)
    budget = None
    if inputs.constants is not None:
        known = inputs.constants
        site = BudgetSite(visible=visible, uncertainty=known.uncertainty, speed=known.speed)
        budget = floor_budget(found, site, part(progress, until, 1.0))
    floor = np.array(found.floor) if inputs.floor_map is None else free_floor(inputs, lattice.points())
    by_tags = tags_of(inputs, lattice, part(progress, until, 1.0))
    reels = reels_of(inputs, lattice, part(progress, until, 1.0))
    return CoverageResult(
        coverage=found, visible=visible, drivable=floor, budget=budget, contours=told, tags=by_tags, reels=reels
    )


def contours_of(inputs: CoverageInput, lattice: Lattice, progress: Progress = silent) -> ContourCoverage | None:
    """What contours tell over the floor, nothing in zones that leave them out; None if nobody asks, or without a map.

    Parameters
    ----------
    inputs : the site and what is asked.
    lattice : the points.
    progress : told how far it is; may raise to cancel.
    """
    if inputs.floor_map is None or inputs.contours is None:
        return None
    found = contour_coverage(inputs.floor_map, inputs.scanners, inputs.contours, lattice, inputs.fix, progress)
    counts = counts_at(inputs.zones, ObservationKind.CONTOURS, lattice.points())
    return replace(
        found,
        told=np.where(counts, found.told, 0).astype(np.int8),
        position_sigma=np.where(counts, found.position_sigma, math.inf),
        heading_sigma=np.where(counts, found.heading_sigma, math.inf),
        beams=np.where(counts, found.beams, 0).astype(np.int32),
    )


def tags_of(inputs: CoverageInput, lattice: Lattice, progress: Progress = silent) -> TagCoverage | None:
    """What tags tell over the floor, nothing in zones that leave them out; None if nobody asks.

    Parameters
    ----------
    inputs : the site and what is asked.
    lattice : the points.
    progress : told how far it is; may raise to cancel.
    """
    tags, camera = inputs.tags, inputs.tag_camera
    if tags is None or camera is None:
        return None
    found = tag_coverage(tags, camera, inputs.floor_map, lattice, inputs.fix, progress)
    counts = counts_at(inputs.zones, ObservationKind.TAGS, lattice.points())
    return replace(
        found,
        seen=np.where(counts, found.seen, 0),
        position_sigma=np.where(counts, found.position_sigma, math.inf),
        heading_sigma=np.where(counts, found.heading_sigma, math.inf),
        in_reach=np.where(counts, found.in_reach, 0),
    )


def reels_of(inputs: CoverageInput, lattice: Lattice, progress: Progress = silent) -> IntArray | None:
    """(N,) reels that would be temporary landmarks from each point; zones switch them off nowhere. None if nobody asks.

    Parameters
    ----------
    inputs : the site and what is asked.
    lattice : the points.
    progress : told how far it is; may raise to cancel.
    """
    reels, rule = inputs.reels, inputs.temporary
    if rule is None:
        return None
    return reels_in_sight(reels, rule, inputs.scanners, inputs.floor_map, lattice, progress)


@dataclass(frozen=True, slots=True, eq=False)
class Ellipses:
    """1-sigma ellipses of a fix at N points of drivable floor that have one."""

    points: FloatArray
    """(N, 2) their centers [m], map frame."""
    semi_axes: FloatArray
    """(N, 2) half their lengths [m], the longer one first."""
    angles: FloatArray
    """(N,) direction of the longer axis [rad], map frame."""


def ellipses_of(result: CoverageResult, spacing: float) -> Ellipses:
    """Ellipses at points of the lattice of a coverage, under its conditions; `spacing` apart at least [m]."""
    found = result.coverage
    chosen = every_nth(found.lattice, max(1, math.ceil(spacing / found.lattice.spacing - 1e-9)))
    points = found.lattice.points()[chosen[(result.drivable & found.counts)[chosen]]]
    covariances = position_covariances(result.visible, points, found.options)
    known = np.isfinite(covariances).all(axis=(1, 2))
    return Ellipses(points[known], *ellipse_axes(covariances[known]))


def free_floor(site: HasFloorMap, points: FloatArray) -> BoolArray:
    """Whether points (N, 2) [m, map frame] lie on floor that the map knows to be free; all do without a map."""
    if site.floor_map is None:
        return np.ones(len(points), dtype=np.bool_)
    grid = site.floor_map.occupancy()
    cells = grid.cells_at(points)
    inside = np.all((cells >= 0) & (cells < site.floor_map.cells.shape), axis=-1)
    row, column = np.where(inside[:, np.newaxis], cells, 0).T
    return inside & (site.floor_map.cells[row, column] == FREE)


def summary(result: CoverageResult, limits: SupervisorParameters) -> dict[str, Number]:
    """Entries of `summary.json`, by their keys; shares are of the drivable floor, None where it has no area.

    Parameters
    ----------
    result : of `coverage`.
    limits : of the supervisor, against which a fix is held.
    """
    found, on = result.coverage, result.drivable
    fixes = found.fixes
    entries: dict[str, Number] = {
        "points": int(on.sum()),
        "spacing_m": found.lattice.spacing,
        "area_m2": float(on.sum() * found.lattice.spacing**2),
        "reflectors": len(result.visible.reflectors),
        "visible_mean": _mean(fixes.visible[on]),
        "visible_min": int(fixes.visible[on].min()) if on.any() else None,
    }
    for count in (1, 2, 3):
        entries[f"share_{count}_visible"] = _mean(fixes.visible[on] >= count)
    if found.options.blocked_per_m > 0.0:
        entries |= {
            "expected_visible_mean": _mean(fixes.expected_visible[on]),
            "two_or_more_mean": _mean(fixes.two_or_more[on]),
            "three_or_more_mean": _mean(fixes.three_or_more[on]),
        }
    regular = on & np.isfinite(fixes.position_sigma)
    entries["share_with_fix"] = _mean(regular[on])
    entries["share_within_limits"] = _mean(within_limits(found, limits)[on])
    for name, values in (("position_sigma", fixes.position_sigma), ("heading_sigma", fixes.heading_sigma)):
        unit = "m" if name == "position_sigma" else "rad"
        for quantile, label in ((0.5, "median"), (0.95, "p95")):
            # Of the whole floor: where more than a twentieth has no fix, the 95 % quantile does not exist.
            entries[f"{name}_{label}_{unit}"] = _quantile(values[on], quantile)
    if result.contours is not None:
        entries |= _contour_entries(result, result.contours, limits)
    if result.tags is not None:
        entries |= _tag_entries(result, result.tags, limits)
    if result.reels is not None:
        entries |= _reel_entries(result, result.reels)
    return entries | ({} if result.budget is None else _budget_entries(result.budget, on))


def _contour_entries(
    result: CoverageResult, contours: ContourCoverage, limits: SupervisorParameters
) -> dict[str, Number]:
    """What contours alone would do, and what reflectors or contours would."""
    on = result.drivable
    within = contours_within(contours, limits)
    return {
        "contour_share_whole_pose": _mean(contours.told[on] == WHOLE_POSE),
        "contour_share_within_limits": _mean(within[on]),
        "contour_position_sigma_median_m": _quantile(contours.position_sigma[on], 0.5),
        "contour_position_sigma_p95_m": _quantile(contours.position_sigma[on], 0.95),
        "share_within_limits_by_either": _mean((within | within_limits(result.coverage, limits))[on]),
    }


def _tag_entries(result: CoverageResult, tags: TagCoverage, limits: SupervisorParameters) -> dict[str, Number]:
    """What one frame of tags would do, and what reflectors or tags would."""
    on = result.drivable
    within = _two_sigma_within(tags.position_sigma, tags.heading_sigma, limits)
    return {
        "tag_share_seen": _mean(tags.seen[on] > 0),
        "tag_share_seen_at_some_heading": _mean(tags.in_reach[on] > 0),
        "tag_share_within_limits": _mean(within[on]),
        "tag_position_sigma_median_m": _quantile(tags.position_sigma[on], 0.5),
        "tag_position_sigma_p95_m": _quantile(tags.position_sigma[on], 0.95),
        "share_within_limits_by_reflectors_or_tags": _mean((within | within_limits(result.coverage, limits))[on]),
    }


def _reel_entries(result: CoverageResult, reels: IntArray) -> dict[str, Number]:
    """Where odometry would not drift: one reel tells a direction and a distance, two the whole motion."""
    on = result.drivable
    none_fixed = on & ~np.isfinite(result.coverage.fixes.position_sigma)
    return {
        "reels_seen_mean": _mean(reels[on].astype(np.float64)),
        "reel_share_seen": _mean(reels[on] > 0),
        "reel_share_two_seen": _mean(reels[on] > 1),
        "reel_share_two_seen_without_fix": _mean(reels[none_fixed] > 1),
    }


def contours_within(contours: ContourCoverage, limits: SupervisorParameters) -> BoolArray:
    """Whether two sigma of a single match stay below the supervisor's limits at each point: (N,) array."""
    return _two_sigma_within(contours.position_sigma, contours.heading_sigma, limits)


def _budget_entries(budget: FloorBudget, on: BoolArray) -> dict[str, Number]:
    """Error of a fix with all constants, and on which share of the floor each source contributes most."""
    largest = np.array(budget.largest)[on]
    return {
        "total_sigma_median_m": _quantile(budget.sigma[on], 0.5),
        "total_sigma_p95_m": _quantile(budget.sigma[on], 0.95),
        **{f"share_{part}_largest": _mean(largest == part) for part in CONTRIBUTIONS},
    }


def within_limits(found: Coverage, limits: SupervisorParameters) -> BoolArray:
    """Whether two sigma of a single fix stay below the supervisor's limits at each point: (N,) array."""
    return _two_sigma_within(found.fixes.position_sigma, found.fixes.heading_sigma, limits)


def _two_sigma_within(position: FloatArray, heading: FloatArray, limits: SupervisorParameters) -> BoolArray:
    """(N,) whether two of each 1-sigma [m] and [rad] stay below the supervisor's limits."""
    return (2.0 * position <= limits.position_limit) & (2.0 * heading <= limits.heading_limit)


def _mean(values: NDArray[np.float64] | NDArray[np.int32] | BoolArray) -> float | None:
    """Mean, None of nothing."""
    return float(np.mean(values, dtype=np.float64)) if len(values) else None


def _quantile(values: NDArray[np.float64], share: float) -> float | None:
    """Value that a share of the points does not exceed; None where it is infinite."""
    if len(values) == 0:
        return None
    found = float(np.sort(values)[min(len(values) - 1, int(share * len(values)))])
    return found if np.isfinite(found) else None

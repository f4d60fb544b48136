"""Virtual drives without beams: who is seen comes from shadow maps, what is detected of them from a library.

For thousands of drives in which no beam matters by itself. People, glints and intensities do need them:
`needs_beams` says so, and such drives are those of `simulation.scenario`. What is not shown: reflectors seen in part,
past the edge of a wall or of another one (a few of a hundred among racks).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from commission.geometry.arrays import BoolArray, FloatArray, IntArray, read_only
from commission.geometry.se2 import compose
from commission.localization.setup import LocalizerSetup
from commission.planning.visibility import (
    VisibilityModel,
    VisibilityOptions,
    VisibleReflectors,
    build_visibility,
    visibility_models,
    walls_of,
)
from commission.simulation.constants import draw_truth, error_of, true_site
from commission.simulation.detection_library import DetectionLibrary, Sightings, draw_detections, kind_of, make_library
from commission.simulation.drive import DriveOptions, TrueMotion, drive, measure
from commission.simulation.random_faults import FALSE_RADIUS
from commission.simulation.scenario import BEAMS, LOSSES, START, WHEELS, stream_of
from commission.simulation.sightings import sightings_of
from commission.site.detection_rates import detection_rate
from commission.site.disturbances import Disturbances, ScannerError
from commission.site.path import Leg, legs_of
from commission.site.project import Project
from commission.site.record_log import RecordLog
from commission.site.reflectors import Reflector, ReflectorMap
from commission.site.scanner import Scanner, scan_moments

OWN_SHADOW = 0.02
"""A reflector that stands farther from its mapped place than this gets a shadow map of its own [m]; else it is seen
from where the mapped one is: survey errors of millimetres move no edge of a shadow by more than that."""
SIGHT = VisibilityOptions(max_incidence_deg=65.0)
"""What counts as in sight: the scanner's own angle of incidence; how many beams it gets, and what the detector makes of
them, the library knows."""


def needs_beams(disturbances: Disturbances) -> str:
    """Say what a virtual drive suffers that only beams can show; empty: nothing.

    Parameters
    ----------
    disturbances : of the drive.
    """
    parts = {
        "people": disturbances.people > 0,
        "glints": disturbances.glints_per_scan > 0.0,
        "intensities": disturbances.intensity.enabled,
    }
    return " and ".join(name for name, is_there in parts.items() if is_there)


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class ShadowWorld:
    """A site prepared for drives without beams."""

    reflectors: ReflectorMap
    """What may raise a reflector flag, as mapped: shadow maps are made of them."""
    models: tuple[VisibilityModel, ...]
    """Shadow maps, for each scanner."""
    libraries: tuple[DetectionLibrary, ...]
    """What is detected, for each scanner."""
    kinds: Mapping[tuple[float, bool, bool], int]
    """Row of each kind of reflector in the libraries."""
    legs: Mapping[str, tuple[Leg, ...]]
    """What is driven along each route."""

    @staticmethod
    def of(
        project: Project,
        setup: LocalizerSetup,
        routes: tuple[str, ...],
        *,
        legs: Mapping[str, tuple[Leg, ...]] | None = None,
    ) -> ShadowWorld:
        """Cast the shadows of a site, and fill the libraries.

        Parameters
        ----------
        project : its reflectors, shiny objects, walls and scanners.
        setup : the detector.
        routes : names of the routes that are driven.
        legs : what is driven along each of them, where it is known.
        """
        if legs is None:
            legs = legs_along(project, routes)
        reflectors = with_shiny(project)
        kinds = {kind_of(each) for each in reflectors.reflectors} | {(FALSE_RADIUS, False, False)}
        rows = {kind: row for row, kind in enumerate(sorted(kinds))}
        return ShadowWorld(
            reflectors=reflectors,
            models=visibility_models(replace(project, reflectors=reflectors), SIGHT),
            libraries=tuple(
                make_library(tuple(rows), scanner, setup, index) for index, scanner in enumerate(project.scanners)
            ),
            kinds=rows,
            legs=legs,
        )


def legs_along(project: Project, routes: tuple[str, ...]) -> dict[str, tuple[Leg, ...]]:
    """Return what is driven along each of some routes, by their names: to find it takes longer than to drive it.

    Raises
    ------
    UsageError
        an unknown route.
    """
    return {name: legs_of(project.route(name), project.vehicle, DriveOptions().limits) for name in routes}


def with_shiny(project: Project) -> ReflectorMap:
    """Return what raises a reflector flag: the reflectors, then shiny objects as posts, by their number."""
    shiny = project.disturbances.shiny_objects
    name = "shiny"
    while any(reflector.id.startswith(name) for reflector in project.reflectors.reflectors):
        name += "'"
    posts = (Reflector(id=f"{name} {n}", x=s.x, y=s.y, radius=s.radius) for n, s in enumerate(shiny, 1))
    return ReflectorMap((*project.reflectors.reflectors, *posts))


def shadow_drive(
    world: ShadowWorld,
    project: Project,
    route_name: str,
    seed: int,
    *,
    dirt: Mapping[str, float] | None = None,
) -> RecordLog:
    """Drive a route and report what is detected, with the chances of `scenario.records` but for those of single beams.

    Parameters
    ----------
    world : the site as it is mapped.
    project : the site of this drive; reflectors may be missing, moved or new.
    route_name : which route of those that the world knows.
    seed : the same gives the same drive. Start, wheels, lost scans and constants are those of a drive with beams.
    dirt : share of the scans in which a reflector is not seen, by its name.

    Raises
    ------
    UsageError, ProjectError
        as `scenario.records`.
    """
    route, legs = project.route(route_name), world.legs[route_name]
    truth = draw_truth(project, route_name, seed)
    motion = drive(route, project.vehicle, stream_of(seed, START), DriveOptions(), legs=legs)
    slips = project.disturbances.slips_per_100_m
    displacements = measure(motion, project.vehicle, truth.wheels, slips, stream_of(seed, WHEELS))
    site = true_site(project, truth)
    site = replace(site, reflectors=with_shiny(site))
    stamps, scanners = scan_moments(project.scanners, motion.duration_ns)
    parts: list[_DetectedScans] = []
    for index, scanner in enumerate(site.scanners):
        moments = _Moments(stamps[scanners == index], motion)
        sights = _Site(world, site, index, dirt or {})
        found = _detections(sights, moments, stream_of(seed, BEAMS, index))
        lost = stream_of(seed, LOSSES, index).random(len(moments.stamps_ns)) < project.disturbances.dropped_scans
        parts.append(_reported(found, lost, scanner, error_of(truth, scanner.name)))
    shown, first = np.unique(stamps, return_index=True)
    return replace(
        _log(parts, tuple(scanner.name for scanner in project.scanners)),
        odometry_stamps_ns=read_only(motion.stamps_ns),
        displacements=read_only(displacements),
        reference_stamps_ns=read_only(shown),
        reference_poses=read_only(motion.poses_at(stamps)[first]),
        truth=truth,
    )


@dataclass(frozen=True, slots=True, eq=False)
class _Moments:
    """When one scanner scans, and how the vehicle moves."""

    stamps_ns: IntArray
    motion: TrueMotion


@dataclass(frozen=True, slots=True, eq=False)
class _Site:
    """What one scanner can see in one drive."""

    world: ShadowWorld
    site: Project
    index: int
    dirt: Mapping[str, float]

    @property
    def scanner(self) -> Scanner:
        """As it is truly mounted."""
        return self.site.scanners[self.index]


@dataclass(frozen=True, slots=True, eq=False)
class _DetectedScans:
    """Detections of one scanner: (K,) stamps, (K,) how many, (n, 2) range and bearing."""

    stamps_ns: IntArray
    counts: IntArray
    range_bearing: FloatArray


def _detections(sights: _Site, moments: _Moments, rng: np.random.Generator) -> _DetectedScans:
    """What one scanner detects, before scans are lost, by its true clock."""
    scanner, each = sights.scanner, sights.site.reflectors.reflectors
    poses = compose(moments.motion.poses_at(moments.stamps_ns), scanner.mounting)
    seen = _seen(sights, poses)
    reflectors = sights.site.reflectors
    places = np.column_stack((reflectors.centers, _facings(reflectors), reflectors.radii))
    kinds = np.array([sights.world.kinds[kind_of(reflector)] for reflector in each], dtype=np.int64)
    turn = scanner.upside_down
    pairs = sightings_of(seen, poses, places, kinds, mirrored=turn)
    scans = np.repeat(np.arange(len(poses)), np.diff(seen.offsets))
    if scanner.sweep_duration > 0.0:
        pairs = _in_sweep(pairs, seen, moments, scans, (scanner, places, kinds))
    range_bearing = draw_detections(sights.world.libraries[sights.index], scanner, pairs, rng)
    kept = np.isfinite(range_bearing[:, 0]) & _told(sights, pairs, seen, rng)
    kept &= _in_light(sights.site.disturbances, moments, pairs.distances, scans)
    counts = np.bincount(scans[kept], minlength=len(poses))
    return _DetectedScans(moments.stamps_ns, counts, range_bearing[kept])


def _facings(reflectors: ReflectorMap) -> FloatArray:
    """(M,) heading of what is known to face somewhere [rad]; NaN elsewhere."""
    return np.where(reflectors.is_directed, reflectors.headings, math.nan)


def _seen(sights: _Site, T_map_scanner: FloatArray) -> VisibleReflectors:
    """Reflectors in sight of each scan, as indices into those of the drive."""
    world, now = sights.world, sights.site.reflectors.reflectors
    rows = {reflector.id: row for row, reflector in enumerate(world.reflectors.reflectors)}
    places = np.full(len(world.reflectors), -1, dtype=np.int64)
    apart: list[int] = []
    for index, reflector in enumerate(now):
        row = rows.get(reflector.id, -1)
        mapped = world.reflectors.reflectors[row]
        if row >= 0 and math.hypot(reflector.x - mapped.x, reflector.y - mapped.y) <= OWN_SHADOW:
            places[row] = index
        else:
            apart.append(index)
    # The pose of the scanner itself is given: a mounting of its own would be added.
    eye = replace(sights.scanner, mounting=np.zeros(3))
    found = replace(world.models[sights.index], scanner=eye).visible_from_poses(T_map_scanner)
    indices = places[found.indices]
    if (indices < 0).any() or apart:
        scans = np.repeat(np.arange(len(T_map_scanner)), found.counts())
        scans, indices = scans[indices >= 0], indices[indices >= 0]
        if apart:
            moved = ReflectorMap(tuple(now[index] for index in apart))
            own = build_visibility(moved, eye, walls_of(sights.site.floor_map), SIGHT).visible_from_poses(T_map_scanner)
            scans = np.concatenate((scans, np.repeat(np.arange(len(T_map_scanner)), own.counts())))
            indices = np.concatenate((indices, np.array(apart)[own.indices]))
            order = np.argsort(scans, kind="stable")
            scans, indices = scans[order], indices[order]
        counts = np.bincount(scans, minlength=len(T_map_scanner))
        return VisibleReflectors(np.concatenate(([0], np.cumsum(counts))), indices)
    return VisibleReflectors(found.offsets, indices)


def _in_sweep(
    pairs: Sightings,
    seen: VisibleReflectors,
    moments: _Moments,
    scans: IntArray,
    what: tuple[Scanner, FloatArray, IntArray],
) -> Sightings:
    """Pairs seen from where the scanner is when the beam at their bearing measures."""
    scanner, places, kinds = what
    beam = np.rint((pairs.bearings - scanner.angle_min) / scanner.angle_increment).astype(np.int64)
    offsets = np.rint(1e9 * scanner.beam_times).astype(np.int64)[np.clip(beam, 0, scanner.beam_count - 1)]
    stamps = np.clip(moments.stamps_ns[scans] + offsets, 0, moments.motion.duration_ns)
    poses = compose(moments.motion.poses_at(stamps), scanner.mounting)
    alone = (np.arange(len(scans) + 1), seen.indices)
    return sightings_of(alone, poses, places, kinds, mirrored=scanner.upside_down)


def _told(sights: _Site, pairs: Sightings, seen: VisibleReflectors, rng: np.random.Generator) -> BoolArray:
    """(n,) whether the scanner tells a reflector from other things: by its distance, and by the dirt on it."""
    rates, names = sights.scanner.detection_rates, [each.id for each in sights.site.reflectors.reflectors]
    if not rates and not sights.dirt:
        return np.ones(len(pairs.distances), np.bool_)
    clean = 1.0 - np.array([sights.dirt.get(name, 0.0) for name in names])
    is_reflector = np.arange(len(names)) < len(names) - len(sights.site.disturbances.shiny_objects)
    share = np.where(is_reflector[seen.indices], detection_rate(rates, pairs.distances), 1.0)
    return rng.random(len(share)) < share * clean[seen.indices]


def _in_light(disturbances: Disturbances, moments: _Moments, distances: FloatArray, scans: IntArray) -> BoolArray:
    """(n,) what is neither covered nor behind the floor of a tilted stretch."""
    seconds = 1e-9 * moments.stamps_ns
    limits = np.full(len(seconds), math.inf)
    for period in disturbances.covered:
        limits[(seconds >= period.start) & (seconds < period.start + period.duration)] = -1.0
    if disturbances.tilted_stretches:
        places = moments.motion.poses_at(moments.stamps_ns)[:, :2]
        for stretch in disturbances.tilted_stretches:
            near = np.hypot(places[:, 0] - stretch.x, places[:, 1] - stretch.y) <= stretch.radius
            limits[near] = np.minimum(limits[near], stretch.range_limit)
    return distances <= limits[scans]


def _reported(found: _DetectedScans, lost: BoolArray, scanner: Scanner, error: ScannerError) -> _DetectedScans:
    """What a scanner reports whose ranges and clock are off; what it stamps before the drive is lost."""
    stamps = found.stamps_ns + round(1e9 * (scanner.clock_offset + error.clock_offset))
    kept = ~lost & (stamps >= 0)
    rows = np.repeat(kept, found.counts)
    range_bearing = found.range_bearing[rows] + (error.range_bias, 0.0)
    range_bearing[:, 0] = np.maximum(range_bearing[:, 0], 0.0)
    return _DetectedScans(stamps[kept], found.counts[kept], range_bearing)


def _log(parts: list[_DetectedScans], names: tuple[str, ...]) -> RecordLog:
    """Detections of all scanners in the order of their stamps; of equal ones the first scanner comes first."""
    stamps = np.concatenate([part.stamps_ns for part in parts])
    counts = np.concatenate([part.counts for part in parts])
    scanners = np.repeat(np.arange(len(parts)), [len(part.stamps_ns) for part in parts])
    range_bearing = np.concatenate([part.range_bearing for part in parts])
    if len(parts) > 1:
        order = np.argsort(stamps, kind="stable")
        firsts = np.concatenate(([0], np.cumsum(counts)))[:-1]
        new = np.concatenate(([0], np.cumsum(counts[order])))[:-1]
        rows = np.repeat(firsts[order] - new, counts[order]) + np.arange(len(range_bearing))
        stamps, counts, scanners, range_bearing = stamps[order], counts[order], scanners[order], range_bearing[rows]
    return RecordLog(
        odometry_stamps_ns=np.empty(0, np.int64),
        displacements=np.empty((0, 3)),
        detection_stamps_ns=read_only(stamps),
        detection_offsets=read_only(np.concatenate(([0], np.cumsum(counts)))),
        range_bearing=read_only(range_bearing),
        detection_scanners=read_only(scanners),
        scanners=names,
    )

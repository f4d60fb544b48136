"""The virtual scanner: a project's walls, reflectors and disturbances prepared for `scan_kernels`, and its noise.

It knows nothing of drives or stamps; people come in as circles.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from commission.geometry.angles import within
from commission.geometry.arrays import BoolArray, FloatArray, IntArray
from commission.geometry.occupancy import OccupancyGrid
from commission.geometry.raycast import RayCaster
from commission.geometry.se2 import compose, compose_scalars
from commission.simulation.bright_kernels import meet_everything, meet_in_sweep, no_echoes, shine
from commission.simulation.echo_intensity import SHINY, TAPE, at_distance, light_of, reported
from commission.simulation.scan_kernels import FLAT_COSINE, Hall, Moment, ScannerBeams, cast_scan, cast_sweep
from commission.site.detection_rates import detection_rate
from commission.site.disturbances import Disturbances
from commission.site.glued import depths_in_walls
from commission.site.project import Project
from commission.site.reflectors import ReflectorMap
from commission.site.scanner import Scanner

GLINT_BEAMS = (1, 8)
"""Fewest and most neighboring beams of a glint: bare metal, a safety vest, the edge of a foil."""

Echoes = tuple[NDArray[np.float32], BoolArray]


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class VirtualScanner:
    """A scanner in a hall, ready to scan from any pose."""

    scanner: Scanner
    """Field of view, noise and mounting."""
    disturbances: Disturbances
    """Glints and uneven floor."""
    hall: Hall
    """Walls, reflectors, then shiny objects."""
    beams: ScannerBeams
    """The scanner's numbers."""
    everything: BoolArray
    """(N,) all of the reflective objects."""
    hidden: IntArray
    """(H,) beams in blind sectors."""
    dirt: FloatArray | None = None
    """(N,) share of the scans in which each reflective object does not shine; None: all are clean."""

    @staticmethod
    def of(project: Project, scanner: Scanner, dirt: Mapping[str, float] | None = None) -> VirtualScanner:
        """Prepare walls and reflectors for a scanner; a project without a floor map is an open field.

        Parameters
        ----------
        project : walls, reflectors and disturbances.
        scanner : one of its scanners.
        dirt : share of the scans in which a reflector does not shine, by its name; those not named are clean.
        """
        floor = project.floor_map
        grid = OccupancyGrid(np.zeros((1, 1), np.bool_), 1.0, np.zeros(3)) if floor is None else floor.occupancy()
        wall_depth = 0.0 if floor is None else 0.5 * floor.resolution
        glued = depths_in_walls(project.reflectors, grid) / FLAT_COSINE
        shiny = np.zeros(len(project.disturbances.shiny_objects))
        wall_depths = np.maximum(np.concatenate([glued, shiny]), wall_depth)
        hall = _hall(RayCaster(grid), project.reflectors, project.disturbances, wall_depths)
        return VirtualScanner(
            scanner=scanner,
            disturbances=project.disturbances,
            hall=hall,
            beams=beams_of_scanner(scanner),
            everything=np.ones(len(hall.radii), np.bool_),
            hidden=_hidden_beams(scanner),
            dirt=np.array([*(dirt.get(each.id, 0.0) for each in project.reflectors.reflectors), *shiny])
            if dirt
            else None,
        )

    def scan(
        self,
        T_map_base: FloatArray,
        circles: FloatArray,
        rng: np.random.Generator,
        *,
        whole: bool = True,
        beam_poses: FloatArray | None = None,
    ) -> Echoes:
        """One scan, taken at one instant or while the vehicle moves.

        Parameters
        ----------
        T_map_base : (3,) true pose of the vehicle [m, m, rad].
        circles : (K, 3) x, y and radius of legs and other moving things [m], map frame.
        rng : draws the noise of each beam, where there are detection rates or dirt which reflectors shine, then the
            glints; the number of draws does not depend on the pose.
        whole : False leaves out the beams that can meet no reflector (unless there are glints): what a detector finds
            is the same to the last bit, in a third of the time. A sweep is always whole.
        beam_poses : (B, 3) `T_map_base` at the time of each beam; None takes all beams at one instant. The floor's
            tilt and the circles are those of the stamp.

        Returns
        -------
        ranges : (B,) float32 [m], NaN where nothing came back.
        reflector : (B,) whether the scanner flags the beam as a reflector.
        """
        count = self.scanner.beam_count
        ranges, flags = np.empty(count, np.float32), np.empty(count, np.bool_)
        noise = rng.standard_normal((count, 2))
        T_map_scanner = self._placed(T_map_base)
        shining = self._shining(T_map_scanner, rng)
        glinting = self.disturbances.glints_per_scan > 0.0
        # Upside down, beams go clockwise: the kernel casts them from the last one on, counter-clockwise.
        if self.scanner.upside_down:
            noise = np.ascontiguousarray(noise[::-1] * (-1.0, 1.0))
        moment = Moment(T_map_scanner, self.range_limit(T_map_base), circles, noise, whole or glinting, shining)
        if beam_poses is None:
            cast_scan(self.hall, self.beams, moment, ranges, flags)
        else:
            poses = compose(beam_poses, self.scanner.mounting)
            poses = np.ascontiguousarray(poses[::-1]) if self.scanner.upside_down else poses
            cast_sweep(self.hall, self.beams, moment._replace(pose=poses), ranges, flags)
        if self.scanner.upside_down:
            ranges, flags = ranges[::-1].copy(), flags[::-1].copy()
        self._glint(ranges, flags, rng)
        self._blind(ranges, flags)
        return ranges, flags

    def bright_scan(
        self,
        T_map_base: FloatArray,
        circles: FloatArray,
        rng: np.random.Generator,
        *,
        beam_poses: FloatArray | None = None,
    ) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """One scan with intensities by `disturbances.intensity`, whether or not that is enabled.

        Parameters
        ----------
        T_map_base, circles, beam_poses : as in `scan`.
        rng : draws the noise of each beam, that of its intensity, then the glints, which are as strong as tape.

        Returns
        -------
        ranges : (B,) float32 [m], NaN where nothing came back.
        intensities : (B,) float32 [sensor's unit], 0 where nothing came back.
        """
        count, light = self.scanner.beam_count, light_of(self.disturbances.intensity)
        ranges, intensities = np.empty(count, np.float32), np.empty(count, np.float32)
        noise, flicker = rng.standard_normal((count, 2)), rng.standard_normal(count)
        T_map_scanner = self._placed(T_map_base)
        if self.scanner.upside_down:
            noise = np.ascontiguousarray(noise[::-1] * (-1.0, 1.0))
        moment = Moment(T_map_scanner, self.range_limit(T_map_base), circles, noise, True, self.everything)
        kinds = np.full(len(self.everything), TAPE, np.int64)
        kinds[len(kinds) - len(self.disturbances.shiny_objects) :] = SHINY
        echoes, far = no_echoes(count), self.beams._replace(reflector_range=math.inf)
        if beam_poses is None:
            meet_everything(self.hall, far, moment, kinds, echoes)
        else:
            poses = compose(beam_poses, self.scanner.mounting)
            poses = np.ascontiguousarray(poses[::-1]) if self.scanner.upside_down else poses
            meet_in_sweep(self.hall, far, moment._replace(pose=poses), kinds, echoes)
        shine(echoes, far, moment._replace(pose=T_map_scanner), light, flicker, ranges, intensities)
        if self.scanner.upside_down:
            ranges, intensities = ranges[::-1].copy(), intensities[::-1].copy()
        glinting = np.zeros(count, np.bool_)
        self._glint(ranges, glinting, rng)
        for i in np.flatnonzero(glinting):
            intensities[i] = reported(light.tape * at_distance(float(ranges[i]), light), light)
        self._blind(ranges, intensities)
        return ranges, intensities

    def _placed(self, T_map_base: FloatArray) -> FloatArray:
        """`T_map_scanner` (3,) of one pose [m, m, rad]: `compose`, at a tenth of the time for a single pose."""
        return np.array(compose_scalars(*T_map_base.tolist(), *self.scanner.mounting))

    def _blind(self, ranges: NDArray[np.float32], told: NDArray[Any]) -> None:
        """Take away what comes from blind sectors: ranges, and flags or intensities."""
        if len(self.hidden):
            ranges[self.hidden], told[self.hidden] = np.nan, 0

    def range_limit(self, T_map_base: FloatArray) -> float:
        """Range at which the beams meet the floor at this place [m]; infinity on even floor."""
        x, y = float(T_map_base[0]), float(T_map_base[1])
        here = (t for t in self.disturbances.tilted_stretches if math.hypot(x - t.x, y - t.y) <= t.radius)
        return min((stretch.range_limit for stretch in here), default=math.inf)

    def _shining(self, T_map_scanner: FloatArray, rng: np.random.Generator) -> BoolArray:
        """(N,) which reflective objects the scanner tells from other things in a scan: each by a chance of its own.

        What was taken for a reflector is taken for one in every scan: the rates are those of reflectors.
        """
        if not self.scanner.detection_rates and self.dirt is None:
            return self.everything
        shining, count = self.everything.copy(), len(self.everything) - len(self.disturbances.shiny_objects)
        distances = np.hypot(*(self.hall.centers[:count] - T_map_scanner[:2]).T)
        clean = 1.0 if self.dirt is None else 1.0 - self.dirt[:count]
        shining[:count] = rng.random(count) < detection_rate(self.scanner.detection_rates, distances) * clean
        return shining

    def _glint(self, ranges: NDArray[np.float32], flags: BoolArray, rng: np.random.Generator) -> None:
        """Flag a few neighboring beams at random places, at whatever they met."""
        for _ in range(int(rng.poisson(self.disturbances.glints_per_scan))):
            first = int(rng.integers(len(ranges)))
            beams = slice(first, first + int(rng.integers(GLINT_BEAMS[0], GLINT_BEAMS[1] + 1)))
            flags[beams] |= ranges[beams] <= self.scanner.reflector_range


def _hidden_beams(scanner: Scanner) -> IntArray:
    """(H,) beams that look into blind sectors, in the order in which the scanner reports them."""
    bearings = scanner.angle_min + scanner.angle_increment * np.arange(scanner.beam_count)
    return np.flatnonzero(within(bearings, scanner.reported_blind_sectors))


def beams_of_scanner(scanner: Scanner) -> ScannerBeams:
    """Numbers of a scanner for the kernels, whose beams go counter-clockwise seen from above.

    Parameters
    ----------
    scanner : its field of view, resolution, noise and ranges.
    """
    last = scanner.angle_min + (scanner.beam_count - 1) * scanner.angle_increment
    return ScannerBeams(
        -last if scanner.upside_down else scanner.angle_min,
        scanner.angle_increment,
        0.5 * math.radians(scanner.beam_width_deg),
        0.5 * scanner.beam_aperture,
        math.radians(scanner.bearing_sigma_deg),
        scanner.range_sigma,
        scanner.range[0],
        scanner.range[1],
        scanner.reflector_range,
    )


def _hall(caster: RayCaster, reflectors: ReflectorMap, disturbances: Disturbances, wall_depths: FloatArray) -> Hall:
    """Walls, then reflectors and shiny objects as the kernel's columns."""
    shiny = disturbances.shiny_objects
    facing = np.where(reflectors.is_flat & ~reflectors.is_directed, math.nan, reflectors.headings)
    return Hall(
        caster.tables,
        np.concatenate([reflectors.centers, np.array([(s.x, s.y) for s in shiny]).reshape(-1, 2)]),
        np.concatenate([reflectors.radii, np.array([s.radius for s in shiny])]),
        np.concatenate([facing, np.zeros(len(shiny))]),
        np.concatenate([reflectors.is_flat, np.zeros(len(shiny), np.bool_)]),
        wall_depths,
    )


def warm_up() -> None:
    """Compile the scan kernel on a scanner of three beams in an open field."""
    scanner = Scanner(field_of_view_deg=(-1.0, 1.0), resolution_deg=1.0)
    virtual = VirtualScanner.of(Project(scanners=(scanner,)), scanner)
    virtual.scan(np.zeros(3), np.array([[1.0, 0.0, 0.1]]), np.random.default_rng(0))
    virtual.scan(np.zeros(3), np.empty((0, 3)), np.random.default_rng(0), beam_poses=np.zeros((3, 3)))

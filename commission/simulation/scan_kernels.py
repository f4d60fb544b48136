"""One scan, compiled: beams against walls, reflectors, shiny objects and legs, kept by the nearest echo of each beam.

Objects are visited by the interval of beams that can meet them, so their number hardly matters. A scan is taken at one
instant, or as a sweep, each beam from a pose of its own.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from commission.compiled import compiled
from commission.geometry.angles import TURN, wrap_scalar
from commission.geometry.arrays import BoolArray, FloatArray
from commission.geometry.ray_kernels import RayTables, cast_ray
from commission.localization.beam_echo import (
    LARGEST_INCIDENCE,
    cylinder_echo,
    half_width_at,
    is_flagged,
    lit_part,
)

FLAT_COSINE = math.cos(LARGEST_INCIDENCE)
"""Cosine of the angle of incidence beyond which a flat reflector returns no more than a wall does."""
BEARING_MARGIN = 5.0
"""Sigmas of bearing noise by which the interval of beams of an object is widened before each beam is checked."""
NEIGHBORS = 2
"""Beams beside those that can meet a reflector which a detector also looks at, to see where a cluster ends."""


class ScannerBeams(NamedTuple):
    """What the kernel has to know of the scanner."""

    angle_min: float
    """Bearing of the first beam [rad]."""
    increment: float
    """Bearing step [rad]."""
    half_divergence: float
    """Half of a beam's divergence [rad]."""
    half_aperture: float
    """Half of a beam's width where it leaves the scanner [m]."""
    bearing_sigma: float
    """[rad]."""
    range_sigma: float
    """[m]."""
    nearest: float
    """Smallest range measured [m]."""
    farthest: float
    """Largest range measured [m]."""
    reflector_range: float
    """Range up to which reflectors are told from other things [m]."""


class Hall(NamedTuple):
    """What stands still: walls, and everything that raises a reflector flag."""

    tables: RayTables
    """Walls."""
    centers: FloatArray
    """(N, 2) reflectors and shiny objects [m], map frame."""
    radii: FloatArray
    """(N,) radius, or half the width of a flat plate [m]."""
    headings: FloatArray
    """(N,) direction that a flat plate faces [rad], map frame."""
    flat: BoolArray
    """(N,) plate instead of cylinder."""
    wall_depths: FloatArray
    """How far behind the surface of a wall's cell a reflector mounted on it may be drawn [m]."""


class Moment(NamedTuple):
    """What differs from scan to scan."""

    pose: FloatArray
    """(3,) `T_map_scanner` [m, m, rad]; of a sweep (B, 3), that at the time of each beam."""
    range_limit: float
    """Range at which every beam meets the floor [m]; infinity on even floor."""
    circles: FloatArray
    """(K, 3) x, y and radius of legs and other moving things [m], map frame."""
    noise: FloatArray
    """(B, 2) standard normal draws for bearing and range of each beam."""
    whole: bool
    """Whether all beams are cast, or only those that can meet a reflective object, and their neighbors."""
    shining: BoolArray
    """(N,) whether the scanner tells each reflective object from other things in this scan."""


class Echoes(NamedTuple):
    """What each beam has met so far."""

    bearings: FloatArray
    """(B,) true bearing of each beam [rad], scanner frame."""
    distances: FloatArray
    """(B,) true range [m]."""
    flags: BoolArray
    """(B,) met a reflective object that shines."""


@compiled
def cast_scan(hall: Hall, beams: ScannerBeams, moment: Moment, ranges: NDArray[np.float32], flags: BoolArray) -> None:
    """Take one scan.

    Parameters
    ----------
    hall, beams, moment : what stands still, the scanner, and what differs from scan to scan.
    ranges : (B,) output: range of each beam [m]; NaN where nothing comes back or the beam is not cast.
    flags : (B,) output: whether the beam met a reflective object.

    Notes
    -----
    range = min over walls and objects of the distance along the beam + sigma_r noise, at bearing angle_min + i
    increment + sigma_b noise: the scanner's noise model, by definition; echoes of reflectors as in `cylinder_echo`.
    """
    count = len(ranges)
    wanted = np.full(count, moment.whole)
    if not moment.whole:
        for k in range(len(hall.radii)):
            _want(hall, beams, moment, k, wanted)
    x, y, heading = moment.pose[0], moment.pose[1], moment.pose[2]
    reach = min(beams.farthest + 4.0 * beams.range_sigma, moment.range_limit)
    echoes = Echoes(np.empty(count), np.empty(count), flags)
    for i in range(count):
        bearing = beams.angle_min + i * beams.increment + beams.bearing_sigma * moment.noise[i, 0]
        c, s = math.cos(heading + bearing), math.sin(heading + bearing)
        echoes.bearings[i] = bearing
        echoes.distances[i] = cast_ray(hall.tables, x, y, c, s, reach)[0] if wanted[i] else math.inf
        flags[i] = False
    for k in range(len(moment.circles)):
        _meet_circle(beams, moment, k, echoes)
    for k in range(len(hall.radii)):
        _meet_reflective(hall, beams, moment, k, echoes)
    for i in range(count):
        distance = echoes.distances[i]
        if distance >= moment.range_limit:
            distance, flags[i] = moment.range_limit, False
        if distance > beams.reflector_range:
            flags[i] = False
        measured = distance + beams.range_sigma * moment.noise[i, 1]
        if not beams.nearest <= measured <= beams.farthest:
            measured, flags[i] = math.nan, False
        ranges[i] = measured


@compiled
def cast_sweep(hall: Hall, beams: ScannerBeams, moment: Moment, ranges: NDArray[np.float32], flags: BoolArray) -> None:
    """Take one scan while the scanner moves.

    Parameters
    ----------
    hall, beams, moment : as in `cast_scan`, but with a pose for each beam; all beams are cast.
    ranges, flags : (B,) outputs as in `cast_scan`.

    Notes
    -----
    range[i] = cast from poses[i]: each beam is a scan of one beam from its own pose, by definition.
    """
    for i in range(len(ranges)):
        beam = one_beam(beams, i)
        here = Moment(moment.pose[i], moment.range_limit, moment.circles, moment.noise[i : i + 1], True, moment.shining)
        cast_scan(hall, beam, here, ranges[i : i + 1], flags[i : i + 1])


@compiled
def one_beam(beams: ScannerBeams, index: int) -> ScannerBeams:
    """Return a scanner that has one beam of another alone.

    Parameters
    ----------
    beams : the other scanner.
    index : of the beam.

    Notes
    -----
    first bearing = angle_min + i increment, by definition.
    """
    return ScannerBeams(
        beams.angle_min + index * beams.increment,
        beams.increment,
        beams.half_divergence,
        beams.half_aperture,
        beams.bearing_sigma,
        beams.range_sigma,
        beams.nearest,
        beams.farthest,
        beams.reflector_range,
    )


@compiled
def _first_beam(beams: ScannerBeams, bearing: float, count: int) -> tuple[int, int]:
    """Index of the beam nearest to a bearing, and beams per full turn (both unclipped)."""
    offset = wrap_scalar(bearing - beams.angle_min - 0.5 * count * beams.increment) + 0.5 * count * beams.increment
    return round(offset / beams.increment), round(TURN / beams.increment)


@compiled
def object_interval(
    hall: Hall, beams: ScannerBeams, moment: Moment, index: int, count: int
) -> tuple[int, int, int, float, float, float]:
    """Beams that can meet a reflective object.

    Parameters
    ----------
    hall, beams, moment : as in `cast_scan`.
    index : of the object.
    count : beams of the scan.

    Returns
    -------
    first, last : of the beams, not clipped to the scan; the last is before the first where no beam can.
    turn : beams of a full turn.
    distance : of its center [m].
    bearing : of its center [rad], scanner frame.
    high : half of the angle that it takes up [rad].

    Notes
    -----
    asin(R / d) + w + 5 sigma about its bearing: what a beam of half width w can reach, derived.
    """
    dx, dy = hall.centers[index, 0] - moment.pose[0], hall.centers[index, 1] - moment.pose[1]
    distance, radius = math.hypot(dx, dy), hall.radii[index]
    if distance <= radius or distance - radius > min(beams.farthest, beams.reflector_range):
        return 0, -1, 1, distance, 0.0, 0.0
    bearing = wrap_scalar(math.atan2(dy, dx) - moment.pose[2])
    middle, turn = _first_beam(beams, bearing, count)
    high = math.asin(radius / distance)
    half_width = half_width_at(distance, beams.half_divergence, beams.half_aperture)
    reach = int((high + half_width + BEARING_MARGIN * beams.bearing_sigma) / beams.increment) + 1
    return middle - reach, middle + reach, turn, distance, bearing, high


@compiled
def _want(hall: Hall, beams: ScannerBeams, moment: Moment, index: int, wanted: BoolArray) -> None:
    """Mark the beams that can meet a reflective object, and their neighbors."""
    first, last, turn, _, _, _ = object_interval(hall, beams, moment, index, len(wanted))
    if last < first:
        return
    for k in range(first - NEIGHBORS, last + NEIGHBORS + 1):
        if k % turn < len(wanted):
            wanted[k % turn] = True


@compiled
def circle_interval(
    beams: ScannerBeams, moment: Moment, index: int, count: int
) -> tuple[int, int, int, float, float, float]:
    """Beams whose middle can meet a dull circle.

    Parameters
    ----------
    beams, moment : as in `cast_scan`.
    index : of the circle.
    count : beams of the scan.

    Returns
    -------
    first, last, turn, distance, bearing, high : as in `object_interval`.

    Notes
    -----
    asin(R / d) + 5 sigma about its bearing, derived.
    """
    radius = moment.circles[index, 2]
    dx, dy = moment.circles[index, 0] - moment.pose[0], moment.circles[index, 1] - moment.pose[1]
    distance = math.hypot(dx, dy)
    if distance <= radius or distance - radius > beams.farthest:
        return 0, -1, 1, distance, 0.0, 0.0
    bearing = wrap_scalar(math.atan2(dy, dx) - moment.pose[2])
    half = math.asin(radius / distance)
    middle, turn = _first_beam(beams, bearing, count)
    reach = int((half + BEARING_MARGIN * beams.bearing_sigma) / beams.increment) + 1
    return middle - reach, middle + reach, turn, distance, bearing, half


@compiled
def _meet_circle(beams: ScannerBeams, moment: Moment, index: int, echoes: Echoes) -> None:
    """Shorten every beam whose middle meets a dull circle."""
    radius = moment.circles[index, 2]
    first, last, turn, distance, bearing, half = circle_interval(beams, moment, index, len(echoes.flags))
    for k in range(first, last + 1):
        i = k % turn
        if i >= len(echoes.flags):
            continue
        off = wrap_scalar(echoes.bearings[i] - bearing)
        if abs(off) <= half:
            echoes.distances[i] = min(echoes.distances[i], cylinder_echo(distance, radius, off))


@compiled
def _meet_reflective(hall: Hall, beams: ScannerBeams, moment: Moment, index: int, echoes: Echoes) -> None:
    """Flag every beam of which a part meets a shining reflective object before its middle meets anything else.

    Retroreflecting tape outshines what the rest of the beam meets, so the echo is that of the lit part of the object:
    its middle gives the range.
    """
    first, last, turn, distance, bearing, high = object_interval(hall, beams, moment, index, len(echoes.flags))
    low, facing = -high, 0.0
    half_width = half_width_at(distance, beams.half_divergence, beams.half_aperture)
    if last >= first and hall.flat[index]:
        facing = plate_facing(hall, moment, index, bearing)
        if -math.cos(facing) < FLAT_COSINE:
            return
        low, high = plate_ends(distance, hall.radii[index], facing)
    for k in range(first, last + 1):
        i = k % turn
        if i >= len(echoes.flags):
            continue
        off = wrap_scalar(echoes.bearings[i] - bearing)
        lower, upper = lit_part(off, half_width, low, high)
        if not is_flagged(lower, upper, half_width, high - low):
            continue
        lit = 0.5 * (upper + lower)
        if hall.flat[index]:
            echo = distance * math.cos(facing) / math.cos(facing - lit)
        else:
            echo = cylinder_echo(distance, hall.radii[index], lit)
        if echo < echoes.distances[i] + hall.wall_depths[index]:
            echoes.distances[i], echoes.flags[i] = echo, moment.shining[index]


@compiled
def plate_facing(hall: Hall, moment: Moment, index: int, bearing: float) -> float:
    """Direction that a plate faces, from the line of sight [rad]; one of unknown direction faces the scanner.

    Parameters
    ----------
    hall, moment : as in `cast_scan`.
    index : of the plate.
    bearing : of its center [rad], scanner frame.

    Notes
    -----
    facing = heading - bearing - theta of the scanner, by definition.
    """
    facing = wrap_scalar(hall.headings[index] - bearing - moment.pose[2])
    return math.pi if math.isnan(facing) else facing


@compiled
def plate_ends(distance: float, half_width: float, facing: float) -> tuple[float, float]:
    """Bearings of a plate's two ends, relative to that of its center [rad], lower first.

    Parameters
    ----------
    distance : of its center [m].
    half_width : half of its width [m].
    facing : direction that it faces, from the line of sight [rad].

    Notes
    -----
    atan2(+-w cos(f), d -+ w sin(f)): the two ends, by definition.
    """
    # The plate stands at a right angle to `facing`, which is measured from the line of sight.
    along, across = -half_width * math.sin(facing), half_width * math.cos(facing)
    one = math.atan2(across, distance + along)
    other = math.atan2(-across, distance - along)
    return min(one, other), max(one, other)

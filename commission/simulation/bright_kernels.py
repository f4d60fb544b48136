"""One scan with intensities, compiled: every echo of a beam with its strength, then what the beam measures of them.

The geometry is that of `scan_kernels`, which casts scans with flags.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from commission.compiled import compiled
from commission.geometry.angles import wrap_scalar
from commission.geometry.arrays import FloatArray, IntArray
from commission.geometry.ray_kernels import cast_ray
from commission.localization.beam_echo import cylinder_echo, half_width_at, lit_part
from commission.simulation.echo_intensity import (
    PERSON,
    TAPE,
    WALL,
    Light,
    at_distance,
    mixed_echo,
    of_surface,
    reported,
)
from commission.simulation.scan_kernels import (
    Hall,
    Moment,
    ScannerBeams,
    circle_interval,
    object_interval,
    one_beam,
    plate_ends,
    plate_facing,
)

SLOPE_BEAMS = 2
"""Beams to each side of one from whose points on the wall its incidence is taken: the cells of a map are stairs."""
CROSSTALK_WIDTHS = 8.0
"""Widths of the overflow beyond which nothing is left of it: exp(-8) is 0.0003."""


class BrightEchoes(NamedTuple):
    """What each of B beams has met so far."""

    bearings: FloatArray
    """(B,) true bearing [rad], scanner frame."""
    behind: FloatArray
    """(B,) distance of wall or person [m]; infinity: nothing."""
    behind_kinds: IntArray
    """(B,) WALL or PERSON."""
    behind_cosines: FloatArray
    """(B,) cosine of the incidence there; of walls NaN until `_wall_cosines`."""
    before: FloatArray
    """(B,) distance of the nearest reflective object before that [m]; infinity: none."""
    before_kinds: IntArray
    """(B,) TAPE or SHINY."""
    before_cosines: FloatArray
    """(B,) cosine of the incidence there."""
    shares: FloatArray
    """(B,) share of the beam that it takes up [0..1]."""


def no_echoes(count: int) -> BrightEchoes:
    """Return so many beams that have met nothing."""
    return BrightEchoes(
        np.empty(count),
        np.full(count, math.inf),
        np.zeros(count, np.int64),
        np.full(count, math.nan),
        np.full(count, math.inf),
        np.zeros(count, np.int64),
        np.zeros(count),
        np.zeros(count),
    )


@compiled
def meet_everything(hall: Hall, beams: ScannerBeams, moment: Moment, kinds: IntArray, echoes: BrightEchoes) -> None:
    """Find the echoes of all beams of a scan.

    Parameters
    ----------
    hall, beams, moment : as in `scan_kernels.cast_scan`, of a scan at one instant.
    kinds : (N,) TAPE or SHINY of each reflective object of the hall.
    echoes : (B,) outputs; `no_echoes` before.

    Notes
    -----
    No formula: `cast_ray` of the middle of each beam, and the nearest of the objects that take up a share of it.
    """
    x, y, heading = moment.pose[0], moment.pose[1], moment.pose[2]
    reach = min(beams.farthest + 4.0 * beams.range_sigma, moment.range_limit)
    for i in range(len(echoes.bearings)):
        bearing = beams.angle_min + i * beams.increment + beams.bearing_sigma * moment.noise[i, 0]
        echoes.bearings[i] = bearing
        c, s = math.cos(heading + bearing), math.sin(heading + bearing)
        echoes.behind[i], echoes.behind_kinds[i] = cast_ray(hall.tables, x, y, c, s, reach)[0], WALL
    for k in range(len(moment.circles)):
        _meet_person(beams, moment, k, echoes)
    for k in range(len(hall.radii)):
        _meet_object(hall, beams, moment, k, int(kinds[k]), echoes)


@compiled
def meet_in_sweep(hall: Hall, beams: ScannerBeams, moment: Moment, kinds: IntArray, echoes: BrightEchoes) -> None:
    """Find the echoes of the beams of a scan while the scanner moves.

    Parameters
    ----------
    hall, beams, moment : as in `scan_kernels.cast_sweep`: a pose for each beam.
    kinds, echoes : as in `meet_everything`.

    Notes
    -----
    echoes[i] = those from poses[i]: each beam is a scan of one beam from its own pose, by definition.
    """
    for i in range(len(echoes.bearings)):
        beam = one_beam(beams, i)
        here = Moment(moment.pose[i], moment.range_limit, moment.circles, moment.noise[i : i + 1], True, moment.shining)
        one = BrightEchoes(
            echoes.bearings[i : i + 1],
            echoes.behind[i : i + 1],
            echoes.behind_kinds[i : i + 1],
            echoes.behind_cosines[i : i + 1],
            echoes.before[i : i + 1],
            echoes.before_kinds[i : i + 1],
            echoes.before_cosines[i : i + 1],
            echoes.shares[i : i + 1],
        )
        meet_everything(hall, beam, here, kinds, one)


@compiled
def shine(  # noqa: PLR0917 - outputs of a scan
    echoes: BrightEchoes,
    beams: ScannerBeams,
    moment: Moment,
    light: Light,
    noise: FloatArray,
    ranges: NDArray[np.float32],
    intensities: NDArray[np.float32],
) -> None:
    """Measure the echoes of all beams.

    Parameters
    ----------
    echoes : of the beams.
    beams, moment : noise of the ranges, and how far the floor leaves them.
    light : how strong surfaces are.
    noise : (B,) standard normal draws for the intensities.
    ranges : (B,) output [m]; NaN where nothing comes back.
    intensities : (B,) output [sensor's unit]; 0 where nothing comes back.

    Notes
    -----
    I = min(reported(sum of the echoes' strengths) x (1 + noise), largest): by definition, see `mixed_echo`.
    """
    _wall_cosines(echoes)
    for i in range(len(ranges)):
        before, behind, share = echoes.before[i], echoes.behind[i], echoes.shares[i]
        front, back = 0.0, 0.0
        if share > 0.0:
            front = share * _strength(before, echoes.before_kinds[i], echoes.before_cosines[i], light)
        if behind < math.inf:
            back = (1.0 - share) * _strength(behind, echoes.behind_kinds[i], echoes.behind_cosines[i], light)
        over, from_there = _overflow(echoes, i, light)
        distance, strength = mixed_echo((front, back, over), (before, behind, from_there), light.echo_length)
        if strength == 0.0:
            # What is black all over still stands in the way.
            distance = before if share >= 0.5 else behind
        if distance >= moment.range_limit:
            distance, strength = moment.range_limit, 0.0
        measured = distance + beams.range_sigma * moment.noise[i, 1]
        if not beams.nearest <= measured <= beams.farthest:
            measured, strength = math.nan, 0.0
        ranges[i] = measured
        told = reported(strength, light) * max(1.0 + light.noise * noise[i], 0.0)
        intensities[i] = min(told, light.largest)


@compiled
def _strength(distance: float, kind: int, cosine: float, light: Light) -> float:
    """Intensity of a surface that fills the beam."""
    return of_surface(kind, cosine, light) * at_distance(distance, light)


@compiled
def _overflow(echoes: BrightEchoes, i: int, light: Light) -> tuple[float, float]:
    """What a beam that meets no tape returns of the tape beside it, and from which distance: c I_j exp(-|b - b_j| / w).

    Of neighbors at different distances the strengths add, and their mean distance counts.
    """
    if light.crosstalk == 0.0 or (echoes.shares[i] > 0.0 and echoes.before_kinds[i] == TAPE):
        return 0.0, math.inf
    total, moment, far = 0.0, 0.0, CROSSTALK_WIDTHS * light.crosstalk_width
    count = len(echoes.bearings)
    for way in (-1, 1):
        j = i + way
        while 0 <= j < count:
            apart = abs(echoes.bearings[j] - echoes.bearings[i])
            if apart > far:
                break
            if echoes.shares[j] > 0.0 and echoes.before_kinds[j] == TAPE:
                own = echoes.shares[j] * _strength(echoes.before[j], TAPE, echoes.before_cosines[j], light)
                over = light.crosstalk * own * math.exp(-apart / light.crosstalk_width)
                total += over
                moment += over * echoes.before[j]
            j += way
    return total, (moment / total if total > 0.0 else math.inf)


@compiled
def _wall_cosines(echoes: BrightEchoes) -> None:
    """Write the cosine of the incidence of each beam on a wall, by the chord to a neighbor's point on it.

    Of the two sides the straighter one: the other may lie behind an edge. Without a neighbor the wall faces the beam.
    """
    count = len(echoes.bearings)
    for i in range(count):
        if echoes.behind_kinds[i] != WALL:
            continue
        best = -1.0
        for j in (i - SLOPE_BEAMS, i + SLOPE_BEAMS):
            if 0 <= j < count and echoes.behind_kinds[j] == WALL and echoes.behind[j] < math.inf:
                turn = echoes.bearings[j] - echoes.bearings[i]
                along = echoes.behind[j] * math.cos(turn) - echoes.behind[i]
                across = echoes.behind[j] * math.sin(turn)
                chord = math.hypot(along, across)
                if chord > 0.0:
                    best = max(best, abs(across) / chord)
        echoes.behind_cosines[i] = 1.0 if best < 0.0 else best


@compiled
def _meet_person(beams: ScannerBeams, moment: Moment, index: int, echoes: BrightEchoes) -> None:
    """Let every beam whose middle meets a dark circle end there."""
    count, radius = len(echoes.bearings), moment.circles[index, 2]
    first, last, turn, distance, bearing, half = circle_interval(beams, moment, index, count)
    for k in range(first, last + 1):
        i = k % turn
        if i >= count:
            continue
        off = wrap_scalar(echoes.bearings[i] - bearing)
        echo = cylinder_echo(distance, radius, off) if abs(off) <= half else math.inf
        if echo < echoes.behind[i]:
            echoes.behind[i], echoes.behind_kinds[i] = echo, PERSON
            echoes.behind_cosines[i] = _cylinder_cosine(distance, radius, off)


@compiled
def _meet_object(  # noqa: PLR0917 - one of the hall's objects
    hall: Hall, beams: ScannerBeams, moment: Moment, index: int, kind: int, echoes: BrightEchoes
) -> None:
    """Let a reflective object take up its share of every beam that reaches it."""
    count, radius = len(echoes.bearings), hall.radii[index]
    first, last, turn, distance, bearing, high = object_interval(hall, beams, moment, index, count)
    low, facing = -high, 0.0
    if last >= first and hall.flat[index]:
        facing = plate_facing(hall, moment, index, bearing)
        if math.cos(facing) >= 0.0:
            return
        low, high = plate_ends(distance, radius, facing)
    half_width = half_width_at(distance, beams.half_divergence, beams.half_aperture) if last >= first else 0.0
    for k in range(first, last + 1):
        i = k % turn
        if i >= count:
            continue
        lower, upper = lit_part(wrap_scalar(echoes.bearings[i] - bearing), half_width, low, high)
        if upper < lower or (upper == lower and half_width > 0.0):
            continue
        lit = 0.5 * (upper + lower)
        if hall.flat[index]:
            echo, cosine = distance * math.cos(facing) / math.cos(facing - lit), -math.cos(facing - lit)
        else:
            echo, cosine = cylinder_echo(distance, radius, lit), _cylinder_cosine(distance, radius, lit)
        if echo < echoes.before[i] and echo < echoes.behind[i] + hall.wall_depths[index]:
            echoes.before[i], echoes.before_kinds[i] = echo, kind
            echoes.before_cosines[i] = max(cosine, 0.0)
            echoes.shares[i] = (upper - lower) / (2.0 * half_width) if half_width > 0.0 else 1.0


@compiled
def _cylinder_cosine(distance: float, radius: float, bearing: float) -> float:
    """Cosine of the incidence of a ray on a cylinder: sin(i) = d sin(b) / R, the law of sines."""
    sine = min(abs(distance * math.sin(bearing)) / radius, 1.0)
    return math.sqrt(1.0 - sine * sine)

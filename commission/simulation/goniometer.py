"""A virtual goniometer: a laser that turns and reports the bearing of each reflector at the time it meets it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from commission.geometry import se2
from commission.geometry.angles import wrap
from commission.geometry.arrays import FloatArray, IntArray
from commission.geometry.raycast import RayCaster
from commission.simulation.drive import TrueMotion
from commission.site.bearing_log import BearingLog
from commission.site.project import Project
from commission.site.records import Reflex
from commission.site.reflectors import ReflectorMap
from commission.site.scanner import Scanner
from commission.site.walls import walls_of

STEP_NS = 2_000_000
"""Step at which bearings along a drive are reckoned [ns]: in between they are taken for linear, which is off by less
than a microradian where they turn with up to 1 rad/s^2."""
BEFORE_THE_REFLECTOR = 0.1
"""How far before a reflector its line of sight ends [m]: it may hang on a wall."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Goniometer:
    """A turning laser; the defaults are those of Alenya et al. 2005, section II."""

    rate: float = 8.0
    """Turns per second [Hz]."""
    bearing_sigma: float = 0.095e-3
    """1-sigma of a bearing [rad]."""
    reach: float = 30.0
    """Distance out to which it sees reflectors [m]."""


def reflexes(
    stamps_ns: IntArray,
    T_map_scanner: FloatArray,
    reflectors: ReflectorMap,
    goniometer: Goniometer,
    rng: np.random.Generator,
) -> BearingLog:
    """Return what the goniometer reports along a drive; nothing stands in its way.

    Parameters
    ----------
    stamps_ns : (K,) ascending [ns], far more often than it turns.
    T_map_scanner : (K, 3) true poses of it [m, m, rad].
    reflectors : where they truly stand.
    goniometer : the sensor.
    rng : of its noise.

    Notes
    -----
    The laser meets a reflector when its angle 2 pi rate t is the bearing, modulo a turn.
    """
    seconds = (stamps_ns - stamps_ns[0]) * 1e-9
    stamps, bearings, names = [], [], list[str]()
    for reflector in reflectors.reflectors:
        away = se2.transform_points(se2.inverse(T_map_scanner), np.array([reflector.x, reflector.y]))
        bearing = np.unwrap(np.arctan2(away[:, 1], away[:, 0]))
        turns = goniometer.rate * seconds - bearing / (2.0 * math.pi)
        met = np.arange(math.ceil(turns[0]), math.floor(turns[-1]) + 1)
        at = np.interp(met, turns, seconds)
        seen = np.interp(at, seconds, np.hypot(away[:, 0], away[:, 1])) <= goniometer.reach
        at = at[seen]
        stamps.append(stamps_ns[0] + np.round(at * 1e9).astype(np.int64))
        bearings.append(np.interp(at, seconds, bearing) + rng.normal(0.0, goniometer.bearing_sigma, len(at)))
        names.extend([reflector.id] * len(at))
    every = np.concatenate(stamps) if stamps else np.empty(0, np.int64)
    order = np.argsort(every, kind="stable")
    return BearingLog(
        stamps_ns=every[order],
        bearings=wrap(np.concatenate(bearings)[order]) if bearings else np.empty(0),
        reflectors=tuple(names[index] for index in order.tolist()),
    )


def reflexes_along(
    site: Project, scanner: Scanner, motion: TrueMotion, rng: np.random.Generator, *, late_s: float = 0.0
) -> list[Reflex]:
    """Return what the goniometer of a vehicle reports along a drive, in order of the stamps.

    Parameters
    ----------
    site : reflectors where they stand, and walls; people stand in nobody's way.
    scanner : the goniometer as it is mounted; it does not know which reflector it meets.
    motion : true motion of base.
    rng : of its noise.
    late_s : how much later than they were met reflexes are stamped [s]; what is stamped before the drive is lost.

    Returns
    -------
    reflexes : where a whole turn met nothing, one without a bearing at its end.

    Notes
    -----
    The laser meets a reflector when its angle 2 pi rate t, in the direction of its turn, is the bearing as reported,
    modulo a turn.
    """
    stamps = np.arange(0, motion.duration_ns + 1, STEP_NS, dtype=np.int64)
    T_map_scanner = se2.compose(motion.poses_at(stamps), scanner.mounting)
    walls = walls_of(site.floor_map)
    found = [_met(site, scanner, (stamps, T_map_scanner), place, walls) for place in site.reflectors.centers]
    met = np.concatenate([np.empty((0, 2)), *found])
    # Of every reflex, seen or not: what one of them draws does not depend on walls.
    met[:, 1] += math.radians(scanner.bearing_sigma_deg) * rng.standard_normal(len(met))
    met = met[np.isfinite(met[:, 0])]
    turns = math.floor(scanner.rate * motion.duration_ns * 1e-9)
    of_turn = np.floor(scanner.rate * met[:, 0]).astype(np.int64)
    blind = np.setdiff1d(np.arange(turns), of_turn)
    rows = np.concatenate([met, np.stack([(blind + 1) / scanner.rate, np.full(len(blind), np.nan)], axis=1)])
    rows = rows[np.argsort(rows[:, 0], kind="stable")]
    stamped = np.round((rows[:, 0] + late_s) * 1e9).astype(np.int64)
    return [
        Reflex(stamp, bearing)
        for stamp, bearing in zip(stamped.tolist(), wrap(rows[:, 1]).tolist(), strict=True)
        if stamp >= 0
    ]


def _met(
    site: Project, scanner: Scanner, drive: tuple[IntArray, FloatArray], place: FloatArray, walls: RayCaster
) -> FloatArray:
    """(n, 2) when [s] and at which bearing as reported [rad] the laser points at a reflector; not seen: a time of NaN.

    Parameters
    ----------
    site, scanner, walls : as in `reflexes_along`.
    drive : stamps [ns] and (K, 3) poses of the goniometer at them.
    place : (2,) of the reflector [m], map frame.
    """
    poses, seconds = drive[1], drive[0] * 1e-9
    away = se2.transform_points(se2.inverse(poses), place)
    upright = np.unwrap(np.arctan2(away[:, 1], away[:, 0]))
    reported = scanner.upright(upright)
    turns = scanner.rate * seconds - scanner.sweep_direction * reported / (2.0 * math.pi)
    numbers = np.arange(math.ceil(turns[0]), math.floor(turns[-1]) + 1)
    at = np.interp(numbers, turns, seconds)
    distances = np.interp(at, seconds, np.hypot(away[:, 0], away[:, 1]))
    seen = (distances >= scanner.range[0]) & (distances <= min(scanner.range[1], scanner.reflector_range))
    bearings = wrap(np.interp(at, seconds, upright))
    seen &= np.any([(bearings >= first) & (bearings <= last) for first, last in scanner.views], axis=0)
    if site.floor_map is not None and seen.any():
        origins = np.stack([np.interp(at, seconds, poses[:, axis]) for axis in (0, 1)], axis=1)
        part = np.maximum(distances - BEFORE_THE_REFLECTOR, 0.0) / np.maximum(distances, 1e-9)
        seen &= walls.line_of_sight(origins, origins + part[:, np.newaxis] * (place - origins))
    for period in site.disturbances.covered:
        seen &= (at < period.start) | (at >= period.start + period.duration)
    return np.stack([np.where(seen, at, np.nan), np.interp(at, seconds, reported)], axis=1)

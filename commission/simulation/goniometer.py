"""A virtual goniometer: a laser that turns and reports the bearing of each reflector at the time it meets it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from commission.geometry import se2
from commission.geometry.angles import wrap
from commission.geometry.arrays import FloatArray, IntArray
from commission.site.bearing_log import BearingLog
from commission.site.reflectors import ReflectorMap


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

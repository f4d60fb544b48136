"""What beams with a width see of a reflector, each a fan of thin rays: an oracle that shares nothing with the package.

A beam begins as wide as its aperture and widens by its divergence; each of its rays is met by the reflector or not.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

RAYS = np.linspace(-0.5, 0.5, 61)
"""Places of the rays of a beam, in its width."""
SPARE = 8
"""Beams to both sides that meet nothing."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ThickBeams:
    """A scanner that looks at one reflector straight ahead."""

    step: float
    """From beam to beam [rad]."""
    divergence: float
    """[rad]."""
    aperture: float = 0.0
    """[m]."""
    share: float = 0.2
    """Share of a beam (or of the reflector where it is narrower) that must be met for a flag; 0: any ray."""
    bearing_sigma: float = 0.0
    """[rad]."""
    range_sigma: float = 0.0
    """[m]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Target:
    """A reflector at a distance."""

    distance: float
    """[m]."""
    radius: float
    """Radius of a cylinder, half the length of a plate [m]."""
    incidence: float | None = None
    """Angle at which a plate is met [rad]; None: a cylinder."""
    background: float | None = None
    """Distance to a wall behind it, square to the sight, whose echo mixes into that of beams which meet both [m]."""


def scans_of(
    beams: ThickBeams, target: Target, count: int, rng: np.random.Generator
) -> tuple[NDArray[np.float32], NDArray[np.bool_], float, NDArray[np.float64]]:
    """Scans of a reflector that stands anywhere between two beams.

    Returns
    -------
    ranges, flags : (count, B) what each beam measures [m], NaN without a flag, and whether it flags.
    angle_min : bearing of the first beam [rad].
    bearings : (count,) of the reflector [rad].
    """
    widest = math.asin(min(1.0, target.radius / target.distance)) + 0.5 * beams.divergence
    widest += math.atan(0.5 * beams.aperture / target.distance)
    side = int((widest + 5.0 * beams.bearing_sigma) / beams.step) + SPARE
    places = (rng.random(count) - 0.5) * beams.step
    nominal = beams.step * np.arange(-side, side + 1)
    off = nominal - places[:, np.newaxis] + beams.bearing_sigma * rng.standard_normal((count, len(nominal)))
    along, met = _met(beams, target, off)
    flags = met.any(axis=-1) & (met.mean(axis=-1) >= _needed(beams, target) - 1e-9)
    mean = np.where(met, along, 0.0).sum(axis=-1) / np.maximum(met.sum(axis=-1), 1)
    if target.background is not None:
        # A mixed pixel: each ray returns what it meets, and the scanner reports their mean.
        behind = target.background / np.cos(off[..., np.newaxis] + beams.divergence * RAYS)
        mean = np.where(met, along, behind).mean(axis=-1)
    ranges = mean + beams.range_sigma * rng.standard_normal(off.shape)
    measured = ranges if target.background is not None else np.where(flags, ranges, np.nan)
    return measured.astype(np.float32), flags, float(nominal[0]), places


def _needed(beams: ThickBeams, target: Target) -> float:
    """Share of a beam's rays that must be met: of a beam that is wider than the reflector, a share of what can be."""
    width = beams.divergence * target.distance + beams.aperture
    seen = 2.0 * target.radius * math.cos(target.incidence or 0.0)
    return beams.share * (min(1.0, seen / width) if width > 0.0 else 1.0)


def _met(beams: ThickBeams, target: Target, off: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Length of each ray up to the reflector [m], and whether it is met; the reflector is on the x axis."""
    turn = off[..., np.newaxis] + beams.divergence * RAYS
    dx, dy = np.cos(turn), np.sin(turn)
    x = -np.sin(off)[..., np.newaxis] * beams.aperture * RAYS
    y = np.cos(off)[..., np.newaxis] * beams.aperture * RAYS
    to_x, to_y = target.distance - x, -y
    if target.incidence is None:
        along = to_x * dx + to_y * dy
        rest = target.radius**2 - (to_x**2 + to_y**2 - along**2)
        return along - np.sqrt(np.maximum(rest, 0.0)), rest >= 0.0
    normal_x, normal_y = math.cos(target.incidence), math.sin(target.incidence)
    along = (to_x * normal_x + to_y * normal_y) / (dx * normal_x + dy * normal_y)
    return along, np.hypot(along * dx - to_x, along * dy - to_y) <= target.radius

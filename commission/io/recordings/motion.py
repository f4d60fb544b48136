"""Odometry as vehicles report it, turned into displacements: poses, velocities, wheels. Arrays in, arrays out.

Rows of any order come in; stamps that ascend go out, and how many rows were out of order or had a stamp that was taken.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from commission.geometry import se2
from commission.geometry.angles import wrap
from commission.geometry.arrays import FloatArray, IntArray


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Sorted:
    """Rows in order of their stamps, each stamp once."""

    stamps_ns: IntArray
    """(N,) ascending [ns]."""
    rows: FloatArray
    """(N, ...) what was measured."""
    disordered: int
    """How many rows came after a later one."""
    repeated: int
    """How many rows had the stamp of another one."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Wheels:
    """The two driven wheels of a vehicle whose odometry is their turning."""

    left: str
    """Name of the left wheel's joint."""
    right: str
    """Name of the right wheel's joint."""
    radius: float
    """Radius of both [m]."""
    separation: float
    """Distance between them [m]."""
    ticks: float | None = None
    """Counts of an encoder for one turn; None where the wheels' angles are in radians."""

    def __post_init__(self) -> None:
        for name in ("radius", "separation"):
            value = getattr(self, name)
            if not 0.0 < value < math.inf:
                raise ValueError(f"wheels: {name} is {value:g}; expected metres > 0")
        if self.ticks is not None and not 0.0 < self.ticks < math.inf:
            raise ValueError(f"wheels: ticks is {self.ticks:g}; expected counts for a turn, > 0")


def in_order(stamps_ns: IntArray, rows: FloatArray) -> Sorted:
    """Sort rows by their stamps; of those with one stamp the last one stands.

    Parameters
    ----------
    stamps_ns : (N,) as they came [ns].
    rows : (N, ...) what was measured.
    """
    order = np.argsort(stamps_ns, kind="stable")
    stamps = stamps_ns[order]
    is_last = np.append(stamps[1:] != stamps[:-1], True) if len(stamps) else np.empty(0, np.bool_)
    return Sorted(
        stamps_ns=stamps[is_last],
        rows=rows[order][is_last],
        disordered=count_disordered(stamps_ns),
        repeated=int(len(stamps) - is_last.sum()),
    )


def composed(stamps_ns: IntArray, displacements: FloatArray) -> Sorted:
    """Sort displacements by their stamps; those with one stamp become one: the motions follow each other.

    Parameters
    ----------
    stamps_ns : (N,) as they came [ns].
    displacements : (N, 3) motion since the row before, in the base frame of the row before [m, m, rad].
    """
    if len(stamps_ns) < 2 or int(np.diff(stamps_ns).min()) > 0:
        return Sorted(stamps_ns=stamps_ns, rows=displacements, disordered=0, repeated=0)
    order = np.argsort(stamps_ns, kind="stable")
    stamps, rows = stamps_ns[order], displacements[order].copy()
    if not (stamps[1:] == stamps[:-1]).any():
        return Sorted(stamps_ns=stamps, rows=rows, disordered=count_disordered(stamps_ns), repeated=0)
    kept: list[int] = []
    for index in range(len(stamps)):
        if kept and stamps[kept[-1]] == stamps[index]:
            rows[kept[-1]] = se2.compose(rows[kept[-1]], rows[index])
        else:
            kept.append(index)
    chosen = np.array(kept, dtype=np.int64)
    return Sorted(
        stamps_ns=stamps[chosen],
        rows=rows[chosen],
        disordered=count_disordered(stamps_ns),
        repeated=len(stamps) - len(kept),
    )


def from_poses(poses: FloatArray) -> FloatArray:
    """(N, 3) displacements of a vehicle from (N, 3) poses [m, m, rad] in any fixed frame; the first is zero."""
    moved = np.zeros_like(poses)
    if len(poses) > 1:
        moved[1:] = se2.relative(poses[:-1], poses[1:])
        moved[1:, 2] = wrap(moved[1:, 2])
    return moved


def from_velocities(stamps_ns: IntArray, velocities: FloatArray) -> FloatArray:
    """Displacements of a vehicle from its velocities: between two of them, their mean holds.

    Parameters
    ----------
    stamps_ns : (N,) ascending [ns].
    velocities : (N, 3) ahead, to the left [m/s] and turning [rad/s], base frame.

    Returns
    -------
    displacements : (N, 3) [m, m, rad]; the first is zero.
    """
    moved = np.zeros_like(velocities)
    if len(velocities) > 1:
        seconds = np.diff(stamps_ns)[:, np.newaxis] * 1e-9
        moved[1:] = se2.exp(0.5 * (velocities[:-1] + velocities[1:]) * seconds)
    return moved


def from_wheels(turned: FloatArray, wheels: Wheels) -> FloatArray:
    """Displacements of a differential vehicle from how far its wheels turned (or velocities from their speeds).

    Parameters
    ----------
    turned : (N, 2) angle by which the left and the right wheel turned since the row before [rad], or speeds [rad/s].
    wheels : their size and distance.

    Returns
    -------
    twists : (N, 3) way ahead [m], to the left and angle [rad] along an arc: since the row before, or in a second.
    """
    ways = turned * wheels.radius
    twists = np.zeros((len(turned), 3))
    twists[:, 0] = 0.5 * (ways[:, 0] + ways[:, 1])
    twists[:, 2] = (ways[:, 1] - ways[:, 0]) / wheels.separation
    return twists


def from_wheel_angles(angles: FloatArray, wheels: Wheels) -> FloatArray:
    """Displacements of a differential vehicle from the angles of its wheels, however often they turned.

    Parameters
    ----------
    angles : (N, 2) left and right [rad], or counts of encoders where `wheels` has ticks: those start again at 2^16
        where none is larger, else at 2^32.
    wheels : their size and distance.

    Returns
    -------
    displacements : (N, 3) [m, m, rad]; the first is zero.
    """
    if wheels.ticks is not None:
        period = float(2**16 if np.ptp(angles, axis=0).max(initial=0.0) < 2**16 else 2**32)
        angles = unwrapped(angles, period) * (2.0 * math.pi / wheels.ticks)
    turned = np.zeros_like(angles)
    turned[1:] = np.diff(angles, axis=0)
    return se2.exp(from_wheels(turned, wheels)) if len(angles) else np.empty((0, 3))


def unwrapped(ticks: FloatArray, period: float) -> FloatArray:
    """Counts that go on where a counter starts again, each column by itself.

    Parameters
    ----------
    ticks : (N, ...) readings of a counter.
    period : where it starts again: 2^32 of an unsigned word. A step of half of it or more is such a start.
    """
    return np.unwrap(ticks, period=period, axis=0)


def count_disordered(stamps_ns: IntArray) -> int:
    """How many stamps are earlier than one before them."""
    return int((stamps_ns < np.maximum.accumulate(stamps_ns)).sum()) if len(stamps_ns) else 0

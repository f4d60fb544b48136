"""When temporary landmarks are born and forgotten: what waits to be seen again, what is gone, old, unsure or moved.

Nothing in here corrects the pose. Andreasson et al. 2011, Fig. 1: *Init Landmarks* and *Landmark Removals*.
"""

from __future__ import annotations

import math

from commission.compiled import compiled, compiled_inline
from commission.geometry.angles import wrap_scalar
from commission.geometry.arrays import BoolArray, FloatArray
from commission.localization.contour import ContourScan, is_blind
from commission.localization.reels import Sighting
from commission.localization.temporary_joint import add_landmark, drop_landmark
from commission.localization.temporary_memory import (
    BORN_NS,
    DRIFT_X,
    DRIFT_Y,
    KIND,
    LANDMARKS,
    MATCHES,
    MISSES,
    MOST_WAITING,
    NEXT_NUMBER,
    NUMBER,
    PER_LANDMARK,
    POSE,
    SEEN_NS,
    SHAPE,
    W_COUNT,
    W_KIND,
    W_SHAPE,
    W_X,
    W_Y,
    WAITING,
    TemporaryMemory,
)
from commission.localization.temporary_model import (
    FORGOTTEN,
    REEL,
    TemporaryModel,
)

ALIKE_REEL = 0.3
"""Share by which the radius of a sighting may differ from its landmark's: a short arc tells the radius badly."""
ALIKE_CORNER = 0.5
"""Angle by which the heading of a corner may differ [rad]."""
SMOOTHING = 0.25
"""Weight of the newest innovation in a landmark's running mean."""
CORNER_SIZE = 0.15
"""Half the distance at which two corners of one heading are one [m]."""
WAITS_WITHIN = 0.2
"""Distance within which a waiting thing must be seen again [m]: one that is carried is farther by then."""
WAITS_NS = 2_000_000_000
"""Time after which a waiting thing that was not seen again is none [ns]."""
SEEN_THROUGH = 0.3
"""How much farther than a landmark its beams must reach, so that it is gone [m]."""
DRIFT_LIMIT = 13.8
"""Squared running mean over its variance, of two degrees of freedom, beyond which a landmark is moved by somebody: one
in a thousand of those that stand still."""
SUSPECT_SCANS = 50
"""Scans more that must see a thing in one place where one has moved or vanished: else what is carried slowly would be a
landmark again and again, and take the pose along."""
SUSPECT_NEAR = 1.0
"""Distance from what has moved or vanished up to which a new thing may be it [m]."""


@compiled_inline
def is_alike(kind: int, shape: float, turned: float, known: float) -> bool:
    """Whether a sighting looks like a landmark: a reel of its radius, a corner of its heading.

    Parameters
    ----------
    kind : of both.
    shape : of the sighting: radius [m], or heading [rad].
    turned : how the frame of that heading lies in the map [rad].
    known : shape of the landmark [m], [rad].

    Notes
    -----
    |r - known| <= `ALIKE_REEL` known, or |angle| <= `ALIKE_CORNER`: by definition.
    """
    if kind == REEL:
        return abs(shape - known) <= ALIKE_REEL * known
    return abs(wrap_scalar(shape + turned - known)) <= ALIKE_CORNER


@compiled_inline
def _size(kind: int, shape: float) -> float:
    """Radius of the place that a thing takes [m]."""
    return shape if kind == REEL else CORNER_SIZE


@compiled
def is_doubtful(memory: TemporaryMemory, matched: BoolArray, kind: int, seen: Sighting) -> bool:
    """Whether a sighting lies where a landmark is, and is not of it: two things do not stand in one place.

    Parameters
    ----------
    memory : a miss is counted for the landmark.
    matched : (most,) whether a landmark was seen, or such a miss has been counted, written.
    kind, seen : what was seen, base frame.

    Notes
    -----
    |p - l| < 0.7 (r + r_l): things that stand beside each other are at least 1 apart; derived.
    """
    mean, found = memory.mean, False
    c, s = math.cos(mean[2]), math.sin(mean[2])
    x, y = mean[0] + c * seen.x - s * seen.y, mean[1] + s * seen.x + c * seen.y
    for slot in range(memory.counts[LANDMARKS]):
        at = POSE + PER_LANDMARK * slot
        if memory.marks[slot, KIND] != kind:
            continue
        apart = 0.7 * (_size(kind, seen.shape) + _size(kind, memory.shapes[slot, SHAPE]))
        if math.hypot(x - mean[at], y - mean[at + 1]) < apart:
            found = True
            if not matched[slot]:
                memory.marks[slot, MISSES] += 1
                matched[slot] = True
    return found


@compiled
def look_for_missing(memory: TemporaryMemory, matched: BoolArray, model: TemporaryModel, scan: ContourScan) -> None:
    """Count a miss for each landmark that was not seen though its beams reach farther: it was carried away.

    Parameters
    ----------
    memory : `MISSES` is written.
    matched : (most,) whether a landmark was seen.
    model : limits of the scanners.
    scan : its beams.

    Notes
    -----
    range > distance + radius + `SEEN_THROUGH` of the three beams at its bearing, by definition; behind nearer ones it
    is hidden, and no miss, nor in a blind sector, where nothing is looked at.
    """
    if scan.beams < 3:
        return
    mean, mount = memory.mean, scan.observation
    c, s = math.cos(mean[2]), math.sin(mean[2])
    for slot in range(memory.counts[LANDMARKS]):
        if matched[slot]:
            continue
        at = POSE + PER_LANDMARK * slot
        dx, dy = mean[at] - mean[0], mean[at + 1] - mean[1]
        x, y = c * dx + s * dy - mount.mount_x, c * dy - s * dx - mount.mount_y
        distance = math.hypot(x, y)
        behind = distance + SEEN_THROUGH
        if memory.marks[slot, KIND] == REEL:
            behind += memory.shapes[slot, SHAPE]
        if behind > min(model.reach, model.limits[scan.scanner, 1]):
            continue
        bearing = scan.sweep.upright * wrap_scalar(math.atan2(y, x) - mount.mount_theta)
        if is_blind(bearing, scan.scanner, model.blind):
            continue
        beam = math.floor((bearing - scan.angle_min) / scan.angle_increment + 0.5)
        if beam < 1 or beam > scan.beams - 2:
            continue
        through = 0
        for k in range(beam - 1, beam + 2):
            # Nothing came back: nothing is there.
            through += not scan.ranges[k] <= behind
        if through == 3:
            memory.marks[slot, MISSES] += 1


@compiled
def forget_landmarks(memory: TemporaryMemory, model: TemporaryModel, stamp_ns: int) -> int:
    """Forget landmarks by age, by uncertainty, by distance, and those that are gone or move; return how many.

    Parameters
    ----------
    memory : written.
    model : limits.
    stamp_ns : of the scan [ns].

    Notes
    -----
    largest eigenvalue = (xx + yy) / 2 + sqrt(((xx - yy) / 2)^2 + xy^2), by definition; the rest as in
    Andreasson et al. 2011, Fig. 1, *Landmark Removals*.
    """
    forgotten, mean, P = 0, memory.mean, memory.covariance
    moved = _moved_most(memory)
    for slot in range(memory.counts[LANDMARKS] - 1, -1, -1):
        at, marks = POSE + PER_LANDMARK * slot, memory.marks[slot]
        half, off = 0.5 * (P[at, at] - P[at + 1, at + 1]), P[at + 1, at]
        largest = 0.5 * (P[at, at] + P[at + 1, at + 1]) + math.sqrt(half * half + off * off)
        is_gone = slot == moved or marks[MISSES] >= model.misses
        if is_gone:
            row = _new_row(memory, marks[KIND], mean[at], mean[at + 1], memory.shapes[slot, SHAPE], stamp_ns)
            memory.waiting[row, W_COUNT] = -SUSPECT_SCANS
        if (
            is_gone
            or stamp_ns - marks[SEEN_NS] > model.forget_ns
            or not largest <= model.largest_variance
            or math.hypot(mean[at] - mean[0], mean[at + 1] - mean[1]) > model.reach
        ):
            drop_landmark(memory, slot)
            forgotten += 1
    for k in range(memory.counts[WAITING] - 1, -1, -1):
        if stamp_ns - memory.waiting_ns[k] > WAITS_NS:
            _drop_waiting(memory, k)
    return forgotten


@compiled_inline
def _moved_most(memory: TemporaryMemory) -> int:
    """Slot of the landmark that drifts most, where it does so beyond the limit; -1: none.

    One alone: what moves takes the pose along, so that what stands seems to drift the other way, though less.
    """
    most, at, shapes = DRIFT_LIMIT * SMOOTHING / (2.0 - SMOOTHING), -1, memory.shapes
    for slot in range(memory.counts[LANDMARKS]):
        drift = shapes[slot, DRIFT_X] * shapes[slot, DRIFT_X] + shapes[slot, DRIFT_Y] * shapes[slot, DRIFT_Y]
        if drift > most:
            most, at = drift, slot
    return at


@compiled_inline
def _new_row(  # noqa: PLR0917 - a thing, number by number
    memory: TemporaryMemory, kind: int, x: float, y: float, shape: float, stamp_ns: int
) -> int:
    """Let a thing wait that nobody has seen yet, by the place of a suspect as one; return its row."""
    w, count = memory.waiting, 0.0
    for k in range(memory.counts[WAITING]):
        near = math.hypot(w[k, W_X] - x, w[k, W_Y] - y) <= SUSPECT_NEAR
        if w[k, W_COUNT] < 0.0 and w[k, W_KIND] == kind and near:
            count = -SUSPECT_SCANS
    row = memory.counts[WAITING]
    if row == MOST_WAITING:
        row = _oldest_waiting(memory)
    else:
        memory.counts[WAITING] = row + 1
    w[row, W_KIND], w[row, W_X], w[row, W_Y], w[row, W_SHAPE], w[row, W_COUNT] = kind, x, y, shape, count
    memory.waiting_ns[row] = stamp_ns
    return row


@compiled_inline
def _oldest_waiting(memory: TemporaryMemory) -> int:
    """Row of the waiting thing seen longest ago."""
    row = 0
    for k in range(memory.counts[WAITING]):
        if memory.waiting_ns[k] < memory.waiting_ns[row]:
            row = k
    return row


@compiled_inline
def _drop_waiting(memory: TemporaryMemory, k: int) -> None:
    """Forget a waiting thing: the last one moves to its row."""
    last = memory.counts[WAITING] - 1
    for column in range(memory.waiting.shape[1]):
        memory.waiting[k, column] = memory.waiting[last, column]
    memory.waiting_ns[k] = memory.waiting_ns[last]
    memory.counts[WAITING] = last


@compiled
def remember_sighting(  # noqa: PLR0917 - a sighting, and where it is remembered
    memory: TemporaryMemory, model: TemporaryModel, kind: int, seen: Sighting, stamp_ns: int, figures: FloatArray
) -> int:
    """Let a new thing wait, and become a landmark once it was seen often enough in one place.

    Parameters
    ----------
    memory : written.
    model : rules and limits.
    kind, seen : what was seen, base frame.
    stamp_ns : of the scan [ns].
    figures : those forgotten are counted on: the one seen longest ago makes room.

    Returns
    -------
    born : 1 where it has become a landmark, else 0.

    Notes
    -----
    No formula: Andreasson et al. 2011, Fig. 1, *Init Landmarks*, once `confirmations` scans have seen it.
    """
    mean, w = memory.mean, memory.waiting
    c, s = math.cos(mean[2]), math.sin(mean[2])
    x, y = mean[0] + c * seen.x - s * seen.y, mean[1] + s * seen.x + c * seen.y
    shape = seen.shape if kind == REEL else wrap_scalar(seen.shape + mean[2])
    row = -1
    for k in range(memory.counts[WAITING]):
        if w[k, W_KIND] == kind and math.hypot(w[k, W_X] - x, w[k, W_Y] - y) <= WAITS_WITHIN:
            if is_alike(kind, shape, 0.0, w[k, W_SHAPE]):
                row = k
    if row < 0:
        row = _new_row(memory, kind, x, y, shape, stamp_ns)
    w[row, W_COUNT] += 1.0
    memory.waiting_ns[row] = stamp_ns
    if w[row, W_COUNT] < model.confirmations or not _has_room(memory, model, stamp_ns, figures):
        return 0
    _drop_waiting(memory, row)
    slot, marks = add_landmark(memory, seen), memory.marks
    memory.shapes[slot, SHAPE] = shape
    marks[slot, KIND], marks[slot, SEEN_NS], marks[slot, BORN_NS] = kind, stamp_ns, stamp_ns
    marks[slot, MATCHES], marks[slot, MISSES], marks[slot, NUMBER] = 1, 0, memory.counts[NEXT_NUMBER]
    memory.counts[NEXT_NUMBER] += 1
    return 1


@compiled_inline
def _has_room(memory: TemporaryMemory, model: TemporaryModel, stamp_ns: int, figures: FloatArray) -> bool:
    """Whether there is room for a landmark; the one seen longest ago makes it, unless this very scan has seen it."""
    if memory.counts[LANDMARKS] < model.most:
        return True
    oldest, at = stamp_ns, -1
    for slot in range(memory.counts[LANDMARKS]):
        if memory.marks[slot, SEEN_NS] < oldest:
            oldest, at = memory.marks[slot, SEEN_NS], slot
    if at < 0:
        return False
    drop_landmark(memory, at)
    figures[FORGOTTEN] += 1.0
    return True

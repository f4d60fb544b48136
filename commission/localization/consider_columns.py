"""Covariance of the pose with the considered constants as columns of an array, carried over the scans of a drive.

Each scan is worked out in a small array of what it sees; all other columns are multiplied by its transition at the end.
What a detection does to the columns that it has to do with is in `consider`.
"""

from __future__ import annotations

import numpy as np

from commission.compiled import compiled_inline
from commission.geometry.arrays import FloatArray, IntArray
from commission.localization.consider import BLOCKS, PER_REFLECTOR, PER_SCANNER, Considering, ConstantsRoom
from commission.localization.pose_gaussian import PoseGaussian

NOTHING = 1e-20
"""What is smaller is 0 [m^2]: the square of a tenth of a nanometre moves no pose, and costs as much as what does."""
CHUNK = 32
"""Columns that are carried over a scan, or left alone, together: of whole reflectors."""
RECHECKED = 50
"""Scans after which a chunk is looked at whether anything is left in it."""


@compiled_inline
def room_for(cross: FloatArray | None, detections: int) -> ConstantsRoom | None:
    """Room for one scan, or None where nothing is considered.

    Parameters
    ----------
    cross : covariance of the pose with the constants, or None.
    detections : of the scan.

    Notes
    -----
    No formula: it makes an array.
    """
    if cross is None:
        return None
    return ConstantsRoom(cross, np.zeros((3, BLOCKS + PER_REFLECTOR * detections)), None)


@compiled_inline
def begin(given: Considering | None, reflectors: int, scanner: int) -> None:
    """Write the first eight columns of a working array.

    Parameters
    ----------
    given : of the scan; nothing is written where nothing is considered.
    reflectors : N of the map.
    scanner : index of the scanner.

    Notes
    -----
    F = [[1, 0, -my], [0, 1, mx], [0, 0, 1]] of all motion since `cross` was written, and F C of the scanner: Sobreira
    et al. 2016, Algorithm 1, line 3. Every correction multiplies all columns alike, so the first three become the
    transition of those constants that the scan says nothing of.
    """
    if given is None:
        return
    work = given.room.work
    for row in range(3):
        for column in range(3):
            work[row, column] = 1.0 if row == column else 0.0
    work[0, 2], work[1, 2] = -given.moved_y, given.moved_x
    start = PER_REFLECTOR * reflectors + PER_SCANNER * scanner
    for i in range(PER_SCANNER):
        _move(given, 3 + i, start + i)


@compiled_inline
def take_along(given: Considering, at: int, entry: int) -> None:
    """Write the columns of a reflector, carried over all corrections of the scan so far.

    Parameters
    ----------
    given : of the scan.
    at : first of the two columns of the working array to write.
    entry : row of the reflector in `places`.

    Notes
    -----
    C = A_i ... A_1 F C, with the transition in the first three columns of the working array: Schmidt 1966.
    """
    cross, work, _ = given.room
    for i in range(PER_REFLECTOR):
        column = PER_REFLECTOR * entry + i
        x, y, theta = cross[0, column], cross[1, column], cross[2, column]
        for row in range(3):
            work[row, at + i] = work[row, 0] * x + work[row, 1] * y + work[row, 2] * theta


@compiled_inline
def take_out(given: Considering | None, at: int, entry: int) -> None:
    """Write the columns of a reflector, carried to the scan.

    Parameters
    ----------
    given : of the scan; nothing is written where nothing is considered.
    at : first of the two columns of the working array to write.
    entry : row of the reflector in `places`.

    Notes
    -----
    C = F C: Sobreira et al. 2016, Algorithm 1, line 3, of a state augmented by a constant.
    """
    if given is None:
        return
    _move(given, at, PER_REFLECTOR * entry)
    _move(given, at + 1, PER_REFLECTOR * entry + 1)


@compiled_inline
def _move(given: Considering, at: int, column: int) -> None:
    """Carry one column to the scan."""
    cross, work, _ = given.room
    heading = cross[2, column]
    work[0, at] = cross[0, column] - given.moved_y * heading
    work[1, at] = cross[1, column] + given.moved_x * heading
    work[2, at] = heading


@compiled_inline
def put_back(given: Considering, reflectors: int, scanner: int) -> None:
    """Carry the covariance with all constants over a scan, those of the scanner from the working array.

    Parameters
    ----------
    given : of the scan; reflectors of the scan follow by `put_block`.
    reflectors : N of the map.
    scanner : index of the scanner.

    Notes
    -----
    C = A_n ... A_1 F C of what no detection has to do with: Schmidt 1966. 0 stays 0.
    """
    cross, work, busy = given.room
    _carry_busy(cross, work, busy)
    start = PER_REFLECTOR * reflectors + PER_SCANNER * scanner
    for row in range(3):
        for i in range(PER_SCANNER):
            cross[row, start + i] = work[row, 3 + i]
    mark_busy(busy, start, start + PER_SCANNER)


@compiled_inline
def _carry_busy(cross: FloatArray, work: FloatArray, busy: IntArray | None) -> None:
    """Multiply the columns that may not be zero by the transition of a scan."""
    columns = cross.shape[1]
    if busy is None:
        _carry(cross, work, 0, columns)
    else:
        for chunk in range(len(busy)):
            if busy[chunk] > 0:
                first, last = CHUNK * chunk, min(CHUNK * (chunk + 1), columns)
                _carry(cross, work, first, last)
                busy[chunk] -= 1
                if busy[chunk] == 0 and not _all_zero(cross, first, last):
                    busy[chunk] = RECHECKED


@compiled_inline
def _carry(cross: FloatArray, work: FloatArray, first: int, last: int) -> None:
    """Multiply some columns by the transition of a scan."""
    xx, xy, xt = work[0, 0], work[0, 1], work[0, 2]
    yx, yy, yt = work[1, 0], work[1, 1], work[1, 2]
    tx, ty, tt = work[2, 0], work[2, 1], work[2, 2]
    for j in range(np.uint64(first), np.uint64(last)):  # signed ones might be negative, counted from the end: slower
        x, y, theta = cross[0, j], cross[1, j], cross[2, j]
        cross[0, j] = _or_nothing(xx * x + xy * y + xt * theta)
        cross[1, j] = _or_nothing(yx * x + yy * y + yt * theta)
        cross[2, j] = _or_nothing(tx * x + ty * y + tt * theta)


@compiled_inline
def _all_zero(cross: FloatArray, first: int, last: int) -> bool:
    """Whether nothing in some columns has to do with the pose."""
    count = 0
    for row in range(3):
        for j in range(first, last):
            count += cross[row, j] != 0.0
    return count == 0


def busy_chunks(cross: FloatArray) -> IntArray:
    """(M,) for each `CHUNK` columns of a covariance with constants: 0 where all are zero, else `RECHECKED`.

    Of a large hall nearly all reflectors have long had nothing to do with the pose: so a scan costs the same in any.
    """
    starts = np.arange(0, cross.shape[1], CHUNK)
    return np.where(np.add.reduceat((cross != 0.0).any(axis=0), starts, dtype=np.int64) > 0, RECHECKED, 0)


@compiled_inline
def _or_nothing(value: float) -> float:
    """0 for what has faded away."""
    return value if abs(value) > NOTHING else 0.0


@compiled_inline
def put_block(given: Considering, at: int, entry: int) -> None:
    """Write the columns of a reflector of the scan back.

    Parameters
    ----------
    given : of the scan, after `put_back`.
    at : first of the two columns of the reflector in the working array.
    entry : row of the reflector in `places`.

    Notes
    -----
    C[:, i] = its column of the working array, by definition.
    """
    cross, work, busy = given.room
    column = PER_REFLECTOR * entry
    for row in range(3):
        cross[row, column] = work[row, at]
        cross[row, column + 1] = work[row, at + 1]
    # A chunk holds whole reflectors.
    mark_busy(busy, column, column + 1)


@compiled_inline
def carry_over(cross: FloatArray, transition: FloatArray, busy: IntArray | None) -> None:
    """Multiply the covariance with all constants by the transition of a correction.

    Parameters
    ----------
    cross : covariance of the pose with the constants, written in place.
    transition : (3, 3) or wider, whose first three columns count.
    busy : (M,) see `busy_chunks`; None: all are.

    Notes
    -----
    C = A C: Schmidt 1966. 0 stays 0.
    """
    if busy is None:
        _carry(cross, transition, 0, cross.shape[1])
    else:
        for chunk in range(len(busy)):
            if busy[chunk] > 0:
                _carry(cross, transition, CHUNK * chunk, min(CHUNK * (chunk + 1), cross.shape[1]))


@compiled_inline
def carry_to(room: ConstantsRoom | None, belief: PoseGaussian, pivot: tuple[float, float]) -> None:
    """Carry the covariance with all constants over the motion since it was written.

    Parameters
    ----------
    room : written in place, or None.
    belief : after *predict*.
    pivot : place of the belief [m] when the covariance was written.

    Notes
    -----
    C = F C, F = [[1, 0, -(y - y0)], [0, 1, x - x0], [0, 0, 1]]: Sobreira et al. 2016, Algorithm 1, line 3.
    """
    if room is None:
        return
    moved = np.eye(3)
    moved[0, 2], moved[1, 2] = -(belief.y - pivot[1]), belief.x - pivot[0]
    carry_over(room.cross, moved, room.busy)


@compiled_inline
def mark_busy(busy: IntArray | None, first: int, last: int) -> None:
    """Remember that columns from `first` to before `last` were written.

    Parameters
    ----------
    busy : (M,) see `busy_chunks`, written; None: all are busy anyway.
    first, last : columns, no more than a chunk of them.

    Notes
    -----
    No formula: both chunks that they may lie in.
    """
    if busy is not None:
        busy[first // CHUNK] = busy[(last - 1) // CHUNK] = RECHECKED

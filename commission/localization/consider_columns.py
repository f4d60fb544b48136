"""Covariance of the pose with the considered constants as columns of an array, carried over the scans of a drive.

Each scan is worked out in a small array of what it sees; all other columns are multiplied by its transition at the end.
What a detection does to the columns that it has to do with is in `consider`.
"""

from __future__ import annotations

import numpy as np

from commission.compiled import compiled_inline
from commission.geometry.arrays import FloatArray, IntArray
from commission.localization.consider import BLOCKS, PER_REFLECTOR, PER_SCANNER, Considering

NOTHING = 1e-20
"""What is smaller is 0 [m^2]: the square of a tenth of a nanometre moves no pose, and costs as much as what does."""
CHUNK = 32
"""Columns that are carried over a scan, or left alone, together: of whole reflectors."""
RECHECKED = 50
"""Scans after which a chunk is looked at whether anything is left in it."""


@compiled_inline
def working_array(
    cross: FloatArray | None, given: Considering | None, reflectors: int, scanner: int, detections: int
) -> FloatArray | None:
    """Array in which a scan is worked out: (3, 8 + 2 detections), its first eight columns written.

    Parameters
    ----------
    cross, given, reflectors, scanner : as in `begin`; None gives None.
    detections : of the scan.

    Notes
    -----
    No formula: `begin`, in an array of its own.
    """
    if given is None:
        return None
    if cross is None:
        return None
    work = np.zeros((3, BLOCKS + PER_REFLECTOR * detections))
    begin(work, cross, given, reflectors, scanner)
    return work


@compiled_inline
def begin(work: FloatArray, cross: FloatArray, given: Considering, reflectors: int, scanner: int) -> None:
    """Write the first eight columns of a working array.

    Parameters
    ----------
    work : (3, 8 + 2 detections) or wider.
    cross : covariance of the pose with the constants.
    given : of the scan.
    reflectors : N of the map.
    scanner : index of the scanner.

    Notes
    -----
    F = [[1, 0, -my], [0, 1, mx], [0, 0, 1]] of all motion since `cross` was written, and F C of the scanner: Sobreira
    et al. 2016, Algorithm 1, line 3. Every correction multiplies all columns alike, so the first three become the
    transition of those constants that the scan says nothing of.
    """
    for row in range(3):
        for column in range(3):
            work[row, column] = 1.0 if row == column else 0.0
    work[0, 2], work[1, 2] = -given.moved_y, given.moved_x
    start = PER_REFLECTOR * reflectors + PER_SCANNER * scanner
    for i in range(PER_SCANNER):
        _move(work, 3 + i, cross, start + i, given)


@compiled_inline
def take_along(work: FloatArray, at: int, cross: FloatArray, entry: int) -> None:
    """Write the columns of a reflector, carried over all corrections of the scan so far.

    Parameters
    ----------
    work : working array of the scan.
    at : first of the two columns to write.
    cross : covariance of the pose with the constants.
    entry : row of the reflector in `places`.

    Notes
    -----
    C = A_i ... A_1 F C, with the transition in the first three columns of `work`: Schmidt 1966.
    """
    for i in range(PER_REFLECTOR):
        column = PER_REFLECTOR * entry + i
        x, y, theta = cross[0, column], cross[1, column], cross[2, column]
        for row in range(3):
            work[row, at + i] = work[row, 0] * x + work[row, 1] * y + work[row, 2] * theta


@compiled_inline
def take_out(work: FloatArray, at: int, cross: FloatArray, entry: int, given: Considering) -> None:
    """Write the columns of a reflector, carried to the scan.

    Parameters
    ----------
    work : working array of the scan.
    at : first of the two columns to write.
    cross : covariance of the pose with the constants.
    entry : row of the reflector in `places`.
    given : of the scan.

    Notes
    -----
    C = F C: Sobreira et al. 2016, Algorithm 1, line 3, of a state augmented by a constant.
    """
    _move(work, at, cross, PER_REFLECTOR * entry, given)
    _move(work, at + 1, cross, PER_REFLECTOR * entry + 1, given)


@compiled_inline
def _move(work: FloatArray, at: int, cross: FloatArray, column: int, given: Considering) -> None:
    """Carry one column to the scan."""
    heading = cross[2, column]
    work[0, at] = cross[0, column] - given.moved_y * heading
    work[1, at] = cross[1, column] + given.moved_x * heading
    work[2, at] = heading


@compiled_inline
def put_back(cross: FloatArray, work: FloatArray, reflectors: int, scanner: int, busy: IntArray | None) -> None:
    """Carry the covariance with all constants over a scan, those of the scanner from the working array.

    Parameters
    ----------
    cross : covariance of the pose with the constants, written in place; reflectors of the scan follow by `put_block`.
    work : working array of the scan.
    reflectors : N of the map.
    scanner : index of the scanner.
    busy : (M,) see `busy_chunks`, written; None: all are.

    Notes
    -----
    C = A_n ... A_1 F C of what no detection has to do with: Schmidt 1966. 0 stays 0.
    """
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
    start = PER_REFLECTOR * reflectors + PER_SCANNER * scanner
    for row in range(3):
        for i in range(PER_SCANNER):
            cross[row, start + i] = work[row, 3 + i]
    if busy is not None:
        busy[start // CHUNK] = busy[(start + PER_SCANNER - 1) // CHUNK] = RECHECKED


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
def put_block(cross: FloatArray, work: FloatArray, at: int, entry: int, busy: IntArray | None) -> None:
    """Write the columns of a reflector of the scan back.

    Parameters
    ----------
    cross : covariance of the pose with the constants, after `put_back`.
    work : working array of the scan.
    at : first of the two columns of the reflector.
    entry : row of the reflector in `places`.
    busy : as in `put_back`.

    Notes
    -----
    C[:, i] = its column of the working array, by definition.
    """
    column = PER_REFLECTOR * entry
    for row in range(3):
        cross[row, column] = work[row, at]
        cross[row, column + 1] = work[row, at + 1]
    if busy is not None:
        # Both: a chunk holds whole reflectors.
        busy[column // CHUNK] = RECHECKED


@compiled_inline
def carry_over(cross: FloatArray, transition: FloatArray, busy: IntArray) -> None:
    """Multiply the covariance with all constants by the transition of a correction.

    Parameters
    ----------
    cross : covariance of the pose with the constants, written in place.
    transition : (3, 3) or wider, whose first three columns count.
    busy : (M,) see `busy_chunks`.

    Notes
    -----
    C = A C: Schmidt 1966. 0 stays 0.
    """
    for chunk in range(len(busy)):
        if busy[chunk] > 0:
            _carry(cross, transition, CHUNK * chunk, min(CHUNK * (chunk + 1), cross.shape[1]))


@compiled_inline
def mark_busy(busy: IntArray, first: int, last: int) -> None:
    """Remember that columns from `first` to before `last` were written.

    Parameters
    ----------
    busy : (M,) see `busy_chunks`, written.
    first, last : columns, no more than a chunk of them.

    Notes
    -----
    No formula: both chunks that they may lie in.
    """
    busy[first // CHUNK] = busy[(last - 1) // CHUNK] = RECHECKED

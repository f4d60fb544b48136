"""One cycle of the localizer for a frame of the camera that looks for tags: its stamp is reached, sightings correct.

Beside `cycle`, which is that of a scan, and called by the same two: live, and by the compiled loop of whole runs.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from commission.compiled import compiled, compiled_inline
from commission.geometry.arrays import FloatArray, IntArray
from commission.localization.consider_columns import carry_over
from commission.localization.contour import ContourScan
from commission.localization.cycle import Cycle, held_back, supervised, with_temporary
from commission.localization.filter_kinds import is_invariant
from commission.localization.observation import ObservationModel
from commission.localization.odometry import NextOdometry, reach, velocity
from commission.localization.rejection import weigh
from commission.localization.rival_poses import RivalPoses
from commission.localization.setup import FilterModel
from commission.localization.several_scans import forget
from commission.localization.state import FilterState
from commission.localization.tags import ACCEPTED, REJECTED, USE, TagModel, correct_by_tag
from commission.localization.temporary_memory import TemporaryMemory
from commission.localization.temporary_model import TemporaryModel
from commission.localization.zones import ZoneRows, kinds_at


class TagFrames(NamedTuple):
    """Frames of a stretch of cycles, for kernels."""

    is_frame: NDArray[np.bool_]
    """(K,) whether a cycle is a frame of the camera, and no scan."""
    offsets: IntArray
    """(K + 1,) sightings of cycle k: offsets[k] to offsets[k + 1]."""
    sightings: FloatArray
    """(n, 6) see `TagLog`."""
    entries: IntArray
    """(n,) row of the tag of each, or NOT_READ, NOT_ON_SITE."""
    model: TagModel


@compiled
def process_tags(  # noqa: PLR0917 - outputs are written into the arrays of the whole run
    state: FilterState,
    stamp_ns: int,
    first: int,
    last: int,
    frames: TagFrames,
    model: FilterModel,
    observation: ObservationModel,
    places: FloatArray,
    cell_offsets: IntArray,
    cross: FloatArray | None,
    busy: IntArray | None,
    status: NDArray[np.int8],
    following: NextOdometry,
    figures: FloatArray,
    zones: ZoneRows,
    temporary: TemporaryModel | None,
    memory: TemporaryMemory | None,
    scan: ContourScan | None,
    goods: FloatArray | None,
    rivals: RivalPoses | None,
) -> Cycle:
    """Process the sightings of a frame.

    Parameters
    ----------
    state : after everything before this frame.
    stamp_ns : of the frame [ns].
    first, last : rows of its sightings, the last one excluded.
    frames : sightings, and tags of the site.
    model : of the whole filter.
    observation, places, cell_offsets, status : of reflectors; nothing is read of them: a frame sees none.
    cross : covariance of the pose with the constants, in and out, or None.
    busy : see `busy_chunks`; None: as `cross`.
    following : the odometry record at or after the frame, where it is known.
    figures : (n, COLUMNS) out, see `tags`.
    zones : where which kinds correct the pose.
    temporary, memory, scan, goods : as in `process_scan`; the scan of a frame has no beams.
    rivals : where the vehicle may stand as well, in and out, or None; a tag that fits leaves none.

    Notes
    -----
    No formula: `reach`, `correct_by_tag` each from the freshest state, and `supervised` in turn.
    """
    prior, motion = reach(state.belief, state.motion, stamp_ns, following, model.odometry)
    if cross is not None and busy is not None:
        moved = np.eye(3)
        moved[0, 2], moved[1, 2] = -(prior.y - state.pivot[1]), prior.x - state.pivot[0]
        carry_over(cross, moved, busy)
    twist = velocity(state.motion, following)
    belief = prior
    for i in range(first, last if kinds_at(zones, prior.x, prior.y).tags else first):
        belief = correct_by_tag(
            belief,
            frames.sightings[i],
            frames.entries[i],
            frames.model,
            twist,
            model.consider,
            cross,
            busy,
            figures[i],
            is_invariant(model.gate.kind),
        )
    belief = with_temporary(
        prior, belief, temporary, memory, scan, state, motion, following, stamp_ns, model, cross, busy, goods
    )
    evidence = weigh(
        state.evidence,
        stamp_ns,
        prior,
        0,
        0,
        np.empty((0, 2)),
        observation,
        model.cells,
        places,
        cell_offsets,
        status,
        said_by_tags(figures, first, last),
        model.rejection,
    )
    pivot = state.pivot if cross is None else (belief.x, belief.y)
    if said_by_tags(figures, first, last) == 1.0:
        forget(rivals)
    after = supervised(state, stamp_ns, belief, motion, evidence, pivot, state.walls, model)
    return Cycle(prior, held_back(rivals, state, after, model))


@compiled_inline
def said_by_tags(figures: FloatArray, first: int, last: int) -> float:
    """What the sightings of a frame say of the pose: 1 for it, -1 against it, 0 nothing.

    Parameters
    ----------
    figures : of all sightings.
    first, last : rows of the frame, the last one excluded.

    Notes
    -----
    No formula: for it where one was accepted, against it where one was rejected and none accepted.
    """
    said = 0.0
    for i in range(first, last):
        if figures[i, USE] == ACCEPTED:
            said = 1.0
        elif figures[i, USE] == REJECTED and said == 0.0:
            said = -1.0
    return said

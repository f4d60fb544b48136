"""One cycle of the localizer for a frame of the camera that looks for tags: its stamp is reached, sightings correct.

Beside `cycle`, which is that of a scan, and called by the same two: live, and by the compiled loop of whole runs.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from commission.compiled import compiled, compiled_inline
from commission.geometry.arrays import FloatArray, IntArray
from commission.localization.consider import ConstantsRoom, busy_of, cross_of
from commission.localization.consider_columns import carry_to
from commission.localization.cycle import Cycle, TemporaryLook, held_back, supervised, with_temporary
from commission.localization.filter_kinds import is_invariant
from commission.localization.odometry import NextOdometry, reach, velocity
from commission.localization.rejection import NOTHING_COUNTED, weigh
from commission.localization.rival_poses import RivalPoses
from commission.localization.setup import FilterModel
from commission.localization.several_scans import forget
from commission.localization.state import Tracking
from commission.localization.tags import ACCEPTED, REJECTED, USE, TagModel, correct_by_tag
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
def process_tags(  # noqa: PLR0917 - a frame and all that it is looked at with
    state: Tracking,
    stamp_ns: int,
    following: NextOdometry,
    first: int,
    last: int,
    frames: TagFrames,
    figures: FloatArray,
    model: FilterModel,
    zones: ZoneRows,
    room: ConstantsRoom | None,
    temporary: TemporaryLook | None,
    rivals: RivalPoses | None,
) -> Cycle:
    """Process the sightings of a frame.

    Parameters
    ----------
    state : after everything before this frame.
    stamp_ns : of the frame [ns].
    following : the odometry record at or after the frame, where it is known.
    first, last : rows of its sightings, the last one excluded.
    frames : sightings, and tags of the site.
    figures : (n, COLUMNS) out, see `tags`.
    model : of the whole filter.
    zones : where which kinds correct the pose.
    room : covariance of the pose with the considered constants, in and out; None: none is considered.
    temporary : as in `process_scan`; the scan of a frame has no beams.
    rivals : where the vehicle may stand as well, in and out, or None; a tag that fits leaves none.

    Notes
    -----
    No formula: `reach`, `correct_by_tag` each from the freshest state, and `supervised` in turn.
    """
    prior, motion = reach(state.belief, state.motion, stamp_ns, following, model.odometry)
    carry_to(room, prior, state.pivot)
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
            cross_of(room),
            busy_of(room),
            figures[i],
            is_invariant(model.gate.kind),
        )
    belief = with_temporary(prior, belief, temporary, state, motion, following, stamp_ns, model, room)
    said = said_by_tags(figures, first, last)
    evidence = weigh(state.evidence, stamp_ns, prior, NOTHING_COUNTED, said, model.rejection)
    pivot = state.pivot if room is None else (belief.x, belief.y)
    if said == 1.0:
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

"""Where a vehicle is that does not know, told by a single tag: it says place and heading at once.

Nothing is searched: a tag whose id was read is that one. What other observations say of it, the supervisor waits for.
"""

from __future__ import annotations

import math

import numpy as np

from commission.geometry import se2
from commission.geometry.arrays import FloatArray, IntArray
from commission.localization.cross_covariance import cross_covariance
from commission.localization.estimate import Mode
from commission.localization.pose_gaussian import PoseGaussian
from commission.localization.rejection import NO_EVIDENCE
from commission.localization.setup import LocalizerSetup
from commission.localization.state import FilterState
from commission.localization.tags import (
    COLUMNS,
    ENTRY,
    NIS,
    PER_CAMERA,
    PER_TAG,
    USE,
    TagModel,
    TagUse,
    considered_of,
    entries_of,
    tag_rows,
)
from commission.site.tag_log import Ids


def told_by_tags(
    states: tuple[FilterState, FilterState],
    setup: LocalizerSetup,
    sightings: FloatArray,
    ids: Ids,
    figures: FloatArray,
) -> FilterState | None:
    """Return the state of a filter that begins anew where a tag says; None where no id that the site has was read.

    Parameters
    ----------
    states : before the frame, and after it as the filter has it.
    setup : tags, camera and what is known of both.
    sightings : (n, 6) of the frame, see `TagLog`.
    ids : (n,) of each.
    figures : (n, COLUMNS) out: the one that told; the others are not looked at.
    """
    model, (before, after) = setup.tag_model, states
    if model is None:
        return None
    entries: IntArray = entries_of(ids, setup.tags)
    read = np.flatnonzero(entries >= 0)
    if not len(read):
        return None
    # The nearest one: its heading turns the place least.
    index = int(read[np.argmin(np.hypot(sightings[read, 0], sightings[read, 1]))])
    entry = int(entries[index])
    figures[:] = np.zeros(COLUMNS)
    figures[:, ENTRY], figures[:, NIS] = -1.0, math.nan
    figures[index, USE], figures[index, ENTRY] = TagUse.LOCATED, entry
    belief, columns = _belief_at(model, sightings[index], entry, setup)
    cross = None
    if setup.constants is not None:
        all_columns = np.zeros((3, len(setup.constants)))
        tag = model.first + PER_CAMERA + PER_TAG * entry
        all_columns[:, model.first : model.first + PER_CAMERA] = columns[:, :PER_CAMERA]
        all_columns[:, tag : tag + PER_TAG] = columns[:, PER_CAMERA:]
        cross = cross_covariance(all_columns, setup.constants)
    tracking = after.tracking._replace(
        belief=belief,
        mode=int(Mode.FAIL),
        evidence=NO_EVIDENCE._replace(stamp_ns=after.tracking.belief_ns, confirmed=0.0),
        # The filter may have believed its sightings in this very frame.
        output=before.tracking.output,
        output_ns=before.tracking.output_ns,
        pivot=(belief.x, belief.y),
    )
    return FilterState(tracking, after.sensor_detects, cross, protection=after.protection)


def _belief_at(
    model: TagModel, sighting: FloatArray, entry: int, setup: LocalizerSetup
) -> tuple[PoseGaussian, FloatArray]:
    """Return where the vehicle is, and its covariance with the constants of camera and tag.

    Notes
    -----
    X = X_tag z^-1 m^-1; P = H^-1 (R + J B J^T) H^-T and C = -H^-1 J B with the rows of `tag_rows` there: derived from
    H (x' - x) = v - J (c' - c), x' and c' being what is estimated.
    """
    mounting = np.array((model.mount_x, model.mount_y, model.mount_theta))
    camera = se2.compose(model.places[entry], se2.inverse(sighting[:3]))
    x, y, theta = (float(each) for each in se2.compose(camera, se2.inverse(mounting)))
    at = PoseGaussian(x, y, theta, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    # The clock is taken for right: how fast the vehicle is, nobody knows yet who does not know where it is.
    rows = tag_rows(at, sighting, model.places[entry], model, (0.0, 0.0, 0.0))
    considered = np.diag(considered_of(entry, model, setup.filter.consider))
    noise = np.diag(rows.variances) + rows.constants @ considered @ rows.constants.T
    half = np.linalg.solve(rows.jacobians, noise)
    solved = np.linalg.solve(rows.jacobians, half.T)
    P = 0.5 * (solved + solved.T)
    columns = np.asarray(-np.linalg.solve(rows.jacobians, rows.constants @ considered), dtype=np.float64)
    upper = (P[0, 0], P[0, 1], P[0, 2], P[1, 1], P[1, 2], P[2, 2])
    return PoseGaussian(x, y, theta, *(float(each) for each in upper)), columns

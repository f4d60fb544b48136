"""Kinds of observation: which of them corrected the pose at each cycle of a run."""

from __future__ import annotations

import numpy as np

from commission.geometry.arrays import BoolArray
from commission.localization import bearings, contour, tags
from commission.localization.estimate import Status
from commission.localization.run_columns import RunColumns
from commission.localization.temporary_model import MATCHED

REFLECTORS, CONTOURS, TAGS, BEARINGS, TEMPORARY = KINDS = (
    *("reflectors", "contours", "tags", "bearings"),
    "temporary landmarks",
)
"""What may correct the pose, in this order. Reflectors: by range and bearing."""
OF_THE_MAP = slice(0, 4)
"""Those of them that tell where on the map the vehicle is; temporary landmarks only keep it from drifting."""


def corrected_by(columns: RunColumns) -> BoolArray:
    """(K, 5) whether each of `KINDS` has corrected the pose at each cycle.

    Parameters
    ----------
    columns : a run.
    """
    found = np.zeros((len(columns), len(KINDS)), dtype=np.bool_)
    met, seen = columns.detected.bearings, columns.detected.tags
    inliers = np.concatenate(([0], np.cumsum(columns.status == Status.INLIER)))
    found[:, 0] = np.diff(inliers[columns.offsets]) > 0
    if len(columns.contours):
        found[:, 1] = columns.contours[:, contour.USE] == contour.ContourUse.ACCEPTED
    if seen is not None and len(columns.tags):
        right = np.isin(columns.tags[:, tags.USE], (tags.TagUse.ACCEPTED, tags.TagUse.LOCATED))
        found[:, 2] = np.diff(np.concatenate(([0], np.cumsum(right)))[seen.offsets]) > 0
    if met is not None and len(columns.bearings):
        found[met.is_reflex, 3] = columns.bearings[:, bearings.USE] == bearings.BearingUse.ACCEPTED
    if len(columns.temporary):
        found[:, 4] = columns.temporary[:, MATCHED] > 0.0
    return found

"""Tags as the newest frame of the camera saw them, laid on the floor from the estimated pose."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from commission.geometry import se2
from commission.geometry.arrays import FloatArray
from commission.localization.run_columns import RunColumns
from commission.localization.setup import LocalizerSetup
from commission.localization.tags import NIS, USE, TagUse

SHOWN_FOR_S = 1.0
"""Age up to which a frame is shown [s]."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class FrameTags:
    """What a frame saw, and what became of it."""

    camera: FloatArray
    """(2,) where the camera was [m], map frame."""
    places: FloatArray
    """(n, 2) where the tags seem to stand [m], map frame."""
    uses: np.ndarray
    """(n,) a `TagUse` each."""
    nis: FloatArray
    """(n,) NIS, three degrees of freedom; NaN where it was held against no tag."""
    gate: float
    """Largest NIS of an accepted one."""


def sightings_at(columns: RunColumns, lived: int, at_ns: int, setup: LocalizerSetup) -> FrameTags | None:
    """Return the newest frame; None where the drive has none, it is old, or tags are not looked at.

    Parameters
    ----------
    columns : the run.
    lived : cycles up to the cursor.
    at_ns : the cursor [ns].
    setup : of the newest cycle.
    """
    seen, model = columns.detected.tags, setup.tag_model
    if seen is None or model is None or not len(columns.tags):
        return None
    begin = int(np.searchsorted(columns.stamps_ns, at_ns - round(SHOWN_FOR_S * 1e9), side="right"))
    frames = np.flatnonzero(seen.is_frame[begin:lived])
    if not len(frames):
        return None
    cycle = begin + int(frames[-1])
    rows = slice(int(seen.offsets[cycle]), int(seen.offsets[cycle + 1]))
    T_map_camera = se2.compose(columns.means[cycle], setup.tag_camera.mounting)
    places = se2.transform_points(T_map_camera, seen.sightings[rows, :2])
    return FrameTags(
        camera=T_map_camera[:2],
        places=places,
        uses=columns.tags[rows, USE].astype(np.int64),
        nis=columns.tags[rows, NIS],
        gate=model.gate,
    )


def sightings_told(found: FrameTags | None) -> list[tuple[str, str]]:
    """Say what became of the tags of a frame, line by line; nothing where no camera looks.

    Parameters
    ----------
    found : the frame.
    """
    if found is None:
        return []
    right = np.isin(found.uses, (TagUse.ACCEPTED, TagUse.LOCATED))
    rejected = found.uses == TagUse.REJECTED
    known = found.nis[np.isfinite(found.nis)]
    largest = f"{known.max():.2f}" if len(known) else "none met"
    unused = len(found.uses) - np.count_nonzero(right) - np.count_nonzero(rejected)
    counts = f"{np.count_nonzero(right)}, {np.count_nonzero(rejected)}, {unused}"
    return [("Tags: in, out, unused", counts), ("Tags, largest NIS / gate", f"{largest} / {found.gate:.2f}")]

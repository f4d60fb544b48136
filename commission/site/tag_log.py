"""What a camera has seen of tags over a drive, as columns: a row per frame, a row per sighting."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from commission.geometry.arrays import FloatArray, IntArray, frozen, read_only

if TYPE_CHECKING:
    from commission.site.records import TagSightings

Ids = NDArray[np.str_]
"""(n,) id of the tag that each sighting is of; empty where the camera cannot read it."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class TagLog:
    """All frames of a camera that looks for tags, in order of their stamps; of a frame without any there is no row."""

    stamps_ns: IntArray = field(default_factory=lambda: np.empty(0, np.int64))
    """(F,) time of each frame [ns]."""
    offsets: IntArray = field(default_factory=lambda: np.zeros(1, np.int64))
    """(F + 1,) sightings of frame i: offsets[i] to offsets[i + 1]."""
    sightings: FloatArray = field(default_factory=lambda: np.empty((0, 6)))
    """(n, 6) x [m], y [m] and heading [rad] of a tag in the camera's frame, then 1-sigma of each; NaN: not said."""
    ids: Ids = field(default_factory=lambda: np.empty(0, np.str_))
    """(n,) id of each tag; empty: not read."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "sightings", frozen(self.sightings, (None, 6), "tag sightings", finite=False))
        object.__setattr__(self, "stamps_ns", read_only(np.asarray(self.stamps_ns, dtype=np.int64)))
        object.__setattr__(self, "offsets", read_only(np.asarray(self.offsets, dtype=np.int64)))
        object.__setattr__(self, "ids", read_only(np.asarray(self.ids, dtype=np.str_)))
        if len(self.offsets) != len(self.stamps_ns) + 1 or self.offsets[-1] != len(self.sightings):
            raise ValueError(
                f"offsets of tags end at {self.offsets[-1]}; expected {len(self.sightings)}, one per frame"
            )
        if len(self.ids) != len(self.sightings):
            raise ValueError(f"{len(self.ids)} ids of {len(self.sightings)} sightings; expected one each")

    def __len__(self) -> int:
        """Return the number of frames."""
        return len(self.stamps_ns)

    @staticmethod
    def of(records: Sequence[TagSightings]) -> TagLog:
        """Gather frames in order of their stamps."""
        if not records:
            return NO_TAGS
        counts = [len(record.ids) for record in records]
        return TagLog(
            stamps_ns=np.array([record.stamp_ns for record in records], dtype=np.int64),
            offsets=np.concatenate([[0], np.cumsum(counts)]).astype(np.int64),
            sightings=np.concatenate([record.sightings for record in records]),
            ids=np.array([each for record in records for each in record.ids], dtype=np.str_),
        )


NO_TAGS = TagLog()
"""Of a vehicle without such a camera."""

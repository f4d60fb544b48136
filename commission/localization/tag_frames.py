"""Frames of the camera that looks for tags among the cycles of a run: where they come, and what they saw."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from commission.geometry.arrays import BoolArray, FloatArray, IntArray, read_only
from commission.site.tag_log import Ids, TagLog


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class TagCycles:
    """A row per cycle, and a row per sighting."""

    is_frame: BoolArray
    """(K,) whether the cycle is a frame of the camera: then it has no detections of reflectors."""
    offsets: IntArray
    """(K + 1,) sightings of cycle k: offsets[k] to offsets[k + 1]."""
    sightings: FloatArray
    """(n, 6) see `TagLog`."""
    ids: Ids
    """(n,) id of each tag; empty: not read."""
    numbers: IntArray
    """(K,) frames before each cycle, since the begin of the run."""

    def part(self, first: int, last: int) -> TagCycles:
        """Return the cycles from `first` to before `last`."""
        rows = slice(int(self.offsets[first]), int(self.offsets[last]))
        offsets = read_only(self.offsets[first : last + 1] - self.offsets[first])
        here = slice(first, last)
        return TagCycles(
            is_frame=self.is_frame[here],
            offsets=offsets,
            sightings=self.sightings[rows],
            ids=self.ids[rows],
            numbers=self.numbers[here],
        )


def among(tags: TagLog, stamps_ns: IntArray) -> TagCycles | None:
    """Place frames among the cycles of scans; None where there is no frame.

    Parameters
    ----------
    tags : of a drive.
    stamps_ns : (S,) of its scans [ns], ascending; of equal stamps the frame comes first.
    """
    if not len(tags):
        return None
    at = np.searchsorted(stamps_ns, tags.stamps_ns, side="left") + np.arange(len(tags))
    cycles = len(stamps_ns) + len(tags)
    is_frame, counts = np.zeros(cycles, dtype=np.bool_), np.zeros(cycles, dtype=np.int64)
    is_frame[at], counts[at] = True, np.diff(tags.offsets)
    offsets = np.concatenate(([0], np.cumsum(counts))).astype(np.int64)
    numbers = np.cumsum(is_frame) - is_frame
    return TagCycles(
        is_frame=read_only(is_frame),
        offsets=read_only(offsets),
        sightings=tags.sightings,
        ids=tags.ids,
        numbers=read_only(numbers),
    )


def in_turn(parts: Sequence[TagCycles | None]) -> TagCycles | None:
    """Return the cycles of one part after those of another; None where no part has frames."""
    some = [part for part in parts if part is not None]
    if not some:
        return None
    if len(some) < len(parts):
        raise ValueError("some parts of a run know of frames with tags and some do not; expected all of one log")
    offsets = np.concatenate([[0], np.cumsum(np.concatenate([np.diff(part.offsets) for part in some]))])
    return TagCycles(
        is_frame=read_only(np.concatenate([part.is_frame for part in some])),
        offsets=read_only(offsets.astype(np.int64)),
        sightings=read_only(np.concatenate([part.sightings for part in some])),
        ids=read_only(np.concatenate([part.ids for part in some])),
        numbers=read_only(np.concatenate([part.numbers for part in some])),
    )

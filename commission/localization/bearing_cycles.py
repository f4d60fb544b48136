"""Reflexes of a goniometer among the cycles of a run: where they come, and what they say."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from commission.geometry.arrays import BoolArray, FloatArray, IntArray, read_only
from commission.site.bearing_log import BearingLog


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class BearingCycles:
    """A row per cycle, and a row per reflex: each is a cycle of its own."""

    is_reflex: BoolArray
    """(K,) whether the cycle is a reflex of the goniometer: then it has no detections of a scanner."""
    numbers: IntArray
    """(K,) reflexes before each cycle, since the begin of the run."""
    bearings: FloatArray
    """(n,) see `BearingLog`."""
    reflectors: tuple[str, ...]
    """(n,) id of the reflector that each is of; empty where nobody says."""

    @property
    def first(self) -> int:
        """Reflexes of the run before these cycles; before none of them, none."""
        return int(self.numbers[0]) if len(self.numbers) else 0

    def rows_before(self, cycle: int) -> int:
        """Return how many of these reflexes come before a cycle of these."""
        return int(self.numbers[cycle]) - self.first if cycle < len(self.numbers) else len(self.bearings)

    def part(self, first: int, last: int) -> BearingCycles:
        """Return the cycles from `first` to before `last`."""
        rows = slice(self.rows_before(first), self.rows_before(last))
        return BearingCycles(
            is_reflex=self.is_reflex[first:last],
            numbers=self.numbers[first:last],
            bearings=self.bearings[rows],
            reflectors=self.reflectors[rows],
        )

    def covered(self) -> BearingCycles:
        """Return the same while all reflectors are covered: the goniometer turns and meets none."""
        return replace(
            self,
            bearings=read_only(np.full(len(self.bearings), np.nan)),
            reflectors=("",) * len(self.bearings),
        )


def bearing_cycles(is_reflex: BoolArray, bearings: FloatArray, reflectors: tuple[str, ...]) -> BearingCycles:
    """Return the cycles of a whole run.

    Parameters
    ----------
    is_reflex : (K,) which of them are reflexes.
    bearings, reflectors : of each reflex in turn.
    """
    numbers = read_only((np.cumsum(is_reflex) - is_reflex).astype(np.int64))
    return BearingCycles(
        is_reflex=read_only(is_reflex), numbers=numbers, bearings=read_only(bearings), reflectors=reflectors
    )


def reflexes_among(log: BearingLog, frames_ns: IntArray, scans_ns: IntArray) -> BearingCycles | None:
    """Place reflexes among frames of a camera and scans; None where there is no reflex.

    Parameters
    ----------
    log : reflexes of a drive.
    frames_ns : (F,) stamps of the frames [ns], ascending; of equal stamps the frame comes first.
    scans_ns : (S,) those of the scans [ns], ascending; of equal stamps the reflex comes first.
    """
    if not len(log):
        return None
    at = np.searchsorted(frames_ns, log.stamps_ns, side="right") + np.searchsorted(scans_ns, log.stamps_ns, side="left")
    is_reflex = np.zeros(len(log) + len(frames_ns) + len(scans_ns), dtype=np.bool_)
    is_reflex[at + np.arange(len(log))] = True
    return bearing_cycles(is_reflex, log.bearings, log.reflectors)


def reflexes_in_turn(parts: Sequence[BearingCycles | None]) -> BearingCycles | None:
    """Return the cycles of one part after those of another; None where no part has reflexes."""
    some = [part for part in parts if part is not None]
    if not some:
        return None
    if len(some) < len(parts):
        raise ValueError("some parts of a run know of reflexes and some do not; expected all of one log")
    return BearingCycles(
        is_reflex=read_only(np.concatenate([part.is_reflex for part in some])),
        numbers=read_only(np.concatenate([part.numbers for part in some])),
        bearings=read_only(np.concatenate([part.bearings for part in some])),
        reflectors=tuple(name for part in some for name in part.reflectors),
    )

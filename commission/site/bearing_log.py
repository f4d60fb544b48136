"""Reflexes of a goniometer: bearings alone, each with its own time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from commission.geometry.arrays import FloatArray, IntArray, frozen, read_only


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class BearingLog:
    """All reflexes of a drive, in order of their stamps."""

    stamps_ns: IntArray
    """(n,) time of each reflex [ns]."""
    bearings: FloatArray
    """(n,) [rad], scanner frame."""
    reflectors: tuple[str, ...]
    """(n,) id of the reflector that each is of; empty where nobody says."""

    def __post_init__(self) -> None:
        count = len(self.stamps_ns)
        object.__setattr__(self, "bearings", frozen(self.bearings, (count,), "bearings"))
        object.__setattr__(self, "stamps_ns", read_only(self.stamps_ns))
        if len(self.reflectors) != count:
            raise ValueError(f"{len(self.reflectors)} ids of {count} reflexes; expected one each")
        if count > 1 and (np.diff(self.stamps_ns) < 0).any():
            raise ValueError("stamps of bearings go back; expected ascending ones")

    def __len__(self) -> int:
        """Return the number of reflexes."""
        return len(self.stamps_ns)

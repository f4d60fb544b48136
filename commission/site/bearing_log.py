"""Reflexes of a goniometer: bearings alone, each with its own time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from commission.geometry.arrays import FloatArray, IntArray, frozen, read_only

if TYPE_CHECKING:
    from commission.site.records import Reflex


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class BearingLog:
    """All reflexes of a drive, in order of their stamps; a turn that met no reflector is a row without a bearing."""

    stamps_ns: IntArray = field(default_factory=lambda: np.empty(0, np.int64))
    """(n,) time of each reflex [ns]."""
    bearings: FloatArray = field(default_factory=lambda: np.empty(0))
    """(n,) [rad], scanner frame; NaN: a whole turn met no reflector."""
    reflectors: tuple[str, ...] = ()
    """(n,) id of the reflector that each is of; empty where nobody says."""

    def __post_init__(self) -> None:
        count = len(self.stamps_ns)
        object.__setattr__(self, "bearings", frozen(self.bearings, (count,), "bearings", finite=False))
        object.__setattr__(self, "stamps_ns", read_only(np.asarray(self.stamps_ns, dtype=np.int64)))
        if len(self.reflectors) != count:
            raise ValueError(f"{len(self.reflectors)} ids of {count} reflexes; expected one each")
        if count > 1 and (np.diff(self.stamps_ns) < 0).any():
            raise ValueError("stamps of bearings go back; expected ascending ones")

    def __len__(self) -> int:
        """Return the number of reflexes."""
        return len(self.stamps_ns)

    @staticmethod
    def of(records: Sequence[Reflex]) -> BearingLog:
        """Gather reflexes, whatever their order, in that of their stamps."""
        if not records:
            return NO_BEARINGS
        records = sorted(records, key=lambda record: record.stamp_ns)
        return BearingLog(
            stamps_ns=np.array([record.stamp_ns for record in records], dtype=np.int64),
            bearings=np.array([record.bearing for record in records]),
            reflectors=tuple(record.reflector for record in records),
        )


NO_BEARINGS = BearingLog()
"""Of a vehicle without a goniometer."""

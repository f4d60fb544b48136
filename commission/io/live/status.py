"""How a live source is doing, in numbers: counted as records come, told when somebody asks. It opens nothing."""

from __future__ import annotations

import threading
from collections import Counter, deque
from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

Arrivals: TypeAlias = tuple[NDArray[np.int64] | None, NDArray[np.int64]]
"""Times by a device's clock, None where it says none, and times of arrival [ns]."""

RECENT_NS = 2_000_000_000
"""Time over which rate, latency and jitter are taken [ns]."""
SILENT_AFTER_S = 1.0
"""Time without a record after which a source is silent [s]."""
SEEN = 256
"""Numbers of messages that are remembered: one that comes again is a duplicate."""
RECENT_LIMIT = 4_096
ARRIVALS = 1_500
"""Arrivals of each kind that are kept for its clock: a minute of scans."""
ODOMETRY = -1
"""Kind of arrivals that is odometry; of scans and detections it is the scanner's index."""
LARGEST_GAP = 100_000
"""Numbers that are further apart are those of a sender that counts anew."""


class SourceState(StrEnum):
    """What a source is doing."""

    STOPPED = "stopped"
    CONNECTING = "connecting"
    WAITING = "waiting"
    RECEIVING = "receiving"
    SILENT = "silent"
    FAILED = "failed"


@dataclass(frozen=True, slots=True, kw_only=True)
class SourceStatus:
    """A source as it is now."""

    state: SourceState
    """What it is doing."""
    records: int = 0
    """Records so far."""
    rate: float = 0.0
    """Records per second of the last two seconds."""
    bytes_received: int = 0
    """Bytes so far."""
    lost: int = 0
    """Messages that never came, by their numbers."""
    duplicates: int = 0
    """Messages that came twice, and were taken once."""
    undecodable: int = 0
    """Pieces that could not be decoded."""
    overrun: int = 0
    """Records that were dropped since nobody took them in time."""
    latency_s: float = float("nan")
    """Median of how much later than the quickest ones records arrive [s]; NaN where they say no time."""
    jitter_s: float = float("nan")
    """95 % of the intervals between records differ from their median by less [s]."""
    silent_s: float = float("inf")
    """Time since the last record [s]; infinite before the first."""
    connects: int = 0
    """How often it was connected to, or its sender began again."""
    trouble: str = ""
    """What went wrong last; empty: nothing."""
    told: Mapping[str, int] | None = None
    """What was left out and why."""

    @property
    def loss(self) -> float:
        """Share of the messages that never came [0..1]."""
        return self.lost / max(self.lost + self.records, 1)


class Numbers:
    """The numbers of one sender's messages: which came twice, and how many never came."""

    def __init__(self) -> None:
        self._newest: int | None = None
        self._seen: deque[int] = deque(maxlen=SEEN)

    def is_behind(self, sequence: int) -> bool:
        """Whether a number is less than one that came."""
        return self._newest is not None and sequence < self._newest

    def taken(self, sequence: int | None) -> int | None:
        """Take a number.

        Parameters
        ----------
        sequence : of a message; None where it has none.

        Returns
        -------
        lost : messages that are missing before it, -1 where it was itself missing before; None where it came before.
        """
        if sequence is None:
            return 0
        if sequence in self._seen:
            return None
        self._seen.append(sequence)
        before = self._newest
        if before is not None and -SEEN < sequence - before < 0:
            return -1
        self._newest = sequence
        return sequence - before - 1 if before is not None and sequence - before <= LARGEST_GAP else 0


class Tally:
    """Counts of one source; written by its thread, read by any."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._arrivals: deque[tuple[int, float]] = deque(maxlen=RECENT_LIMIT)
        self.state = SourceState.STOPPED
        self.records = self.bytes_received = self.lost = self.duplicates = 0
        self.undecodable = self.overrun = self.connects = 0
        self.trouble = ""
        self.last_ns: int | None = None
        self._times: dict[int, deque[tuple[int | None, int]]] = {}

    def arrived(self, arrived_ns: int, late_ns: int | None) -> None:
        """Count a record.

        Parameters
        ----------
        arrived_ns : when it arrived [ns].
        late_ns : how much later than the quickest ones [ns]; None where its sender says no time.
        """
        with self._lock:
            self.records += 1
            self.last_ns = arrived_ns
            self.state = SourceState.RECEIVING
            self._arrivals.append((arrived_ns, float("nan") if late_ns is None else late_ns * 1e-9))

    def timed(self, kind: int, device_ns: int | None, arrived_ns: int) -> None:
        """Keep when a record was measured and when it arrived.

        Parameters
        ----------
        kind : index of its scanner, or ODOMETRY.
        device_ns : time by its sender's clock [ns]; None where it says none.
        arrived_ns : time of arrival [ns].
        """
        with self._lock:
            self._times.setdefault(kind, deque(maxlen=ARRIVALS)).append((device_ns, arrived_ns))

    def forget_times(self) -> None:
        """Begin anew: another clock is behind what comes."""
        with self._lock:
            self._times.clear()

    def times(self) -> dict[int, Arrivals]:
        """Return when the last records of each kind were measured, None where their sender says no time, and came."""
        with self._lock:
            kept = {kind: list(rows) for kind, rows in self._times.items()}
        return {
            kind: (
                None if any(device is None for device, _ in rows) else np.array([row[0] for row in rows], np.int64),
                np.array([row[1] for row in rows], np.int64),
            )
            for kind, rows in kept.items()
        }

    def status(self, now_ns: int, told: Counter[str]) -> SourceStatus:
        """Return the source as it is at a time [ns]."""
        with self._lock:
            recent = [pair for pair in self._arrivals if now_ns - pair[0] < RECENT_NS]
            silent_s = float("inf") if self.last_ns is None else (now_ns - self.last_ns) * 1e-9
            state = self.state
            if state is SourceState.RECEIVING and silent_s > SILENT_AFTER_S:
                state = SourceState.SILENT
            latencies = [late for _, late in recent if late == late]  # noqa: PLR0124 - NaN is none
            return SourceStatus(
                state=state,
                records=self.records,
                rate=_rate([arrived for arrived, _ in recent]),
                bytes_received=self.bytes_received,
                lost=self.lost,
                duplicates=self.duplicates,
                undecodable=self.undecodable,
                overrun=self.overrun,
                latency_s=float(np.median(latencies)) if latencies else float("nan"),
                jitter_s=_jitter([arrived for arrived, _ in recent]),
                silent_s=silent_s,
                connects=self.connects,
                trouble=self.trouble,
                told={words: count for words, count in list(told.items()) if count},
            )


def _rate(arrivals: list[int]) -> float:
    """Records per second."""
    if len(arrivals) < 2 or arrivals[-1] <= arrivals[0]:
        return 0.0
    return (len(arrivals) - 1) / ((arrivals[-1] - arrivals[0]) * 1e-9)


def _jitter(arrivals: list[int]) -> float:
    """Jitter of the intervals [s]."""
    if len(arrivals) < 3:
        return float("nan")
    intervals = np.diff(np.array(arrivals)) * 1e-9
    return float(np.quantile(np.abs(intervals - np.median(intervals)), 0.95))

"""Recording of a live run: all records, and what the localizer made of them, into an MCAP file while it drives.

It never overwrites. What the program is killed in leaves a file that is readable up to the second before.
"""

from __future__ import annotations

import threading
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from commission.errors import CommissionError, UsageError
from commission.io.atomic import cannot_write
from commission.io.recordings.recorder import Recorder
from commission.localization.estimate import Belief, Estimate
from commission.site.recorded_start import RecordedStart
from commission.site.records import Odometry, Record
from commission.site.scanner import Scanner

MCAP = ".mcap"


@dataclass(frozen=True, slots=True, kw_only=True)
class RecordingStatus:
    """A recording as it is now."""

    path: Path
    """The file."""
    size: int
    """Bytes in it; what came within the last second is not yet among them."""
    duration: float
    """Time from the first record to the latest one [s]."""
    records: int
    """Records so far."""
    is_over: bool
    """Whether nothing more is written."""
    trouble: str = ""
    """Why it ended early; empty: it did not."""


class SessionRecorder:
    """A file that a live run is recorded to; appended to by the localizer's thread, asked and ended by any.

    Parameters
    ----------
    path : the file, which must not exist; it is made at once.
    scanners : the vehicle's.

    Raises
    ------
    UsageError
        there is something at the path, or it does not end in .mcap.
    FileFormatError
        the file cannot be written.
    """

    def __init__(self, path: Path, scanners: Sequence[Scanner]) -> None:
        if path.suffix.lower() != MCAP:
            raise UsageError(f"{path} is no name for a recording; expected one that ends in {MCAP}")
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            self._file = path.open("xb")
        except FileExistsError as error:
            if not path.exists():
                raise cannot_write(path, error) from error
            raise UsageError(f"{path} exists; expected a new file: a recording is never overwritten") from None
        except (OSError, ValueError) as error:
            raise cannot_write(path, error) from error
        self.path = path
        self._scanners = tuple(scanners)
        self._lock = threading.Lock()
        self._recorder: Recorder | None = None
        self._is_over = False
        self._trouble = ""

    @property
    def is_begun(self) -> bool:
        """Whether a record is in it."""
        return self._recorder is not None

    def append(
        self, record: Record, estimates: Iterable[Estimate], before: Belief | None, *, sought: bool = False
    ) -> None:
        """Append a record and what followed from it; a file that cannot be written ends the recording and no more.

        Parameters
        ----------
        record : in its order.
        estimates : that the localizer gave when it was fed the record.
        before : what was known of the pose before the record; read of the first one, where odometry begins.
        sought : whether the vehicle looked where it is then.
        """
        with self._lock:
            if self._is_over:
                return
            try:
                if self._recorder is None:
                    names = tuple(scanner.name for scanner in self._scanners)
                    mounted = self._scanners
                    start = None if before is None else RecordedStart(before.mean, before.covariance, sought)
                    self._recorder = Recorder(self.path, names, mounted=mounted, start=start, file=self._file)
                    if before is not None and before.stamp_ns < record.stamp_ns:
                        # Else the first displacement would have no begin.
                        self._recorder.append(Odometry(before.stamp_ns, np.zeros(3)))
                self._recorder.append(record)
            except CommissionError as error:
                self._fail(error)
        self.append_estimates(estimates)

    def append_estimates(self, estimates: Iterable[Estimate]) -> None:
        """Append what the localizer gave, like `append`."""
        with self._lock:
            try:
                for estimate in estimates:
                    if self._recorder is not None and not self._is_over:
                        self._recorder.append_estimate(estimate)
            except CommissionError as error:
                self._fail(error)

    def status(self) -> RecordingStatus:
        """Return how it is doing."""
        recorder = self._recorder
        return RecordingStatus(
            path=self.path,
            size=0 if recorder is None else recorder.size,
            duration=0.0 if recorder is None else recorder.duration,
            records=0 if recorder is None else recorder.records,
            is_over=self._is_over,
            trouble=self._trouble,
        )

    def close(self) -> RecordingStatus:
        """Write what waits and end the file; one that no record came for is taken away. Closing twice does nothing."""
        with self._lock:
            if not self._is_over:
                self._end()
        return self.status()

    def _fail(self, error: CommissionError) -> None:
        self._trouble = str(error)
        self._end()

    def _end(self) -> None:
        self._is_over = True
        try:
            if self._recorder is not None:
                self._recorder.close()
            self._file.close()
            if self._recorder is None:
                self.path.unlink(missing_ok=True)
        except (OSError, CommissionError) as error:
            self._trouble = self._trouble or str(error)


def new_recording(folder: Path, stamp: str, what: str = "live") -> Path:
    """Return the path of a recording that is not there yet.

    Parameters
    ----------
    folder : where recordings are.
    stamp : what it is called by: when it begins.
    what : with what its name begins.
    """
    path, number = folder / f"{what}-{stamp}{MCAP}", 1
    while path.exists():
        number += 1
        path = folder / f"{what}-{stamp}-{number}{MCAP}"
    return path

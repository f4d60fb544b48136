"""A whole drive and what the localizer made of it as one MCAP file, as if it had been recorded while it drove."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from commission.errors import UsageError
from commission.io.atomic import atomic_file
from commission.io.overwriting import refuse_files
from commission.io.recordings.recorder import Recorder
from commission.localization.run_columns import RunColumns
from commission.progress import Progress, silent
from commission.site.recorded_start import RecordedStart
from commission.site.scanner import Scanner
from commission.studies.run import RunInput
from commission.studies.start import StartOrigin

MCAP = ".mcap"
TELL_EVERY = 500
"""Records from one report of progress to the next."""
CHUNK_S = 600.0


def write_run(
    path: Path, inputs: RunInput, columns: RunColumns, scanners: Sequence[Scanner], progress: Progress = silent
) -> int:
    """Write a drive with estimate, detections and mode; returns the bytes of the file.

    Parameters
    ----------
    path : a file that does not exist and ends in .mcap; it is there once it is complete.
    inputs : records and start of the drive.
    columns : what the localizer made of it.
    scanners : the vehicle's, for viewers: where on it scans are drawn.
    progress : told how far it is; may raise to cancel.

    Raises
    ------
    UsageError
        there is something at the path, or it does not end in .mcap.
    FileFormatError
        the file cannot be written.
    """
    if path.suffix.lower() != MCAP:
        raise UsageError(f"{path} is no name for a recording; expected one that ends in {MCAP}")
    refuse_files(path, force=False)
    log, belief = inputs.log, inputs.start.belief
    start = RecordedStart(belief.mean, belief.covariance, inputs.start.origin is StartOrigin.SEARCH)
    cycle, count = 0, len(log)
    with atomic_file(path) as file:
        recorder = Recorder(
            path,
            log.scanners,
            truth=log.truth,
            reference_mount=log.reference_mount,
            mounted=scanners,
            start=start,
            chunk_s=CHUNK_S,
            file=file,
        )
        for number, record in enumerate(log.records()):
            while cycle < len(columns) and columns.stamps_ns[cycle] < record.stamp_ns:
                recorder.append_estimate(columns.estimate(cycle))
                cycle += 1
            recorder.append(record)
            if number % TELL_EVERY == 0:
                progress(number / count, f"{recorder.size / 1e6:.0f} MB")
        for left in range(cycle, len(columns)):
            recorder.append_estimate(columns.estimate(left))
        recorder.close()
        # Somebody else may have made the file meanwhile.
        refuse_files(path, force=False)
        return recorder.size

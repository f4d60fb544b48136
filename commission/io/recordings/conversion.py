"""From a recording of one format to one of another, with all that it has a place for; what has none there is told."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from commission.io.recordings.base import open_recording
from commission.io.recordings.channels import NO_OPTIONS, ChannelOptions
from commission.io.recordings.mcap_recording import McapRecording
from commission.io.recordings.writers import holds_all, write_records
from commission.site.record_log import RecordLog

NO_ESTIMATES = (
    "what the localizer said while it was recorded (estimate, detections, mode) has no place in tables; the file read "
    "keeps it (.mcap, .db3 and .bag take it over), and `commission localize` makes it anew"
)
NO_START = (
    "where the vehicle was when the recording began has no place in tables: localize the one that is written with "
    "--initial-pose {}"
)


def convert_recording(source: Path, target: Path, options: ChannelOptions = NO_OPTIONS) -> tuple[str, ...]:
    """Convert a recording; what the localizer said while it was recorded goes with it, byte by byte.

    Parameters
    ----------
    source : what to read.
    target : what to write: its name says the format.
    options : which topics are what, where that is not plain.

    Returns
    -------
    report : what was mended, left out or lost, one line each.

    Raises
    ------
    FileFormatError
        the source is unreadable, or the target cannot be written.
    UsageError
        there are several topics for one role: lists them.
    """
    recording = open_recording(source, options)
    own = recording if isinstance(recording, McapRecording) else None
    # Before it is loaded: a recording lets go of its index then.
    has_estimates = own is not None and own.holds_estimates()
    log = recording.load()
    write_records(
        target,
        log.records(),
        log.truth,
        scanners=log.scanners,
        reference_mount=log.reference_mount,
        start=log.start,
        beside=() if own is None else own.beside(),
    )
    return (*log.notes, *(() if holds_all(target) else _left_out(log, has_estimates=has_estimates)))


def _left_out(log: RecordLog, *, has_estimates: bool) -> Iterator[str]:
    """Say what tables have no place for."""
    if has_estimates:
        yield NO_ESTIMATES
    if log.start is not None:
        sigmas = np.sqrt(np.diagonal(log.start.covariance))
        given = "auto" if log.start.sought else ",".join(f"{value:.4f}" for value in (*log.start.pose, *sigmas))
        yield NO_START.format(given)

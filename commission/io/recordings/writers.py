"""In which format a recording is written: chosen by the name of where it goes. The formats are other modules."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path

from commission.errors import UsageError
from commission.io.overwriting import refuse_files, refuse_recording
from commission.io.recordings.csv_writer import write_recording
from commission.io.recordings.mcap_reader import Message
from commission.io.recordings.recorder import write_bag, write_mcap
from commission.site.recorded_start import RecordedStart
from commission.site.records import Record
from commission.site.reference_mount import BASE, ReferenceMount
from commission.site.scanner import ONLY_NAME
from commission.site.truth import Truth

MCAP = ".mcap"
_FILES = {MCAP: write_mcap, ".db3": write_bag, ".bag": write_bag}
"""What writes each kind of file, by the ending of its name."""
_READ_ONLY = (".pcap", ".pcapng", ".log", ".clf")
WRITTEN = (
    "a folder for tables (odometry.csv with detections.csv or scans.npz), or a name that ends in .mcap or .db3 (ROS 2) "
    "or .bag (ROS 1)"
)
"""What a recording can be written as, in words."""


def refuse_to_write(path: Path, *, force: bool) -> None:
    """Look at where a recording is about to be written.

    Parameters
    ----------
    path : folder, or file that ends in .mcap, .db3 or .bag.
    force : whether a recording that is there may be replaced.

    Raises
    ------
    UsageError
        the ending is one of a format that is read only, or something is there that would be overwritten.
    """
    if path.suffix.lower() in _READ_ONLY and not path.is_dir():
        raise UsageError(f"{path} ends in {path.suffix}, which is read only; expected {WRITTEN}")
    if _writer_of(path) is not None:
        refuse_files(path, force=force)
    else:
        refuse_recording(path, force=force)


def write_records(
    path: Path,
    records: Iterable[Record],
    truth: Truth | None = None,
    *,
    scanners: tuple[str, ...] = (ONLY_NAME,),
    reference_mount: ReferenceMount = BASE,
    start: RecordedStart | None = None,
    beside: Iterable[Message] = (),
) -> None:
    """Write a recording: as MCAP or as a bag where the name ends so, else as a CSV folder.

    Parameters
    ----------
    path : where; the recording there is replaced once the new one is complete.
    records : in the order of their stamps; a source's error passes through and leaves what is there as it was.
    truth : the constants of a virtual drive.
    scanners : names of the scanners that records have indices of.
    reference_mount : where the reference measures.
    start : where the vehicle was said to be before the first record; a CSV folder has no place for it.
    beside : what stands beside the records of another file; a CSV folder has no place for it.

    Raises
    ------
    FileFormatError
        it cannot be written, or the format cannot hold a record.
    """
    write = _writer_of(path)
    if write is None:
        write_recording(path, records, truth, scanners=scanners, reference_mount=reference_mount)
        return
    write(path, records, truth, scanners=scanners, reference_mount=reference_mount, start=start, beside=beside)


def holds_all(path: Path) -> bool:
    """Whether what is written there holds all of a recording, also where it began and what the localizer said."""
    return _writer_of(path) is not None


def _writer_of(path: Path) -> Callable[..., None] | None:
    """What writes the file of a name; None of a folder."""
    return None if path.is_dir() else _FILES.get(path.suffix.lower())

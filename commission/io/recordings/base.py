"""What every reader of recordings offers, and how one is chosen for a path. The formats are modules beside this one."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Protocol

from commission.errors import FileFormatError, UsageError
from commission.io.reading import cannot_read
from commission.io.recordings.bag_parts import bag_of
from commission.io.recordings.capture import Capture
from commission.io.recordings.carmen import CarmenLog
from commission.io.recordings.channels import NO_OPTIONS, ChannelOptions
from commission.io.recordings.csv_folder import CsvFolder
from commission.io.recordings.mcap_recording import McapRecording
from commission.io.recordings.own_bag import OwnBag
from commission.io.recordings.ros_bag import RosBag
from commission.site.record_log import RecordLog
from commission.site.records import Record
from commission.site.reference_mount import ReferenceMount
from commission.site.truth import Truth


class Recording(Protocol):
    """A recording on disk; opening one reads little more than its headers."""

    @property
    def path(self) -> Path:
        """Where it is."""
        ...

    @property
    def scanners(self) -> tuple[str, ...]:
        """Names of the scanners; records have indices into them."""
        ...

    def records(self) -> Iterator[Record]:
        """Deliver every record in order of stamps, in memory that does not grow with the recording's length.

        Raises FileFormatError, on the way, at the first thing that is wrong.
        """
        ...

    def truth(self) -> Truth | None:
        """Read the constants of a virtual drive; None of a real vehicle. Raises FileFormatError."""
        ...

    def reference_mount(self) -> ReferenceMount:
        """Read where on the vehicle the reference measures; base where nothing is said. Raises FileFormatError."""
        ...

    def load(self) -> RecordLog:
        """Read everything into columns, two to three times as fast as record by record; raises FileFormatError."""
        ...


def _csv_folder(path: Path, options: ChannelOptions) -> Recording:
    """Open a CSV folder, whose files say what they are."""
    if options != ChannelOptions():
        raise UsageError(f"{path} is a CSV folder; expected --channel and --wheels for recordings with topics only")
    return CsvFolder(path)


def _own_mcap(path: Path, options: ChannelOptions) -> Recording:
    """Open a file of our recorder: by what it says, or as a bag where topics are named."""
    return McapRecording(path) if options == NO_OPTIONS else RosBag(path, options)


def _bag(path: Path, options: ChannelOptions) -> Recording:
    """Open a bag: one that was converted here by what it says, or as any other where topics are named."""
    return OwnBag(path) if options == NO_OPTIONS and OwnBag.recognizes(path) else RosBag(path, options)


_FORMATS: tuple[tuple[Callable[[Path], bool], Callable[[Path, ChannelOptions], Recording]], ...] = (
    (CsvFolder.recognizes, _csv_folder),
    (Capture.recognizes, Capture),
    (McapRecording.recognizes, _own_mcap),
    (RosBag.recognizes, _bag),
    (CarmenLog.recognizes, CarmenLog),
)
READ = "a folder with odometry.csv, a ROS bag (.mcap, .db3, .bag), a capture (.pcap, .pcapng), or a CARMEN log"
"""What a recording can be, in words."""


def is_recording(path: Path) -> bool:
    """Whether an existing file or folder is a recording, by its content."""
    path = bag_of(path)
    return any(recognizes(path) for recognizes, _ in _FORMATS)


def open_recording(path: Path, options: ChannelOptions = NO_OPTIONS) -> Recording:
    """Open a recording, whatever its format is.

    Parameters
    ----------
    path : file or folder.
    options : which topics are what, where that is not plain.

    Raises
    ------
    FileFormatError
        it does not exist, is of no known format, or lacks a part that its format requires.
    UsageError
        there are several topics for one role: lists them.
    """
    try:
        if not path.exists():
            raise FileFormatError(path, "", "does not exist", "a recording")
        path = bag_of(path)
        for recognizes, reader in _FORMATS:
            if recognizes(path):
                return reader(path, options)
    except (OSError, ValueError) as error:
        raise cannot_read(path, error) from error
    packed = _packing(path)
    if packed:
        remedy = f"what is in it, unpacked ({packed[1]}), or of a ROS 2 bag its folder with metadata.yaml"
        raise FileFormatError(path, "", f"is packed as a whole ({packed[0]})", remedy)
    bags = sorted(each.name for each in path.glob("*.bag")) if path.is_dir() else []
    if bags:
        found = f"is a folder with bags of ROS 1, {', '.join(bags[:3])}{' and others' if len(bags) > 3 else ''}"
        raise FileFormatError(path, "", found, "one of them")
    raise FileFormatError(path, "", "is no recording", READ)


_PACKINGS = {
    b"\x28\xb5\x2f\xfd": ("zstd", "zstd -d"),
    b"\x1f\x8b": ("gzip", "gunzip, of a .tar.gz: tar xf"),
    b"BZh": ("bzip2", "bunzip2"),
    b"\xfd7zXZ\0": ("xz", "unxz"),
    b"\x04\x22\x4d\x18": ("lz4", "lz4 -d"),
    b"PK\x03\x04": ("zip", "unzip"),
    b"7z\xbc\xaf\x27\x1c": ("7z", "7z x"),
}
"""How packed files begin; what the packing is called, and what unpacks it."""


def _packing(path: Path) -> tuple[str, str] | None:
    """How a file is packed, and what unpacks it; None where it is not."""
    if not path.is_file():
        return None
    with path.open("rb") as file:
        begin = file.read(8)
    return next((told for magic, told in _PACKINGS.items() if begin.startswith(magic)), None)


def load_log(path: Path, options: ChannelOptions = NO_OPTIONS) -> RecordLog:
    """Read a whole recording into columns; see `open_recording`."""
    return open_recording(path, options).load()

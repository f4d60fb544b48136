"""Reading back, to the last bit, a bag of ROS 1 or in sqlite3 that was written here: by way of an MCAP file.

Bags of others are read by `ros_bag`, and so is this one where topics are named.
"""

from __future__ import annotations

import json
import shutil
import tempfile
import weakref
from dataclasses import replace
from pathlib import Path

from commission.errors import FileFormatError
from commission.io.atomic import cannot_write
from commission.io.recordings import ros_encoding as ros
from commission.io.recordings.bag_writer import ABOUT, TEXT
from commission.io.recordings.mcap_recording import McapRecording
from commission.io.recordings.mcap_writer import McapWriter
from commission.io.recordings.recorder import BESIDE
from commission.io.recordings.ros_source import open_bag
from commission.site.record_log import RecordLog

_CHUNK_BYTES = 4_000_000


class OwnBag(McapRecording):
    """A bag that was converted here; opening it copies what it holds into a temporary file.

    Parameters
    ----------
    path : where it is.

    Raises
    ------
    FileFormatError
        it is damaged, or of a version that this program does not know.
    """

    def __init__(self, path: Path) -> None:
        try:
            folder = Path(tempfile.mkdtemp())
        except OSError as error:
            raise cannot_write(path, error) from error
        weakref.finalize(self, shutil.rmtree, folder, ignore_errors=True)
        copy = folder / "copy.mcap"
        self._notes = _copied(path, copy)
        super().__init__(path, copy)

    def load(self) -> RecordLog:
        """Read everything but scans into columns; raises FileFormatError."""
        log = super().load()
        return replace(log, notes=(*self._notes, *log.notes))

    @staticmethod
    def recognizes(path: Path) -> bool:
        """Whether a bag is such a one, by its topics; raises FileFormatError where it is damaged."""
        return any(topic.name == ABOUT and topic.type == TEXT for topic in open_bag(path).topics)


def _copied(path: Path, copy: Path) -> tuple[str, ...]:
    """Write what is needed of a bag into an MCAP file; returns what was noticed about the bag."""
    bag = open_bag(path)
    about = next(iter(bag.messages({ABOUT})), None)
    try:
        said = {} if about is None else json.loads(about.value.data)
        if not isinstance(said, dict):
            raise ValueError("it is no object")
        groups = {str(name): {str(key): str(value) for key, value in group.items()} for name, group in said.items()}
    except (ValueError, AttributeError, RecursionError) as error:
        raise FileFormatError(path, ABOUT, f"says nothing that is known ({error})", "as it was written") from error
    types = {topic.name: topic.type for topic in bag.topics}
    wanted = {name for name, kind in types.items() if kind == ros.LASER_SCAN or kind in ros.OWN_FIELDS}
    wanted |= {name for name, kind in BESIDE.items() if types.get(name) == kind}
    try:
        with copy.open("wb") as file:
            writer = McapWriter(copy, file, chunk_bytes=_CHUNK_BYTES, chunk_ns=600_000_000_000)
            for name, values in groups.items():
                writer.add_metadata(name, values)
            channels = {name: writer.add_channel(name, types[name], "") for name in sorted(wanted)}
            for topic, time_ns, data in bag.raw_messages(wanted):
                is_scan = types[topic] in (ros.LASER_SCAN, ros.BEAMS)
                writer.add_message(channels[topic], max(time_ns, 0), data, compression="" if is_scan else "lz4")
            writer.finish()
        return bag.notes
    except OSError as error:
        raise cannot_write(copy, error) from error

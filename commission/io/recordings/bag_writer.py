"""Writing a ROS 1 bag (.bag) or a ROS 2 bag in sqlite3 (.db3) message by message, by `rosbags`.

It takes what `McapWriter` takes, messages of ROS 2 in CDR, so that one recorder writes all three. It knows no message.
"""

from __future__ import annotations

import json
import os
import shutil
import struct
from collections.abc import Generator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from commission.io.atomic import cannot_write, staged
from commission.io.recordings.ros_types import learn_type, ros2_types

if TYPE_CHECKING:
    from rosbags.typesys.store import Typestore

ROS1, SQLITE = ".bag", ".db3"
"""How names of bags end that are written here."""
ABOUT = "/commission/about"
"""Topic of what the bag says about itself, which an MCAP file has in its metadata."""
TEXT = "std_msgs/msg/String"
_TRANSFORMS = "tf2_msgs/msg/TFMessage"


class MessageWriter(Protocol):
    """A file of messages that is being written; `McapWriter` is one too."""

    written: int
    """Bytes so far."""

    def add_metadata(self, name: str, values: dict[str, str]) -> None:
        """Write texts that say something about the whole file."""
        ...

    def add_channel(self, topic: str, schema: str, definition: str) -> int:
        """Announce a topic; returns its number.

        Parameters
        ----------
        topic : its name.
        schema : name of the type of its messages.
        definition : what the type is, in the language of ROS 2 messages.
        """
        ...

    def add_message(self, channel: int, time_ns: int, data: bytes, *, compression: str = "") -> None:
        """Add a message.

        Parameters
        ----------
        channel : number of its topic.
        time_ns : when it was recorded [ns], 0 or more.
        data : its bytes.
        compression : of what it is packed with: `lz4`, or nothing.
        """
        ...

    def flush(self) -> None:
        """Write what waits."""
        ...

    def finish(self) -> None:
        """Write what waits, and what closes the file."""
        ...


class BagWriter:
    """A bag that is being written; a `MessageWriter`.

    Parameters
    ----------
    path : its name, for messages.
    file : the bag itself, of which nothing is there yet: a file of ROS 1, or the folder of ROS 2 around its file.
    """

    def __init__(self, path: Path, file: Path) -> None:
        self.path = path
        self.written = 0
        """Bytes of all messages."""
        self.is_ros1 = path.suffix.lower() == ROS1
        """Whether it is one of ROS 1, not of ROS 2."""
        self._ros2 = ros2_types()
        self._store = _ros1_types() if self.is_ros1 else self._ros2
        self._writer = _library_writer(file, is_ros1=self.is_ros1)
        self._connections: list[Any] = []
        self._kinds: list[str] = []
        self._about: dict[str, dict[str, str]] = {}
        with _told(path):
            self._writer.open()

    def add_metadata(self, name: str, values: dict[str, str]) -> None:
        """Say something about the whole bag: it becomes a message before the first other one.

        Parameters
        ----------
        name : of all of it.
        values : by their keys.
        """
        self._about[name] = values

    def add_channel(self, topic: str, schema: str, definition: str) -> int:
        """Announce a topic; returns its number.

        Parameters
        ----------
        topic : its name.
        schema : name of the type of its messages: `sensor_msgs/msg/LaserScan`.
        definition : what the type is, in the language of ROS 2 messages.
        """
        self._register(schema, definition)
        with _told(self.path):
            self._connections.append(self._writer.add_connection(topic, schema, typestore=self._store))
        self._kinds.append(schema)
        return len(self._connections) - 1

    def add_message(self, channel: int, time_ns: int, data: bytes, *, compression: str = "") -> None:
        """Add a message.

        Parameters
        ----------
        channel : number of its topic.
        time_ns : when it was recorded [ns], 0 or more.
        data : its bytes, as ROS 2 has them.
        compression : of no meaning here: neither kind packs by topic.
        """
        del compression
        if self._about:
            self._tell_about(time_ns)
        with _told(self.path):
            kind = self._kinds[channel]
            plain = self._ros2.cdr_to_ros1(data, kind) if self.is_ros1 else data
            self._writer.write(self._connections[channel], time_ns, plain)
        self.written += len(data)

    def flush(self) -> None:
        """Do nothing: the library writes when it likes to."""

    def finish(self) -> None:
        """Close the bag."""
        with _told(self.path):
            self._writer.close()

    def abort(self) -> None:
        """Close what is open, and leave the bag half written."""
        with suppress(Exception):
            self._writer.abort()

    def _tell_about(self, time_ns: int) -> None:
        """Write what is said about the bag, as one text."""
        about, self._about = self._about, {}
        channel = self.add_channel(ABOUT, TEXT, "string data\n")
        text = json.dumps(about).encode("utf-8") + b"\0"
        self.add_message(channel, time_ns, b"\0\1\0\0" + struct.pack("<I", len(text)) + text)

    def _register(self, schema: str, definition: str) -> None:
        """Make a type of ours known: those of ROS are."""
        for store in (self._store, self._ros2):
            if schema not in store.fielddefs:
                learn_type(store, schema, definition)


@contextmanager
def atomic_bag(path: Path) -> Generator[BagWriter]:
    """Write a bag beside `path`; after the block it takes the place of `path`, after an error it is gone.

    Parameters
    ----------
    path : the file; its name ends in .bag or .db3.

    Raises
    ------
    FileFormatError
        it cannot be written.
    """
    with staged(path.parent, last=path.name) as scratch:
        place = scratch / "bag"
        writer = BagWriter(path, place)
        try:
            yield writer
        finally:
            # Of a closed one nothing is left to do.
            writer.abort()
        # A bag of ROS 2 is a folder; its file tells the same, and `ros2 bag` takes it as it is.
        made = place if place.is_file() else place / f"bag{SQLITE}"
        made.replace(scratch / path.name)
        shutil.rmtree(place, ignore_errors=True)
        with (scratch / path.name).open("rb+") as file:
            os.fsync(file.fileno())


def _ros1_types() -> Typestore:
    """Types of ROS 1, as a bag of it defines them."""
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS1_NOETIC)
    # ROS 1 has it in a package of its own, which the library leaves out.
    learn_type(store, _TRANSFORMS, "geometry_msgs/TransformStamped[] transforms")
    return store


def _library_writer(file: Path, *, is_ros1: bool) -> Any:
    """Return the library's writer, not yet open."""
    if is_ros1:
        from rosbags.rosbag1 import Writer as Writer1

        return Writer1(file)
    from rosbags.rosbag2 import StoragePlugin
    from rosbags.rosbag2 import Writer as Writer2

    return Writer2(file, version=9, storage_plugin=StoragePlugin.SQLITE3)


@contextmanager
def _told(path: Path) -> Generator[None]:
    """Turn what the library raises over a full disk into one line."""
    import apsw
    from rosbags.rosbag1 import WriterError as Error1
    from rosbags.rosbag2 import WriterError as Error2

    try:
        yield
    except (OSError, apsw.Error, Error1, Error2) as error:
        raise cannot_write(path, error) from error

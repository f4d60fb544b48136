"""Messages of ROS bags of every kind, decoded: MCAP by our own reader, sqlite3 and ROS 1 by `rosbags`.

It knows no record of ours. Types come from the bag; a bag without definitions is read by those of a ROS distribution.
"""

from __future__ import annotations

import shutil
import struct
import tempfile
import weakref
from collections.abc import Callable, Collection, Generator, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, TypeVar

from commission.errors import FileFormatError, reason_of
from commission.io.reading import cannot_read
from commission.io.recordings.bag_parts import METADATA, files_of, missing_parts, unmerged
from commission.io.recordings.mcap_reader import MAGIC, McapChannel, McapFile, Message, MessageFile
from commission.io.recordings.packed_bag import packed_files, unpacked_folder
from commission.io.recordings.ros1_file import Ros1File
from commission.io.recordings.ros_types import learn_type, ros2_type, ros2_types, typestore_of, unpacked_message

if TYPE_CHECKING:
    from rosbags.typesys.store import Typestore

ROS1_MAGIC = b"#ROSBAG V2.0"
SQLITE_MAGIC = b"SQLite format 3\0"
_Made = TypeVar("_Made")
_MAGICS = (MAGIC, ROS1_MAGIC, SQLITE_MAGIC)


@dataclass(frozen=True, slots=True)
class BagTopic:
    """A topic as the bag names it."""

    name: str
    """Its name."""
    type: str
    """Type of its messages, as `sensor_msgs/msg/LaserScan`."""
    count: int | None
    """Messages; None where the file does not say."""


@dataclass(frozen=True, slots=True)
class BagMessage:
    """One message, decoded."""

    topic: str
    """Name of its topic."""
    log_time_ns: int
    """When it was recorded [ns]."""
    value: Any
    """Its fields, by the names of its type."""


class BagSource(Protocol):
    """A bag that is opened."""

    @property
    def topics(self) -> tuple[BagTopic, ...]:
        """All topics whose messages can be decoded."""
        ...

    @property
    def unread(self) -> tuple[str, ...]:
        """All other topics, each with how it is encoded."""
        ...

    def messages(self, topics: Collection[str]) -> Iterator[BagMessage]:
        """Deliver the messages of some topics as they were written; raises FileFormatError."""
        ...

    def raw_messages(self, topics: Collection[str]) -> Iterator[tuple[str, int, bytes]]:
        """Deliver topic, time of recording [ns] and bytes, as ROS 2 has them, of messages; raises FileFormatError."""
        ...

    @property
    def notes(self) -> tuple[str, ...]:
        """What was noticed on the way, after the last message."""
        ...


def is_bag(path: Path) -> bool:
    """Whether a file or folder is a ROS bag, by its first bytes (a folder by its metadata or its files)."""
    if path.is_dir():
        plain = (path / METADATA).is_file() or bool(files_of(path, ".mcap") or files_of(path, ".db3"))
        return plain or is_packed(path)
    with path.open("rb") as file:
        begin = file.read(len(SQLITE_MAGIC))
    return begin.startswith(_MAGICS) or is_packed(path)


def is_packed(path: Path) -> bool:
    """Whether a bag is packed as a whole, and no metadata says so."""
    if path.is_dir() and ((path / METADATA).is_file() or files_of(path, ".mcap", ".db3")):
        return False
    return bool(packed_files(path, _MAGICS))


def open_bag(path: Path) -> BagSource:
    """Open a bag; raises FileFormatError where it is damaged or of a version that is not read."""
    if is_packed(path):
        return PackedSource(path)
    if path.is_dir():
        files = files_of(path, ".mcap")
        return McapSource(path, files) if files else RosbagsSource(path)
    if _begins_with(path, MAGIC):
        return McapSource(path, [path])
    try:
        return RosbagsSource(path)
    except FileFormatError:
        # Without its index a bag of ROS 1 is read from its begin.
        whole = McapSource(path, [path]) if _begins_with(path, ROS1_MAGIC) else None
        if whole is None or not whole.topics:
            raise
        return whole


class PackedSource:
    """A bag that is packed as a whole: what is in it is read."""

    def __init__(self, path: Path) -> None:
        """Unpack it."""
        self.path = path
        files = packed_files(path, _MAGICS)
        folder, self._cut = unpacked_folder(self, path, files)
        single = folder / files[0].name[: -len(files[0].suffix)]
        with self._named():
            self._bag = open_bag(folder if path.is_dir() else single)
        self.topics = self._bag.topics
        self.unread = self._bag.unread

    @property
    def notes(self) -> tuple[str, ...]:
        """What was noticed on the way."""
        return (*self._cut, *self._bag.notes)

    def messages(self, topics: Collection[str]) -> Iterator[BagMessage]:
        """Deliver the messages of some topics as they were written; raises FileFormatError."""
        with self._named():
            yield from self._bag.messages(topics)

    def raw_messages(self, topics: Collection[str]) -> Iterator[tuple[str, int, bytes]]:
        """Deliver topic, time of recording [ns] and bytes, as ROS 2 has them, of messages; raises FileFormatError."""
        with self._named():
            yield from self._bag.raw_messages(topics)

    @contextmanager
    def _named(self) -> Generator[None]:
        """Name the bag where an error names what was unpacked."""
        try:
            yield
        except FileFormatError as error:
            raise FileFormatError(self.path, error.where, error.problem, error.remedy) from error


class McapSource:
    """One or several MCAP files that follow each other, or a bag of ROS 1 without its index."""

    def __init__(self, path: Path, files: list[Path]) -> None:
        """Read what the files say about their channels; one without a summary is read through."""
        self.path = path
        self.files = files
        self._missing = missing_parts(path, files) if path.is_dir() else ()
        self._cut: list[str] = []
        self._typestores: dict[tuple[str, str, str], Typestore] = {}
        found: dict[str, tuple[str, int | None]] = {}
        unread: dict[str, str] = {}
        for file in files:
            mcap = _file_of(file)
            counts: dict[str, int] = {}
            if mcap.read_summary():
                for number, channel in mcap.channels.items():
                    counts[channel.topic] = counts.get(channel.topic, 0) + mcap.counts.get(number, 0)
            else:
                for message in mcap.messages():
                    counts[message.channel.topic] = counts.get(message.channel.topic, 0) + 1
            for channel in mcap.channels.values():
                if channel.encoding in ("cdr", "ros1") and channel.topic in counts:
                    before = found.get(channel.topic, ("", 0))[1] or 0
                    found[channel.topic] = ros2_type(channel.schema), before + counts.pop(channel.topic)
                elif channel.encoding not in ("cdr", "ros1"):
                    unread[channel.topic] = f"{channel.topic} ({channel.schema}, encoded as {channel.encoding})"
        self.topics = tuple(BagTopic(name, kind, count) for name, (kind, count) in found.items())
        self.unread = tuple(unread.values())

    @property
    def notes(self) -> tuple[str, ...]:
        """Which files are missing, and which are cut."""
        return (*self._missing, *self._cut)

    def messages(self, topics: Collection[str]) -> Iterator[BagMessage]:
        """Deliver the messages of some topics as they were written; raises FileFormatError."""
        return self._each(topics, self._decoded)

    def raw_messages(self, topics: Collection[str]) -> Iterator[tuple[str, int, bytes]]:
        """Deliver topic, time of recording [ns] and bytes, as ROS 2 has them, of messages; raises FileFormatError."""
        store = ros2_types()

        def raw(message: Message) -> tuple[str, int, bytes]:
            kind, data = ros2_type(message.channel.schema), unpacked_message(message.data)
            if message.channel.encoding == "ros1":
                if kind not in store.fielddefs:
                    learn_type(store, kind, message.channel.definition)
                data = bytes(store.ros1_to_cdr(data, kind))
            return message.channel.topic, message.log_time_ns, data

        return self._each(topics, raw)

    def _each(self, topics: Collection[str], make: Callable[[Message], _Made]) -> Iterator[_Made]:
        """Deliver what is made of each message of some topics."""
        self._cut = []
        for file in self.files:
            mcap = _file_of(file)
            with _told(file):
                for message in mcap.messages():
                    if message.channel.topic in topics:
                        yield make(message)
            if mcap.is_cut:
                self._cut.append(f"{file.name} was cut while it was recorded; it is read up to there")

    def _decoded(self, message: Message) -> BagMessage:
        channel, data = message.channel, unpacked_message(message.data)
        store = self._typestore(channel)
        kind = ros2_type(channel.schema)
        read = store.deserialize_ros1 if channel.encoding == "ros1" else store.deserialize_cdr
        return BagMessage(channel.topic, message.log_time_ns, read(data, kind))

    def _typestore(self, channel: McapChannel) -> Typestore:
        key = channel.schema, channel.schema_encoding, channel.definition
        if key not in self._typestores:
            self._typestores[key] = typestore_of(channel)
        return self._typestores[key]


def _file_of(path: Path) -> MessageFile:
    return Ros1File(path) if _begins_with(path, ROS1_MAGIC) else McapFile(path)


class RosbagsSource:
    """A ROS 1 bag, or a ROS 2 bag in sqlite3."""

    unread: tuple[str, ...] = ()

    def __init__(self, path: Path) -> None:
        """Read what the bag says about its topics."""
        self.path = path
        files = files_of(path, ".db3", ".zstd") if path.is_dir() else [path]
        self._missing = missing_parts(path, files) if path.is_dir() else ()
        self.notes: tuple[str, ...] = (*self._missing, *unmerged(files))
        self._is_ros1 = path.is_file() and _begins_with(path, ROS1_MAGIC)
        self._named = self._with_ending(".bag" if self._is_ros1 else ".db3")
        with _told(path), self._reader() as reader:
            found: dict[str, tuple[str, int]] = {}
            for connection in reader.connections:
                if not (isinstance(connection.topic, str) and isinstance(connection.msgtype, str)):
                    raise ValueError(f"a topic is named {connection.topic!r}, of the type {connection.msgtype!r}")
                count = found.get(connection.topic, ("", 0))[1] + connection.msgcount
                found[connection.topic] = connection.msgtype, count
        self.topics = tuple(BagTopic(name, kind, count) for name, (kind, count) in found.items())

    def _with_ending(self, ending: str) -> Path:
        """Path by which the library, which goes by endings, takes the bag for what it is: a link where it has none."""
        if self.path.is_dir() or self.path.suffix == ending:
            return self.path
        try:
            folder = Path(tempfile.mkdtemp())
            weakref.finalize(self, shutil.rmtree, folder, ignore_errors=True)
            link = folder / f"bag{ending}"
            link.symlink_to(self.path.resolve())
        except OSError as error:
            found = f"is a bag that ends in {self.path.suffix!r}"
            raise FileFormatError(self.path, "", found, f"a name that ends in {ending}") from error
        return link

    def messages(self, topics: Collection[str]) -> Iterator[BagMessage]:
        """Deliver the messages of some topics in the order of their recording; raises FileFormatError."""
        with _told(self.path), self._reader() as reader:
            chosen = [connection for connection in reader.connections if connection.topic in topics]
            if not chosen:
                return
            for connection, stamp, data in _plain(reader.messages(connections=chosen)):
                plain = data if self._is_ros1 else unpacked_message(data)
                yield BagMessage(connection.topic, stamp, reader.deserialize(plain, connection.msgtype))

    def raw_messages(self, topics: Collection[str]) -> Iterator[tuple[str, int, bytes]]:
        """Deliver topic, time of recording [ns] and bytes, as ROS 2 has them, of messages; raises FileFormatError."""
        store = ros2_types()
        with _told(self.path), self._reader() as reader:
            chosen = [connection for connection in reader.connections if connection.topic in topics]
            for connection, stamp, data in _plain(reader.messages(connections=chosen)) if chosen else ():
                if self._is_ros1 and connection.msgtype not in store.fielddefs:
                    learn_type(store, connection.msgtype, connection.msgdef.data)
                whole = store.ros1_to_cdr(data, connection.msgtype) if self._is_ros1 else data
                yield connection.topic, stamp, bytes(whole)

    def _reader(self) -> Any:
        from rosbags.highlevel import AnyReader
        from rosbags.typesys import Stores, get_typestore

        store = get_typestore(Stores.ROS1_NOETIC if self._is_ros1 else Stores.ROS2_HUMBLE)
        paths = [self._named]
        files = files_of(self.path, ".db3") if self.path.is_dir() else []
        if files and (self._missing or not (self.path / METADATA).is_file()):
            # A recorder writes the metadata when it ends: where it was stopped, the files stand alone. By the metadata
            # the library wants all of them.
            paths = files
        return AnyReader(paths, default_typestore=store)


def _plain(messages: Iterator[tuple[Any, Any, Any]]) -> Iterator[tuple[Any, int, bytes]]:
    """Deliver messages whose time and content are what they shall be: a cell of sqlite holds whatever it likes."""
    for connection, stamp, data in messages:
        if not isinstance(stamp, int) or not isinstance(data, bytes | memoryview):
            raise ValueError(f"a message of {connection.topic} has no time or no content")
        yield connection, stamp, bytes(data)


def _begins_with(path: Path, magic: bytes) -> bool:
    with path.open("rb") as file:
        return file.read(len(magic)) == magic


@contextmanager
def _told(path: Path) -> Generator[None]:
    """Turn what the library raises over a damaged bag into one line."""
    import apsw
    from rosbags.highlevel import AnyReaderError
    from rosbags.rosbag1 import ReaderError as Ros1Error
    from rosbags.rosbag2 import ReaderError as Ros2Error
    from rosbags.serde import SerdeError
    from rosbags.typesys import TypesysError

    garbage = (AnyReaderError, Ros1Error, Ros2Error, SerdeError, TypesysError, apsw.Error, struct.error)
    plain = (ValueError, LookupError, AssertionError, EOFError, RuntimeError, TypeError, ArithmeticError)
    try:
        yield
    except OSError as error:
        raise cannot_read(path, error) from error
    except (*garbage, *plain) as error:
        reason = reason_of(error)
        remedy = "a bag that was closed (ROS 1: rosbag reindex)" if "index" in reason else "a whole bag"
        raise FileFormatError(path, "", f"is damaged or no bag ({reason})", remedy) from error

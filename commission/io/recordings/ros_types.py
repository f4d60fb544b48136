"""Types of ROS messages, by which they are decoded: those of a bag, or of a distribution. It opens no file."""

from __future__ import annotations

from typing import TYPE_CHECKING

from commission.io.recordings.mcap_reader import RECORD_LIMIT, McapChannel
from commission.io.recordings.packed_bag import ZSTD_MAGIC

if TYPE_CHECKING:
    from rosbags.typesys.store import Typestore


def typestore_of(channel: McapChannel) -> Typestore:
    """Types that the messages of a channel are made of."""
    from rosbags.typesys import Stores, get_types_from_idl, get_types_from_msg, get_typestore

    if not channel.definition:
        return get_typestore(Stores.ROS1_NOETIC if channel.encoding == "ros1" else Stores.ROS2_HUMBLE)
    store = get_typestore(Stores.EMPTY)
    if channel.schema_encoding in ("ros2idl", "omgidl"):
        for part in channel.definition.split("=" * 80 + "\n"):
            text = part.split("\n", 1)[1] if part.startswith("IDL: ") else part
            if text.strip():
                store.register(get_types_from_idl(text))
    else:
        store.register(get_types_from_msg(channel.definition, ros2_type(channel.schema)))
    return store


def ros2_types() -> Typestore:
    """Types of ROS 2: between its messages and those of ROS 1, whose headers count themselves, they translate."""
    from rosbags.typesys import Stores, get_typestore

    return get_typestore(Stores.ROS2_HUMBLE)


def learn_type(store: Typestore, kind: str, definition: str) -> None:
    """Make a type known, and those in it that are not.

    Parameters
    ----------
    store : takes it.
    kind : its name: `commission_msgs/msg/Beams`.
    definition : what it is, in the language of ROS messages.
    """
    from rosbags.typesys import get_types_from_msg

    types = get_types_from_msg(definition, kind)
    store.register({name: fields for name, fields in types.items() if name not in store.fielddefs})


def unpacked_message(data: bytes) -> bytes:
    """Return a message of a bag whose messages are packed one by one (`compression_mode: MESSAGE`), or it as it is.

    Encoded messages begin with a byte of 0: what begins as zstd does is none. Raises ValueError where it is damaged.
    """
    if not data.startswith(ZSTD_MAGIC):
        return data
    from rosbags.rosbag2.storage_mcap import zstd

    try:
        # A few bytes could unpack into gigabytes.
        return zstd.ZstdDecompressor().decompress(data, max_length=RECORD_LIMIT)
    except zstd.ZstdError as error:
        raise ValueError(str(error)) from error


def ros2_type(name: str) -> str:
    """Name of a type as ROS 2 has it: `sensor_msgs/msg/LaserScan` of `sensor_msgs/LaserScan`."""
    parts = name.split("/")
    return f"{parts[0]}/msg/{parts[1]}" if len(parts) == 2 else name

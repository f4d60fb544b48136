"""Which topics of a recording are its scanners, its odometry, its reference. No file is read here.

Where there is one candidate it is taken. Where there are several, they are listed with the option that chooses.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

from commission.errors import UsageError
from commission.io.recordings.motion import Wheels
from commission.site.scanner import ONLY_NAME, is_name


class Role(StrEnum):
    """What a topic is to a recording."""

    SCAN = "scan"
    ODOMETRY = "odometry"
    REFERENCE = "reference"


@dataclass(frozen=True, slots=True, kw_only=True)
class Topic:
    """A topic of a recording that could be used."""

    name: str
    """Its name: `/front/scan`."""
    type: str
    """Type of its messages: `sensor_msgs/msg/LaserScan`."""
    role: Role
    """What it could be."""
    rank: int = 0
    """Of several candidates only those of the lowest rank count: odometry comes before what wheels say."""
    count: int | None = None
    """Messages; None where the file does not say."""

    @property
    def told(self) -> str:
        """It in a list: `/odom (nav_msgs/msg/Odometry, 512 messages)`."""
        return f"{self.name} ({self.type}{'' if self.count is None else f', {self.count} messages'})"


@dataclass(frozen=True, slots=True, kw_only=True)
class ChannelOptions:
    """What a person says about the topics of a recording."""

    channels: tuple[str, ...] = ()
    """`scan=/front/scan`, `scan.front=/front/scan` (with the scanner's name), `odometry=/odom`, `reference=/pose`,
    `odometry=none`."""
    wheels: Wheels | None = None
    """Wheels whose turning is the odometry."""

    @staticmethod
    def parse(channels: Sequence[str], wheels: str | None) -> ChannelOptions:
        """Return what the words of a command line say.

        Parameters
        ----------
        channels : each KIND=TOPIC.
        wheels : LEFT,RIGHT,RADIUS,SEPARATION or LEFT,RIGHT,RADIUS,SEPARATION,TICKS; None: none.

        Raises
        ------
        UsageError
            a word is of another form; says which is expected.
        """
        for word in channels:
            _split(word)
        return ChannelOptions(channels=tuple(channels), wheels=None if wheels is None else _wheels(wheels))


NO_OPTIONS = ChannelOptions()
"""Nothing is said: the recording must be plain."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Chosen:
    """The topics that are read."""

    scanners: dict[str, str]
    """Scanner's name of each topic of scans."""
    odometry: Topic | None = None
    """Where motion comes from."""
    reference: Topic | None = None
    """Where the second system's poses come from."""


def choose(path: Path, topics: Sequence[Topic], options: ChannelOptions) -> Chosen:
    """Return the topics that are read.

    Parameters
    ----------
    path : the recording, for messages.
    topics : candidates.
    options : what a person says.

    Raises
    ------
    UsageError
        a topic that was named is not there, or there are several candidates: lists them.
    """
    named: dict[Role, list[tuple[str, Topic | None]]] = {}
    for word in options.channels:
        role, scanner, name = _split(word)
        topic = None if name == "none" else _named(path, topics, role, name)
        named.setdefault(role, []).append((scanner, topic))
    return Chosen(
        scanners=_scanners(path, topics, named.get(Role.SCAN)),
        odometry=_one(path, topics, Role.ODOMETRY, named.get(Role.ODOMETRY)),
        reference=_one(path, topics, Role.REFERENCE, named.get(Role.REFERENCE)),
    )


def left_out(topics: Sequence[Topic], role: Role) -> str:
    """Return the topics that could be of a role and are taken only where they are named; empty where there are none."""
    return ", ".join(topic.told for topic in topics if topic.role is role and topic.count != 0)


def _split(word: str) -> tuple[Role, str, str]:
    """Role, name of a scanner (or nothing) and topic of an option."""
    key, sign, topic = word.partition("=")
    kind, _, scanner = key.partition(".")
    good = sign and topic and kind in list(Role) and (not scanner or (kind == Role.SCAN and is_name(scanner)))
    if not good:
        expected = "scan=TOPIC, scan.NAME=TOPIC, odometry=TOPIC or reference=TOPIC (TOPIC none: of no topic)"
        raise UsageError(f"--channel is {word!r}; expected {expected}")
    return Role(kind), scanner, topic


def _wheels(text: str) -> Wheels:
    parts = [part.strip() for part in text.split(",")]
    expected = "LEFT,RIGHT,RADIUS,SEPARATION[,TICKS]: names of two joints, metres, metres, counts for a turn"
    try:
        if len(parts) not in (4, 5):
            raise ValueError(f"has {len(parts)} parts")
        numbers = [float(part) for part in parts[2:]]
        if not all(map(math.isfinite, numbers)):
            raise ValueError("has a number that is not finite")
        return Wheels(
            left=parts[0],
            right=parts[1],
            radius=numbers[0],
            separation=numbers[1],
            ticks=numbers[2] if len(numbers) > 2 else None,
        )
    except ValueError as error:
        raise UsageError(f"--wheels is {text!r}: {error}; expected {expected}") from None


def _named(path: Path, topics: Sequence[Topic], role: Role, name: str) -> Topic:
    """Return the topic of a name, of a role."""
    found = [topic for topic in topics if topic.role is role and topic.name == name]
    if not found:
        has = ", ".join(topic.told for topic in topics if topic.role is role)
        expected = f"one of: {has}" if has else f"none: it has no topic of {role}"
        raise UsageError(f"{path} has no topic {name!r} of {role}; expected --channel {role}={expected}")
    return found[0]


def _one(path: Path, topics: Sequence[Topic], role: Role, named: list[tuple[str, Topic | None]] | None) -> Topic | None:
    """Return the one topic of a role, or None."""
    if named is not None:
        if len(named) > 1:
            raise UsageError(f"--channel {role} is given {len(named)} times; expected once")
        return named[0][1]
    of_role = [topic for topic in topics if topic.role is role and topic.count != 0]
    best = [topic for topic in of_role if topic.rank == min(each.rank for each in of_role)]
    if len(best) > 1:
        raise _several(path, role, best)
    return best[0] if best else None


def _scanners(path: Path, topics: Sequence[Topic], named: list[tuple[str, Topic | None]] | None) -> dict[str, str]:
    """Scanner's name of each topic of scans that is read."""
    if named is not None:
        chosen = [(scanner, topic.name) for scanner, topic in named if topic is not None]
        alone = len(chosen) == 1
        names = {topic: scanner or (ONLY_NAME if alone else _name_of(topic)) for scanner, topic in chosen}
        if len(set(names.values())) < len(chosen):
            raise UsageError("--channel scan: two scanners have one name; expected scan.NAME=TOPIC for each")
        return names
    of_role = [topic for topic in topics if topic.role is Role.SCAN and topic.count != 0]
    best = [topic.name for topic in of_role if topic.rank == min(each.rank for each in of_role)]
    if len(best) < 2:
        return {name: ONLY_NAME for name in best}
    # `/front/scan` and `/rear/scan` are two scanners; `/scan` and `/scan_filtered` may be one.
    folders = {name.rstrip("/").rpartition("/")[0] for name in best}
    ends = {name.rstrip("/").rpartition("/")[2] for name in best}
    names = {name: _name_of(name) for name in best}
    if len(ends) > 1 or len(folders) < len(best) or len(set(names.values())) < len(best):
        raise _several(path, Role.SCAN, [topic for topic in of_role if topic.name in best])
    return names


def _name_of(topic: str) -> str:
    """Name of a scanner from its topic: `front` of `/front/scan` and of `/scan_front`."""
    parts = [part for part in topic.split("/") if part]
    words = parts[-2] if len(parts) > 1 and parts[-1].lower() in ("scan", "scans", "laser") else parts[-1]
    short = words.removeprefix("scan_").removesuffix("_scan")
    return short if is_name(short) else ONLY_NAME


def _several(path: Path, role: Role, topics: Sequence[Topic]) -> UsageError:
    listed = ", ".join(topic.told for topic in topics)
    more = "; several for several scanners" if role is Role.SCAN else ""
    return UsageError(f"{path} has {len(topics)} topics of {role}: {listed}; expected --channel {role}=TOPIC{more}")

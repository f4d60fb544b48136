"""Live sources by name, and how one is named in a command: `json:127.0.0.1:6061`, `sick-safety@front left:6060`.

A source's module is imported when the source is asked for.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

from commission.errors import UsageError
from commission.io.live.driver import Driver

LOCAL = "127.0.0.1"
LAST_PORT = 65_535


class SourceKind(NamedTuple):
    """Where the driver of a protocol is."""

    module: str
    driver: str
    virtual: tuple[str, str] | None
    """Module and class of the virtual device; None: there is none."""
    transport: str
    """`udp`: is listened to at an address of this computer; `tcp`, `websocket`: is connected to."""
    port: int
    """The usual one."""
    words: str
    """What it is."""


KINDS: dict[str, SourceKind] = {
    "json": SourceKind(
        "json_driver", "JsonDriver", ("virtual_json", "JsonVehicle"), "udp", 6061, "records as JSON over UDP"
    ),
    "sick-safety": SourceKind(
        "safety_driver",
        "SafetyDriver",
        ("virtual_safety", "VirtualSafetyScanner"),
        "udp",
        6060,
        "SICK microScan3, nanoScan3, outdoorScan3",
    ),
    "cola": SourceKind(
        "cola_driver", "ColaDriver", ("virtual_cola", "VirtualTim"), "tcp", 2112, "SICK TiM, LMS, LRS, MRS (CoLa A, B)"
    ),
    "rosbridge": SourceKind(
        "rosbridge_driver",
        "RosbridgeDriver",
        ("virtual_rosbridge", "VirtualRosVehicle"),
        "websocket",
        9090,
        "/scan and /odom of ROS 1 or 2 over rosbridge",
    ),
    "nav350": SourceKind("nav350_driver", "NavDriver", ("virtual_nav350", "VirtualNav350"), "tcp", 2111, "SICK NAV350"),
    "compact": SourceKind(
        "compact_driver",
        "CompactDriver",
        ("virtual_compact", "VirtualPicoScan"),
        "udp",
        2115,
        "SICK picoScan, multiScan",
    ),
}


@dataclass(frozen=True, slots=True)
class SourceAddress:
    """Which protocol, where, and of which scanner."""

    name: str
    """Key of `KINDS`."""
    host: str
    """Address of this computer that is listened at (UDP), or of the device that is connected to (TCP)."""
    port: int
    """Its port; 0 takes a free one to listen at."""
    scanner: str | None = None
    """The vehicle's scanner that it is, by its name; None: the first, or what messages themselves say."""

    @staticmethod
    def parse(text: str) -> SourceAddress:
        """Read `NAME[@SCANNER]:[HOST:]PORT`; raises UsageError that says what is expected."""
        head, _, rest = text.partition(":")
        name, _, scanner = head.partition("@")
        host, _, port = rest.rpartition(":")
        if name not in KINDS:
            raise UsageError(f"source {text!r} is of no known kind; expected one of {', '.join(KINDS)}")
        if not rest:
            port = str(KINDS[name].port)
        if not (port.isascii() and port.isdecimal() and len(port) <= 5 and int(port) <= LAST_PORT):
            found = f"has {port[:20]!r} for a port;" if port else "has no port;"
            expected = f"{name}:HOST:PORT such as {name}:{LOCAL}:6061, PORT up to {LAST_PORT}"
            raise UsageError(f"source {text!r} {found} expected {expected}")
        return SourceAddress(name, host.strip("[]") or LOCAL, int(port), scanner or None)

    @property
    def kind(self) -> SourceKind:
        """Where its driver is."""
        return KINDS[self.name]

    def __str__(self) -> str:
        """Return the text that is read back as this."""
        scanner = "" if self.scanner is None else f"@{self.scanner}"
        return f"{self.name}{scanner}:{self.host}:{self.port}"


def device_of(address: SourceAddress, scanners: tuple[str, ...]) -> Any:
    """Return a virtual device that sends to, or is connected to at, an address; not open.

    Parameters
    ----------
    address : of who listens (UDP), or of the device (TCP, websocket).
    scanners : names of the vehicle's scanners.

    Raises
    ------
    UsageError
        there is no virtual device of that protocol.
    """
    if address.kind.virtual is None:
        known = ", ".join(name for name, kind in KINDS.items() if kind.virtual is not None)
        raise UsageError(f"there is no virtual {address.name}; expected one of {known}")
    module, name = address.kind.virtual
    return getattr(importlib.import_module(f"commission.io.live.{module}"), name)(address, scanners)


def driver_of(address: SourceAddress, scanners: tuple[str, ...], *, scans_only: bool = False) -> Callable[[], Driver]:
    """Return what makes a driver of a source, anew for each conversation.

    Parameters
    ----------
    address : which one.
    scanners : names of the vehicle's scanners.
    scans_only : whether odometry comes from another source of the same server.

    Raises
    ------
    UsageError
        the vehicle has no such scanner.
    """
    if address.scanner is not None and address.scanner not in scanners:
        known = ", ".join(map(repr, scanners))
        raise UsageError(f"source {str(address)!r}: there is no scanner {address.scanner!r}; expected one of {known}")
    index = 0 if address.scanner is None else scanners.index(address.scanner)
    module = importlib.import_module(f"commission.io.live.{address.kind.module}")
    driver: Any = getattr(module, address.kind.driver)

    def make() -> Driver:
        made = driver(scanners, index)
        if address.scanner is not None:
            made.restrict(scans_only=scans_only)
        return made

    return make

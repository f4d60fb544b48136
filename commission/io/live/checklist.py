"""What to look at when a live source says nothing. It asks the computer for its own addresses, nobody else."""

from __future__ import annotations

import math
import socket

from commission.io.live.registry import LOCAL, SourceAddress
from commission.io.live.status import SourceState, SourceStatus
from commission.site.quantity import counted_text

EVERY = ("0.0.0.0", "")  # noqa: S104 - compared with, not bound to


def own_addresses() -> tuple[str, ...]:
    """Return this computer's IPv4 addresses, as far as it knows them."""
    found = {LOCAL}
    try:
        found.update(str(info[4][0]) for info in socket.getaddrinfo(socket.gethostname(), None, socket.AF_INET))
    except OSError:
        pass
    return tuple(sorted(found))


def checklist(address: SourceAddress, status: SourceStatus, own: tuple[str, ...]) -> tuple[str, ...]:
    """Return what to look at; nothing while records come.

    Parameters
    ----------
    address : of the source.
    status : how it is doing.
    own : this computer's addresses, by `own_addresses`.
    """
    if status.state in (SourceState.RECEIVING, SourceState.STOPPED):
        return ()
    if status.state is SourceState.FAILED:
        return (status.trouble, "disconnect and connect again; the log says where it was")
    if status.records:
        return _of_silence(address, status)
    is_datagram = address.kind.transport == "udp"
    if not is_datagram:
        return _of_device(address, status)
    what = f"{address.kind.words.split(' over ')[0]}"
    lines = [f"nothing that is {what} arrives on UDP {address.host}:{address.port}"]
    if status.bytes_received:
        lines.append(f"{status.bytes_received} bytes came and {status.undecodable} pieces cannot be decoded")
        lines.append(f"the last one: {status.trouble}" if status.trouble else "no record has been complete yet")
        return tuple(lines)
    lines.append(f"this computer has {', '.join(own)}: the sender has to send to one of them")
    if address.host == LOCAL:
        lines.append(f"it listens to this computer alone; for others: {address.name}:ADDRESS:{address.port}")
    elif address.host not in (*own, *EVERY):
        lines.append(f"{address.host} is none of these")
    lines.append(f"the sender's port has to be {address.port}, and a firewall has to let UDP {address.port} in")
    if address.name == "sick-safety":
        lines.append("data output has to be switched on in Safety Designer; this program does not write to the scanner")
    return tuple(lines)


def _of_silence(address: SourceAddress, status: SourceStatus) -> tuple[str, ...]:
    """Return what to look at where records have come, and come no more."""
    since = f" for {status.silent_s:.0f} s" if math.isfinite(status.silent_s) else ""
    lines = [f"{counted_text(status.records, 'record')} came, and none{since}"]
    if status.trouble:
        lines.append(status.trouble)
    where = "this computer" if address.kind.transport == "udp" else f"{address.host}:{address.port}"
    lines.append(f"is the sender switched on, and its way to {where} unbroken?")
    return tuple(lines)


def _of_device(address: SourceAddress, status: SourceStatus) -> tuple[str, ...]:
    """Return what to look at where a device is connected to."""
    lines = [f"{address.host}:{address.port} says nothing that is {address.kind.words}"]
    if status.trouble:
        lines.append(status.trouble)
    lines.append(f"is {address.host} the device's address, and in the network of this computer?")
    return tuple(lines)

"""Which addresses a browser may make this computer connect to or listen at. It opens nothing.

Who starts the program names any (`--source`). A browser names devices in the private networks alone, by number and at
ports above those of the system's services: else its page would be a way to try whatever this computer can reach.
"""

from __future__ import annotations

import ipaddress
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import TypeAlias

from commission.errors import UsageError
from commission.io.live.registry import LOCAL, SourceAddress

Network: TypeAlias = ipaddress.IPv4Network | ipaddress.IPv6Network

LOOPBACK: tuple[Network, ...] = (ipaddress.ip_network("127.0.0.0/8"), ipaddress.ip_network("::1/128"))
PRIVATE: tuple[Network, ...] = tuple(
    ipaddress.ip_network(text) for text in ("10.0.0.0/8", "172.16.0.0/12", "192.168.0.0/16", "fc00::/7")
)
"""RFC 1918 and RFC 4193. Addresses of the link itself (169.254.0.0/16) are none: clouds tell secrets there."""
FIRST_PORT = 1_024
"""First port above those of the system's services."""
MOST_SOURCES = 16
"""Sources that are listened to at once: each has a thread."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Permission:
    """What browsers may name."""

    named: tuple[SourceAddress, ...] = ()
    """Addresses that the program was started with: always."""
    networks: tuple[Network, ...] = PRIVATE
    """Networks in which devices may be."""
    is_shared: bool = False
    """Whether browsers of other computers are let in: those may not try what answers on this computer alone."""

    @staticmethod
    def of(sources: Iterable[str], networks: Iterable[str], *, is_shared: bool) -> Permission:
        """Return what may be named beside the private networks.

        Parameters
        ----------
        sources : each as `NAME[@SCANNER]:HOST:PORT`.
        networks : each as `ADDRESS` or `ADDRESS/BITS`.
        is_shared : whether browsers of other computers are let in.

        Raises
        ------
        UsageError
            one of them is none.
        """
        found = tuple(SourceAddress.parse(text) for text in sources)
        return Permission(named=found, networks=(*PRIVATE, *map(_network, networks)), is_shared=is_shared)

    def checked(self, texts: Iterable[str]) -> tuple[SourceAddress, ...]:
        """Return the addresses that a browser names.

        Parameters
        ----------
        texts : each as `NAME[@SCANNER]:HOST:PORT`.

        Raises
        ------
        UsageError
            one is none, or may not be named: says how to allow it.
        """
        addresses = tuple(SourceAddress.parse(text) for text in texts)
        if len(addresses) > MOST_SOURCES:
            raise UsageError(f"{len(addresses)} sources are named; expected {MOST_SOURCES} at most")
        return tuple(map(self._checked, addresses))

    def _checked(self, address: SourceAddress) -> SourceAddress:
        """Return an address with its host as a number; raises UsageError."""
        if any(replace(each, scanner=address.scanner) == address for each in self.named):
            return address
        if address.host == "localhost":
            address = replace(address, host=LOCAL)
        listens = address.kind.transport == "udp"
        if address.port < FIRST_PORT and not (listens and address.port == 0):
            raise _refused(address, f"port {address.port} is one of the system's services", f"{FIRST_PORT} or more")
        try:
            host = ipaddress.ip_address(address.host)
        except ValueError:
            raise _refused(address, f"{address.host!r} is a name, which may lead anywhere", "a number") from None
        if getattr(host, "scope_id", None) is not None:
            # What follows a "%" may be anything, and would be read as another host where addresses are put together.
            raise _refused(address, f"{address.host!r} is of one interface", "an address without '%'")
        host = getattr(host, "ipv4_mapped", None) or host
        if host.is_unspecified and not listens:
            raise _refused(address, f"{address.host} stands for this computer", "an address of the vehicle's network")
        if any(host in network for network in LOOPBACK):
            if self.is_shared and not listens:
                raise _refused(address, "what answers on this computer alone is not for others to try", "a device's")
        elif not any(host in network for network in self.networks):
            found, expected = f"{host} is in no private network", "an address of the vehicle's network"
            raise _refused(address, found, expected, None if host.is_unspecified else host)
        return replace(address, host=str(ipaddress.ip_address(address.host)))


NEAR = Permission()
"""Devices in private networks, and at this computer."""


def _network(text: str) -> Network:
    try:
        return ipaddress.ip_network(text, strict=False)
    except ValueError:
        expected = "expected an address or ADDRESS/BITS such as 169.254.0.0/16"
        raise UsageError(f"--connect-to is {text!r}; {expected}") from None


def _refused(address: SourceAddress, found: str, expected: str, host: object = None) -> UsageError:
    how = f"--source {str(address)!r}" + (f" or --connect-to {host}" if host is not None else "")
    return UsageError(
        f"source {str(address)!r} is not for a browser to name: {found}; expected {expected}, or a page that is "
        f"started with {how}"
    )

"""What stands before IP in a captured packet: Ethernet with its virtual networks, Linux cooked captures, and others.

Kinds of links: www.tcpdump.org/linktypes. Kinds of what a frame holds (EtherType): IEEE 802.
"""

from __future__ import annotations

from collections import Counter

_TYPE_AT = {1: 12, 113: 14, 276: 0}
"""Where a frame says what it holds, by the kind of link: Ethernet, Linux cooked 1 and 2."""
_LINK_BYTES = {0: 4, 1: 14, 12: 0, 14: 0, 101: 0, 108: 4, 113: 16, 228: 0, 276: 20}
"""Bytes before what a frame holds: loopback, Ethernet, raw (12, 14, 101, 228), OpenBSD loopback, Linux cooked 1, 2."""
_VIRTUAL = (b"\x81\x00", b"\x88\xa8", b"\x91\x00", b"\x92\x00")
"""A tag of a virtual network (IEEE 802.1Q, 802.1ad, and what switches sent before it)."""
_POINT_TO_POINT = b"\x88\x64"
_IPV4, _IPV6 = b"\x08\x00", b"\x86\xdd"
_QUIET = (b"\x08\x06", b"\x88\xcc", b"\x88\xe1", b"\x88\x92", b"\x88\xf7")
"""Frames of every plant that hold no datagram: ARP, LLDP, HomePlug, PROFINET, PTP."""


def network_packet(link: int, packet: bytes, told: Counter[str]) -> bytes:
    """Return the IPv4 packet in a captured one; empty where there is none.

    Parameters
    ----------
    link : kind of link.
    packet : as it was captured, from its first byte.
    told : takes what is not read, and how often.
    """
    begin = _LINK_BYTES.get(link)
    if begin is None:
        told[f"packets are of link type {link}, which is not read (Ethernet is 1)"] += 1
        return b""
    if link in _TYPE_AT:
        held = packet[_TYPE_AT[link] : _TYPE_AT[link] + 2]
        # Four bytes for each virtual network: its number, and the kind of what follows.
        while held in _VIRTUAL:
            held = packet[begin + 2 : begin + 4]
            begin += 4
        if held == _POINT_TO_POINT:
            held = _IPV4 if packet[begin + 6 : begin + 8] == b"\x00\x21" else held
            begin += 8
        if held not in (_IPV4, _IPV6):
            # Less than 1536 is the length of a frame of IEEE 802.3: spanning trees of switches.
            if len(held) == 2 and held not in _QUIET and held >= b"\x06\x00":
                told[f"packets hold what is not read (EtherType 0x{held.hex()}; IPv4 is 0x0800)"] += 1
            return b""
    if len(packet) <= begin or packet[begin] >> 4 != 4:
        told["packets are of IPv6, which is not read"] += len(packet) > begin and packet[begin] >> 4 == 6
        return b""
    return packet[begin:]

"""Who sends to one port: of two that send the same, one is taken, and the other one told with its address."""

from __future__ import annotations

from collections import Counter
from typing import TypeAlias

LET_GO_NS = 1_000_000_000
"""Time after which another one may be the sender that was silent [ns]."""
TOLD_LIMIT = 8
"""Senders that are told by their addresses; of more, their number."""

Sender: TypeAlias = tuple[str, int]
"""Address and port."""


class Senders:
    """Senders to one port, by what they send.

    A sender that begins again on its computer has another port, and is taken at once: the newest of one computer is the
    one, and whoever still sends there beside it is another one. Of several computers the first one is it.

    Parameters
    ----------
    told : takes what is left out, with both addresses.
    """

    def __init__(self, told: Counter[str]) -> None:
        self._told = told
        self._taken: dict[int, tuple[Sender, int]] = {}
        self._replaced: dict[int, list[Sender]] = {}
        self._addresses: set[Sender] = set()

    def takes(self, channel: int, sender: Sender | None, arrived_ns: int) -> bool:
        """Whether something of a sender is taken; what is not is told.

        Parameters
        ----------
        channel : what it sends: two may send different things.
        sender : its address; None: there is but one.
        arrived_ns : when it arrived [ns].
        """
        if sender is None:
            return True
        owner, heard_ns = self._taken.get(channel, (sender, arrived_ns))
        replaced = self._replaced.setdefault(channel, [])
        if owner != sender and arrived_ns - heard_ns < LET_GO_NS:
            if owner[0] != sender[0] or sender in replaced:
                self._tell(sender, owner)
                return False
            replaced[:] = [*replaced[1 - TOLD_LIMIT :], owner]
        elif owner != sender:
            replaced.clear()
        self._taken[channel] = sender, arrived_ns
        return True

    def _tell(self, sender: Sender, owner: Sender) -> None:
        """Tell that something of a sender is left out since another one is taken."""
        if sender in self._addresses or len(self._addresses) < TOLD_LIMIT:
            self._addresses.add(sender)
            (host, port), (other, its) = sender, owner
            self._told[f"messages of {host}:{port} are left out, since {other}:{its} sends the same to this port"] += 1
        else:
            self._told[f"messages of further senders than {TOLD_LIMIT} to this port are left out"] += 1

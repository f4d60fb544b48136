"""Who sends to one port: of two that send the same, one is taken, and the other one told with its address."""

from __future__ import annotations

from collections import Counter, OrderedDict, deque
from typing import TypeAlias

LET_GO_NS = 1_000_000_000
"""Time after which another one may be the sender that was silent [ns]."""
TOLD_LIMIT = 8
"""Senders that are told by their addresses; of more, their number."""

Sender: TypeAlias = tuple[str, int]
"""Address and port."""
NEW_PORTS = 0
"""Port that stands for all of a program that takes ever new ones."""
_HOSTS = 8
_STABLE = 8
_LATEST = 64
"""Ports of a computer that are looked at, but those that go on."""
_LONGEST = 3
"""Messages in a row of a port that is left: odometry, scan and reference of one turn; with more it goes on."""
_FEW, _MANY = 3, 8
"""Ports that were left after some messages each, from which it is one program with ever new ones; and from which it
surely is, so that a port that comes again does so by chance."""


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
            self._told[
                f"messages of {_called(sender)} are left out, since {_called(owner)} sends the same to this port"
            ] += 1
        else:
            self._told[f"messages of further senders than {TOLD_LIMIT} to this port are left out"] += 1


def _called(sender: Sender) -> str:
    """Address in a message."""
    host, port = sender
    return f"{host} (ever new ports)" if port == NEW_PORTS else f"{host}:{port}"


class Ports:
    """Which messages are of one program, where one opens new sockets on and on: then each of them has another port.

    A port that sends on after others did, or many messages in a row, goes on, and is a program of its own. Where some
    that are new were left, the next new ones are taken for one program: what several such of one computer send is not
    told apart.
    """

    def __init__(self) -> None:
        self._hosts: OrderedDict[str, _Host] = OrderedDict()

    def program(self, sender: Sender | None) -> Sender | None:
        """Return who a message is of.

        Parameters
        ----------
        sender : its address; None: there is but one.

        Returns
        -------
        program : the address, with NEW_PORTS for its port where it takes ever new ones.
        """
        if sender is None:
            return None
        host, port = sender
        known = self._hosts.setdefault(host, _Host())
        self._hosts.move_to_end(host)
        if len(self._hosts) > _HOSTS:
            self._hosts.popitem(last=False)
        return (host, NEW_PORTS) if known.is_left_soon(port) else sender


class _Host:
    """Ports of one computer."""

    def __init__(self) -> None:
        self._stable: OrderedDict[int, None] = OrderedDict()
        self._left: deque[int] = deque(maxlen=_LATEST)
        self._current, self._row, self._is_left_soon = -1, 0, False

    def is_left_soon(self, port: int) -> bool:
        """Take the port of a message; returns whether it is of a program that takes ever new ones."""
        if port in self._stable:
            self._stable.move_to_end(port)
            return False
        if port == self._current:
            self._row += 1
            return self._is_left_soon if self._row <= _LONGEST else self._goes_on(port)
        came = self._left.count(port)
        if came > 1 or (came and len(self._left) - came < _MANY):
            return self._goes_on(port)
        if self._current >= 0:
            self._left.append(self._current)
        self._current, self._row, self._is_left_soon = port, 1, len(self._left) >= _FEW
        return self._is_left_soon

    def _goes_on(self, port: int) -> bool:
        self._stable[port] = None
        if len(self._stable) > _STABLE:
            self._stable.popitem(last=False)
        self._left = deque((each for each in self._left if each != port), _LATEST)
        if self._current == port:
            self._current = -1
        self._is_left_soon &= len(self._left) >= _FEW
        return False

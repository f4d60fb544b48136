"""Files on their way from browsers to one server: bounded over all of them, and gone with the browser that sends them.

viser keeps what it is sent until the last part comes, and tells every browser of each part, for ever.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from viser import ViserServer

from commission.app.base import viser_private

MOST_KEPT = 256_000_000
"""Memory for all files on their way, of all browsers [bytes]."""
PART_COSTS = 200
"""Memory that a part takes beside what it holds [bytes]."""
STALE_AFTER_S = 60.0
"""Time after which a file of which nothing comes any more makes room for another one [s]."""


@dataclass(slots=True, kw_only=True)
class Transfer:
    """A file on its way."""

    client: int
    """Number of the browser's connection."""
    button: str
    """Identifier of the button."""
    name: str
    """As the browser calls it."""
    size: int
    """Bytes that were announced."""
    count: int
    """Parts that were announced."""
    touched: float
    """When something of it came last [s]."""
    parts: dict[int, bytes] = field(default_factory=dict)
    received: int = 0
    """Bytes that have come."""

    @property
    def cost(self) -> int:
        """Bytes of memory that it takes."""
        return self.received + PART_COSTS * len(self.parts)


class Transfers:
    """All files on their way to one server: bounded over all browsers, and gone with the browser that sends them."""

    def __init__(self, server: ViserServer) -> None:
        self._open: dict[str, Transfer] = {}
        viser_private.on_leave(server, self.leave)

    @property
    def open(self) -> tuple[Transfer, ...]:
        """Files that are not whole yet."""
        return tuple(self._open.values())

    @property
    def kept(self) -> int:
        """Bytes that are kept of unfinished files."""
        return sum(transfer.cost for transfer in self._open.values())

    def get(self, name: str) -> Transfer | None:
        """Return the file under way that has this name."""
        return self._open.get(name)

    def begin(self, name: str, transfer: Transfer) -> None:
        """Add a file. One at a time for a browser and button: a hostile one could otherwise begin thousands."""
        for other, known in tuple(self._open.items()):
            is_stale = transfer.touched - known.touched > STALE_AFTER_S
            if is_stale or (known.client, known.button) == (transfer.client, transfer.button):
                del self._open[other]
        self._open[name] = transfer

    def end(self, name: str) -> None:
        """Forget a file, finished or not."""
        self._open.pop(name, None)

    def leave(self, client: int) -> None:
        """Forget the files of a browser that has gone."""
        for name in [name for name, transfer in self._open.items() if transfer.client == client]:
            del self._open[name]

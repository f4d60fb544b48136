"""How long work says how far it is, for all rooms: the one protocol, one who does not care, and a part of a whole.

It shows nothing itself. The call is also the place where work that was cancelled stops.
"""

from __future__ import annotations

from typing import Protocol


class Progress(Protocol):
    """Called by work that takes a while, often enough that it can be stopped without annoyance."""

    def __call__(self, fraction: float, message: str, /) -> None:
        """Say how far the work is.

        Parameters
        ----------
        fraction : done so far [0..1].
        message : what is being done now, in a few words.

        Raises
        ------
        JobCancelled
            nobody wants the result any more.
        """
        ...


def silent(fraction: float, message: str, /) -> None:
    """Progress that nobody follows."""


def part(progress: Progress, first: float, last: float) -> Progress:
    """Progress of a part of the work as progress of the whole.

    Parameters
    ----------
    progress : of the whole.
    first, last : done of the whole before and after the part [0..1].
    """

    def of_part(fraction: float, message: str, /) -> None:
        progress(first + (last - first) * fraction, message)

    return of_part

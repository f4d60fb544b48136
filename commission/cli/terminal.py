"""What a command that takes a while shows in a terminal. It writes nothing where the output goes elsewhere."""

from __future__ import annotations

import sys


def shown_progress(fraction: float, message: str, /) -> None:
    """Progress on one line of the terminal, where there is one; Ctrl+C stops.

    Parameters
    ----------
    fraction : done so far [0..1].
    message : what is being done now.
    """
    if sys.stderr.isatty():
        sys.stderr.write(f"\r{fraction:4.0%} {message:<40}" + ("\n" if fraction >= 1.0 else ""))
        sys.stderr.flush()

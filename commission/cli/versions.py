"""The command `version`."""

from __future__ import annotations

import sys
from dataclasses import dataclass

import commission


@dataclass(frozen=True)
class Version:
    """Print the version of the program."""

    def run(self) -> None:
        """Write it to stdout."""
        sys.stdout.write(f"commission {commission.__version__}\n")

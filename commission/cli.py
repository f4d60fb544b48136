"""The command `commission`: parses arguments, calls the layers below, turns an error into one line and exit code 2.

Each command is a function with typed parameters; tyro makes its help from the docstring. No computation happens here.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from typing import Any, NoReturn

import tyro

import commission
from commission.errors import CommissionError

EXIT_ERROR = 2


def version() -> None:
    """Print the version of the program."""
    sys.stdout.write(f"commission {commission.__version__}\n")


COMMANDS: dict[str, Callable[..., Any]] = {
    "version": version,
}


def main(arguments: Sequence[str] | None = None) -> NoReturn:
    """Run one command and exit: 0 when it is done, 2 with one line on stderr when it cannot be.

    Parameters
    ----------
    arguments : command and its options; those of the process when None.
    """
    try:
        tyro.extras.subcommand_cli_from_dict(
            COMMANDS, prog="commission", description=commission.__doc__, args=arguments
        )
    except CommissionError as error:
        sys.stderr.write(f"commission: {' '.join(str(error).split())}\n")
        sys.exit(EXIT_ERROR)
    except KeyboardInterrupt:
        sys.exit(130)
    sys.exit(0)

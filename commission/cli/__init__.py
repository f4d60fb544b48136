"""The command `commission`: parses arguments, calls the layers below, turns an error into one line and exit code 2.

Each command is a frozen value with a `run`; tyro makes its options and their help from the strings under its fields.
Nothing is computed in this room, and a command imports what it needs only when it runs, so that help is immediate.
"""

from __future__ import annotations

import os
import sys
import traceback
from collections.abc import Sequence
from pathlib import Path
from typing import NoReturn

from commission.app.base.logs import SHOW_TRACEBACK, one_line_each
from commission.cli import ambiguity as confusing
from commission.cli import convert as converting
from commission.cli import coverage as covering
from commission.cli import inspect as inspecting
from commission.cli import localize as localizing
from commission.cli import parsing
from commission.cli import place as placing
from commission.cli import predict as predicting
from commission.cli import serve as page
from commission.cli import simulate as simulating
from commission.cli.parsing import Command
from commission.cli.versions import Version
from commission.errors import CommissionError

EXIT_ERROR = 2
EXIT_INTERRUPTED = 130

COMMANDS: dict[str, type[Command]] = {
    "demo": page.Demo,
    "serve": page.Serve,
    "simulate": simulating.Simulate,
    "localize": localizing.Localize,
    "inspect": inspecting.Inspect,
    "coverage": covering.CoverageCommand,
    "predict": predicting.Predict,
    "ambiguity": confusing.Ambiguity,
    "place": placing.Place,
    "convert": converting.Convert,
    "version": Version,
}


def main(arguments: Sequence[str] | None = None) -> NoReturn:
    """Run one command and exit: 0 when it is done, 2 with one line on stderr when it cannot be.

    Parameters
    ----------
    arguments : command and its options; those of the process when None.
    """
    try:
        command = parsing.parse(COMMANDS, arguments)
        with one_line_each():
            command.run()
        sys.stdout.flush()
    except KeyboardInterrupt:
        sys.exit(EXIT_INTERRUPTED)
    except BrokenPipeError:
        # Whoever read the output (`| head`) has gone; flushing again at exit would complain a second time.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    except CommissionError as error:
        _fail(str(error))
    except OSError as error:
        _fail(f"{error.filename}: {error.strerror}" if error.filename else str(error))
    except Exception as error:
        if os.environ.get(SHOW_TRACEBACK):
            raise
        place = traceback.extract_tb(error.__traceback__)[-1]
        fault = f"{type(error).__name__}: {error}, {Path(place.filename).name} line {place.lineno}"
        _fail(f"a fault of the program ({fault}); {SHOW_TRACEBACK}=1 shows more")
    sys.exit(0)


def _fail(message: str) -> NoReturn:
    """Say on one line why the command could not be done, and exit."""
    sys.stderr.write(f"commission: {' '.join(message.split())}\n")
    sys.exit(EXIT_ERROR)

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
from commission.cli.align import Align
from commission.cli.ambiguity import Ambiguity
from commission.cli.calibrate import Calibrate
from commission.cli.clock import Clock
from commission.cli.convert import Convert
from commission.cli.coverage import CoverageCommand
from commission.cli.inspect import Inspect
from commission.cli.layouts import Layouts
from commission.cli.localize import Localize
from commission.cli.monitor import MonitorCommand
from commission.cli.montecarlo import MonteCarlo
from commission.cli.parsing import Command, parse
from commission.cli.place import Place
from commission.cli.predict import Predict
from commission.cli.problems import Problems
from commission.cli.serve import Demo, Serve
from commission.cli.simulate import Simulate
from commission.cli.sweep import SweepCommand
from commission.cli.triangulate import Triangulate
from commission.cli.tune import Tune
from commission.cli.versions import Version
from commission.cli.vision import Vision
from commission.errors import CommissionError

EXIT_ERROR = 2
EXIT_INTERRUPTED = 130

COMMANDS: dict[str, type[Command]] = {
    "demo": Demo,
    "serve": Serve,
    "simulate": Simulate,
    "localize": Localize,
    "inspect": Inspect,
    "coverage": CoverageCommand,
    "predict": Predict,
    "ambiguity": Ambiguity,
    "calibrate": Calibrate,
    "clock": Clock,
    "tune": Tune,
    "monitor": MonitorCommand,
    "place": Place,
    "layouts": Layouts,
    "problems": Problems,
    "sweep": SweepCommand,
    "montecarlo": MonteCarlo,
    "vision": Vision,
    "triangulate": Triangulate,
    "convert": Convert,
    "align": Align,
    "version": Version,
}


def main(arguments: Sequence[str] | None = None) -> NoReturn:
    """Run one command and exit: 0 when it is done, 2 with one line on stderr when it cannot be.

    Parameters
    ----------
    arguments : command and its options; those of the process when None.
    """
    try:
        command = parse(COMMANDS, arguments)
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

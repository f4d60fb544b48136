"""From the words of a command line to a command, and from text options to values. It runs no command."""

from __future__ import annotations

import contextlib
import io
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import tyro

import commission
from commission.errors import UsageError
from commission.site.quantity import LARGEST

FRAME = "│╭╮╰╯"
RULES = ("─", "╭", "╰")
POSE_FORM = "X,Y,THETA or X,Y,THETA,SX,SY,STHETA (metres, radians, 1-sigma above 0)"


class Command(Protocol):
    """What a command line asks for."""

    def run(self) -> None:
        """Do it; raises CommissionError when it cannot be done."""


def parse(commands: Mapping[str, type[Command]], arguments: Sequence[str] | None) -> Command:
    """Return the command that the arguments ask for; `--help` prints to stdout and exits with 0.

    Parameters
    ----------
    commands : frozen dataclasses by the names of their commands.
    arguments : words of the command line; those of the process when None.

    Raises
    ------
    UsageError
        the words are no command; its text is what tyro says, without tyro's frame.
    """
    _refuse_empty(sys.argv[1:] if arguments is None else arguments)
    complaint = io.StringIO()
    try:
        with contextlib.redirect_stderr(complaint):
            return tyro.extras.subcommand_cli_from_dict(
                dict(commands), prog="commission", description=commission.__doc__, args=arguments
            )
    except SystemExit as finished:
        if not finished.code:
            sys.stdout.flush()
            raise
        raise UsageError(_without_frame(complaint.getvalue())) from None


def _refuse_empty(words: Sequence[str]) -> None:
    """Raise UsageError for a word without a letter, as `--out "$FOLDER"` gives where the variable is not set.

    As a path it would be the folder that one stands in.
    """
    for index, word in enumerate(words):
        option, equals, value = word.partition("=")
        if not word.strip():
            before = words[index - 1] if index else ""
            name = before if before.startswith("--") else f"argument {index + 1}"
            raise UsageError(f"{name} is empty; expected a value")
        if word.startswith("--") and equals and not value.strip():
            raise UsageError(f"{option} is empty; expected a value")


def _without_frame(complaint: str) -> str:
    """First paragraphs of a framed complaint as one line: what is wrong, not the help text that follows."""
    sentences: list[str] = []
    for framed in complaint.splitlines():
        line = framed.strip().strip(FRAME).strip()
        if line.startswith(("For full helptext", "Argument helptext", "Got errors")):
            break
        if line and not framed.startswith(RULES) and not line.startswith("─"):
            sentences.append(line)
    return " ".join(sentences) or "the command line cannot be read"


@dataclass(frozen=True)
class InitialPose:
    """Where the vehicle is said to stand when the recording begins."""

    pose: tuple[float, float, float]
    """`T_map_base`: x [m], y [m], theta [rad]."""
    sigmas: tuple[float, float, float] | None
    """1-sigma uncertainty of x [m], y [m] and theta [rad]; None when none were given."""


def reference_antenna(text: str) -> tuple[float, ...]:
    """Read `X,Y` or `X,Y,Z`; raises UsageError that shows the text and the form expected."""
    form = "X,Y or X,Y,Z (metres, base frame)"
    try:
        numbers = tuple(float(word) for word in text.split(","))
    except ValueError:
        raise UsageError(f"--reference-antenna is {text!r}; expected numbers {form}") from None
    if len(numbers) not in (2, 3):
        raise UsageError(f"--reference-antenna {text!r} has {len(numbers)} numbers; expected {form}")
    return numbers


def initial_pose(text: str) -> InitialPose:
    """Read `X,Y,THETA` or `X,Y,THETA,SX,SY,STHETA`; raises UsageError that shows the text and the form expected."""
    try:
        numbers = [float(word) for word in text.split(",")]
    except ValueError:
        raise UsageError(f"--initial-pose is {text!r}; expected numbers {POSE_FORM}") from None
    if len(numbers) not in (3, 6):
        raise UsageError(f"--initial-pose {text!r} has {len(numbers)} numbers; expected {POSE_FORM}")
    if not all(abs(number) <= LARGEST for number in numbers):
        raise UsageError(f"--initial-pose {text!r} holds a number that no place has; expected {POSE_FORM}")
    x, y, theta, *sigmas = numbers
    if not sigmas:
        return InitialPose((x, y, theta), None)
    if not all(sigma > 0.0 for sigma in sigmas):
        raise UsageError(f"--initial-pose {text!r} has a 1-sigma that is not positive; expected {POSE_FORM}")
    return InitialPose((x, y, theta), (sigmas[0], sigmas[1], sigmas[2]))


def recording_names(paths: Sequence[Path]) -> tuple[str, ...]:
    """Names of recordings for a person: short ones, or all of each path where two were the same.

    Parameters
    ----------
    paths : as they were typed.
    """
    names = tuple(path.stem for path in paths)
    return names if len(set(names)) == len(names) else tuple(map(str, paths))

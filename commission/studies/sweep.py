"""One or two parameters over ranges: a figure of the whole drive for each value, all from one set of detections.

Runs are independent: this machine's cores do them, or a cluster. Nothing is drawn or written here.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from commission.errors import UsageError
from commission.geometry.arrays import FloatArray, read_only
from commission.progress import Progress, silent
from commission.site.fields import FieldInfo, field_info, get_field, with_field
from commission.site.parameters import Parameters
from commission.site.quantity import counted_text
from commission.studies.inputs import StudyInput
from commission.studies.run import RunInput, RunResult, judged_run
from commission.studies.variant_figures import BY_KEY, VariantFigure
from commission.studies.workers import Threads, Workers

MOST_AXES = 2
MOST_VALUES = 1000
"""Values of one parameter; more are a mistyped range."""
MOST_RUNS = 10_000
FIRST_SHARE = 0.05
"""Share of the progress that the run with the project's own values takes, from which the others take detections."""
FORM = "group.key=FROM..TO:N, for example association.gate_probability=0.8..0.99:20"


@dataclass(frozen=True, slots=True, eq=False)
class SweepAxis:
    """A parameter and the values that it is given."""

    key: str
    """`group.key`, as in `project.yaml`."""
    values: FloatArray
    """(N,) values, in SI units and radians, ascending or descending."""

    @staticmethod
    def parse(text: str, parameters: Parameters) -> SweepAxis:
        """Read `group.key=FROM..TO:N`, in SI units and radians.

        Parameters
        ----------
        text : as it was typed.
        parameters : whose field it is; a value that the field refuses is refused here.

        Raises
        ------
        UsageError
            another form, an unknown key, a field that is no number, or a value that it refuses.
        """
        key, equals, span = (each.strip() for each in text.partition("="))
        first, dots, rest = span.partition("..")
        last, colon, count = rest.partition(":")
        try:
            ends, number = (float(first), float(last)), int(count)
        except ValueError:
            raise UsageError(f"--over is {text!r}; expected {FORM}") from None
        if not (equals and dots and colon) or not all(map(math.isfinite, ends)):
            raise UsageError(f"--over is {text!r}; expected {FORM}")
        if not 2 <= number <= MOST_VALUES or ends[0] == ends[1]:
            raise UsageError(f"--over {text!r} asks for {number} values; expected 2 to {MOST_VALUES} different ones")
        values = np.linspace(*ends, number)
        try:
            if _is_whole(field_info(parameters, key, "parameter")):
                values = np.unique(np.round(values))
            elif not isinstance(get_field(parameters, key, "parameter"), float):
                raise UsageError(f"--over {key} is no number; expected a parameter that is")
            for end in (values[0], values[-1]):
                set_number(parameters, key, float(end))
        except ValueError as error:
            raise UsageError(f"--over: {error}") from error
        return SweepAxis(key, read_only(values))


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class SweepInput(StudyInput):
    """All that the study reads."""

    run: RunInput
    """The drive, its start, and the setup that is varied: one segment."""
    axes: tuple[SweepAxis, ...]
    """One parameter or two."""
    figure: str
    """Key of the figure: one of `variant_figures`."""

    def __post_init__(self) -> None:
        if not 1 <= len(self.axes) <= MOST_AXES or len({axis.key for axis in self.axes}) != len(self.axes):
            keys = ", ".join(axis.key for axis in self.axes) or "none"
            raise UsageError(f"a sweep is over {keys}; expected one parameter or two different ones")
        if self.figure not in BY_KEY:
            raise UsageError(f"figure {self.figure!r} is unknown; expected one of {', '.join(BY_KEY)}")
        count = math.prod(len(axis.values) for axis in self.axes)
        if count > MOST_RUNS:
            raise UsageError(f"the sweep has {count} runs; expected {MOST_RUNS} at most")


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class SweepResult:
    """The figure at each place."""

    inputs: SweepInput
    """What was swept."""
    values: FloatArray
    """(N,) or (N, M) the figure in SI units, axes in their order; NaN where it is undefined."""
    operating: tuple[float, ...]
    """Value of each parameter in the project."""
    at_operating: float
    """The figure there."""

    @property
    def figure(self) -> VariantFigure:
        """What the values are."""
        return BY_KEY[self.inputs.figure]


@dataclass(frozen=True, slots=True, eq=False)
class _Given:
    """What all runs read."""

    inputs: SweepInput
    """What is swept."""
    first: RunResult | None
    """The run as in the project, whose detections serve the others; none where memory is not shared."""


def sweep(inputs: SweepInput, progress: Progress = silent, *, workers: Workers | None = None) -> SweepResult:
    """Localize a drive with each value.

    Parameters
    ----------
    inputs : drive, axes and figure.
    progress : told how far it is; may raise to cancel: runs that have not begun never do.
    workers : who does it; this machine's cores when None. Figures but cycle times are the same to the last bit.
    """
    figure, parameters = BY_KEY[inputs.figure], inputs.run.segments[0].setup.parameters
    workers = workers or Threads()
    progress(0.0, "as in the project")
    first = judged_run(inputs.run)
    if figure.of_errors and first.statistics is None:
        raise UsageError(
            f"figure {inputs.figure!r} needs a reference, and the recording has none; expected another one"
        )
    shape = tuple(len(axis.values) for axis in inputs.axes)
    values = np.full(shape, math.nan)
    given = _Given(inputs, first if workers.shares_memory else None)
    places = itertools.product(*map(range, shape))
    for done, (place, value) in enumerate(workers.each(_value_at, given, places), 1):
        values[place] = value
        progress(FIRST_SHARE + (1.0 - FIRST_SHARE) * done / values.size, f"{done} of {values.size} runs")
    return SweepResult(
        inputs=inputs,
        values=read_only(values),
        operating=tuple(float(get_field(parameters, axis.key)) for axis in inputs.axes),
        at_operating=figure.value(first),
    )


def _value_at(given: _Given, place: tuple[int, ...], progress: Progress) -> float:
    """The figure at one place."""
    inputs = given.inputs
    parameters = inputs.run.segments[0].setup.parameters
    run = judged_run(_at(inputs, parameters, place), progress, earlier=given.first, of_scanners=False)
    return BY_KEY[inputs.figure].value(run)


def set_number(parameters: Parameters, key: str, value: float) -> Parameters:
    """Return parameters with one number changed; a count is rounded.

    Parameters
    ----------
    parameters : where to start.
    key : `group.key`.
    value : in SI units and radians.
    """
    whole = _is_whole(field_info(parameters, key, "parameter"))
    return with_field(parameters, key, round(value) if whole else value, "parameter")


def _is_whole(info: FieldInfo) -> bool:
    return info.kind is int


def _at(inputs: SweepInput, parameters: Parameters, place: Sequence[int]) -> RunInput:
    """Return the input of the run at one place."""
    for axis, index in zip(inputs.axes, place, strict=True):
        parameters = set_number(parameters, axis.key, float(axis.values[index]))
    setup = inputs.run.segments[0].setup
    return inputs.run.with_setup(replace(setup, parameters=parameters))


def told(result: SweepResult) -> list[str]:
    """Lines that tell a person what the sweep found.

    Parameters
    ----------
    result : the sweep.
    """
    figure, axes = result.figure, result.inputs.axes
    lines = [
        f"Sweep        {counted_text(result.values.size, 'run')} over {' and '.join(axis.key for axis in axes)}",
        f"Project      {figure.label} {figure.text(result.at_operating)} at {_named(axes, result.operating)}",
    ]
    if not np.isfinite(result.values).any():
        return [*lines, "Values       none is defined"]
    for name, find in (("Least", np.nanargmin), ("Largest", np.nanargmax)):
        place = np.unravel_index(int(find(result.values)), result.values.shape)
        numbers = tuple(float(axis.values[index]) for axis, index in zip(axes, place, strict=True))
        lines.append(f"{name:<13}{figure.text(float(result.values[place]))} at {_named(axes, numbers)}")
    return lines


def _named(axes: Sequence[SweepAxis], numbers: Sequence[float]) -> str:
    return ", ".join(f"{axis.key} = {number:.6g}" for axis, number in zip(axes, numbers, strict=True))

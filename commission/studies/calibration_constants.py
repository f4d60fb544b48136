"""Constants of the least squares as figures of a project, with what a drive would have to hold to show each.

Whether a figure deserves to be used is judged elsewhere.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from commission.geometry.arrays import FloatArray
from commission.site.quantity import DEGREES, MILLIMETRES, MILLISECONDS, PERCENT, Shown
from commission.studies.calibration_fit import CalibrationFit, CalibrationProblem
from commission.studies.calibration_values import CalibrationInput

SHOWN_SHARE = 0.8
"""A constant whose 1-sigma is more than this share of its prior's is not shown by the drive."""
CLOCK_SHARE = 0.7
"""The same of a clock: what is hardly surer than before is no finding, unless it is far beyond doubt (`PLAIN`)."""
PLAIN = 5.0
"""A clock that is off by so many 1-sigma is shown, however little the project's own says."""
MOVED = 3.0
"""A reflector is wrong from so many 1-sigma on, and from so many of its survey."""
COARSE_S = 0.05
"""Interval of odometry from which on its rows may be stamped an interval too early without anybody noticing [s]."""
CIRCLE_FIT = 0.0005
"""1-sigma of what the detector itself adds to ranges, unlike at every distance: 0.1 to 0.8 mm in virtual drives [m]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CalibratedConstant:
    """One constant of the least squares as a figure of the project."""

    key: str
    """See `Value.key`."""
    row: int
    """Where it stands among the constants."""
    before: float
    """What the project says."""
    shift: float
    """What the drive says more."""
    sigma: float
    """1-sigma of that."""
    shown: Shown
    """Unit in which people read it."""
    offset: float = 0.0
    """Part of the constant that is something else."""
    scale: tuple[int, float] | None = None
    """Another constant that adds to it, and how often."""
    hidden: str = ""
    """Why the drive does not show it; empty: it does."""
    remark: str = ""
    """What else is to be said of it."""
    is_place: bool = False
    """Whether it is a coordinate of a reflector."""
    is_wrong: bool = False
    """Whether that reflector stands elsewhere."""

    def of(self, constants: FloatArray) -> float:
        """Return its shift by other constants."""
        more = 0.0 if self.scale is None else float(constants[self.scale[0]]) * self.scale[1]
        return float(constants[self.row]) + more - self.offset


NEEDS = {
    "mounting.x": "mounting x needs turning on the spot; none, or hardly any, in this drive",
    "mounting.y": "mounting y needs turning on the spot or reflectors near by; too few in this drive",
    "mounting.heading": "the heading of the mounting needs metres driven with reflectors in sight; too few here",
    "clock_offset": "a clock needs turns and changes of speed; none, or hardly any, in this drive",
    "observation.range_bias": "a range bias needs reflectors on both sides; they are all on one side of this drive",
    "odometry.forward_scale": "the scale of the way needs metres driven; too few in this drive",
    "odometry.turn_scale": "the scale of turns (wheels apart) needs turns; none, or hardly any, in this drive",
    "odometry.turn_per_m": "a course that is off needs metres driven; too few in this drive",
}
"""What it takes to show each figure."""


def calibrated_constants(
    inputs: CalibrationInput, problem: CalibrationProblem, whole: CalibrationFit
) -> list[CalibratedConstant]:
    """All constants with their names, in the order of the table.

    Parameters
    ----------
    inputs : what the project says.
    problem : what was solved.
    whole : its solution.
    """
    layout, c = problem.drive.layout, whole.point.constants
    odometry = inputs.parameters.odometry
    degrees_per_m = Shown("°/m", DEGREES.scale)
    mean_range = float(np.nanmean(whole.ranges))
    rows: list[tuple[str, str, int, float, Shown]] = []
    for index, scanner in enumerate(inputs.scanners):
        first = layout.mounting(index).start
        name = f"scanners.{scanner.name}"
        for axis, (of, shown) in enumerate((("x", MILLIMETRES), ("y", MILLIMETRES), ("heading", DEGREES))):
            rows.append((f"{name}.mounting.{of}", f"mounting.{of}", first + axis, float(scanner.mounting[axis]), shown))
        rows.append((f"{name}.clock_offset", "clock_offset", layout.clock(index), scanner.clock_offset, MILLISECONDS))
    bias = "observation.range_bias"
    rows.append((bias, bias, layout.bias, inputs.parameters.observation.range_bias, MILLIMETRES))
    names = ("forward_scale", "turn_scale", "turn_per_m")
    for index, (name, shown) in enumerate(zip(names, (PERCENT, PERCENT, degrees_per_m), strict=True)):
        key = f"odometry.{name}"
        rows.append((key, key, layout.wheels + index, getattr(odometry, name), shown))
    listed: list[CalibratedConstant] = []
    for key, kind, row, before, shown in rows:
        offset, remark = _early_odometry(inputs, float(c[row])) if kind == "clock_offset" else (0.0, "")
        scale = (layout.range_scale, mean_range) if kind == bias else None
        share = np.zeros(layout.size)
        share[row] = 1.0
        if scale is not None:
            share[scale[0]] = scale[1]
        each = CalibratedConstant(
            key=key,
            row=row,
            before=before,
            shift=0.0,
            sigma=math.hypot(whole.sigma_of(share), CIRCLE_FIT if kind == bias else 0.0),
            shown=shown,
            offset=offset,
            scale=scale,
            remark=remark,
            hidden=_hidden(kind, problem, whole, row),
        )
        listed.append(replace(each, shift=each.of(c)))
    return [*listed, *_places(inputs, problem, whole)]


def _hidden(kind: str, problem: CalibrationProblem, whole: CalibrationFit, row: int) -> str:
    """Say what the drive would have to hold to show a constant; empty where it shows it."""
    prior, sigma = float(problem.prior[row]), float(whole.sigmas[row])
    if prior == 0.0:
        return "the project's uncertainty takes it for exact"
    if kind == "clock_offset" and hides_clock(prior, sigma, float(whole.point.constants[row])):
        return NEEDS[kind]
    # A project that is contradicted has a wider prior.
    return NEEDS[kind] if whole.information[row] > prior * SHOWN_SHARE * 2.0 and sigma > SHOWN_SHARE * prior else ""


def hides_clock(prior: float, sigma: float, shift: float) -> bool:
    """Whether a drive does not show a clock.

    Parameters
    ----------
    prior : 1-sigma before the drive [s].
    sigma : 1-sigma after it [s]; more than before where a shift lies in the heavy tail of the prior.
    shift : what the drive says more than the project [s].
    """
    return sigma > CLOCK_SHARE * prior and abs(shift) < PLAIN * sigma


def _places(inputs: CalibrationInput, problem: CalibrationProblem, whole: CalibrationFit) -> list[CalibratedConstant]:
    """Places of all reflectors; wrong is one that is far off by its own and by its survey's 1-sigma."""
    layout, listed = problem.drive.layout, list[CalibratedConstant]()
    for index, reflector in enumerate(inputs.reflectors.reflectors):
        rows = [layout.places + 2 * index + axis for axis in range(2)]
        shifts, sigmas, priors = whole.point.constants[rows], whole.sigmas[rows], problem.prior[rows]
        wrong = bool(np.any(np.abs(shifts) > MOVED * np.hypot(sigmas, priors)))
        for axis, name in enumerate("xy"):
            listed.append(
                CalibratedConstant(
                    key=f"reflectors.{reflector.id}.{name}",
                    row=rows[axis],
                    before=getattr(reflector, name),
                    shift=float(shifts[axis]),
                    sigma=float(sigmas[axis]),
                    shown=MILLIMETRES,
                    is_place=True,
                    is_wrong=wrong,
                )
            )
    return listed


def _early_odometry(inputs: CalibrationInput, offset: float) -> tuple[float, str]:
    """Part of a clock's offset [s] that is rather odometry stamped an interval too early, and what to say of it."""
    intervals = np.diff(inputs.log.odometry_stamps_ns)
    interval = float(np.median(intervals)) * 1e-9 if len(intervals) else 0.0
    if interval < COARSE_S or offset < 0.5 * interval:
        return 0.0, ""
    return interval, (
        f"scans and odometry are {MILLISECONDS.text(offset)} apart; rows of odometry probably hold the motion of the "
        f"{MILLISECONDS.text(interval)} that begin at their stamp (move them on by a row), the rest is the scanner's"
    )

"""What many drives say of the figures together: each is calibrated by itself, by whoever works, then all are weighed.

Nothing is estimated in here: what one drive says, and on which half of it that was judged, is `calibration`'s.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

from commission.errors import UsageError
from commission.progress import Progress, silent
from commission.site.quantity import counted_text
from commission.studies.calibration import calibrate
from commission.studies.calibration_constants import MOVED
from commission.studies.calibration_values import CalibrationInput, CalibrationVerdict, Value
from commission.studies.inputs import StudyInput
from commission.studies.workers import Threads, Workers

DISAGREE = 3.0
"""Drives that differ by so many times what they say are told of: something has changed between them."""
PLACES = "reflectors."
"""How the names of reflectors' places begin: a drive lists those alone that it finds elsewhere."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class DriveCalibration:
    """What one of many drives says."""

    name: str
    """Of the drive."""
    values: tuple[Value, ...]
    """All its figures; none where it could not be calibrated."""
    notes: tuple[str, ...]
    """What else stands out, in words."""
    failure: str = ""
    """Why it could not be calibrated, in words; empty where it was."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class DrivesCalibrationInput(StudyInput):
    """All that is weighed."""

    drives: tuple[DriveCalibration, ...]
    """Each of them, in the order in which they were named."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class DrivesCalibration:
    """What many drives say together."""

    inputs: DrivesCalibrationInput
    """What each says."""
    values: tuple[Value, ...]
    """All figures, in the order of the first drive that names them."""
    notes: tuple[str, ...]
    """What else stands out, in words, with the drive that it is of."""

    @property
    def proposed(self) -> tuple[Value, ...]:
        """Return the values that are proposed."""
        return tuple(value for value in self.values if value.verdict is CalibrationVerdict.PROPOSED)


def calibrate_drives(
    drives: Iterable[tuple[str, CalibrationInput]],
    count: int,
    progress: Progress = silent,
    *,
    workers: Workers | None = None,
) -> DrivesCalibration:
    """Calibrate by each drive, and weigh what they say.

    Parameters
    ----------
    drives : name and input of each; read as somebody has time for it, so that not all are in memory at once.
    count : how many they are.
    progress : told how far it is; may raise to cancel.
    workers : who does it; this machine's cores when None. The result is the same to the last bit.

    Raises
    ------
    UsageError
        no drive could be calibrated.
    """
    progress(0.0, "calibrating by each drive")
    found: dict[int, DriveCalibration] = {}
    tasks = ((number, name, inputs) for number, (name, inputs) in enumerate(drives))
    for (number, _, _), drive in (workers or Threads()).each(_one_drive, None, tasks):
        found[number] = drive
        progress(len(found) / max(count, 1), f"{len(found)} of {counted_text(count, 'drive')}")
    ordered = tuple(found[number] for number in sorted(found))
    if all(each.failure for each in ordered):
        told = "; ".join(f"{each.name}: {each.failure}" for each in ordered)
        raise UsageError(f"no drive could be calibrated: {told or 'there is none'}")
    return weighed(DrivesCalibrationInput(drives=ordered))


def _one_drive(_given: None, task: tuple[int, str, CalibrationInput], progress: Progress) -> DriveCalibration:
    """What one drive says; one in which the vehicle is lost stops no others."""
    _, name, inputs = task
    try:
        found = calibrate(inputs, progress)
    except UsageError as error:
        return DriveCalibration(name=name, values=(), notes=(), failure=str(error))
    return DriveCalibration(name=name, values=found.values, notes=found.notes)


def weighed(inputs: DrivesCalibrationInput) -> DrivesCalibration:
    """Weigh what drives say, figure by figure.

    Parameters
    ----------
    inputs : what each says.
    """
    by_key: dict[str, list[Value]] = {}
    for drive in inputs.drives:
        for value in drive.values:
            by_key.setdefault(value.key, []).append(value)
    calibrated = sum(not drive.failure for drive in inputs.drives)
    values = tuple(together(said, calibrated) for said in by_key.values())
    notes = [f"{drive.name}: not calibrated: {drive.failure}" for drive in inputs.drives if drive.failure]
    notes += [f"{drive.name}: {note}" for drive in inputs.drives for note in drive.notes]
    return DrivesCalibration(inputs=inputs, values=values, notes=tuple(notes))


def together(said: Sequence[Value], drives: int) -> Value:
    """What several drives say of one figure.

    The mean of those that show it, weighed by 1 / sigma^2. Where they differ by more than they say, its 1-sigma is as
    much larger (Birge 1932): what has changed between two drives is not proposed, neither as it was nor as it is. It
    is proposed where more than half of the drives propose it by themselves, each judged on its own halves.

    Parameters
    ----------
    said : by each drive that lists the figure, one at least.
    drives : how many were calibrated; places of reflectors agree with the project in those that do not list them.
    """
    shown = [each for each in said if each.verdict is not CalibrationVerdict.NOT_SHOWN and 0.0 < each.sigma < math.inf]
    if not shown:
        return replace(said[0], reason=f"not by any of {counted_text(len(said), 'drive')}: {said[0].reason}")
    weights = [1.0 / (each.sigma * each.sigma) for each in shown]
    total = sum(weights)
    mean = sum(weight * each.proposed for weight, each in zip(weights, shown, strict=True)) / total
    scatter = sum(weight * (each.proposed - mean) ** 2 for weight, each in zip(weights, shown, strict=True))
    apart = math.sqrt(scatter / (len(shown) - 1)) if len(shown) > 1 else 0.0
    sigma = max(apart, 1.0) / math.sqrt(total)
    verdict, reason = _verdict(shown, mean, sigma, drives)
    if apart > DISAGREE:
        reason += f"; they differ by {apart:.1f} times what they say: something has changed between them"
    return replace(shown[0], proposed=mean, sigma=sigma, verdict=verdict, reason=reason, stretches=())


def _verdict(shown: Sequence[Value], mean: float, sigma: float, drives: int) -> tuple[CalibrationVerdict, str]:
    """What becomes of a figure, and why."""
    telling = drives if shown[0].key.startswith(PLACES) else len(shown)
    proposing = sum(each.verdict is CalibrationVerdict.PROPOSED for each in shown)
    worse = sum(each.verdict is CalibrationVerdict.WORSE for each in shown)
    of_all = f"of {counted_text(telling, 'drive')}"
    if 2 * proposing > telling:
        if abs(mean - shown[0].before) > MOVED * sigma:
            return CalibrationVerdict.PROPOSED, f"proposed by {proposing} {of_all}"
        return CalibrationVerdict.AGREES, f"proposed by {proposing} {of_all}, together within {MOVED:g} sigma"
    if worse:
        return CalibrationVerdict.WORSE, f"worse by {worse}, proposed by {proposing} {of_all}"
    return CalibrationVerdict.AGREES, f"proposed by {proposing} {of_all}"

"""What a calibration reads, and a figure that it has found: before, proposed, how sure, and what becomes of it.

A figure is put into a setup by its name; nothing is estimated in here.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import StrEnum

from commission.geometry.angles import wrap
from commission.geometry.arrays import frozen
from commission.localization.setup import LocalizerSetup
from commission.site.parameters import Parameters
from commission.site.project import Project
from commission.site.quantity import Shown
from commission.site.record_log import RecordLog
from commission.site.reflectors import ReflectorMap
from commission.site.scanner import Scanner
from commission.site.uncertainty import Uncertainty
from commission.studies.inputs import StudyInput
from commission.studies.start import Start

MOUNTING = ("mounting.x", "mounting.y", "mounting.heading")
"""Figures of a mounting, in the order of its numbers."""


class CalibrationVerdict(StrEnum):
    """What becomes of a value."""

    PROPOSED = "proposed"
    AGREES = "agrees with the project"
    NOT_SHOWN = "not shown by this drive"
    WORSE = "not proposed: the other half of the drive gets worse"


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class CalibrationInput(StudyInput):
    """All that a calibration depends on."""

    log: RecordLog
    """The recording; its reference is not read."""
    start: Start
    """Belief before the first record."""
    reflectors: ReflectorMap
    """The reflector map."""
    scanners: tuple[Scanner, ...]
    """Mountings and clocks that are believed."""
    parameters: Parameters
    """Tunables that are believed."""
    uncertainty: Uncertainty
    """How well the constants are known before."""

    @staticmethod
    def of(project: Project, log: RecordLog, start: Start) -> CalibrationInput:
        """Take what a calibration reads from a project.

        Parameters
        ----------
        project : what is believed.
        log : the recording.
        start : belief before the first record, and where it comes from.
        """
        return CalibrationInput(
            log=log,
            start=start,
            reflectors=project.reflectors,
            scanners=project.scanners,
            parameters=project.parameters,
            uncertainty=project.uncertainty,
        )

    @property
    def setup(self) -> LocalizerSetup:
        """What the localizer is given today."""
        return LocalizerSetup(
            reflectors=self.reflectors, scanners=self.scanners, parameters=self.parameters, uncertainty=self.uncertainty
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Value:
    """One figure: what the project says, what the drive says, and what becomes of it."""

    key: str
    """Its name: `observation.range_sigma`, `scanners.NAME.mounting.x`, `reflectors.ID.x`."""
    before: float
    """What the project says, SI units and radians."""
    proposed: float
    """What the drive says."""
    sigma: float
    """1-sigma of that; residuals that are correlated in time are allowed for."""
    verdict: CalibrationVerdict
    """What becomes of it."""
    shown: Shown
    """Unit in which people read it."""
    reason: str = ""
    """Why, in words."""
    stretches: tuple[tuple[float, float], ...] = ()
    """Stretches of the drive that say most of it, from and to [s]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class NoiseVerdict:
    """What becomes of one kind of noise."""

    is_worse: bool
    """Whether a half gets worse with what the other half says."""
    reason: str
    """Why, in words."""


def with_value(setup: LocalizerSetup, key: str, value: float) -> LocalizerSetup:
    """Return the setup with one figure changed.

    Parameters
    ----------
    setup : of the localizer.
    key : see `Value.key`.
    value : SI units and radians.
    """
    group, _, name = key.partition(".")
    if group == "reflectors":
        of, _, axis = name.rpartition(".")
        changed = tuple(
            replace(each, **{axis: value}) if each.id == of else each for each in setup.reflectors.reflectors
        )
        return replace(setup, reflectors=ReflectorMap(changed))
    if group == "scanners":
        return replace(setup, scanners=tuple(_scanner_with(each, name, value) for each in setup.scanners))
    owner = getattr(setup.parameters, group)
    return replace(setup, parameters=replace(setup.parameters, **{group: replace(owner, **{name: value})}))


def value_in(setup: LocalizerSetup, key: str) -> float | None:
    """Return what a setup says of a figure; None where it has no such scanner or reflector.

    Parameters
    ----------
    setup : of the localizer.
    key : see `Value.key`.
    """
    group, _, name = key.partition(".")
    if group == "reflectors":
        of, _, axis = name.rpartition(".")
        places = (float(getattr(each, axis)) for each in setup.reflectors.reflectors if each.id == of)
        return next(places, None)
    if group == "scanners":
        for scanner in setup.scanners:
            field = name.removeprefix(f"{scanner.name}.")
            if field in MOUNTING:
                return float(scanner.mounting[MOUNTING.index(field)])
            if field == "clock_offset":
                return scanner.clock_offset
        return None
    return float(getattr(getattr(setup.parameters, group), name))


def _scanner_with(scanner: Scanner, name: str, value: float) -> Scanner:
    """Return the scanner with one figure changed if it is the one that is named."""
    if not name.startswith(f"{scanner.name}."):
        return scanner
    field = name[len(scanner.name) + 1 :]
    if field == "clock_offset":
        return replace(scanner, clock_offset=value)
    mounting = scanner.mounting.copy()
    axis = MOUNTING.index(field)
    mounting[axis] = float(wrap(value)) if axis == 2 else value
    return replace(scanner, mounting=frozen(mounting, (3,), "mounting"))

"""The truth of a virtual world: wheels, constant errors, people, shiny things, faults. Read by the simulation alone."""

from __future__ import annotations

from collections.abc import Container
from dataclasses import dataclass, field, fields
from typing import Annotated

from commission.site.checks import check_fields
from commission.site.intensity import IntensityModel
from commission.site.odometry_growth import (
    FORWARD_PER_SQRT_M,
    FORWARD_PER_SQRT_S,
    HEADING_PER_SQRT_M,
    HEADING_PER_SQRT_RAD,
    HEADING_PER_SQRT_S,
    LATERAL_PER_SQRT_M,
)
from commission.site.parameters import OdometryParameters
from commission.site.quantity import (
    DEGREES,
    MILLIMETRES,
    NOT_NEGATIVE,
    PERCENT,
    SHARE,
    Bounds,
    Group,
    Quantity,
    Shown,
    Words,
    X,
    Y,
)

PEOPLE = Quantity(label="People", bounds=Bounds.between(0, 10_000), step=1, entry=(0, 500))
_FREQUENCY = Bounds.between(0.0, 1000.0)
_MILLISECONDS = Shown("ms", 1000.0)
_SHORT = Bounds.between(0.0, 0.1)
_EITHER_WAY = Bounds.between(-10.0, 10.0)
_SCALE = Bounds.between(0.0, 0.1)


def _sigma(label: str) -> Quantity:
    """1-sigma of a length that is the same over a whole drive."""
    return Quantity(label=label, unit="m", shown=MILLIMETRES, bounds=_SHORT, step=0.1, decimals=6)


def _scale(label: str) -> Quantity:
    """1-sigma of a factor of the wheels, less one."""
    return Quantity(label=label, shown=PERCENT, bounds=_SCALE, step=0.01, decimals=6)


@dataclass(frozen=True, slots=True, kw_only=True)
class WheelNoise:
    """True noise of the wheels of a virtual vehicle; what the filter believes of it is `parameters.odometry`."""

    forward_per_sqrt_m: Annotated[float, FORWARD_PER_SQRT_M] = 0.01
    """True 1-sigma error along the motion after one metre driven."""
    lateral_per_sqrt_m: Annotated[float, LATERAL_PER_SQRT_M] = 0.003
    """True 1-sigma error across the motion after one metre driven."""
    heading_per_sqrt_m: Annotated[float, HEADING_PER_SQRT_M] = 0.006
    """True 1-sigma heading error after one metre driven."""
    heading_per_sqrt_rad: Annotated[float, HEADING_PER_SQRT_RAD] = 0.01
    """True 1-sigma heading error after turning one radian."""
    forward_per_sqrt_s: Annotated[float, FORWARD_PER_SQRT_S] = 0.0005
    """True 1-sigma error along the vehicle's axis after one second, even at rest."""
    heading_per_sqrt_s: Annotated[float, HEADING_PER_SQRT_S] = 0.0002
    """True 1-sigma heading error after one second, even at rest."""

    @staticmethod
    def believed(odometry: OdometryParameters, stated: Container[str]) -> WheelNoise:
        """Return the wheels that a filter believes in: those of projects that do not say how noisy theirs are.

        Parameters
        ----------
        odometry : what the filter believes.
        stated : names of what the project says of it; the defaults of a filter are no statement about wheels.
        """
        names = (each.name for each in fields(WheelNoise) if each.name in stated)
        return WheelNoise(**{name: getattr(odometry, name) for name in names})

    def __post_init__(self) -> None:
        check_fields(self, "wheels.")


@dataclass(frozen=True, slots=True, kw_only=True)
class ScannerError:
    """Errors of one scanner that are the same in every drive: what was mounted askew, or measures too far."""

    scanner: Annotated[str, Words("Scanner")] = "scanner"
    """Name of the scanner."""
    mounting: Annotated[
        tuple[float, float, float],
        Quantity(label="Mounting x off by", unit="m", shown=MILLIMETRES, bounds=_EITHER_WAY, step=0.1, decimals=6),
        Quantity(label="Mounting y off by", unit="m", shown=MILLIMETRES, bounds=_EITHER_WAY, step=0.1, decimals=6),
        Quantity(label="Turned by", unit="rad", shown=DEGREES, bounds=_EITHER_WAY, step=0.01, decimals=6),
    ] = (0.0, 0.0, 0.0)
    """What the true mounting has more than the project's: x, y and heading in the base frame."""
    range_bias: Annotated[
        float,
        Quantity(label="Range bias", unit="m", shown=MILLIMETRES, bounds=_EITHER_WAY, step=0.1, decimals=6),
    ] = 0.0
    """What the scanner adds to every range."""
    clock_offset: Annotated[
        float, Quantity(label="Clock late by", unit="s", shown=_MILLISECONDS, bounds=_EITHER_WAY, step=0.1, decimals=6)
    ] = 0.0
    """How much later than they were taken its scans are stamped."""

    def __post_init__(self) -> None:
        check_fields(self, "constant error's ")


@dataclass(frozen=True, slots=True, kw_only=True)
class ConstantErrors:
    """What is wrong in the same way over a whole virtual drive: 1-sigma of what is drawn once for each seed."""

    survey_factor: Annotated[float, Quantity(label="Survey", bounds=Bounds.between(0.0, 100.0), step=0.1)] = 0.0
    """True survey error of each reflector in multiples of the `sigma` that the map gives it; 0: all stand as mapped."""
    survey_sigma: Annotated[float, _sigma("Survey 1σ")] = 0.0
    """1-sigma of the true survey error, along x and along y, of each reflector whose `sigma` is 0 in the map."""
    mounting_sigma: Annotated[
        tuple[float, float, float],
        _sigma("Mounting x 1σ"),
        _sigma("Mounting y 1σ"),
        Quantity(label="Facing 1σ", unit="rad", shown=DEGREES, bounds=_SHORT, step=0.01, decimals=6),
    ] = (0.0, 0.0, 0.0)
    """1-sigma of what the true mounting of each scanner has more than the project's: x, y and heading."""
    range_bias_sigma: Annotated[float, _sigma("Range bias 1σ")] = 0.0
    """1-sigma of what each scanner adds to all its ranges."""
    clock_offset_sigma: Annotated[
        float, Quantity(label="Clock 1σ", unit="s", shown=_MILLISECONDS, bounds=_SHORT, step=0.1, decimals=6)
    ] = 0.0
    """1-sigma of how much later than they were taken the scans of each scanner are stamped."""
    forward_scale_sigma: Annotated[float, _scale("All wheels 1σ")] = 0.0
    """1-sigma of the share by which all wheels together report too much way."""
    wheel_scale_sigma: Annotated[float, _scale("Each wheel 1σ")] = 0.0
    """1-sigma of the share by which each driven wheel alone reports too much way: left and right differ."""
    separation_scale_sigma: Annotated[float, _scale("Separation 1σ")] = 0.0
    """1-sigma of the share by which the true distance between the wheels is larger than the vehicle's."""
    scanners: tuple[ScannerError, ...] = ()
    """Errors of single scanners that are no chance; what is drawn comes on top."""

    def __post_init__(self) -> None:
        check_fields(self, "constants.")


@dataclass(frozen=True, slots=True)
class ShinyObject:
    """A fixed object that the scanner takes for a reflector: an upright plate or post of a given width."""

    x: Annotated[float, X]
    """Center, x in the map frame."""
    y: Annotated[float, Y]
    """Center, y in the map frame."""
    radius: Annotated[float, Quantity(label="Radius", unit="m", bounds=Bounds.between(0.001, 2.0), decimals=4)] = 0.1
    """Half its width."""

    def __post_init__(self) -> None:
        check_fields(self, "shiny object's ")


@dataclass(frozen=True, slots=True)
class TiltedStretch:
    """A circular patch of uneven floor on which the laser meets the ground early."""

    x: Annotated[float, X]
    """Center, x in the map frame."""
    y: Annotated[float, Y]
    """Center, y in the map frame."""
    radius: Annotated[float, Quantity(label="Radius", unit="m", bounds=NOT_NEGATIVE, decimals=4)]
    """Radius of the patch."""
    range_limit: Annotated[float, Quantity(label="Range left", unit="m", bounds=Bounds.at_least(0.1), decimals=4)] = 4.0
    """Range that is left while the vehicle stands on it."""

    def __post_init__(self) -> None:
        check_fields(self, "tilted stretch's ")


@dataclass(frozen=True, slots=True)
class CoveredPeriod:
    """A time during which every reflector is covered."""

    start: Annotated[float, Quantity(label="Start", unit="s", bounds=NOT_NEGATIVE)]
    """Time after the start of the drive."""
    duration: Annotated[float, Quantity(label="Duration", unit="s", bounds=NOT_NEGATIVE)]
    """How long it lasts."""

    def __post_init__(self) -> None:
        check_fields(self, "covered period's ")


@dataclass(frozen=True, slots=True, kw_only=True)
class Reel:
    """A paper reel that stands upright, alone or below others: goods that come, go and are carried."""

    x: Annotated[float, X]
    """Center, x in the map frame."""
    y: Annotated[float, Y]
    """Center, y in the map frame."""
    radius: Annotated[float, Quantity(label="Radius", unit="m", bounds=Bounds.between(0.01, 10.0), decimals=4)] = 0.6
    """Its radius."""
    appears: Annotated[float, Quantity(label="Appears", unit="s", bounds=NOT_NEGATIVE)] = 0.0
    """Time after the start of the drive at which it is put down."""
    vanishes: Annotated[float, Quantity(label="Vanishes", unit="s", bounds=NOT_NEGATIVE)] = 0.0
    """Time after the start at which it is gone; 0: it stays."""
    carried: Annotated[float, Quantity(label="Carried from", unit="s", bounds=NOT_NEGATIVE)] = 0.0
    """Time after the start at which another vehicle begins to carry it; 0: it stays where it is."""
    to_x: Annotated[float, X] = 0.0
    """Where it is carried to, x in the map frame."""
    to_y: Annotated[float, Y] = 0.0
    """Where it is carried to, y in the map frame."""
    speed: Annotated[float, Quantity(label="Carried at", unit="m/s", bounds=Bounds.between(0.001, 20.0))] = 1.0
    """How fast it is carried."""

    def __post_init__(self) -> None:
        check_fields(self, "reel's ")


@dataclass(frozen=True, slots=True, kw_only=True)
class Disturbances:
    """Everything that a virtual drive suffers beyond the noise of its sensors."""

    people: Annotated[int, PEOPLE] = 0
    """People walking about on the free floor."""
    walking_speed: Annotated[float, Quantity(label="Walking speed", unit="m/s", bounds=Bounds.between(0.0, 10.0))] = 1.0
    """Mean speed of a person."""
    shiny_objects: tuple[ShinyObject, ...] = ()
    """Fixed things that look like reflectors."""
    glints_per_scan: Annotated[float, Quantity(label="Glints per scan", bounds=_FREQUENCY)] = 0.0
    """Mean number of random short reflections in a scan."""
    tilted_stretches: tuple[TiltedStretch, ...] = ()
    """Patches of uneven floor."""
    dropped_scans: Annotated[float, Quantity(label="Scans lost", shown=PERCENT, bounds=SHARE, step=0.1)] = 0.0
    """Share of scans that never arrive."""
    slips_per_100_m: Annotated[float, Quantity(label="Wheel slips per 100 m", bounds=_FREQUENCY)] = 0.0
    """Mean number of wheel slips per 100 m driven."""
    covered: tuple[CoveredPeriod, ...] = ()
    """Times at which all reflectors are covered."""
    reels: tuple[Reel, ...] = ()
    """Paper reels that stand about, come, go and are carried."""
    wheels: Annotated[WheelNoise, Group("Noise of the wheels")] = field(default_factory=WheelNoise)
    """True noise of the wheels."""
    constants: Annotated[ConstantErrors, Group("Constant errors")] = field(default_factory=ConstantErrors)
    """What is wrong in the same way over a whole drive."""
    intensity: Annotated[IntensityModel, Group("Intensities")] = field(default_factory=IntensityModel)
    """How strong echoes are."""

    def undisturbed(self) -> Disturbances:
        """Return the noise of the wheels alone: a hall without people, faults and constant errors."""
        return Disturbances(wheels=self.wheels)

    def __post_init__(self) -> None:
        check_fields(self, "disturbances.")

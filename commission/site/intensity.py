"""How strong the echoes of a virtual world are: by distance, incidence and surface, with mixed and overflowing light.

Read by the simulation alone. Intensities are in whatever unit the scanner's own are, the detector's threshold too.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from commission.site.checks import check_fields
from commission.site.quantity import BARE, DEGREES, NOT_NEGATIVE, PERCENT, POSITIVE, SHARE, Bounds, Quantity, Switch

UNIT = "sensor's unit"
_ANGLE = Bounds.between(1e-4, 1.0)


def _strength(label: str) -> Quantity:
    """An intensity."""
    return Quantity(label=label, unit=UNIT, shown=BARE, bounds=NOT_NEGATIVE, step=0.0001)


@dataclass(frozen=True, slots=True, kw_only=True)
class IntensityModel:
    """Strength of echoes: what a beam returns that meets one surface is level x distance x incidence, of two the sum.

    References
    ----------
    Fall with the distance: the lidar equation, 1 / r^2 of a surface that fills the beam. Tape: minima of ASTM D4956-01,
    type III, white, at 0.2 degrees of observation: 250 cd/lx/m^2 at -4 and 150 at 30 degrees of entrance, which a
    cosine to the power of 3.5 gives; a white wall has 1 / pi of the same unit, 785 times less. What is not named here
    is ours, without a source: fit it to scans of your own.
    """

    enabled: Annotated[bool, Switch("Scans with intensities")] = False
    """Whether virtual scans have intensities in place of flags: then the detector's threshold decides what is a
    reflector, and neither the scanner's detection rates nor its range for reflectors do."""
    reference_distance: Annotated[
        float, Quantity(label="Intensities at", unit="m", bounds=POSITIVE, step=0.1, decimals=4)
    ] = 10.0
    """Distance at which surfaces have the intensities below, met at a right angle."""
    range_exponent: Annotated[float, Quantity(label="Falls by power", bounds=Bounds.between(0.0, 8.0), step=0.1)] = 2.0
    """Power of the distance by which intensities fall; 0: the scanner corrects for it."""
    near_distance: Annotated[
        float, Quantity(label="Near field to", unit="m", bounds=NOT_NEGATIVE, step=0.1, decimals=4)
    ] = 0.5
    """Distance below which the receiver sees less and less of the lit spot: of 63 % there; 0: it sees all of it."""
    reflector: Annotated[float, _strength("Of reflectors")] = 1.0
    """Intensity of reflective tape."""
    reflector_exponent: Annotated[
        float, Quantity(label="Tape falls by power", bounds=Bounds.between(0.0, 50.0), step=0.1)
    ] = 3.5
    """Power of the cosine of the incidence by which the intensity of tape falls."""
    wall: Annotated[float, _strength("Of walls")] = 0.0013
    """Intensity of walls, which falls by the cosine of the incidence."""
    people: Annotated[float, _strength("Of people")] = 0.0003
    """Intensity of legs and other dark things, which falls by the cosine of the incidence."""
    shiny: Annotated[float, _strength("Of shiny objects")] = 1.0
    """Intensity of the mirror image in shiny objects, besides that of a wall: seen where the beam comes straight."""
    shiny_lobe: Annotated[
        float, Quantity(label="Mirror's 1σ", unit="rad", shown=DEGREES, bounds=_ANGLE, step=0.1, decimals=6)
    ] = 0.1
    """1-sigma of the incidence within which shiny objects mirror."""
    noise: Annotated[float, Quantity(label="Intensity 1σ", shown=PERCENT, bounds=SHARE, step=0.1)] = 0.05
    """1-sigma noise of each beam's intensity, as a share of it."""
    echo_length: Annotated[
        float, Quantity(label="Echoes mix over", unit="m", bounds=NOT_NEGATIVE, step=0.01, decimals=4)
    ] = 0.3
    """Depth within which the echoes of one beam become one, with a range in between; of others the stronger counts."""
    crosstalk: Annotated[float, Quantity(label="Overflow", shown=PERCENT, bounds=SHARE, step=0.01)] = 0.001
    """Share of a reflector's intensity that beams beside it return as well, from its distance."""
    crosstalk_width: Annotated[
        float, Quantity(label="Overflows by", unit="rad", shown=DEGREES, bounds=_ANGLE, step=0.1, decimals=6)
    ] = 0.01
    """Angle over which that share falls to 37 %."""
    response: Annotated[float, Quantity(label="Reported by power", bounds=Bounds.between(0.01, 10.0), step=0.01)] = 1.0
    """Power of the light by which the reported intensity grows, from that of reflectors down; 1: in proportion. Many
    scanners report far less than that: walls before a real TiM781S follow a power of 0.18."""
    largest: Annotated[float, Quantity(label="Saturates at", unit=UNIT, shown=BARE, bounds=POSITIVE, step=0.1)] = 10.0
    """Largest intensity that is reported."""

    def __post_init__(self) -> None:
        check_fields(self, "intensity.")

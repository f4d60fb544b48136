"""How many beams a reflector shows: the detector filter's window, by the beams' width or by equation 3 as printed.

How many there are depends on what share of a beam a scanner needs for its flag, which no data sheet says: anything from
a touch to the beam's middle. The window reaches from one to the other; the parameters for its errors widen it.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from commission.compiled import compiled_inline
from commission.localization.beam_echo import LARGEST_INCIDENCE, LIT_SHARE, BeamModel, flagged_span, half_width_at

TOUCH, MIDDLE = 0.0, 0.5
"""Shares of a beam that must meet a reflector for its flag, between which those of real scanners lie."""
TILT_SIGMAS = 2.0
"""Sigmas of a plate's slope between which its incidence is taken to be."""
STEEPEST = math.tan(LARGEST_INCIDENCE)
"""Largest slope at which a plate reflects."""


class BeamWindow(NamedTuple):
    """Beams that a reflector shows."""

    fewest: int
    most: int
    likely: float
    """Mean over all places between two beams, of a scanner that flags at `LIT_SHARE`."""


class Tilt(NamedTuple):
    """How a plate stands, as the ranges of its beams tell it."""

    slope: float
    """Tangent of the angle of incidence."""
    spread: float
    """Sum of squared distances of its beams from their middle, along its width [m^2]; 0 of a single beam."""


@compiled_inline
def expected_beams(distance: float, radius: float, increment: float) -> int:
    """Beams without width that a reflector intercepts.

    Parameters
    ----------
    distance : to its center [m].
    radius : of the reflector [m].
    increment : step between beams [rad].

    Notes
    -----
    floor(2 asin(radius / distance) / increment): Sobreira et al. 2016, equation 3.
    """
    return math.floor(2.0 * math.asin(min(1.0, radius / max(distance, radius))) / abs(increment))


@compiled_inline
def window_of_equation_3(distance: float, radius: float, flat: bool, increment: float) -> BeamWindow:
    """Beams that a reflector shows by equation 3; a plate seen obliquely shows any number fewer.

    Parameters
    ----------
    distance, radius : to its center, and its radius or half its width [m].
    flat : whether it is a plate.
    increment : step between beams [rad].

    Notes
    -----
    fewest = most = `expected_beams`: Sobreira et al. 2016, equation 3; of a plate, fewest = 0.
    """
    count = expected_beams(distance, radius, increment)
    return BeamWindow(0 if flat else count, count, float(count))


@compiled_inline
def window_of_cylinder(distance: float, radius: float, increment: float, beam: BeamModel) -> BeamWindow:
    """Beams of some width that a cylinder shows.

    Parameters
    ----------
    distance, radius : to its center, and its radius [m].
    increment : step between beams [rad].
    beam : width and noise of the beams.

    Notes
    -----
    floor(span / increment), span by `flagged_span`: Sobreira et al. 2016, equation 3, for beams with a width.
    """
    far = max(distance, radius)
    high = math.asin(min(1.0, radius / far))
    return _window(high, high, high, half_width_at(far, beam.half_divergence, beam.half_aperture), increment, beam)


@compiled_inline
def window_of_plate(distance: float, half_length: float, tilt: Tilt, increment: float, beam: BeamModel) -> BeamWindow:
    """Beams of some width that a plate shows, as far as its ranges tell how it stands.

    Parameters
    ----------
    distance, half_length : to its center, and half its width [m].
    tilt : its slope by its own ranges.
    increment : step between beams [rad].
    beam : width and noise of the beams.

    Notes
    -----
    Half the angle between the plate's two ends in `flagged_span`, for the slopes within `TILT_SIGMAS` of the measured
    one. A bearing's noise moves the range by distance times slope; a beam as wide as the plate sees its middle
    wherever it meets it, so that the slope looks smaller, by up to high / (high + w). Derived.
    """
    slope = min(abs(tilt.slope), STEEPEST)
    half_width = half_width_at(distance, beam.half_divergence, beam.half_aperture)
    likely = _half_angle(distance, half_length, slope)
    least, largest = 0.0, STEEPEST
    if tilt.spread > 0.0:
        along = distance * slope * beam.bearing_sigma
        sigma = math.sqrt((beam.range_sigma * beam.range_sigma + along * along) / tilt.spread)
        least = max(slope - TILT_SIGMAS * sigma, 0.0)
        largest = min(slope * (1.0 + half_width / likely) + TILT_SIGMAS * sigma, STEEPEST)
    narrow, wide = _half_angle(distance, half_length, largest), _half_angle(distance, half_length, least)
    return _window(narrow, likely, wide, half_width, increment, beam)


@compiled_inline
def _half_angle(distance: float, half_length: float, slope: float) -> float:
    """Half of the angle between the two ends of a plate of that slope [rad]."""
    cosine = 1.0 / math.sqrt(1.0 + slope * slope)
    across, along = half_length * cosine, half_length * cosine * slope
    return 0.5 * (math.atan2(across, distance - along) + math.atan2(across, distance + along))


@compiled_inline
def _window(  # noqa: PLR0917 - an object's size, three times, and the beams
    narrow: float, likely: float, wide: float, half_width: float, increment: float, beam: BeamModel
) -> BeamWindow:
    """Beams that objects between two sizes show [half angles, rad]; noise moves either edge by a sigma of a bearing."""
    step, noise = abs(increment), 2.0 * beam.bearing_sigma
    return BeamWindow(
        math.floor((flagged_span(narrow, half_width, MIDDLE) - noise) / step),
        math.floor((flagged_span(wide, half_width, TOUCH) + noise) / step),
        flagged_span(likely, half_width, LIT_SHARE) / step,
    )

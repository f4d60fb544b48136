"""Constants of virtual drives that are drawn as a project knows them."""

from __future__ import annotations

from dataclasses import replace

from commission.site.disturbances import ConstantErrors
from commission.site.uncertainty import Uncertainty


def constants_as_known(known: Uncertainty) -> ConstantErrors:
    """Survey, mounting, range bias and clock, each with its own 1-sigma; the wheels are right."""
    return ConstantErrors(
        survey_sigma=known.survey,
        mounting_sigma=(known.mounting_position, known.mounting_position, known.mounting_heading),
        range_bias_sigma=known.range_bias,
        clock_offset_sigma=known.clock,
    )


def with_wheels(known: Uncertainty) -> ConstantErrors:
    """The same, of a vehicle whose wheels are off by a few thousandths, and their separation by a hundredth."""
    return replace(
        constants_as_known(known), forward_scale_sigma=0.005, wheel_scale_sigma=0.002, separation_scale_sigma=0.01
    )

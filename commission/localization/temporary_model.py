"""Rules and limits of temporary landmarks as scalars and arrays for kernels, and the columns of what became of them."""

from __future__ import annotations

from collections.abc import Sequence
from enum import IntEnum
from typing import NamedTuple

from commission.geometry.arrays import FloatArray
from commission.geometry.gaussian import chi_square_gate
from commission.localization.contour import what_is_no_echo
from commission.localization.corners import CornerRule
from commission.localization.reels import ReelRule
from commission.site.parameters import TemporaryParameters
from commission.site.scanner import Scanner


class LandmarkKind(IntEnum):
    """What a temporary landmark is."""

    REEL = 0
    CORNER = 1


REEL, CORNER = int(LandmarkKind.REEL), int(LandmarkKind.CORNER)
REELS, CORNERS, MATCHED, DOUBTFUL, BORN, FORGOTTEN, KNOWN, NIS_SUM, AWAITED = range(9)
"""Columns of what is known of a cycle: reels and corners in its scan, those of landmarks, those that lie where a
landmark is that they do not fit, landmarks born, forgotten, and known after it, sum of the NIS of the matched ones (two
degrees of freedom each), and things that wait to be seen again."""
COLUMNS = 9


class TemporaryModel(NamedTuple):
    """Rules and limits, for kernels."""

    most: int
    reel: ReelRule
    corner: CornerRule
    gap: float
    floor_variance: float
    """Variance of a place besides the noise of its points, each axis [m^2]."""
    gate: float
    """Largest NIS of a sighting of a landmark, of two degrees of freedom."""
    confirmations: int
    misses: int
    forget_ns: int
    largest_variance: float
    """Variance of a landmark's place, along whichever direction, from which on it is forgotten [m^2]."""
    reach: float
    limits: FloatArray
    """(S, 2) smallest and largest range of each scanner [m]."""
    blind: FloatArray
    """(B, 3) see `ContourModel`."""


def temporary_model(scanners: Sequence[Scanner], given: TemporaryParameters) -> TemporaryModel | None:
    """Return what kernels need; None where temporary landmarks are switched off.

    Parameters
    ----------
    scanners : of the vehicle.
    given : the parameters.
    """
    if not given.enabled:
        return None
    return TemporaryModel(
        int(given.most),
        ReelRule(
            int(given.fewest_points),
            given.least_radius,
            given.largest_radius,
            given.largest_residual,
            given.least_arc,
            given.largest_arc,
            given.beam_sigma,
        ),
        CornerRule(
            given.corners,
            given.least_side,
            given.largest_side,
            given.largest_residual,
            given.corner_tolerance,
            given.beam_sigma,
        ),
        given.gap,
        given.position_sigma**2,
        chi_square_gate(given.gate_probability, 2),
        int(given.confirmations),
        int(given.misses),
        round(1e9 * given.forget_after),
        given.largest_sigma**2,
        given.reach,
        *what_is_no_echo(scanners),
    )

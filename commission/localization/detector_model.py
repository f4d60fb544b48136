"""What the detector's kernels read of reflectors, scanner, parameters and scans. No detection in here."""

from __future__ import annotations

import math
from typing import NamedTuple, TypeAlias

import numpy as np

from commission.compiled import compiled_inline
from commission.geometry.angles import TURN
from commission.geometry.arrays import BoolArray, FloatArray, IntArray, read_only
from commission.localization.beam_echo import LARGEST_INCIDENCE
from commission.site.parameters import DetectorParameters
from commission.site.reflectors import Reflector, ReflectorKind, ReflectorMap
from commission.site.scanner import Scanner

ReflectorClass: TypeAlias = tuple[float, bool, float, float]
"""Radius that is reckoned with, whether it is a plate, smallest and largest radius that it may have [m]."""


class DetectorModel(NamedTuple):
    """Classes of reflectors and tolerances, for kernels."""

    radii: FloatArray
    """(C,) radius of each class of reflectors in the map [m]; half the width of a plate."""
    flat: BoolArray
    """(C,) whether the class is of flat plates."""
    smallest: FloatArray
    """(C,) smallest radius that one of the class may have [m]: another one than `radii` where theirs is unknown."""
    largest: FloatArray
    """(C,) largest radius that one of the class may have [m]."""
    enabled: bool
    fewer: int
    """MinModelError: beams that may be missing. It bounds a signed error, so the window is [-fewer, more]."""
    more: int
    """MaxModelError: beams that may be too many."""
    range_jump: float
    widest: float
    """Diameter of the largest reflector, up to which dark beams at the range of a body belong to it [m]; 0: none do."""
    steepest: float
    """Largest slope at which a plate reflects, where there are plates; 0: there are none."""
    mixed: bool
    """Whether there are plates and cylinders, which the shape of a cluster tells apart."""
    circle: bool
    """Whether the center is a fitted circle rather than the paper's central beam."""
    by_width: bool
    """Whether the window reckons with the width of the beams; else it is that of equation 3 as printed."""
    half_divergence: float
    """Half of a beam's divergence [rad]. A `BeamModel` laid out flat: parallel kernels take no nested tuples."""
    half_aperture: float
    """Half of a beam's width where it leaves the scanner [m]."""
    bearing_sigma: float
    """1-sigma noise of a beam's bearing [rad]."""
    range_sigma: float
    """1-sigma noise of a beam's range [m]."""


class Beams(NamedTuple):
    """Bearings of the beams of a scan."""

    used: int
    """Beams to read; a scan that repeats its first beam at the end is cut."""
    angle_min: float
    increment: float
    full_turn: bool
    """Whether the last beam is the first one's neighbor."""


class BeamColumns(NamedTuple):
    """`Beams` of many scans, a row for each."""

    used: IntArray
    angle_min: FloatArray
    increment: FloatArray
    full_turn: BoolArray


def detector_model(reflectors: ReflectorMap, scanner: Scanner, parameters: DetectorParameters) -> DetectorModel:
    """Return the distinct radii and kinds of a map, and the detector's tolerances.

    Parameters
    ----------
    reflectors : their radii and kinds are looked at.
    scanner : width and noise of its beams.
    parameters : window of the detector filter and rule for the center.
    """
    classes = sorted({class_of(reflector) for reflector in reflectors.reflectors})
    radii, smallest, largest = (np.array([each[i] for each in classes], dtype=np.float64) for i in (0, 2, 3))
    flat = np.array([each[1] for each in classes], dtype=np.bool_)
    return DetectorModel(
        read_only(radii),
        read_only(flat),
        read_only(smallest),
        read_only(largest),
        bool(parameters.enabled),
        int(parameters.min_model_error),
        int(parameters.max_model_error),
        float(parameters.range_jump),
        2.0 * float(largest.max(initial=0.0)) if parameters.expected_beams == "beam_width" else 0.0,
        math.tan(LARGEST_INCIDENCE) if flat.any() else 0.0,
        bool(flat.any() and not flat.all()) and parameters.expected_beams == "beam_width",
        parameters.center == "circle",
        parameters.expected_beams == "beam_width",
        0.5 * math.radians(scanner.beam_width_deg),
        0.5 * scanner.beam_aperture,
        math.radians(scanner.bearing_sigma_deg),
        max(float(scanner.range_sigma), 1e-3),
    )


def class_of(reflector: Reflector) -> ReflectorClass:
    """What the detector tells reflectors apart by."""
    return (reflector.reckoned_radius, reflector.kind is ReflectorKind.FLAT, *reflector.radii)


def beams_of(counts: IntArray, angle_min: FloatArray, increments: FloatArray) -> BeamColumns:
    """Return the bearings of scans for the kernels.

    Parameters
    ----------
    counts : (K,) beams of each scan.
    angle_min, increments : (K,) first bearing and step between beams of each scan [rad].

    Raises
    ------
    ValueError
        the beams of a scan do not advance.
    """
    wrong = np.flatnonzero(~(np.isfinite(angle_min) & np.isfinite(increments) & (increments != 0.0)))
    if len(wrong):
        start, step = angle_min[wrong[0]], increments[wrong[0]]
        raise ValueError(f"scan starts at {start} rad with steps of {step} rad; expected a finite step, not 0")
    steps = np.abs(increments)
    once = np.minimum(counts, np.floor(TURN / steps + 0.5)).astype(np.int64)
    full_turn = once * steps > TURN - 0.5 * steps
    return BeamColumns(read_only(once), read_only(angle_min), read_only(increments), read_only(full_turn))


@compiled_inline
def beams_at(columns: BeamColumns, row: int) -> Beams:
    """Bearings of one scan of many, as `beams_of` gives them."""
    return Beams(columns.used[row], columns.angle_min[row], columns.increment[row], columns.full_turn[row])

"""Detect: from a scan to reflectors (Sobreira et al. 2016, Algorithm 2 and equation 3). Knows no pose.

A cluster is a run of neighboring reflective beams whose ranges do not jump. One missing beam inside a run (no echo, or
an echo at the same range without the flag) is bridged, since scanners drop single flags; it counts as a beam, because
the filter's window speaks of width. Two missing beams, or one that sees something nearer or farther, end the cluster.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from commission.compiled import compiled, compiled_inline
from commission.geometry.angles import TURN, wrap_scalar
from commission.geometry.arrays import BoolArray, FloatArray, IntArray, read_only
from commission.localization.beam_echo import BeamModel, half_width_at
from commission.localization.beam_window import (
    BeamWindow,
    Tilt,
    window_of_cylinder,
    window_of_equation_3,
    window_of_plate,
)
from commission.localization.estimate import Status
from commission.localization.reflector_center import central_beam, circle_fit, plate, rest_of_cylinder
from commission.site.parameters import DetectorParameters
from commission.site.records import Scan
from commission.site.reflectors import ReflectorMap
from commission.site.scanner import Scanner

INLIER = int(Status.INLIER)
OUTLIER_DETECTOR = int(Status.OUTLIER_DETECTOR)


class DetectorModel(NamedTuple):
    """Classes of reflectors and tolerances, for kernels."""

    radii: FloatArray
    """(C,) radius of each class of reflectors in the map [m]; half the width of a plate."""
    flat: BoolArray
    """(C,) whether the class is of flat plates."""
    enabled: bool
    fewer: int
    """MinModelError: beams that may be missing. It bounds a signed error, so the window is [-fewer, more]."""
    more: int
    """MaxModelError: beams that may be too many."""
    range_jump: float
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


class Clusters(NamedTuple):
    """Clusters as the kernels write them, a row for each."""

    range_bearing: FloatArray
    """(n, 2) center [m, rad], scanner frame."""
    widths: IntArray
    """(n,) [beams]."""
    expected: FloatArray
    """(n,) width that the likeliest kind of reflector has there [beams]."""
    status: NDArray[np.int8]
    """(n,) INLIER or OUTLIER_DETECTOR."""


@dataclass(frozen=True, slots=True, eq=False)
class DetectedReflectors:
    """Clusters of one scan, those that the detector filter rejects included."""

    range_bearing: FloatArray
    """(N, 2) range [m] and bearing [rad] of each center, scanner frame."""
    beams: IntArray
    """(N,) width of each cluster [beams]."""
    expected: FloatArray
    """(N,) width that the likeliest kind of reflector has there [beams]; NaN without any reflector in the map."""
    status: NDArray[np.int8]
    """(N,) `Status.INLIER`, or `Status.OUTLIER_DETECTOR` where the detector filter rejects the cluster."""


def detector_model(reflectors: ReflectorMap, scanner: Scanner, parameters: DetectorParameters) -> DetectorModel:
    """Return the distinct radii and kinds of a map, and the detector's tolerances.

    Parameters
    ----------
    reflectors : their radii and kinds are looked at.
    scanner : width and noise of its beams.
    parameters : window of the detector filter and rule for the center.
    """
    flat_of = reflectors.is_flat
    classes = sorted({(float(radius), bool(flat)) for radius, flat in zip(reflectors.radii, flat_of, strict=True)})
    radii = np.array([radius for radius, _ in classes], dtype=np.float64)
    flat = np.array([is_flat for _, is_flat in classes], dtype=np.bool_)
    return DetectorModel(
        read_only(radii),
        read_only(flat),
        bool(parameters.enabled),
        int(parameters.min_model_error),
        int(parameters.max_model_error),
        float(parameters.range_jump),
        bool(flat.any() and not flat.all()) and parameters.expected_beams == "beam_width",
        parameters.center == "circle",
        parameters.expected_beams == "beam_width",
        0.5 * math.radians(scanner.beam_width_deg),
        0.5 * scanner.beam_aperture,
        math.radians(scanner.bearing_sigma_deg),
        max(float(scanner.range_sigma), 1e-3),
    )


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


def reflective_beams(
    ranges: NDArray[np.float32],
    intensities: NDArray[np.float32] | None,
    reflector: NDArray[np.bool_] | None,
    threshold: float,
) -> NDArray[np.bool_]:
    """Which beams met something reflective: the scanner's flag, else echoes at least as strong as the threshold.

    Parameters
    ----------
    ranges : (..., B) array [m].
    intensities, reflector : (..., B) arrays, or None where the scanner has none; without either no beam did.
    threshold : smallest intensity of a reflector, in the scanner's own unit.

    Returns
    -------
    flags : (..., B) array.
    """
    if reflector is not None:
        return read_only(np.asarray(reflector, dtype=np.bool_))
    if intensities is not None:
        return read_only(np.asarray(intensities) >= threshold)
    return read_only(np.zeros(ranges.shape, dtype=np.bool_))


def detect(scan: Scan, model: DetectorModel, parameters: DetectorParameters) -> DetectedReflectors:
    """Detect the reflectors in one scan.

    Parameters
    ----------
    scan : with reflector flags, else intensities; with neither, nothing is detected.
    model : of the reflector map, by `detector_model`.
    parameters : the same as in `model`; its intensity threshold is used here.

    Returns
    -------
    detected : every cluster, in the order of its beams.
    """
    ranges = read_only(np.asarray(scan.ranges, dtype=np.float32))
    flags = reflective_beams(ranges, scan.intensities, scan.reflector, parameters.intensity_threshold)
    columns = beams_of(np.array([len(ranges)]), np.array([scan.angle_min]), np.array([scan.angle_increment]))
    beams = Beams(int(columns.used[0]), scan.angle_min, scan.angle_increment, bool(columns.full_turn[0]))
    count = count_clusters(ranges, flags, beams, model)
    clusters = room_for(count)
    detect_clusters(ranges, flags, beams, model, 0, *clusters)
    return DetectedReflectors(*clusters)


def room_for(count: int) -> Clusters:
    """Return rows for so many clusters, to be written."""
    return Clusters(
        np.empty((count, 2)), np.empty(count, dtype=np.int64), np.empty(count), np.empty(count, dtype=np.int8)
    )


@compiled_inline
def _lit(ranges: NDArray[np.float32], flags: NDArray[np.bool_], beam: int) -> bool:
    """Whether a beam is reflective and has a range."""
    return flags[beam] and ranges[beam] > 0.0 and ranges[beam] < math.inf


@compiled_inline
def _next_cluster(  # noqa: PLR0917 - a scan and a position in it
    ranges: NDArray[np.float32], flags: NDArray[np.bool_], count: int, position: int, end: int, jump: float
) -> tuple[int, int]:
    """First and last beam of the cluster at or after a position; first = end when none. Beams count on past a turn."""
    first = position
    while True:
        # Most beams are dark: this loop is most of the detector's time, so it does nothing else.
        while first < min(end, count) and not flags[first]:
            first += 1
        if first >= end or _lit(ranges, flags, first if first < count else first - count):
            break
        first += 1
    last = first
    while last + 1 < end:
        here = ranges[last if last < count else last - count]
        beam = last + 1 if last + 1 < count else last + 1 - count
        if _lit(ranges, flags, beam):
            if not abs(ranges[beam] - here) <= jump:
                break
            last += 1
            continue
        if last + 2 >= end or abs(ranges[beam] - here) > jump:
            break
        after = last + 2 if last + 2 < count else last + 2 - count
        if not (_lit(ranges, flags, after) and abs(ranges[after] - here) <= jump):
            break
        last += 2
    return first, last


@compiled_inline
def _start_of_turn(ranges: NDArray[np.float32], flags: NDArray[np.bool_], beams: Beams) -> int:
    """First beam after two dark ones, so that no cluster lies across the start of a full turn."""
    if not beams.full_turn:
        return 0
    dark = 0
    for position in range(beams.used - 2, 2 * beams.used):
        beam = position if position < beams.used else position - beams.used
        if dark >= 2 and position >= beams.used:
            return beam
        dark = 0 if _lit(ranges, flags, beam) else dark + 1
    return 0


@compiled
def count_clusters(ranges: NDArray[np.float32], flags: NDArray[np.bool_], beams: Beams, model: DetectorModel) -> int:
    """Count the clusters in a scan, to reserve space for them.

    Parameters
    ----------
    ranges, flags : (B,) range [m] of each beam, and whether it met something reflective.
    beams : bearings of the scan.
    model : the largest jump of the range within a cluster is read.

    Notes
    -----
    No formula: what a cluster is, is said at the top of the module (Sobreira et al. 2016, Algorithm 2, lines 2 and 3).
    """
    position = _start_of_turn(ranges, flags, beams)
    end = position + beams.used if beams.full_turn else beams.used
    found = 0
    while position < end:
        first, last = _next_cluster(ranges, flags, beams.used, position, end, model.range_jump)
        if first < end:
            found += 1
        position = last + 1
    return found


@compiled
def detect_clusters(  # noqa: PLR0917 - outputs are written into the arrays of the whole run
    ranges: NDArray[np.float32],
    flags: NDArray[np.bool_],
    beams: Beams,
    model: DetectorModel,
    row: int,
    range_bearing: FloatArray,
    widths: IntArray,
    expected: FloatArray,
    status: NDArray[np.int8],
) -> int:
    """Write center, width and status of each cluster of a scan; return the row after the last.

    Parameters
    ----------
    ranges, flags : (B,) range [m] of each beam, and whether it met something reflective.
    beams : bearings of the scan.
    model : classes of reflectors and tolerances.
    row : of the first cluster in the outputs.
    range_bearing : (n, 2) output: center [m, rad], scanner frame.
    widths : (n,) output: [beams].
    expected : (n,) output: width of the likeliest kind of reflector there [beams].
    status : (n,) output: INLIER or OUTLIER_DETECTOR.

    Notes
    -----
    Inlier if fewest - min_model_error <= counted beams <= most + max_model_error: Sobreira et al. 2016, Algorithm 2,
    line 7, where fewest = most, and whose lower bound is printed without its sign.
    """
    position = _start_of_turn(ranges, flags, beams)
    end = position + beams.used if beams.full_turn else beams.used
    while position < end:
        first, last = _next_cluster(ranges, flags, beams.used, position, end, model.range_jump)
        if first < end:
            distance, bearing, likely, passed = _judge(ranges, flags, beams, first, last, model)
            range_bearing[row, 0] = distance
            range_bearing[row, 1] = wrap_scalar(bearing)
            widths[row], expected[row] = last - first + 1, likely
            status[row] = INLIER if passed or not model.enabled else OUTLIER_DETECTOR
            row += 1
        position = last + 1
    return row


@compiled_inline
def _judge(  # noqa: PLR0917 - a scan and a cluster in it
    ranges: NDArray[np.float32], flags: NDArray[np.bool_], beams: Beams, first: int, last: int, model: DetectorModel
) -> tuple[float, float, float, bool]:
    """Center and expected width of a cluster as the class of reflectors that fits best; whether it passes the filter.

    Without any reflector in the map, every cluster is a post of no radius that fails.
    """
    distance, bearing, likely, passed = math.nan, math.nan, math.nan, False
    least, width, slope, spread, rest = math.inf, last - first + 1, 0.0, 0.0, 0.0
    for kind in range(len(model.radii)):
        radius = model.radii[kind]
        if model.flat[kind]:
            r, b, slope, spread, rest = plate(ranges, flags, beams.used, first, last, beams.angle_min, beams.increment)
        elif model.circle:
            r, b = circle_fit(
                ranges,
                flags,
                beams.used,
                first,
                last,
                beams.angle_min,
                beams.increment,
                radius,
                _beam(model),
                beams.full_turn,
            )
        else:
            r, b = central_beam(ranges, flags, beams.used, first, last, beams.angle_min, beams.increment, radius)
        window = _window(r, Tilt(slope, spread), beams.increment, kind, model)
        misfit = abs(width - window.likely)
        if model.mixed:
            if not model.flat[kind]:
                rest = rest_of_cylinder(
                    ranges,
                    flags,
                    beams.used,
                    first,
                    last,
                    beams.angle_min,
                    beams.increment,
                    r,
                    b,
                    radius,
                    half_width_at(r, model.half_divergence, model.half_aperture),
                )
            # Post and plate of one width differ by less than a beam; their ranges tell which it is.
            misfit += 0.5 * rest / (model.range_sigma * model.range_sigma)
        fits = window.fewest - model.fewer <= width <= window.most + model.more
        if (fits and not passed) or (fits == passed and misfit < least):
            distance, bearing, likely, passed, least = r, b, window.likely, fits, misfit
    if least == math.inf:
        distance, bearing, _, _, _ = plate(ranges, flags, beams.used, first, last, beams.angle_min, beams.increment)
    return distance, bearing, likely, passed


@compiled_inline
def _window(distance: float, tilt: Tilt, step: float, kind: int, model: DetectorModel) -> BeamWindow:
    """Beams that a class of reflectors shows at a distance; a plate as its ranges say that it stands."""
    radius, flat = model.radii[kind], model.flat[kind]
    if not model.by_width:
        return window_of_equation_3(distance, radius, flat, step)
    if flat:
        return window_of_plate(distance, radius, tilt, step, _beam(model))
    return window_of_cylinder(distance, radius, step, _beam(model))


@compiled_inline
def _beam(model: DetectorModel) -> BeamModel:
    """Width and noise of the beams."""
    return BeamModel(model.half_divergence, model.half_aperture, model.bearing_sigma, model.range_sigma)

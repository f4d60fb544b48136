"""Detect: from a scan to reflectors (Sobreira et al. 2016, Algorithm 2 and equation 3). Knows no pose.

What a cluster is, is told in `clusters`, how many beams a reflector shows in `beam_window`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from commission.compiled import compiled, compiled_inline
from commission.geometry.angles import within, wrap_scalar
from commission.geometry.arrays import FloatArray, IntArray, read_only
from commission.localization.beam_echo import BeamModel, half_width_at
from commission.localization.beam_window import (
    BeamWindow,
    Tilt,
    window_of_cylinder,
    window_of_equation_3,
    window_of_plate,
)
from commission.localization.clusters import body_of, cluster_rule, count_clusters, next_cluster, start_of_turn
from commission.localization.detector_model import Beams, DetectorModel, beams_of
from commission.localization.estimate import Status
from commission.localization.reflector_center import central_beam, circle_fit, plate, rest_of_cylinder
from commission.site.parameters import DetectorParameters
from commission.site.records import Scan

INLIER = int(Status.INLIER)
OUTLIER_DETECTOR = int(Status.OUTLIER_DETECTOR)
NO_SECTORS: FloatArray = np.empty((0, 2))
"""Of a scanner without blind sectors."""


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


def reflective_beams(
    ranges: NDArray[np.float32],
    intensities: NDArray[np.float32] | None,
    reflector: NDArray[np.bool_] | None,
    parameters: DetectorParameters,
) -> NDArray[np.bool_]:
    """Which beams met something reflective: the scanner's flag, else echoes at least as strong as the threshold.

    Parameters
    ----------
    ranges : (..., B) array [m].
    intensities, reflector : (..., B) arrays, or None where the scanner has none; without either no beam did.
    parameters : smallest intensity of a reflector, near by and far away.

    Returns
    -------
    flags : (..., B) array.
    """
    if reflector is not None:
        return read_only(np.asarray(reflector, dtype=np.bool_))
    if intensities is not None:
        return read_only(np.asarray(intensities) >= threshold_at(ranges, parameters))
    return read_only(np.zeros(ranges.shape, dtype=np.bool_))


def threshold_at(ranges: NDArray[np.floating], parameters: DetectorParameters) -> float | FloatArray:
    """Smallest intensity of a reflector at some ranges, in the scanner's own unit.

    Parameters
    ----------
    ranges : (..., B) array [m]; NaN, where nothing came back, counts as near.
    parameters : `intensity_threshold`, `far_threshold`, `far_distance`.

    Returns
    -------
    threshold : one for all where it does not change with the range, else a (..., B) array.

    Notes
    -----
    t (1 + (f - 1) min(r / d, 1)): linear from the threshold t near by to f t at the distance d, by definition.
    """
    near = parameters.intensity_threshold
    if parameters.far_threshold == 1.0:
        return near
    way = np.clip(np.nan_to_num(np.asarray(ranges, dtype=np.float64)) / parameters.far_distance, 0.0, 1.0)
    return near * (1.0 + (parameters.far_threshold - 1.0) * way)


def without_blind(
    ranges: NDArray[np.float32], flags: NDArray[np.bool_], bearings: tuple[FloatArray, FloatArray], blind: FloatArray
) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    """Beams in blind sectors as if nothing came back from there.

    A reflector that reaches into one shows the beams that are left, as at the ends of the field of view.

    Parameters
    ----------
    ranges, flags : (..., B) arrays: [m], and whether each beam met something reflective.
    bearings : (...) bearing of the first beam of each scan, and step from beam to beam [rad].
    blind : (S, 2) first bearing and width of each sector, as the scanner reports bearings [rad].
    """
    if not len(blind):
        return ranges, flags
    first, step = (np.asarray(angles)[..., np.newaxis] for angles in bearings)
    hidden = within(first + step * np.arange(ranges.shape[-1]), blind)
    kept = np.where(hidden, np.float32(np.nan), ranges)
    return read_only(kept), read_only(flags & ~hidden)


def status_of_reported(range_bearing: FloatArray, blind: FloatArray) -> NDArray[np.int8]:
    """(N,) what the detector says of reflectors that the sensor itself detected: those in blind sectors are none.

    Parameters
    ----------
    range_bearing : (N, 2) array [m, rad], as the scanner reports them.
    blind : as in `without_blind`.
    """
    return np.where(within(range_bearing[:, 1], blind), OUTLIER_DETECTOR, INLIER).astype(np.int8)


def detect(
    scan: Scan, model: DetectorModel, parameters: DetectorParameters, blind: FloatArray = NO_SECTORS
) -> DetectedReflectors:
    """Detect the reflectors in one scan.

    Parameters
    ----------
    scan : with reflector flags, else intensities; with neither, nothing is detected.
    model : of the reflector map, by `detector_model`.
    parameters : the same as in `model`; its thresholds of the intensity are used here.
    blind : (S, 2) first bearing and width of each blind sector of the scanner [rad].

    Returns
    -------
    detected : every cluster, in the order of its beams.
    """
    ranges = read_only(np.asarray(scan.ranges, dtype=np.float32))
    flags = reflective_beams(ranges, scan.intensities, scan.reflector, parameters)
    angles = np.array(scan.angle_min), np.array(scan.angle_increment)
    ranges, flags = without_blind(ranges, flags, angles, blind)
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
    rule = cluster_rule(model)
    position = start_of_turn(ranges, flags, beams, rule)
    end = position + beams.used if beams.full_turn else beams.used
    while position < end:
        first, last = next_cluster(ranges, flags, beams, position, end, rule)
        if first < end:
            distance, bearing, likely, passed = _judge(ranges, flags, beams, first, last, model)
            range_bearing[row, 0] = distance
            range_bearing[row, 1] = wrap_scalar(bearing)
            widths[row], expected[row] = last - first + 1, likely
            status[row] = INLIER if passed or not model.enabled else OUTLIER_DETECTOR
            row += 1
        position = last + 1
    return row


@compiled
def passing_widths(distance: float, step: float, kind: int, model: DetectorModel) -> tuple[int, int]:
    """Fewest and most beams with which a cluster passes as one class of reflectors; a plate however it stands.

    Parameters
    ----------
    distance : to its center [m].
    step : between beams [rad].
    kind : row of the model's classes.
    model : classes of reflectors and tolerances.

    Notes
    -----
    low = max(fewest - min_model_error, 1), high = most + max_model_error: Sobreira et al. 2016, Algorithm 2, line 7.
    """
    window = _window(distance, Tilt(0.0, 0.0), step, kind, model)
    return max(window.fewest - model.fewer, 1), window.most + model.more


@compiled_inline
def _judge(  # noqa: PLR0917 - a scan and a cluster in it
    ranges: NDArray[np.float32], flags: NDArray[np.bool_], beams: Beams, first: int, last: int, model: DetectorModel
) -> tuple[float, float, float, bool]:
    """Center and expected width of a cluster as the class of reflectors that fits best; whether it passes the filter.

    Without any reflector in the map, every cluster is a post of no radius that fails.
    """
    distance, bearing, likely, passed = math.nan, math.nan, math.nan, False
    least, width, slope, spread, rest = math.inf, last - first + 1, 0.0, 0.0, 0.0
    body = body_of(ranges, flags, beams, first, last, cluster_rule(model))
    for kind in range(len(model.radii)):
        radius = model.radii[kind]
        if model.flat[kind]:
            r, b, slope, spread, rest = plate(
                ranges, flags, beams.used, first, last, body, beams.angle_min, beams.increment
            )
        elif model.circle:
            r, b = circle_fit(
                ranges,
                flags,
                beams.used,
                first,
                last,
                body,
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
                    body[0],
                    body[1],
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
        distance, bearing, _, _, _ = plate(
            ranges, flags, beams.used, first, last, body, beams.angle_min, beams.increment
        )
    return distance, bearing, likely, passed


@compiled_inline
def _window(distance: float, tilt: Tilt, step: float, kind: int, model: DetectorModel) -> BeamWindow:
    """Beams that a class of reflectors shows at a distance; a plate as its ranges say that it stands.

    Of an unknown radius the window reaches from the smallest to the largest that it may be.
    """
    window = _window_of(distance, model.radii[kind], tilt, step, model.flat[kind], model)
    if model.smallest[kind] == model.largest[kind]:
        return window
    narrow = _window_of(distance, model.smallest[kind], tilt, step, model.flat[kind], model)
    wide = _window_of(distance, model.largest[kind], tilt, step, model.flat[kind], model)
    return BeamWindow(narrow.fewest, wide.most, window.likely)


@compiled_inline
def _window_of(  # noqa: PLR0917 - one size of a reflector
    distance: float, radius: float, tilt: Tilt, step: float, flat: bool, model: DetectorModel
) -> BeamWindow:
    """Beams that a reflector of one size shows."""
    if not model.by_width:
        return window_of_equation_3(distance, radius, flat, step)
    if flat:
        return window_of_plate(distance, radius, tilt, step, _beam(model))
    return window_of_cylinder(distance, radius, step, _beam(model))


@compiled_inline
def _beam(model: DetectorModel) -> BeamModel:
    """Width and noise of the beams."""
    return BeamModel(model.half_divergence, model.half_aperture, model.bearing_sigma, model.range_sigma)

"""A drive by bearings alone: dynamic triangulation (Alenya et al. 2005, section II), beside it a filter."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from commission.errors import UsageError
from commission.geometry import se2
from commission.geometry.arrays import FloatArray, IntArray, read_only
from commission.geometry.gaussian import chi_square_gate
from commission.localization.bearing_rows import bearing_row, correct_by_bearing, row_nis, whose
from commission.localization.dynamic_triangulation import DynamicTriangulation
from commission.localization.observation import ObservationModel
from commission.localization.odometry import odometry_noise, predict
from commission.localization.pose_gaussian import covariance_of, from_belief, mean_of
from commission.site.bearing_log import BearingLog
from commission.site.parameters import OdometryParameters
from commission.site.record_log import RecordLog
from commission.site.reflectors import ReflectorMap
from commission.studies.inputs import StudyInput
from commission.studies.metrics import reference_at
from commission.studies.reference_headings import in_radians
from commission.studies.start import Start

NOBODY = -1


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class TriangulationInput(StudyInput):
    """All that a drive by bearings depends on."""

    log: RecordLog
    """Its odometry."""
    bearings: BearingLog
    """Its reflexes."""
    start: Start
    """Pose before the first record."""
    reflectors: ReflectorMap
    """The map."""
    mounting: FloatArray
    """(3,) `T_base_scanner` of the goniometer [m, m, rad]."""
    odometry: OdometryParameters
    """Growth of odometry's uncertainty."""
    bearing_sigma: float
    """1-sigma of a bearing [rad]."""
    gate_probability: float = 0.999
    """Share of true bearings inside the gate."""
    rate: float = 8.0
    """Turns per second of the goniometer: a reflex is used for one and a half turns [Hz]."""
    reach: float = 30.0
    """Distance out to which it sees reflectors [m]."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class TriangulationResult:
    """Both estimates at each reflex."""

    stamps_ns: IntArray
    """(n,) of the reflexes [ns]."""
    landmarks: IntArray
    """(n,) reflector that each was taken for; -1: none."""
    nis: FloatArray
    """(n,) of the reflex before the filter used it, 1 degree of freedom; NaN where it is of nobody."""
    fixes: FloatArray
    """(n, 3) `T_map_base` by dynamic triangulation: the last fix moved along [m, m, rad]."""
    fix_covariances: FloatArray
    """(n, 3, 3) of a fix at this reflex; NaN where there is none."""
    chosen: IntArray
    """(n, 3) reflectors of the fix; -1 where there is none."""
    filtered: FloatArray
    """(n, 3) `T_map_base` by the filter [m, m, rad]."""
    filtered_covariances: FloatArray
    """(n, 3, 3) of that."""


def triangulate(inputs: TriangulationInput) -> TriangulationResult:
    """Localize a drive by bearings alone, both ways.

    Raises
    ------
    UsageError
        a reflex names a reflector that the map lacks, or the map has fewer than three.
    """
    count = len(inputs.bearings)
    places = _places(inputs)
    ids = {reflector.id: index for index, reflector in enumerate(inputs.reflectors.reflectors)}
    unknown = sorted({name for name in inputs.bearings.reflectors if name and name not in ids})
    if unknown:
        raise UsageError(f"bearings name the reflector {unknown[0]!r}, which the map lacks; expected its ids, or none")
    if len(ids) < 3:
        raise UsageError(f"the map has {len(ids)} reflectors; expected at least 3 to triangulate by")
    noise, gate = odometry_noise(inputs.odometry), chi_square_gate(inputs.gate_probability, 1)
    x, y, theta = (float(value) for value in inputs.mounting)
    model = ObservationModel(x, y, theta, math.inf, inputs.bearing_sigma**2, 0.0)
    paper = DynamicTriangulation(
        places[:, :2], inputs.mounting, inputs.bearing_sigma, noise=noise, memory=1.5 / inputs.rate
    )
    belief = from_belief(inputs.start.belief)
    paper.start(mean_of(belief))
    landmarks, nis = np.full(count, NOBODY), np.full(count, np.nan)
    fixes, spreads, chosen = np.empty((count, 3)), np.full((count, 3, 3), np.nan), np.full((count, 3), NOBODY)
    filtered, covariances = np.empty((count, 3)), np.empty((count, 3, 3))
    for index, moved, seconds in _steps(inputs.log, inputs.bearings.stamps_ns):
        if seconds > 0.0:
            paper.move(moved, seconds)
            belief = predict(belief, float(moved[0]), float(moved[1]), float(moved[2]), seconds, noise)
        if index == NOBODY:
            continue
        bearing, name = float(inputs.bearings.bearings[index]), inputs.bearings.reflectors[index]
        found = ids[name] if name else whose(belief, bearing, places, gate, inputs.reach, model)
        if found != NOBODY:
            row = bearing_row(belief, bearing, *places[found].tolist(), model)
            nis[index] = row_nis(belief, row)
            if nis[index] <= gate:
                landmarks[index] = found
                belief = correct_by_bearing(belief, row).belief
                fix = paper.reflex(found, int(inputs.bearings.stamps_ns[index]), bearing)
                if fix is not None:
                    spreads[index], chosen[index] = fix.covariance, fix.chosen
        fixes[index], filtered[index], covariances[index] = paper.pose, mean_of(belief), covariance_of(belief)
    return TriangulationResult(
        stamps_ns=inputs.bearings.stamps_ns,
        landmarks=read_only(landmarks),
        nis=read_only(nis),
        fixes=read_only(fixes),
        fix_covariances=read_only(spreads),
        chosen=read_only(chosen),
        filtered=read_only(filtered),
        filtered_covariances=read_only(covariances),
    )


def _places(inputs: TriangulationInput) -> FloatArray:
    """(N, 3) x, y and variance of each reflector's place."""
    own = [reflector.own_sigma**2 for reflector in inputs.reflectors.reflectors]
    return np.ascontiguousarray(np.column_stack([inputs.reflectors.centers.reshape(-1, 2), own]))


def _steps(log: RecordLog, reflex_ns: IntArray) -> Iterator[tuple[int, FloatArray, float]]:
    """Deliver reflexes in turn with the motion and time since the step before; motion behind the last reflex is left.

    A displacement that reflexes lie within is driven at constant speed and turn rate.
    """
    stamps, displacements = log.odometry_stamps_ns, log.displacements
    now = int(reflex_ns[0]) if len(stamps) == 0 else int(stamps[0])
    record, rest = 1, np.zeros(3) if len(stamps) < 2 else displacements[1]
    for index, stamp in enumerate(reflex_ns.tolist()):
        while record < len(stamps) and stamps[record] <= stamp:
            yield NOBODY, rest, (int(stamps[record]) - now) * 1e-9
            now = int(stamps[record])
            record += 1
            rest = displacements[record] if record < len(stamps) else np.zeros(3)
        if record >= len(stamps) or stamp <= now:
            yield index, np.zeros(3), max(stamp - now, 0) * 1e-9
            now = max(now, stamp)
            continue
        share = (stamp - now) / (int(stamps[record]) - now)
        part = se2.exp(share * se2.log(rest))
        yield index, part, (stamp - now) * 1e-9
        rest, now = se2.relative(part, rest), stamp


def summary(inputs: TriangulationInput, result: TriangulationResult) -> dict[str, float | int | None]:
    """Entries of `summary.json`; those of the reference only where there is one.

    Parameters
    ----------
    inputs, result : of the study.
    """
    fixed = result.chosen[:, 0] >= 0
    spread = np.trace(result.fix_covariances[fixed, :2, :2], axis1=1, axis2=2)
    entries: dict[str, float | int | None] = {
        "reflexes": len(result.stamps_ns),
        "of_nobody": int(np.count_nonzero(result.landmarks == NOBODY)),
        "fixes": int(np.count_nonzero(fixed)),
        "fix_sigma_m": float(np.sqrt(np.mean(spread))) if fixed.any() else None,
        "nis_mean": float(np.nanmean(result.nis)) if np.isfinite(result.nis).any() else None,
    }
    log = inputs.log
    truth = reference_at(result.stamps_ns, log.reference_times_ns, in_radians(log.reference_poses))
    for name, poses in (("fix", result.fixes), ("filter", result.filtered)):
        known = np.isfinite(truth[:, 0]) & (fixed if name == "fix" else True)
        if known.any():
            square = np.square(poses[known, :2] - truth[known, :2]).sum(axis=1)
            entries[f"{name}_position_rmse_m"] = float(np.sqrt(np.mean(square)))
    return entries

"""Associate a scan by any method: by itself, or with those before it, where the run may go on from another pose."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from commission.compiled import compiled, compiled_inline
from commission.geometry.arrays import FloatArray, IntArray
from commission.geometry.directions import UnitVector, composed, direction_of
from commission.localization.association import INLIER, NOBODY, OUTLIER_ASSOCIATION, Gate, associate, score
from commission.localization.consider import BLOCKS, Considering
from commission.localization.consider_columns import begin, take_out
from commission.localization.estimate import Status
from commission.localization.observation import ObservationModel
from commission.localization.pose_gaussian import PoseGaussian
from commission.localization.reflector_index import Cells
from commission.localization.rival_poses import RivalPoses
from commission.localization.search import viewpoint
from commission.localization.several_scans import Mix, decide_over_scans, forget, mixed, no_mix

OUTLIER_DETECTOR = int(Status.OUTLIER_DETECTOR)


class Associated(NamedTuple):
    """What a scan is corrected from."""

    prior: PoseGaussian
    facing: UnitVector
    given: Considering | None
    mix: Mix
    """What is to be added once it is corrected."""


@compiled_inline
def prepare(  # noqa: PLR0917 - the scan's detections, array by array
    cross: FloatArray | None,
    given: Considering | None,
    work: FloatArray | None,
    aims: FloatArray,
    first: int,
    last: int,
    detections: FloatArray,
    observation: ObservationModel,
    reflectors: int,
    scanner: int,
) -> None:
    """Write what a scan is worked out from.

    Parameters
    ----------
    cross, given : covariance with the constants, and what the detections of the scan have in common, or None.
    work, aims : written; no work: none is considered.
    first, last, detections, observation, scanner : as in `corrected`.
    reflectors : N of the map.

    Notes
    -----
    aim = (cos, sin) of mount + bearing, by definition: all sines and cosines of a scan but those of the heading. The
    third column of `aims` is for where in `work` the reflector of a detection is.
    """
    for i in range(first, last):
        aim = direction_of(observation.mount_theta + detections[i, 1])
        aims[i - first, 0], aims[i - first, 1] = aim
    if cross is not None and given is not None and work is not None:
        begin(work, cross, given, reflectors, scanner)


@compiled_inline
def associate_by(  # noqa: PLR0917 - outputs are written into the arrays of the whole run
    rivals: RivalPoses | None,
    corrects: bool,
    prior: PoseGaussian,
    facing: UnitVector,
    first: int,
    last: int,
    detections: FloatArray,
    aims: FloatArray,
    model: ObservationModel,
    gate: Gate,
    cells: Cells,
    places: FloatArray,
    cell_offsets: IntArray,
    cross: FloatArray | None,
    given: Considering | None,
    work: FloatArray | None,
    scanner: int,
    status: NDArray[np.int8],
    entries: IntArray,
    d2: FloatArray,
) -> Associated:
    """Associate the detections of one scan; where that is decided over several, the pose may be another one.

    Parameters
    ----------
    rivals : where the vehicle may stand as well, in and out; None: scans are decided on one by one.
    corrects : whether reflectors correct the pose here; where not, there are no rivals.
    prior, facing : after *predict*, and the direction of its heading.
    first, last, detections, aims, model, gate, cells, places, cell_offsets : as in `associate`.
    cross, given, work : of the scan, where constants are considered, else None; zero of another pose.
    scanner : index of the scan's scanner.
    status, entries, d2 : as in `associate`.

    Notes
    -----
    No formula: `decide_over_scans`, else `associate` alone.
    """
    if rivals is None:
        associate(
            prior,
            facing,
            first,
            last,
            detections,
            aims,
            model,
            gate,
            cells,
            places,
            cell_offsets,
            cross,
            given,
            work,
            status,
            entries,
            d2,
        )
        return Associated(prior, facing, given, no_mix())
    return _over_scans(
        rivals,
        corrects,
        prior,
        facing,
        first,
        last,
        detections,
        aims,
        model,
        gate,
        cells,
        places,
        cell_offsets,
        cross,
        given,
        work,
        scanner,
        status,
        entries,
        d2,
    )


@compiled
def _over_scans(  # noqa: PLR0917 - outputs are written into the arrays of the whole run
    rivals: RivalPoses,
    corrects: bool,
    prior: PoseGaussian,
    facing: UnitVector,
    first: int,
    last: int,
    detections: FloatArray,
    aims: FloatArray,
    model: ObservationModel,
    gate: Gate,
    cells: Cells,
    places: FloatArray,
    cell_offsets: IntArray,
    cross: FloatArray | None,
    given: Considering | None,
    work: FloatArray | None,
    scanner: int,
    status: NDArray[np.int8],
    entries: IntArray,
    d2: FloatArray,
) -> Associated:
    """`associate_by`, over several scans; each distance is that of the scan alone, at the pose that is gone on from."""
    decided, mix = corrects and gate.enabled, no_mix()
    chosen = np.full(last - first, NOBODY)
    if decided:
        decision = decide_over_scans(
            rivals,
            prior,
            first,
            last,
            detections,
            aims,
            status,
            model,
            gate.d2,
            cells,
            places,
            cell_offsets,
            given,
            chosen,
        )
        prior, mix = decision.prior, decision.mix
        if decision.is_other:
            facing = direction_of(prior.theta)
            given = _anew(cross, given, work, len(places), scanner)
    else:
        forget(rivals)
    associate(
        prior,
        facing,
        first,
        last,
        detections,
        aims,
        model,
        gate,
        cells,
        places,
        cell_offsets,
        cross,
        given,
        work,
        status,
        entries,
        d2,
    )
    if decided:
        view = viewpoint(prior, facing, model)
        for i in range(first, last):
            entry = chosen[i - first]
            if status[i] == OUTLIER_DETECTOR:
                continue
            if entry != NOBODY and entry != entries[i]:
                if cross is not None and given is not None and work is not None:
                    take_out(work, BLOCKS, cross, entry, given)
                measured = detections[i, 0] - model.range_bias
                aim = UnitVector(aims[i - first, 0], aims[i - first, 1])
                x, y, variance = places[entry, 0], places[entry, 1], places[entry, 2]
                ray, entries[i] = composed(facing, aim), entry
                d2[i], _ = score(gate.kind, prior, facing, measured, ray, aim, x, y, variance, view, model, given, work)
            # What poses are told apart by takes the constants for noise: the gate of a scan knows better.
            status[i] = INLIER if entry != NOBODY and d2[i] <= gate.d2 else OUTLIER_ASSOCIATION
    return Associated(prior, facing, given, mix)


@compiled_inline
def _anew(
    cross: FloatArray | None, given: Considering | None, work: FloatArray | None, reflectors: int, scanner: int
) -> Considering | None:
    """Let a pose have nothing to do with the constants: one that the run goes on from has none of its own."""
    if cross is None or given is None or work is None:
        return given
    cross[:] = 0.0
    still = Considering(given.variances, 0.0, 0.0, given.speed_x, given.speed_y, given.turn_rate)
    begin(work, cross, still, reflectors, scanner)
    return still


@compiled_inline
def with_mix(rivals: RivalPoses | None, belief: PoseGaussian, mix: Mix) -> PoseGaussian:
    """Belief after the detections of a scan and what other poses that have become one with it add.

    Parameters
    ----------
    rivals : as in `associate_by`.
    belief : after the detections.
    mix : of the scan.

    Notes
    -----
    No formula: `mixed`.
    """
    return belief if rivals is None else mixed(belief, mix)

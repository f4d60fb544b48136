"""Associate a scan by any method: by itself, or with those before it, where the run may go on from another pose."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from commission.compiled import compiled, compiled_inline
from commission.geometry.directions import UnitVector, composed, direction_of
from commission.localization.association import INLIER, NOBODY, OUTLIER_ASSOCIATION, Gate, associate, score
from commission.localization.consider import BLOCKS, Considering
from commission.localization.consider_columns import begin, take_out
from commission.localization.estimate import Status
from commission.localization.observation import ObservationModel
from commission.localization.pose_gaussian import PoseGaussian
from commission.localization.reflector_index import ReflectorIndex
from commission.localization.rival_poses import RivalPoses
from commission.localization.scan_rows import ScanRows
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
def prepare(
    rows: ScanRows, observation: ObservationModel, given: Considering | None, reflectors: int, scanner: int
) -> None:
    """Write what a scan is worked out from.

    Parameters
    ----------
    rows : the scan's detections, whose `aims` are written.
    observation : mounting of the scanner.
    given : what the detections have in common, whose working array is begun; None: no constants are considered.
    reflectors : N of the map.
    scanner : index of the scanner.

    Notes
    -----
    aim = (cos, sin) of mount + bearing, by definition: all sines and cosines of a scan but those of the heading.
    """
    for i in range(rows.first, rows.last):
        aim = direction_of(observation.mount_theta + rows.measured[i, 1])
        rows.aims[i - rows.first, 0], rows.aims[i - rows.first, 1] = aim
    begin(given, reflectors, scanner)


@compiled_inline
def associate_by(  # noqa: PLR0917 - a scan at a belief
    rivals: RivalPoses | None,
    corrects: bool,
    prior: PoseGaussian,
    facing: UnitVector,
    rows: ScanRows,
    model: ObservationModel,
    gate: Gate,
    index: ReflectorIndex,
    given: Considering | None,
    scanner: int,
) -> Associated:
    """Associate the detections of one scan; where that is decided over several, the pose may be another one.

    Parameters
    ----------
    rivals : where the vehicle may stand as well, in and out; None: scans are decided on one by one.
    corrects : whether reflectors correct the pose here; where not, there are no rivals.
    prior, facing : after *predict*, and the direction of its heading.
    rows, model, gate, index : as in `associate`.
    given : of the scan, where constants are considered, else None; of another pose, it has nothing to do with them.
    scanner : index of the scan's scanner.

    Notes
    -----
    No formula: `decide_over_scans`, else `associate` alone.
    """
    if rivals is None:
        associate(prior, facing, rows, model, gate, index, given)
        return Associated(prior, facing, given, no_mix())
    return _over_scans(rivals, corrects, prior, facing, rows, model, gate, index, given, scanner)


@compiled
def _over_scans(  # noqa: PLR0917 - a scan at several poses
    rivals: RivalPoses,
    corrects: bool,
    prior: PoseGaussian,
    facing: UnitVector,
    rows: ScanRows,
    model: ObservationModel,
    gate: Gate,
    index: ReflectorIndex,
    given: Considering | None,
    scanner: int,
) -> Associated:
    """`associate_by`, over several scans; each distance is that of the scan alone, at the pose that is gone on from."""
    first, last, measured, aims, status, entries, d2 = rows
    decided, mix = corrects and gate.enabled, no_mix()
    chosen = np.full(last - first, NOBODY)
    if decided:
        decision = decide_over_scans(rivals, prior, rows, model, gate.d2, index, given, chosen)
        prior, mix = decision.prior, decision.mix
        if decision.is_other:
            facing = direction_of(prior.theta)
            given = _anew(given, len(index.places), scanner)
    else:
        forget(rivals)
    associate(prior, facing, rows, model, gate, index, given)
    if decided:
        view = viewpoint(prior, facing, model)
        for i in range(first, last):
            entry = chosen[i - first]
            if status[i] == OUTLIER_DETECTOR:
                continue
            if entry != NOBODY and entry != entries[i]:
                take_out(given, BLOCKS, entry)
                distance, aim = measured[i, 0] - model.range_bias, UnitVector(aims[i - first, 0], aims[i - first, 1])
                x, y, variance = index.places[entry, 0], index.places[entry, 1], index.places[entry, 2]
                ray, entries[i] = composed(facing, aim), entry
                d2[i], _ = score(gate.kind, prior, facing, distance, ray, aim, x, y, variance, view, model, given)
            # What poses are told apart by takes the constants for noise: the gate of a scan knows better.
            status[i] = INLIER if entry != NOBODY and d2[i] <= gate.d2 else OUTLIER_ASSOCIATION
    return Associated(prior, facing, given, mix)


@compiled_inline
def _anew(given: Considering | None, reflectors: int, scanner: int) -> Considering | None:
    """Let a pose have nothing to do with the constants: one that the run goes on from has none of its own."""
    if given is None:
        return None
    given.room.cross[:] = 0.0
    still = Considering(given.variances, 0.0, 0.0, given.speed_x, given.speed_y, given.turn_rate, given.room)
    begin(still, reflectors, scanner)
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

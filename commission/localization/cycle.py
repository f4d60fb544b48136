"""One cycle of the localizer: the scan's stamp is reached, its detections are associated, corrected and supervised.

The one implementation of the cycle: `Localizer.feed` calls it per record and `whole_run` in a compiled loop, so that
live, replay and simulation agree to the last bit. From a state and a record to the state after it; nothing is kept.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from commission.compiled import compiled_inline
from commission.geometry.arrays import FloatArray, IntArray
from commission.localization.association import INLIER, NOBODY, associate
from commission.localization.kalman import correct
from commission.localization.observation import ObservationModel
from commission.localization.odometry import NextOdometry, OdometryNoise, advance, reach
from commission.localization.pose_gaussian import PoseGaussian
from commission.localization.rejection import rejects_the_world, weigh
from commission.localization.setup import FilterModel
from commission.localization.state import FilterState
from commission.localization.supervisor import FAIL, LOST, OPERATIONAL, supervise


class Cycle(NamedTuple):
    """State after a scan, and the belief just before its detections were used."""

    prior: PoseGaussian
    state: FilterState


@compiled_inline
def process_odometry(  # noqa: PLR0917 - one odometry record, number by number
    state: FilterState, stamp_ns: int, dx: float, dy: float, dtheta: float, noise: OdometryNoise
) -> FilterState:
    """Predict over the motion of an odometry record: `advance`, in the filter's state.

    Parameters
    ----------
    state : before the record.
    stamp_ns : of the record [ns].
    dx, dy, dtheta : its displacement [m, m, rad].
    noise : variances per metre, radian and second.
    """
    belief, motion = advance(state.belief, state.motion, stamp_ns, dx, dy, dtheta, noise)
    return FilterState(
        belief,
        stamp_ns,
        motion,
        state.mode,
        state.evidence,
        state.output,
        state.output_ns,
        stamp_ns,
        state.sensor_detects,
    )


@compiled_inline
def process_scan(  # noqa: PLR0917 - outputs are written into the arrays of the whole run
    state: FilterState,
    stamp_ns: int,
    first: int,
    last: int,
    detections: FloatArray,
    model: FilterModel,
    observation: ObservationModel,
    places: FloatArray,
    cell_offsets: IntArray,
    status: NDArray[np.int8],
    reflectors: IntArray,
    d2: FloatArray,
    following: NextOdometry,
) -> Cycle:
    """Process the detections of a scan.

    Parameters
    ----------
    state : after everything before this scan.
    stamp_ns : of the scan [ns].
    first, last : rows of the scan's detections, the last one excluded.
    detections : (n, 2) measured range [m] and bearing [rad], scanner frame.
    model : of the whole filter.
    observation : mounting and noise of the scan's scanner.
    places, cell_offsets : the map, see `ReflectorIndex`.
    status : (n,) in: INLIER or OUTLIER_DETECTOR; out: a `Status`.
    reflectors : (n,) out: index into the reflector map, or -1.
    d2 : (n,) out: squared Mahalanobis distance at the prior, NaN for none.
    following : the odometry record at or after the scan, where it is known.

    Notes
    -----
    No formula: `reach`, `associate`, `correct` and `supervise` in turn: Sobreira et al. 2016, Algorithms 1, 3 and 4;
    then the rule by rejections, which overrules it.
    """
    prior, motion = reach(state.belief, state.motion, stamp_ns, following, model.odometry)
    associate(
        prior,
        first,
        last,
        detections,
        observation,
        model.gate,
        model.cells,
        places,
        cell_offsets,
        status,
        reflectors,
        d2,
    )
    posterior = prior
    for i in range(first, last):
        entry = int(reflectors[i])
        if entry == NOBODY:
            continue
        if status[i] == INLIER:
            posterior = correct(
                posterior,
                detections[i, 0] - observation.range_bias,
                detections[i, 1],
                places[entry, 0],
                places[entry, 1],
                places[entry, 2],
                observation,
            )
        reflectors[i] = int(places[entry, 3])
    evidence = weigh(
        state.evidence,
        stamp_ns,
        prior,
        first,
        last,
        detections,
        observation,
        model.cells,
        places,
        cell_offsets,
        status,
        model.rejection,
    )
    was_lost = state.mode == LOST
    mode = supervise(FAIL if was_lost else state.mode, posterior, model.limits)
    if rejects_the_world(was_lost, evidence, model.rejection):
        mode = LOST
    output, output_ns = state.output, state.output_ns
    if mode == OPERATIONAL:
        output, output_ns = posterior, stamp_ns
    return Cycle(
        prior,
        FilterState(posterior, stamp_ns, motion, mode, evidence, output, output_ns, stamp_ns, state.sensor_detects),
    )

"""What the consistency of a run says looks wrong, in words: lost from when on and for how long, noise misstated."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from commission.geometry.arrays import FloatArray
from commission.geometry.stretches import stretches_of
from commission.localization.estimate import Mode, Status
from commission.localization.run_columns import RunColumns
from commission.site.quantity import PERCENT
from commission.studies.consistency import has_distance
from commission.studies.plausibility import Finding

LOST_FOR_S = 1.0
"""Shortest time of being lost that is told: no shorter one stops a drive for long."""
LOST_WINDOW_S = 5.0
LOST_SHARE = 0.4
"""Accepted share over a window of 5 s below which the vehicle is probably lost [0..1]."""
TOO_SMALL, TOO_LARGE = 1.25, 0.25
"""How much larger, or smaller, innovations are than the filter says before it is told. A drive is one draw of constants
that the filter considers: the bundled sites have 0.52 to 0.95, a vehicle far better than the defaults 0.3."""
LARGEST = 2.5
"""Beyond that factor half of all detections are rejected: what is wrong then is not the noise."""
SAME_SHAPE = 0.05
"""How far the shares beyond the gate, and beyond twice that, may be from those of a Gaussian so much wider [0..1]:
false detections lie farther off."""
FEWEST = 200
"""Detections below which their median says nothing."""
_MEDIAN = 2.0 * math.log(2.0)
"""Median of a chi-square of 2 degrees of freedom."""


def consistency_findings(run: RunColumns) -> tuple[Finding, ...]:
    """Say what looks wrong about a run, from what it accepted and rejected alone.

    Parameters
    ----------
    run : the run.

    Returns
    -------
    findings : none where nothing looks wrong.
    """
    return (*lost_findings(run), *noise_findings(run))


def lost_findings(run: RunColumns) -> tuple[Finding, ...]:
    """Say when most detections fit no reflector: first, for how long in all, and longest."""
    judged = run.counts(Status.INLIER) + run.counts(Status.OUTLIER_ASSOCIATION)
    accepted = run.counts(Status.INLIER)
    if not judged.sum():
        return ()
    times = np.asarray((run.stamps_ns - run.stamps_ns[0]) * 1e-9, dtype=np.float64)
    first = np.searchsorted(times, times - LOST_WINDOW_S)
    sums = [np.concatenate(([0], np.cumsum(counts))) for counts in (accepted, judged)]
    good, all_ = (total[1:] - total[first] for total in sums)
    misfits = ((all_ > 0) & (good < LOST_SHARE * all_)) | (run.modes == Mode.LOST)
    stretches = [(begin, after - 1) for begin, after in stretches_of(misfits).tolist()]
    stretches = [each for each in stretches if times[each[1]] - times[each[0]] >= LOST_FOR_S or len(run) - 1 in each]
    return tuple(_lost(run, times, np.array(stretches))) if stretches else ()


def _lost(run: RunColumns, times: FloatArray, stretches: np.ndarray) -> Iterator[Finding]:
    """Tell of the stretches (S, 2), first and last cycle of each."""
    lengths = times[stretches[:, 1]] - times[stretches[:, 0]]
    inside = np.zeros(len(run), dtype=np.bool_)
    for begin, end in stretches.tolist():
        inside[begin : end + 1] = True
    accepted, rejected = (
        int(run.counts(status)[inside].sum()) for status in (Status.INLIER, Status.OUTLIER_ASSOCIATION)
    )
    begins, ends = times[stretches].T
    longest = int(np.argmax(lengths))
    to_the_end = stretches[-1, 1] == len(run) - 1
    share = PERCENT.text(rejected / max(1, accepted + rejected))
    where = f"from {begins[0]:.1f} s on"
    if len(stretches) > 1 or not to_the_end:
        where = (
            f"in {lengths.sum():.1f} s ({PERCENT.text(lengths.sum() / max(times[-1], 1e-9))} of the drive), first at "
            f"{begins[0]:.1f} s, the longest time from {begins[longest]:.1f} to {ends[longest]:.1f} s"
        ) + (f", and to the end from {begins[-1]:.1f} s on" if to_the_end and longest != len(stretches) - 1 else "")
    yield Finding(
        found=f"{share} of the detections are rejected {where}",
        probably="the vehicle is lost there, whatever its covariance says, or most of what it detects is no reflector",
        remedy="look at what happens just before the first time; odometry or detections may be noisier than the "
        "parameters say",
    )


def noise_findings(run: RunColumns) -> tuple[Finding, ...]:
    """Say by how much innovations are larger or smaller than the filter says, where their shape is that of noise."""
    gates = {segment.setup.filter.gate for segment in run.segments}
    if len(gates) > 1:
        return ()
    (gate,) = gates
    known = has_distance(run)
    if np.count_nonzero(known) < FEWEST:
        return ()
    # The median, as a few false detections do not move it. Of innovations that are f times as wide it is f^2 as large,
    # and the share beyond a gate g is exp(-g / 2 f^2), beyond twice that its square.
    factor = math.sqrt(float(np.median(run.d2[known])) / _MEDIAN)
    is_told = TOO_SMALL < factor <= LARGEST or 0.0 < factor < TOO_LARGE
    if not is_told:
        return ()
    rejected = float(np.mean(run.status[known] == Status.OUTLIER_ASSOCIATION))
    for bound in (gate.d2, 2.0 * gate.d2):
        beyond = float(np.mean(run.d2[known] > bound))
        if abs(beyond - math.exp(-0.5 * bound / factor**2)) > SAME_SHAPE:
            return ()
    which, cure = ("small", "larger") if factor > 1.0 else ("large", "smaller")
    return (
        Finding(
            found=f"detections lie {factor:.2f} times as far from where they are expected as the filter says, "
            f"{PERCENT.text(rejected, '.1f')} are rejected",
            probably=f"noise of scanner and odometry, and constants, are stated too {which}, by about a factor of "
            f"{factor:.2f} together",
            remedy=f"{cure} observation.range_sigma and observation.bearing_sigma (or the scanners' own noise of "
            "detections), odometry or uncertainty, as data sheets and survey say",
        ),
    )

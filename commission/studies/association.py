"""One reflector of one scan under the glass: gate, innovation, rivals, beams, and its last innovations. No drawing.

Everything is laid on the floor as `laid_on_the_floor` does it, a metre of range along the ray and a radian of bearing
across it: there a detection lies inside the gate's ellipse exactly if its d2 is at most the gate.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from commission.geometry import se2
from commission.geometry.angles import wrap
from commission.geometry.arrays import FloatArray, IntArray
from commission.geometry.gaussian import mahalanobis_squared
from commission.localization.detector import passing_widths
from commission.localization.detector_model import class_of
from commission.localization.estimate import Estimate, Status
from commission.localization.observation import SMALLEST_RANGE, range_bearing, residuals
from commission.localization.run_columns import RunColumns
from commission.localization.setup import LocalizerSetup
from commission.site.reflectors import Reflector

CLOUD = 200
"""Innovations of the cloud: the last ones of the reflector."""
LOOKED_BACK = 16_384
"""Cycles before the cursor in which they are sought: 27 minutes at 10 Hz."""
LARGEST_EXPONENT = 700.0
"""The exponential of more is beyond what a float holds."""
NEAR = 4.0
"""Gates, in d2, within which another reflector is a rival, and a detection that is taken for nobody is told."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class AssociationInput:
    """What the study may read."""

    columns: RunColumns
    """The run."""
    cycle: int
    """The scan."""
    estimate: Estimate
    """That cycle of the columns."""
    covariances: FloatArray
    """(N, 2, 2) `validation_ellipses` of the scan: 1-sigma regions of all reflectors on the floor [m^2], map axes."""
    reflector: str = ""
    """Id of the reflector that is looked at; empty: the worst of the scan."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class JudgedDetection:
    """A detection beside the reflector that is looked at."""

    offset: FloatArray
    """(2,) from the reflector to where the belief before the scan sees it [m], map axes."""
    corrected: FloatArray
    """(2,) the same, seen from the belief after the scan [m]."""
    along: float
    """Innovation of the range: along the ray [m]."""
    across: float
    """Innovation of the bearing at the reflector's distance: across the ray, to the left [m]."""
    bearing: float
    """Innovation of the bearing [rad]."""
    measured: tuple[float, float]
    """Range, without the bias that is known of it [m], and bearing [rad] at the stamp, scanner frame."""
    d2: float
    """Squared Mahalanobis distance to the reflector: of one that is taken for it, the filter's own."""
    status: Status
    """What became of it."""
    taken_for: str
    """Id of the reflector that it is taken for; empty: none."""
    beams: int
    """Width of its cluster [beams]; 0: the sensor itself detected."""
    expected_beams: float
    """Width that the likeliest kind of reflector has there [beams]; NaN: nobody knows."""

    @property
    def length(self) -> float:
        """Length of the innovation [m]."""
        return float(np.hypot(*self.offset))


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Rival:
    """Another reflector for which the detection might be taken."""

    reflector: Reflector
    """It."""
    offset: FloatArray
    """(2,) from the reflector that is looked at to it [m], map axes."""
    covariance: FloatArray
    """(2, 2) its 1-sigma region on the floor [m^2]."""
    d2: float
    """Squared Mahalanobis distance of the detection to it."""
    likelihood: float
    """Likelihood of the detection as one of it, divided by that as one of the reflector that is looked at."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Cloud:
    """The last innovations of a reflector, accepted or not: a spread of the accepted alone would be cut by the gate."""

    points: FloatArray
    """(n, 2) along and across the ray of its own scan [m], the newest last."""
    accepted: int
    """How many of them were inliers."""
    is_whole: bool
    """Whether there are CLOUD of them, or no more since the drive began."""

    @property
    def mean(self) -> FloatArray:
        """(2,) along and across [m]; NaN without any."""
        return self.points.mean(axis=0) if len(self.points) else np.full(2, np.nan)

    @property
    def covariance(self) -> FloatArray:
        """(2, 2) along and across, of the sample [m^2]; NaN of fewer than two."""
        return np.cov(self.points.T) if len(self.points) > 1 else np.full((2, 2), np.nan)


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Association:
    """A reflector in a scan, in numbers."""

    reflector: Reflector
    """Which one."""
    is_worst: bool
    """Whether it was chosen since its detection has the largest d2 of the scan."""
    estimate: Estimate
    """The scan."""
    predicted: tuple[float, float]
    """Range [m] and bearing [rad] that were expected, scanner frame."""
    along: FloatArray
    """(2,) unit vector from the scanner to the reflector, map axes."""
    covariance: FloatArray
    """(2, 2) 1-sigma region on the floor in which its detection was expected [m^2], map axes."""
    probability: float
    """Probability of the gate."""
    detection: JudgedDetection | None
    """Its detection; none: it was not seen in this scan."""
    widths: tuple[int, int] | None
    """Fewest and most beams with which it passes the detector filter there; none: the filter is off."""
    others: FloatArray
    """(M, 2) from the reflector to the other detections of the scan [m], map axes."""
    rivals: tuple[Rival, ...]
    """Other reflectors near the detection, the likeliest first."""
    cloud: Cloud
    """Its last innovations up to this scan."""

    @property
    def across(self) -> FloatArray:
        """(2,) unit vector across the ray, to the left, map axes."""
        return np.array([-self.along[1], self.along[0]])

    @property
    def axes(self) -> FloatArray:
        """(2, 2) columns along and across: from these to map axes."""
        return np.stack([self.along, self.across], axis=1)

    @property
    def sigmas(self) -> tuple[float, float]:
        """1-sigma along and across the ray that the filter expects of the innovation [m]."""
        variances = np.einsum("ij,ik,kj->j", self.axes, self.covariance, self.axes)
        return float(np.sqrt(variances[0])), float(np.sqrt(variances[1]))


def association(given: AssociationInput) -> Association | None:
    """Look at one reflector of one scan.

    Parameters
    ----------
    given : run, scan and reflector.

    Returns
    -------
    association : None where the reflector is not in the map of that scan, or none is named and none was detected.

    Notes
    -----
    o = [u, r w] v with v the innovation, u along and w across the ray, r the expected range: what `laid_on_the_floor`
    does to S is done to v, so that o^T M^-1 o = v^T S^-1 v. Derived.
    """
    estimate, setup = given.estimate, given.columns.segment(given.cycle).setup
    index = index_of(setup, given.reflector) if given.reflector else worst_of(estimate)
    if index is None:
        return None
    sight = _sight_of(estimate, setup)
    reflector, covariance = setup.reflectors.reflectors[index], given.covariances[index]
    offsets = sight.offsets(index)
    row = _detection_of(estimate, mahalanobis_squared(offsets, covariance), index)
    others = offsets if row is None else np.delete(offsets, row, axis=0)
    expected_range, expected_bearing = sight.expected[index].tolist()
    return Association(
        reflector=reflector,
        is_worst=not given.reflector,
        estimate=estimate,
        predicted=(expected_range, expected_bearing),
        along=sight.rays[index],
        covariance=covariance,
        probability=setup.parameters.association.gate_probability,
        detection=None if row is None else _judged(given, setup, sight, (row, index)),
        widths=_widths(setup, estimate.scanner, reflector, expected_range),
        others=others,
        rivals=() if row is None else _rivals(given, setup, sight, (row, index)),
        cloud=last_innovations(given.columns, given.cycle, reflector.id),
    )


def worst_of(estimate: Estimate) -> int | None:
    """Index of the reflector whose detection has the largest d2 of a scan; None: none lies near a reflector."""
    near = (estimate.reflector >= 0) & np.isfinite(estimate.d2)
    return int(estimate.reflector[near][np.argmax(estimate.d2[near])]) if near.any() else None


def index_of(setup: LocalizerSetup, wanted: str) -> int | None:
    """Index of a reflector in the map of a setup by its id; None: it is not in it."""
    each = enumerate(setup.reflectors.reflectors)
    return next((index for index, reflector in each if reflector.id == wanted), None)


def last_innovations(columns: RunColumns, cycle: int, reflector: str) -> Cloud:
    """Return the last innovations of a reflector up to a cycle.

    Parameters
    ----------
    columns : of the run.
    cycle : the last one that counts; the LOOKED_BACK before it are looked at.
    reflector : its id; of a segment whose map has none of that name nothing counts.
    """
    first, end = max(0, cycle + 1 - LOOKED_BACK), cycle + 1
    rows, wanted = [np.empty(0, np.int64)], CLOUD
    for segment, last in zip(reversed(columns.segments), reversed((*columns.firsts[1:].tolist(), end)), strict=True):
        index, here = index_of(segment.setup, reflector), (max(segment.first, first), min(last, end))
        if index is None or here[0] >= here[1] or wanted <= 0:
            continue
        start, stop = columns.offsets[here[0]], columns.offsets[here[1]]
        rows.insert(0, start + np.flatnonzero(columns.reflector[start:stop] == index)[-wanted:])
        wanted -= len(rows[0])
    chosen = np.concatenate(rows)
    return Cloud(
        points=innovations_of(columns, chosen),
        accepted=int(np.count_nonzero(columns.status[chosen] == Status.INLIER)),
        is_whole=first == 0 or len(chosen) == CLOUD,
    )


def innovations_of(columns: RunColumns, rows: IntArray) -> FloatArray:
    """(n, 2) innovations of some detections along and across their rays [m], each of the belief before its scan.

    Parameters
    ----------
    columns : of the run.
    rows : (n,) ascending rows of detections that are taken for a reflector.
    """
    cycles = np.searchsorted(columns.offsets, rows, side="right") - 1
    found = np.empty((len(rows), 2))
    segments = np.searchsorted(columns.firsts, cycles, side="right") - 1
    scanners = columns.detected.scanners[cycles]
    for segment, scanner in sorted(set(zip(segments.tolist(), scanners.tolist(), strict=True))):
        here = (segments == segment) & (scanners == scanner)
        setup = columns.segments[segment].setup
        poses = np.array([columns.priors.at(cycle)[0] for cycle in cycles[here].tolist()])
        T_map_scanner = se2.compose(poses, setup.scanners[scanner].mounting)
        measured = columns.range_bearing[rows[here]] - (setup.observations[scanner].range_bias, 0.0)
        places = setup.reflectors.centers[columns.reflector[rows[here]]]
        innovations, distances = residuals(T_map_scanner, places, measured)
        found[here] = np.stack((innovations[:, 0], distances * innovations[:, 1]), axis=1)
    return found


class _Sight(NamedTuple):
    """All reflectors and all detections of a scan, as the belief before it sees them."""

    expected: FloatArray
    """(N, 2) range [m] and bearing [rad] of each reflector, scanner frame."""
    rays: FloatArray
    """(N, 2) unit vectors from the scanner to each, map axes."""
    seen: FloatArray
    """(M, 2) range, bias taken off [m], and bearing [rad] of each detection, scanner frame."""

    def innovations(self, reflector: int) -> FloatArray:
        """(M, 2) of each detection against a reflector: range [m], bearing [rad]."""
        difference = self.seen - self.expected[reflector]
        difference[:, 1] = wrap(difference[:, 1])
        return difference

    def offsets(self, reflector: int) -> FloatArray:
        """(M, 2) innovations laid on the floor [m], map axes."""
        u = self.rays[reflector]
        distance = max(float(self.expected[reflector, 0]), SMALLEST_RANGE)
        spread = np.array([[u[0], -distance * u[1]], [u[1], distance * u[0]]])
        return self.innovations(reflector) @ spread.T


def _sight_of(estimate: Estimate, setup: LocalizerSetup) -> _Sight:
    """Return what a scan shows from the belief before it."""
    mounting, model = setup.scanners[estimate.scanner].mounting, setup.observations[estimate.scanner]
    expected = range_bearing(estimate.prior.mean, mounting, setup.reflectors.centers)
    rays = setup.reflectors.centers - se2.compose(estimate.prior.mean, mounting)[:2]
    return _Sight(
        expected,
        rays / np.maximum(expected[:, :1], SMALLEST_RANGE),
        estimate.detections - (model.range_bias, 0.0),
    )


def _detection_of(estimate: Estimate, d2: FloatArray, reflector: int) -> int | None:
    """Row of the detection that is taken for a reflector, else of the nearest that is taken for none; None: none."""
    own = np.flatnonzero(estimate.reflector == reflector)
    accepted = own[estimate.status[own] == Status.INLIER]
    if len(own):
        among = accepted if len(accepted) else own
        return int(among[np.argmin(estimate.d2[among])])
    free = np.flatnonzero((estimate.reflector < 0) & (d2 <= NEAR * estimate.gate))
    return int(free[np.argmin(d2[free])]) if len(free) else None


def _judged(given: AssociationInput, setup: LocalizerSetup, sight: _Sight, pair: tuple[int, int]) -> JudgedDetection:
    """Return a detection beside a reflector, given as row and index."""
    (row, reflector), estimate = pair, given.estimate
    offset, innovation = sight.offsets(reflector)[row], sight.innovations(reflector)[row]
    taken = int(estimate.reflector[row])
    own = float(mahalanobis_squared(offset, given.covariances[reflector]))
    return JudgedDetection(
        offset=offset,
        corrected=estimate.points_map[row] - setup.reflectors.centers[reflector],
        along=float(innovation[0]),
        across=float(innovation[1] * sight.expected[reflector, 0]),
        bearing=float(innovation[1]),
        measured=(float(sight.seen[row, 0]), float(sight.seen[row, 1])),
        d2=float(estimate.d2[row]) if taken == reflector else own,
        status=Status(int(estimate.status[row])),
        taken_for=setup.reflectors.reflectors[taken].id if taken >= 0 else "",
        beams=int(estimate.beams[row]),
        expected_beams=float(estimate.expected_beams[row]),
    )


def _rivals(given: AssociationInput, setup: LocalizerSetup, sight: _Sight, pair: tuple[int, int]) -> tuple[Rival, ...]:
    """Return the other reflectors near a detection, given as row and index, the likeliest first."""
    (row, chosen), centers = pair, setup.reflectors.centers
    at = np.stack([sight.offsets(index)[row] for index in range(len(centers))])
    d2 = mahalanobis_squared(at, given.covariances)
    distances = np.maximum(sight.expected[:, 0], SMALLEST_RANGE)
    # The spread from innovations to the floor has the determinant r, its square is what M has more than S.
    log_likelihood = -0.5 * (d2 + np.log(np.linalg.det(given.covariances) / np.square(distances)))
    near = np.flatnonzero((d2 <= NEAR * given.estimate.gate) & (np.arange(len(centers)) != chosen))
    return tuple(
        Rival(
            reflector=setup.reflectors.reflectors[index],
            offset=centers[index] - centers[chosen],
            covariance=given.covariances[index],
            d2=float(d2[index]),
            likelihood=float(np.exp(min(log_likelihood[index] - log_likelihood[chosen], LARGEST_EXPONENT))),
        )
        for index in near[np.argsort(-log_likelihood[near], kind="stable")].tolist()
    )


def _widths(setup: LocalizerSetup, scanner: int, reflector: Reflector, distance: float) -> tuple[int, int] | None:
    """Fewest and most beams with which a reflector passes at a distance [m]."""
    model = setup.detectors[scanner]
    if not model.enabled:
        return None
    classes = sorted({class_of(each) for each in setup.reflectors.reflectors})
    kind = classes.index(class_of(reflector))
    return passing_widths(distance, setup.scanners[scanner].angle_increment, kind, model)

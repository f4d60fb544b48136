"""A run of the localizer as columns: a row per cycle, a row per detection. It holds what came out and computes no step.

Whoever makes them (`whole_run` at once, `growing_run` while the vehicle drives), the columns are the same.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from commission.geometry.arrays import FloatArray, IntArray
from commission.localization.detection_log import DetectionLog
from commission.localization.estimate import Belief, Estimate, Mode, SeenBearing, SeenTags, Status
from commission.localization.observation import project_detections
from commission.localization.priors import Priors
from commission.localization.search_state import SearchMoment
from commission.localization.setup import LocalizerSetup
from commission.localization.state import FilterState, belief_of, output_of


@dataclass(frozen=True, slots=True)
class RunSegment:
    """A stretch of a run with one setup: from a cycle on, until the next segment begins."""

    first: int
    """Its first cycle; what the odometry says between the cycle before and this one belongs to it, too."""
    setup: LocalizerSetup
    """Reflector map, scanner and parameters."""
    covered: bool = False
    """Whether all reflectors are covered: nothing is detected."""
    locate: bool = False
    """Whether the pose is thrown away where it begins: the vehicle looks where it is."""

    def __post_init__(self) -> None:
        if self.first < 0:
            raise ValueError(f"a segment begins at cycle {self.first}; expected 0 or more")


def firsts_of(segments: Sequence[RunSegment]) -> IntArray:
    """(S,) first cycle of each segment; raises ValueError unless they begin at cycle 0 and follow each other."""
    firsts = np.array([segment.first for segment in segments], dtype=np.int64)
    if not len(firsts) or firsts[0] != 0 or (np.diff(firsts) <= 0).any():
        raise ValueError(f"segments begin at cycles {firsts.tolist()}; expected 0, then ascending")
    return firsts


class Checkpoint(NamedTuple):
    """The filter's state just before a cycle and the odometry that leads to it."""

    cycle: int
    state: FilterState


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class RunColumns:
    """A run: K cycles (one per scan, frame or reflex) with n detections in total. All arrays are read-only."""

    segments: tuple[RunSegment, ...]
    """What it was made with; the first one begins at cycle 0, each later one after the one before."""
    checkpoints: tuple[Checkpoint, ...]
    """States along the way, the one before the first record first: `whole_run.state_before` resumes from them."""
    detected: DetectionLog
    """Stamps of the cycles, rows of their detections, and the detections as measured."""
    range_bearing: FloatArray
    """(n, 2) range [m] and bearing [rad] of each detection at the stamp of its scan, scanner frame, upright."""
    priors: Priors
    """Beliefs after *predict*."""
    means: FloatArray
    """(K, 3) `T_map_base` after *correct*: the filter's own state [m, m, rad]."""
    covariances: FloatArray
    """(K, 3, 3) after *correct*."""
    modes: NDArray[np.int8]
    """(K,) a `Mode` each."""
    status: NDArray[np.int8]
    """(n,) a `Status` each."""
    reflector: IntArray
    """(n,) index into the reflector map of its segment; -1: none."""
    d2: FloatArray
    """(n,) squared Mahalanobis distance to that reflector; NaN: none."""
    contours: FloatArray
    """(K, 15) what became of the contours of each cycle, see `contour`; (0, 15) where they are not looked at."""
    tags: FloatArray
    """(m, 6) what became of each sighting of a tag, see `tags`; (0, 6) where they are not looked at."""
    bearings: FloatArray
    """(b, 5) what became of each reflex of a goniometer, see `bearings`; (0, 5) where they are not looked at."""
    levels: FloatArray
    """(K, 2) protection level of position [m] and heading [rad] that the supervisor goes by: inf where the vehicle is
    lost or not located, NaN where it goes by 2-sigma; (0, 2) where it always does."""
    temporary: FloatArray
    """(K, 9) what became of temporary landmarks in each cycle, see `temporary`; (0, 9) where they are not looked at."""
    final: FilterState
    """State after the last record, odometry included."""
    searches: tuple[SearchMoment, ...] = ()
    """Hypotheses after each cycle at which the vehicle looked where it is, in the order of time."""
    firsts: IntArray = field(init=False, repr=False)
    """(S,) first cycle of each segment."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "firsts", firsts_of(self.segments))

    def __len__(self) -> int:
        """Return the number of cycles."""
        return len(self.detected)

    @property
    def initial(self) -> Belief:
        """Belief before the first record."""
        return belief_of(self.checkpoints[0].state)

    @property
    def stamps_ns(self) -> IntArray:
        """(K,) time of each scan [ns]."""
        return self.detected.stamps_ns

    @property
    def offsets(self) -> IntArray:
        """(K + 1,) detections of cycle k: offsets[k] to offsets[k + 1]."""
        return self.detected.offsets

    @property
    def beams(self) -> IntArray:
        """(n,) width of each cluster [beams]; 0 where the sensor itself detected."""
        return self.detected.beams

    @property
    def expected_beams(self) -> FloatArray:
        """(n,) width that the likeliest kind of reflector has there [beams]; NaN where nobody knows."""
        return self.detected.expected

    def segment(self, cycle: int) -> RunSegment:
        """Return the segment of a cycle."""
        return self.segments[int(np.searchsorted(self.firsts, cycle, side="right")) - 1]

    def search(self, cycle: int) -> SearchMoment | None:
        """Return the hypotheses after a cycle; None where the vehicle does not look where it is."""
        at = bisect_left(self.searches, cycle, key=lambda moment: moment.cycle)
        return self.searches[at] if at < len(self.searches) and self.searches[at].cycle == cycle else None

    def counts(self, status: Status) -> IntArray:
        """(K,) detections of one status in each cycle."""
        totals = np.zeros(len(self.status) + 1, dtype=np.int64)
        np.cumsum(self.status == status, out=totals[1:])
        return totals[self.offsets[1:]] - totals[self.offsets[:-1]]

    def points_map(self) -> FloatArray:
        """(n, 2) every detection seen from the posterior of its cycle [m], map frame."""
        ends = (*self.firsts[1:].tolist(), len(self))
        parts = [
            project_detections(
                self.means[segment.first : end],
                self.offsets[segment.first : end + 1] - self.offsets[segment.first],
                self.range_bearing[self.offsets[segment.first] : self.offsets[end]],
                segment.setup.observation_rows,
                scanners=self.detected.scanners[segment.first : end],
            )
            for segment, end in zip(self.segments, ends, strict=True)
        ]
        return parts[0] if len(parts) == 1 else np.concatenate(parts)

    def estimate(self, cycle: int) -> Estimate:
        """Return one cycle as `Localizer.feed` gives it, to the last bit."""
        setup = self.segment(cycle).setup
        stamp_ns = int(self.stamps_ns[cycle])
        rows = slice(int(self.offsets[cycle]), int(self.offsets[cycle + 1]))
        detections = self.range_bearing[rows]
        offsets = np.array((0, len(detections)), dtype=np.int64)
        points = project_detections(
            self.means[cycle : cycle + 1],
            offsets,
            detections,
            setup.observation_rows,
            scanners=self.detected.scanners[cycle : cycle + 1],
        )
        return Estimate(
            stamp_ns=stamp_ns,
            prior=Belief(stamp_ns, *self.priors.at(cycle)),
            posterior=self.belief(cycle),
            output=self._output(cycle),
            mode=Mode(int(self.modes[cycle])),
            detections=detections,
            measured=self.detected.range_bearing[rows],
            beams=self.beams[rows],
            expected_beams=self.expected_beams[rows],
            points_map=points,
            status=self.status[rows],
            reflector=self.reflector[rows],
            d2=self.d2[rows],
            gate=setup.filter.gate.d2,
            scanner=int(self.detected.scanners[cycle]),
            contours=self.contours[cycle] if setup.contour is not None and self.is_scan(cycle) else None,
            temporary=self.temporary[cycle] if setup.temporary is not None else None,
            tags=self._tags(cycle),
            bearing=self._bearing(cycle),
            levels=None if setup.protection is None else self.levels[cycle],
        )

    def is_frame(self, cycle: int) -> bool:
        """Whether a cycle is a frame of the camera that looks for tags, and no scan."""
        return self.detected.tags is not None and bool(self.detected.tags.is_frame[cycle])

    def is_reflex(self, cycle: int) -> bool:
        """Whether a cycle is a reflex of the goniometer, and no scan."""
        return self.detected.bearings is not None and bool(self.detected.bearings.is_reflex[cycle])

    @property
    def has_scans(self) -> bool:
        """Whether any cycle is a scan, or there are none at all."""
        is_scan = self.detected.is_scan
        return is_scan is None or bool(is_scan.any())

    def is_scan(self, cycle: int) -> bool:
        """Whether a cycle is a scan, and neither a frame nor a reflex."""
        return not self.is_frame(cycle) and not self.is_reflex(cycle)

    def _bearing(self, cycle: int) -> SeenBearing | None:
        """Return what a reflex told, and what became of it; None of a scan."""
        met = self.detected.bearings
        if met is None or not self.is_reflex(cycle):
            return None
        row = met.rows_before(cycle)
        figures = self.bearings[row] if self.segment(cycle).setup.bearing_model is not None else None
        return SeenBearing(float(met.bearings[row]), met.reflectors[row], figures)

    def _tags(self, cycle: int) -> SeenTags | None:
        """Return what a frame saw of tags, and what became of it; None of a scan."""
        seen = self.detected.tags
        if seen is None or not self.is_frame(cycle):
            return None
        rows = slice(int(seen.offsets[cycle]), int(seen.offsets[cycle + 1]))
        figures = self.tags[rows] if self.segment(cycle).setup.tag_model is not None else None
        return SeenTags(seen.sightings[rows], tuple(seen.ids[rows].tolist()), figures)

    def belief(self, cycle: int) -> Belief:
        """Return the filter's own belief after a cycle."""
        return Belief(int(self.stamps_ns[cycle]), self.means[cycle], self.covariances[cycle])

    def _output(self, cycle: int) -> Belief:
        """Return what the vehicle is given after a cycle: the belief of the last operational one."""
        operational = self.modes[cycle::-1] == Mode.OPERATIONAL
        back = int(np.argmax(operational))
        return self.belief(cycle - back) if operational[back] else output_of(self.checkpoints[0].state)

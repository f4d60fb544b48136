"""What each reflector of the map contributed to a drive: how often it should be seen and was, and how well it fits.

Expected is what the floor map promises from the estimated pose: where the estimate is wrong, so is that.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Self

import numpy as np
from scipy.spatial import KDTree

from commission.geometry.arrays import FloatArray, IntArray, read_only
from commission.localization.estimate import Status
from commission.localization.observation import residuals
from commission.localization.run_columns import RunColumns, RunSegment
from commission.planning.visibility import VisibilityModel, VisibilityOptions, build_visibility
from commission.progress import Progress, silent
from commission.site.floor_map import FloorMap
from commission.site.quantity import FARTHEST
from commission.site.reflectors import ReflectorMap
from commission.site.walls import walls_of
from commission.studies.inputs import StudyInput
from commission.studies.run import RunResult
from commission.studies.scanner_figures import BELONGS, sensors_of


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class ReflectorFiguresInput(StudyInput):
    """All that the study reads."""

    columns: RunColumns
    """The run."""
    first_ns: int
    """Stamp of the first record [ns]."""
    floor_map: FloorMap | None
    """Walls; none: nothing stands in between."""

    @classmethod
    def of(cls, result: RunResult, floor_map: FloorMap | None) -> Self:
        """Input of a whole drive."""
        return cls(columns=result.columns, first_ns=result.inputs.log.first_ns, floor_map=floor_map)


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class ReflectorFigures:
    """Figures of M reflectors: all that some segment of the run has in its map."""

    inputs: ReflectorFiguresInput
    """What they were made of."""
    names: tuple[str, ...]
    """Id of each."""
    places: FloatArray
    """(M, 2) where each stands by the last map that has it [m], map frame."""
    expected: IntArray
    """(M,) scans in which it is in free sight from the estimated pose, in the field of view, near enough to pass the
    detector, and not covered."""
    seen: IntArray
    """(M,) scans with a detection that passed the detector and lies within a metre of it."""
    accepted: IntArray
    """(M,) detections that corrected the estimate."""
    rejected: IntArray
    """(M,) detections within a metre of it that the gate rejected."""
    along_mean: FloatArray
    """(M,) mean of the accepted innovations along the beam: measured minus expected range [m]; NaN without any."""
    along_spread: FloatArray
    """(M,) their standard deviation [m]; NaN with fewer than two."""
    across_mean: FloatArray
    """(M,) mean of the accepted innovations across the beam, to the left: by the bearing, times the range [m]."""
    across_spread: FloatArray
    """(M,) their standard deviation [m]."""
    nis: FloatArray
    """(M,) mean squared Mahalanobis distance of accepted and rejected (2 degrees of freedom), of those that the filter
    knows: it looks no farther than detections can be and pass the gate. NaN without any."""
    last_seen: FloatArray
    """(M,) time of the last accepted detection after the first record [s]; NaN without any."""

    def __len__(self) -> int:
        """Return the number of reflectors."""
        return len(self.names)


class _FigureSums:
    """What is added up for each of M reflectors."""

    def __init__(self, count: int) -> None:
        self.expected, self.seen, self.accepted, self.rejected = np.zeros((4, count), dtype=np.int64)
        self.first, self.second = np.zeros((2, count)), np.zeros((2, count))
        self.nis, self.judged = np.zeros((2, count))
        self.last = np.full(count, math.nan)


def reflector_figures(inputs: ReflectorFiguresInput, progress: Progress = silent) -> ReflectorFigures:
    """Count and average over a drive.

    Parameters
    ----------
    inputs : the run and the walls.
    progress : told how far it is; may raise to cancel.
    """
    columns = inputs.columns
    names, places, own = numbered(columns)
    sums = _FigureSums(len(names))
    caster, models = walls_of(inputs.floor_map), dict[int, tuple[VisibilityModel, ...]]()
    for segment, first, means in _blocks(columns):
        progress(first / len(columns), "what each reflector contributes")
        index = columns.segments.index(segment)
        if index not in models and not segment.covered and len(segment.setup.reflectors):
            options = VisibilityOptions(detector=segment.setup.parameters.detector)
            models[index] = tuple(
                build_visibility(segment.setup.reflectors, scanner, caster, options)
                for scanner in segment.setup.scanners
            )
        cycles = first, first + len(means)
        if index in models:
            sums.expected += _expected(columns, models[index], cycles, own[index], len(names))
        _add(sums, columns, (segment, *cycles), (means, own[index]))
    progress(1.0, "what each reflector contributes")
    return _averaged(inputs, names, places, sums)


def numbered(columns: RunColumns) -> tuple[tuple[str, ...], FloatArray, tuple[IntArray, ...]]:
    """Give each reflector a number that is the same in all segments of a run.

    Returns
    -------
    names : (M,) their ids.
    places : (M, 2) where each stands by the last map that has it [m].
    own : of each segment, the number of each of its reflectors, and -1 at the end: of none.
    """
    known: dict[str, int] = {}
    places: dict[str, tuple[float, float]] = {}
    own: list[IntArray] = []
    for segment in columns.segments:
        every = segment.setup.reflectors.reflectors
        own.append(np.array([*(known.setdefault(each.id, len(known)) for each in every), -1], dtype=np.int64))
        places |= {each.id: (each.x, each.y) for each in every}
    return tuple(known), np.array([places[name] for name in known]).reshape(-1, 2), tuple(own)


def _blocks(columns: RunColumns) -> Iterator[tuple[RunSegment, int, FloatArray]]:
    """Beliefs before some cycles of one segment: the segment, the first cycle and the (B, 3) means."""
    first = 0
    for rows in columns.priors.blocks():
        after = first + len(rows.means)
        bounds = [first, *(bound for bound in columns.firsts.tolist() if first < bound < after), after]
        for begin, end in itertools.pairwise(bounds):
            yield columns.segment(begin), begin, rows.means[begin - first : end - first]
        first = after


def _expected(
    columns: RunColumns, models: tuple[VisibilityModel, ...], cycles: tuple[int, int], own: IntArray, count: int
) -> IntArray:
    """(M,) scans of some cycles in which each reflector is in sight."""
    found = np.zeros(count, dtype=np.int64)
    here = slice(*cycles)
    scanners, poses = columns.detected.scanners[here], columns.means[here]
    # An estimate that has run away sees nothing, and lies beyond what can be counted in squares of the floor.
    on_floor = (np.abs(poses[:, :2]) <= FARTHEST).all(axis=1)
    for index, model in enumerate(models):
        visible = model.visible_from_poses(poses[(scanners == index) & on_floor])
        found += np.bincount(own[visible.indices], minlength=count)
    return found


def _add(
    sums: _FigureSums, columns: RunColumns, stretch: tuple[RunSegment, int, int], given: tuple[FloatArray, IntArray]
) -> None:
    """Add the detections of some cycles of one segment; `given` are the beliefs before them and the numbers."""
    segment, first, after = stretch
    priors, own = given
    setup, count = segment.setup, len(sums.nis)
    rows = slice(int(columns.offsets[first]), int(columns.offsets[after]))
    status, d2 = columns.status[rows], columns.d2[rows]
    if not len(setup.reflectors) or not len(status):
        return
    sensors = sensors_of(columns, priors, stretch)
    measured = columns.range_bearing[rows] - (setup.parameters.observation.range_bias, 0.0)
    reflector = np.where(
        (columns.reflector[rows] < 0) & (status == Status.OUTLIER_ASSOCIATION),
        _nearest(setup.reflectors, sensors, measured),
        columns.reflector[rows],
    )
    found, distances = residuals(sensors, setup.reflectors.centers[reflector], measured)
    along, across = found[:, 0], found[:, 1] * distances
    passed = (reflector >= 0) & (status != Status.OUTLIER_DETECTOR)
    accepted = passed & (status == Status.INLIER)
    near = accepted | (passed & (np.hypot(along, across) < BELONGS))
    counts = np.diff(columns.offsets[first : after + 1])
    number, cycle = own[reflector], np.repeat(np.arange(first, after), counts)
    sums.accepted += np.bincount(number[accepted], minlength=count)
    sums.rejected += np.bincount(number[near & ~accepted], minlength=count)
    scans = np.unique(number[near] * len(columns) + cycle[near]) // len(columns)
    sums.seen += np.bincount(scans, minlength=count)
    judged = near & np.isfinite(d2)
    sums.nis += np.bincount(number[judged], weights=d2[judged], minlength=count)
    sums.judged += np.bincount(number[judged], minlength=count)
    for axis, values in enumerate((along, across)):
        sums.first[axis] += np.bincount(number[accepted], weights=values[accepted], minlength=count)
        sums.second[axis] += np.bincount(number[accepted], weights=values[accepted] ** 2, minlength=count)
    # Cycles ascend: of each reflector the last one remains.
    sums.last[number[accepted]] = cycle[accepted]


def _nearest(reflectors: ReflectorMap, sensors: FloatArray, measured: FloatArray) -> IntArray:
    """(n,) reflector nearest to where each detection (n, 2) lies, seen from its scanner (n, 3).

    The filter names none where its search, which is no wider than the gate, found nobody: a reflector that was surveyed
    a hand off would look unseen.
    """
    bearings = sensors[:, 2] + measured[:, 1]
    places = sensors[:, :2] + measured[:, :1] * np.stack((np.cos(bearings), np.sin(bearings)), axis=1)
    return np.asarray(KDTree(reflectors.centers).query(places)[1], dtype=np.int64)


def _averaged(
    inputs: ReflectorFiguresInput, names: tuple[str, ...], places: FloatArray, sums: _FigureSums
) -> ReflectorFigures:
    """Figures of what was added up."""
    total = sums.accepted.astype(np.float64)
    with np.errstate(divide="ignore", invalid="ignore"):
        means = sums.first / total
        variances = np.maximum(sums.second - total * means**2, 0.0) / (total - 1.0)
        spreads = np.where(total > 1.0, np.sqrt(np.abs(variances)), math.nan)
        nis = sums.nis / sums.judged
    last = np.full(len(names), math.nan)
    known = np.isfinite(sums.last)
    last[known] = (inputs.columns.stamps_ns[sums.last[known].astype(np.int64)] - inputs.first_ns) * 1e-9
    return ReflectorFigures(
        inputs=inputs,
        names=names,
        places=read_only(places),
        expected=read_only(sums.expected),
        seen=read_only(sums.seen),
        accepted=read_only(sums.accepted),
        rejected=read_only(sums.rejected),
        along_mean=read_only(means[0]),
        along_spread=read_only(spreads[0]),
        across_mean=read_only(means[1]),
        across_spread=read_only(spreads[1]),
        nis=read_only(nis),
        last_seen=read_only(last),
    )

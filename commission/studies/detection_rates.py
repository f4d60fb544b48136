"""In how many scans reflectors are seen that should be, by their distance: estimated from a drive that was localized.

Should be: the map says that one stands in free sight. Where the estimate is wrong, or the map, nothing is seen either:
judge a drive that went well.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from commission.geometry.arrays import BoolArray, FloatArray, IntArray
from commission.localization.estimate import Mode, Status
from commission.localization.run_columns import RunColumns
from commission.planning.visibility import visibility_models
from commission.progress import Progress, silent
from commission.site.project import Project
from commission.site.quantity import PERCENT
from commission.studies.scanner_figures import BELONGS

EDGES = (0.0, 2.5, 5.0, 7.5, 10.0, 15.0, 20.0, 30.0, 40.0)
"""Distances between which one share is taken [m]."""
CONFIDENT = 1.959963984540054
"""Quantile of the standard normal distribution at 97.5 %: intervals hold the true share in 95 of 100 cases."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DetectionRate:
    """Share of scans in which reflectors at some distance are seen."""

    scanner: str
    """Name of the scanner."""
    nearest: float
    """Smallest distance from scanner to reflector [m]."""
    farthest: float
    """Largest distance, itself not included [m]."""
    distance: float = math.nan
    """Mean distance of what is expected [m]; NaN where nothing is."""
    expected: int
    """Pairs of a scan and a reflector in its free sight."""
    seen: int
    """Those of them with a detection that passed the detector and lies near the reflector, accepted or not."""

    @property
    def share(self) -> float:
        """Share that is seen [0..1]; NaN where none is expected."""
        return self.seen / self.expected if self.expected else math.nan

    @property
    def interval(self) -> tuple[float, float]:
        """Ends of the interval that holds the true share in 95 of 100 cases, see `wilson`."""
        return wilson(self.seen, self.expected)


def wilson(successes: int, trials: int) -> tuple[float, float]:
    """Interval of a share, 95 %.

    Parameters
    ----------
    successes, trials : what was counted; without any trial the interval is 0 to 1.

    Notes
    -----
    (p + z^2 / 2n +- z sqrt(p (1 - p) / n + z^2 / 4n^2)) / (1 + z^2 / n): Wilson 1927, J. Am. Stat. Assoc. 22, 209.
    Scans are taken for independent of each other, which neighboring ones are not: the true interval is wider.
    """
    if trials == 0:
        return 0.0, 1.0
    share, z2 = successes / trials, CONFIDENT**2 / trials
    center, half = share + 0.5 * z2, CONFIDENT * math.sqrt(share * (1.0 - share) / trials + 0.25 * z2 / trials)
    return max((center - half) / (1.0 + z2), 0.0), min((center + half) / (1.0 + z2), 1.0)


def detection_rates(
    project: Project, columns: RunColumns, edges: Sequence[float] = EDGES, progress: Progress = silent
) -> tuple[DetectionRate, ...]:
    """Count for each scanner and distance how many reflectors should be seen and are, while the mode is operational.

    Parameters
    ----------
    project : floor map, reflectors and scanners of the whole run; a scanner's range for reflectors does not limit what
        should be seen, since it is what one wants to know.
    columns : the run.
    edges : distances between which one share is taken, ascending [m].
    progress : told how far it is; may raise to cancel.

    Returns
    -------
    rates : of each scanner those distances at which something is expected.
    """
    scanners = tuple(dataclasses.replace(each, reflector_range=each.range[1]) for each in project.scanners)
    models = visibility_models(dataclasses.replace(project, scanners=scanners))
    seen, found = _seen(columns, project.reflectors.centers), list[DetectionRate]()
    for index, model in enumerate(models):
        progress(index / len(models), f"counting what scanner {scanners[index].name} sees")
        cycles = np.flatnonzero((columns.modes == Mode.OPERATIONAL) & (columns.detected.scanners == index))
        visible = model.visible_from_poses(columns.means[cycles])
        pairs = np.repeat(cycles, visible.counts()), visible.indices
        distances = _distances(columns, model.scanner.mounting, project.reflectors.centers, pairs)
        found += _rates(scanners[index].name, edges, distances, seen[pairs])
    return tuple(found)


def _seen(columns: RunColumns, centers: FloatArray) -> BoolArray:
    """(K, M) whether a cycle has a detection near each reflector that passed the detector."""
    known = np.flatnonzero((columns.status != Status.OUTLIER_DETECTOR) & (columns.reflector >= 0))
    apart = np.hypot(*(columns.points_map()[known] - centers[columns.reflector[known]]).T)
    near = known[apart < BELONGS]
    cycles = np.repeat(np.arange(len(columns)), np.diff(columns.offsets))
    seen = np.zeros((len(columns), max(len(centers), 1)), dtype=np.bool_)
    seen[cycles[near], columns.reflector[near]] = True
    return seen


def _distances(
    columns: RunColumns, mounting: FloatArray, centers: FloatArray, pairs: tuple[IntArray, IntArray]
) -> FloatArray:
    """(n,) distance from the scanner to the reflector of each pair [m]."""
    x, y, heading = columns.means[pairs[0]].T
    c, s = np.cos(heading), np.sin(heading)
    sensor = np.stack((x + c * mounting[0] - s * mounting[1], y + s * mounting[0] + c * mounting[1]), axis=1)
    return np.hypot(*(centers[pairs[1]] - sensor).T)


def _rates(scanner: str, edges: Sequence[float], distances: FloatArray, seen: BoolArray) -> list[DetectionRate]:
    """Counts between each two edges."""
    expected, _ = np.histogram(distances, np.asarray(edges))
    hits, _ = np.histogram(distances[seen], np.asarray(edges))
    way, _ = np.histogram(distances, np.asarray(edges), weights=distances)
    return [
        DetectionRate(
            scanner=scanner,
            nearest=edges[i],
            farthest=edges[i + 1],
            distance=float(way[i] / expected[i]),
            expected=int(expected[i]),
            seen=int(hits[i]),
        )
        for i in range(len(expected))
        if expected[i]
    ]


def rate_told(rate: DetectionRate) -> str:
    """One line for a person: how often reflectors at some distance are seen, and how certain that is."""
    low, high = (PERCENT.number(end) for end in rate.interval)
    return (
        f"Seen         {PERCENT.text(rate.share)} ({low} to {high}) of {rate.expected} from {rate.nearest:g} to "
        f"{rate.farthest:g} m, scanner {rate.scanner}"
    )


def rate_entries(rates: Sequence[DetectionRate]) -> list[dict[str, str | int | float]]:
    """Entries of `summary.json` under `detection_rates`, one mapping for each."""
    return [
        {
            "scanner": rate.scanner,
            "from_m": rate.nearest,
            "to_m": rate.farthest,
            "expected": rate.expected,
            "seen": rate.seen,
            "probability": rate.share,
            "probability_low": rate.interval[0],
            "probability_high": rate.interval[1],
        }
        for rate in rates
    ]

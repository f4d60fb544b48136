"""What has changed about the reflectors since they were surveyed, by one drive or by many: what to correct in the map.

It takes each drive's diagnosis as it is, finds by cumulative sums when a reflector was moved, and lets the newest drive
that tells something of a reflector decide. It changes nothing but the map that `corrected` returns.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np

from commission.geometry.arrays import FloatArray, IntArray
from commission.progress import Progress, part, silent
from commission.site.floor_map import FloorMap
from commission.site.project import Project
from commission.site.quantity import MILLIMETRES, PERCENT
from commission.site.record_log import RecordLog
from commission.site.reflectors import Reflector, ReflectorMap
from commission.studies.calibration import CalibrationInput, calibrate
from commission.studies.calibration_fit import places_of
from commission.studies.diagnosis import (
    FEWEST_EXPECTED,
    NEAR_M,
    Diagnosis,
    OutlierCluster,
    ReflectorDiagnosis,
    Suspicion,
    diagnosis,
    diagnosis_input,
)
from commission.studies.inputs import StudyInput
from commission.studies.start import Start

BLOCK_S = 1.0
"""Offsets are averaged over so long a time [s]: those of neighboring scans have their errors in common."""
ALARM = 8.0
"""Sum of log-likelihood ratios from which a change is believed: by chance once in 3,000 (Page 1954, Wald's bound)."""
AT_ONCE_S = 3.0
"""A change within this time of the first sighting was there before the drive [s]."""
LOOKED_FOR_M = 0.04
"""Shift that is looked for in a reflector that the diagnosis does not suspect [m]."""
LEAST_SPREAD_M = 0.006
"""Standard deviation of the mean of a second at least [m]: errors of shape and mounting change along the way."""
FEWEST_BLOCKS = 5
"""Seconds with sightings of a reflector, before and after, below which nothing is said of when it was moved."""
FARTHEST_M = 10.0
"""Sightings farther away do not tell where exactly it stands: half a degree is a hand there [m]."""
APART = 0.8
"""Share of the blocks before and after a change that must lie on their own side, where both places were seen."""
SAME_THING_M = 0.15
"""Things of two drives nearer than this are one [m]."""


class MapFault(StrEnum):
    """What is wrong about the map."""

    MOVED = "moved"
    MISSING = "missing"
    DIRTY = "dirty"
    DOUBLE = "double"
    NEW = "new"


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class MonitorInput(StudyInput):
    """All that the monitor reads."""

    names: tuple[str, ...]
    """Of the drives, the oldest first."""
    diagnoses: tuple[Diagnosis, ...]
    """What each of them shows."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DriveEvidence:
    """What one drive says of a reflector, or of a thing that is none of the map."""

    drive: str
    """Its name."""
    expected: int
    """Scans in which it is in sight by the map."""
    seen: int
    """Scans with a detection within a metre of it; detections of a thing."""
    beams: float
    """Mean width of its clusters as a share of what is expected [1]; NaN where the sensor detects."""
    suspicion: Suspicion | None
    """What is suspected by this drive alone."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MapFinding:
    """One thing about the map that is no longer so."""

    fault: MapFault
    """What it is."""
    id: str
    """The reflector; of a new one the name that it would get."""
    before: tuple[float, float] | None
    """Its place by the map [m]; None of a new one."""
    after: tuple[float, float] | None
    """Where it is now [m]; None of a missing one."""
    sigma: float
    """1-sigma of that place, each axis [m]; NaN where there is none."""
    since: str
    """From when on, as far as the drives tell."""
    evidence: tuple[DriveEvidence, ...]
    """Of each drive that tells something."""
    text: str
    """In words, with figures."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Monitor:
    """What the drives show of the map."""

    inputs: MonitorInput
    """What it was made of."""
    findings: tuple[MapFinding, ...]
    """By reflector in the order of the map, then what is new."""
    unseen: tuple[str, ...]
    """Reflectors of which no drive tells anything, because they hardly come in sight."""


def diagnosed_drive(project: Project, log: RecordLog, start: Start, progress: Progress = silent) -> Diagnosis:
    """Diagnose one drive by the project's map.

    Parameters
    ----------
    project : the site.
    log, start : the drive, and where it starts.
    progress : told how far it is; may raise to cancel.

    Raises
    ------
    UsageError
        the vehicle is lost, so that nothing can be said.
    """
    floor: FloorMap | None = project.floor_map
    found = calibrate(CalibrationInput.of(project, log, start), part(progress, 0.0, 0.8))
    return diagnosis(diagnosis_input(project, found, floor, part(progress, 0.8, 1.0)))


def monitor(inputs: MonitorInput) -> Monitor:
    """Name what has changed about the reflectors.

    Parameters
    ----------
    inputs : diagnosed drives over one map.
    """
    findings: list[MapFinding] = []
    unseen: list[str] = []
    drives = tuple(zip(inputs.names, inputs.diagnoses, strict=True))
    ids = [each.id for each in inputs.diagnoses[0].reflectors] if drives else []
    for index, name in enumerate(ids):
        telling = [(drive, each) for drive, each in drives if _tells(each.reflectors[index])]
        if not telling:
            unseen.append(name)
            continue
        findings += _of_reflector(index, telling)
    findings += _new_ones(drives, set(ids))
    return Monitor(inputs=inputs, findings=tuple(findings), unseen=tuple(unseen))


def _tells(reflector: ReflectorDiagnosis) -> bool:
    """Whether a drive says anything of a reflector."""
    return reflector.expected >= FEWEST_EXPECTED or reflector.suspicion is not None


def _of_reflector(index: int, telling: Sequence[tuple[str, Diagnosis]]) -> Iterator[MapFinding]:
    """What the newest drive that tells of it says of one reflector of the map."""
    _, newest = telling[-1]
    now = newest.reflectors[index]
    moved = moved_at(newest, index) if now.suspicion in {None, Suspicion.MOVED, Suspicion.DOUBLE} else None
    if now.suspicion is None and moved is None:
        return
    evidence = tuple(_evidence(drive, each, index) for drive, each in telling)
    fault, name = MapFault.MOVED if now.suspicion is None else MapFault(now.suspicion.value), now.id
    x, y = newest.inputs.figures.places[index].tolist()
    after: tuple[float, float] | None = (x, y)
    sigma, since = math.nan, _since(fault, telling, index)
    if moved is not None:
        fault, after, sigma = MapFault.MOVED, (x + moved.off[0], y + moved.off[1]), moved.sigma
        since = since if moved.seconds is None else f"{telling[-1][0]}, {moved.seconds:.0f} s"
    elif fault is MapFault.MOVED:
        after = x + now.off[0], y + now.off[1]
    if fault is MapFault.MISSING:
        after = None
    yield MapFinding(
        fault=fault,
        id=name,
        before=(x, y),
        after=after,
        sigma=sigma,
        since=since,
        evidence=evidence,
        text=_told(fault, name, ((x, y), after, sigma), since, evidence),
    )


def _since(fault: MapFault, telling: Sequence[tuple[str, Diagnosis]], index: int) -> str:
    """The first of the drives in a row, up to the newest one, that suspect the same."""
    first = len(telling) - 1
    kinds = {MapFault.MISSING, MapFault.DIRTY} if fault is MapFault.DIRTY else {fault}
    while first > 0:
        suspicion = telling[first - 1][1].reflectors[index].suspicion
        if suspicion is None or MapFault(suspicion.value) not in kinds:
            break
        first -= 1
    return f"{telling[first][0]}{' or before' if first == 0 else ''}"


def _evidence(drive: str, found: Diagnosis, index: int) -> DriveEvidence:
    """Figures of one drive."""
    each, columns = found.reflectors[index], found.inputs.figures.inputs.columns
    accepted = (columns.reflector == index) & (columns.beams > 0) & (columns.expected_beams > 0.0)
    width = columns.beams[accepted] / columns.expected_beams[accepted]
    beams = float(np.mean(width)) if len(width) else math.nan
    return DriveEvidence(drive=drive, expected=each.expected, seen=each.seen, beams=beams, suspicion=each.suspicion)


@dataclass(frozen=True, slots=True)
class MovedReflector:
    """How far and when a reflector was moved."""

    off: tuple[float, float]
    """From its place by the map [m]."""
    sigma: float
    """1-sigma of that, each axis [m]."""
    seconds: float | None
    """When, after the first scan [s]; None: before the drive."""


def moved_at(found: Diagnosis, index: int) -> MovedReflector | None:
    """Return how far and when a reflector was moved by one drive; None where it stands, or stands twice.

    Parameters
    ----------
    found : the drive.
    index : of the reflector.

    Notes
    -----
    S <- max(0, S + |d| (u . x - |d| / 2) / s^2): the cumulative sum of the log-likelihood ratio of a known shift
    d = |d| u (Page, Biometrika 41, 1954), over means x of a second with standard deviation s; the change is where the
    sum left zero for the last time before it passed the alarm. x is the offset from the mapped place on the floor,
    with poses smoothed over the whole drive.
    """
    times, offsets = blocks_of(found, index)
    if len(times) < FEWEST_BLOCKS:
        return None
    known = np.array(found.reflectors[index].off)
    if known.any():
        return _moved_along(times, offsets, known)
    # Of one that was moved on the way, the diagnosis of the whole drive sees the mean of both places.
    turns = np.arange(0.0, 2.0 * math.pi, 0.25 * math.pi)
    looked_for = (LOOKED_FOR_M * np.array([math.cos(turn), math.sin(turn)]) for turn in turns)
    moved = [_moved_along(times, offsets, off) for off in looked_for]
    late = [
        each
        for each in moved
        if each is not None
        and each.seconds is not None
        and min(np.count_nonzero(times < each.seconds), np.count_nonzero(times >= each.seconds)) >= FEWEST_BLOCKS
    ]
    return max(late, key=lambda each: math.hypot(*each.off), default=None)


def _moved_along(times: FloatArray, offsets: FloatArray, off: FloatArray) -> MovedReflector | None:
    """Look for a shift of about `off` (2,) [m] in offsets (n, 2) [m] at (n,) times [s]."""
    length = float(np.hypot(*off))
    along = offsets @ (off / length)
    spread = max(float(np.median(np.abs(np.diff(along)))) / 0.95, LEAST_SPREAD_M)
    began = change_point(length * (along - 0.5 * length) / spread**2)
    if began is None:
        return None
    after, before = offsets[began:], along[:began]
    shift = np.median(after, axis=0)
    size = float(shift @ (off / length))
    # Where it stands twice, both places are seen by turns; one that was touched only is back where it was.
    if size < 0.5 * length or np.mean(after @ (off / length) > 0.5 * size) < APART:
        return None
    if began and np.mean(before < 0.5 * size) < APART:
        return None
    error = 1.25 * np.std(after, axis=0).max() / math.sqrt(len(after))
    seconds = None if times[began] - times[0] <= AT_ONCE_S else float(times[began])
    return MovedReflector((float(shift[0]), float(shift[1])), max(float(error), 0.002), seconds)


def change_point(ratios: FloatArray) -> int | None:
    """Index from which on something has changed, by a cumulative sum; None where it never passes the alarm.

    Parameters
    ----------
    ratios : (n,) log-likelihood ratios of changed against unchanged, in the order of time.
    """
    total, began = 0.0, 0
    for at, ratio in enumerate(ratios.tolist()):
        if total <= 0.0:
            total, began = 0.0, at
        total += ratio
        if total > ALARM:
            return began
    return None


def blocks_of(found: Diagnosis, index: int) -> tuple[FloatArray, FloatArray]:
    """Offsets of what is seen near a reflector, second by second.

    Parameters
    ----------
    found : the drive.
    index : of the reflector.

    Returns
    -------
    times : (n,) after the first scan [s].
    offsets : (n, 2) median offset from its place by the map [m], map frame.
    """
    fitted = found.inputs.calibration
    drive, point = fitted.problem.drive, fitted.fit.point
    _, places, ranges = places_of(drive, point)
    offsets = places - drive.places[index]
    owner = fitted.fit.reflector
    # What is of none may be it at another place, where the diagnosis suspects that; else it is somebody who walks by.
    is_its = (owner == index) | ((owner < 0) & any(found.reflectors[index].off))
    near = is_its & (np.hypot(offsets[:, 0], offsets[:, 1]) < NEAR_M) & (ranges < FARTHEST_M)
    seconds = (drive.stamps_ns[drive.cycle[near]] - drive.stamps_ns[0]) * 1e-9
    block: IntArray = np.floor(seconds / BLOCK_S).astype(np.int64)
    kept = [each for each in np.unique(block).tolist() if np.count_nonzero(block == each) >= 3]
    medians = [np.median(offsets[near][block == each], axis=0) for each in kept]
    return (np.array(kept) + 0.5) * BLOCK_S, np.array(medians).reshape(-1, 2)


def _new_ones(drives: Sequence[tuple[str, Diagnosis]], ids: set[str]) -> Iterator[MapFinding]:
    """Things that the newest drive sees where no reflector is mapped, and since when."""
    if not drives:
        return
    newest, found = drives[-1]
    for cluster in (each for each in found.clusters if not each.near):
        name = next(name for name in (f"new-{number}" for number in range(1, 10_000)) if name not in ids)
        ids.add(name)
        told = [(drive, thing) for drive, each in drives for thing in each.clusters if _is_one(cluster, thing)]
        evidence = tuple(
            DriveEvidence(drive=drive, expected=0, seen=thing.count, beams=math.nan, suspicion=None)
            for drive, thing in told
        )
        since = told[0][0] if told else newest
        since += " or before" if since == drives[0][0] else ""
        place = cluster.x, cluster.y
        yield MapFinding(
            fault=MapFault.NEW,
            id=name,
            before=None,
            after=place,
            sigma=0.01,
            since=since,
            evidence=evidence,
            text=f"{cluster.text}; since {since}",
        )


def _is_one(a: OutlierCluster, b: OutlierCluster) -> bool:
    """Whether two drives have seen one thing."""
    return not b.near and math.hypot(a.x - b.x, a.y - b.y) < SAME_THING_M


def _told(
    fault: MapFault,
    name: str,
    places: tuple[tuple[float, float], tuple[float, float] | None, float],
    since: str,
    evidence: Sequence[DriveEvidence],
) -> str:
    """Say a finding about a reflector of the map in words."""
    before, after, sigma = places
    newest = evidence[-1]
    share = PERCENT.text(newest.seen / max(newest.expected, 1))
    seen = f"seen in {newest.seen} of {newest.expected} scans ({share})"
    if fault is MapFault.MOVED and after is not None:
        dx, dy = after[0] - before[0], after[1] - before[1]
        known = f" ± {MILLIMETRES.text(sigma)}" if math.isfinite(sigma) else ""
        return (
            f"{name} has moved by {MILLIMETRES.text(math.hypot(dx, dy))}{known}: {MILLIMETRES.text(dx, '+.0f')} in x, "
            f"{MILLIMETRES.text(dy, '+.0f')} in y; since {since}"
        )
    if fault is MapFault.DOUBLE:
        return f"{name} stands twice: its place and another one beside it are seen by turns; since {since}"
    if fault is MapFault.MISSING:
        return f"{name} is missing: {seen}; since {since}"
    beams = f", {PERCENT.text(newest.beams)} of the beams that are expected" if math.isfinite(newest.beams) else ""
    return f"{name} is dirty or half hidden: {seen}{beams}; since {since}"


def corrected(reflectors: ReflectorMap, findings: Iterable[MapFinding], *, add_new: bool = False) -> ReflectorMap:
    """Return the map as the drives show it: moved ones at their new places, missing ones gone.

    Parameters
    ----------
    reflectors : the map before; locked reflectors stay as they are.
    findings : what was found; dirty and double ones are for a person to look at.
    add_new : whether things that no reflector of the map explains are added, which may be shiny columns.
    """
    found = {each.id: each for each in findings}
    kept: list[Reflector] = []
    for each in reflectors.reflectors:
        finding = found.get(each.id)
        if finding is None or each.locked or finding.fault not in {MapFault.MOVED, MapFault.MISSING}:
            kept.append(each)
        elif finding.fault is MapFault.MOVED and finding.after is not None:
            x, y = (round(value, 4) for value in finding.after)
            kept.append(replace(each, x=x, y=y, sigma=max(each.sigma, round(finding.sigma, 4))))
    if add_new:
        for each in found.values():
            if each.fault is MapFault.NEW and each.after is not None:
                x, y = (round(value, 4) for value in each.after)
                kept.append(Reflector(id=each.id, x=x, y=y, radius=None, sigma=each.sigma, note="seen, not surveyed"))
    return ReflectorMap(tuple(kept))

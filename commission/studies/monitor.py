"""What has changed about the reflectors since they were surveyed, by one drive or by many.

It takes each drive's diagnosis as it is, and lets the newest drive that tells something of a reflector decide. It
changes nothing: the map that follows from it is `map_correction`'s.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from commission.localization.cross_covariance import survey_variance
from commission.progress import Progress, part, silent
from commission.site.floor_map import FloorMap
from commission.site.project import Project
from commission.site.record_log import RecordLog
from commission.studies.calibration import CalibrationInput, calibrate
from commission.studies.diagnosis import (
    FEWEST_EXPECTED,
    Diagnosis,
    OutlierCluster,
    ReflectorDiagnosis,
    Suspicion,
    diagnosis,
    diagnosis_input,
)
from commission.studies.inputs import StudyInput
from commission.studies.map_findings import DriveEvidence, MapFault, MapFinding, told
from commission.studies.moved_reflector import moved_at
from commission.studies.start import Start

NEW_SIGMA_M = 0.01
"""1-sigma of the place of a thing among the reflectors, each axis [m]."""
SAME_THING_M = 0.15
"""Things of two drives nearer than this are one [m]."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class MonitorInput(StudyInput):
    """All that the monitor reads."""

    names: tuple[str, ...]
    """Of the drives, the oldest first."""
    diagnoses: tuple[Diagnosis, ...]
    """What each of them shows."""


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
        fault, after = MapFault.MOVED, (x + moved.off[0], y + moved.off[1])
        # It is seen from poses that the others tell: it stands no better known among them than they were surveyed.
        sigma = math.hypot(moved.sigma, _survey_sigma(newest, index))
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
        text=told(fault, name, ((x, y), after, sigma), since, evidence),
    )


def _survey_sigma(found: Diagnosis, index: int) -> float:
    """1-sigma of the surveyed place of a reflector [m]."""
    inputs = found.inputs.calibration.inputs
    return math.sqrt(survey_variance(inputs.reflectors.reflectors[index], inputs.uncertainty))


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


def _new_ones(drives: Sequence[tuple[str, Diagnosis]], ids: set[str]) -> Iterator[MapFinding]:
    """Things that the newest drive sees where no reflector is mapped, and since when."""
    if not drives:
        return
    newest, found = drives[-1]
    for cluster in (each for each in found.clusters if not each.near):
        name = next(name for name in (f"new-{number}" for number in range(1, 10_000)) if name not in ids)
        ids.add(name)
        seen_by = [(drive, thing) for drive, each in drives for thing in each.clusters if _is_one(cluster, thing)]
        evidence = tuple(
            DriveEvidence(drive=drive, expected=0, seen=thing.count, beams=math.nan, suspicion=None)
            for drive, thing in seen_by
        )
        since = seen_by[0][0] if seen_by else newest
        since += " or before" if since == drives[0][0] else ""
        place = cluster.x, cluster.y
        yield MapFinding(
            fault=MapFault.NEW,
            id=name,
            before=None,
            after=place,
            sigma=math.hypot(NEW_SIGMA_M, found.inputs.calibration.inputs.uncertainty.survey),
            since=since,
            evidence=evidence,
            text=f"{cluster.text}; since {since}",
        )


def _is_one(a: OutlierCluster, b: OutlierCluster) -> bool:
    """Whether two drives have seen one thing."""
    return not b.near and math.hypot(a.x - b.x, a.y - b.y) < SAME_THING_M

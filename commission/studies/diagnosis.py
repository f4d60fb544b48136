"""What is wrong with a site, by a drive through it: reflectors, things that shine, and constants, each in words.

It judges what a calibration has found and what no reflector of the map explains. It changes nothing.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from commission.geometry.arrays import FloatArray
from commission.progress import Progress, part, silent
from commission.site.floor_map import FloorMap
from commission.site.project import Project
from commission.site.quantity import MILLIMETRES, PERCENT
from commission.studies.calibration import Calibration, CalibrationVerdict, Value, accepted
from commission.studies.calibration_fit import places_of
from commission.studies.heaps import heaps_of, middle_of, nearest_of
from commission.studies.inputs import StudyInput
from commission.studies.reflector_figures import ReflectorFigures, ReflectorFiguresInput, reflector_figures
from commission.studies.run import RunInput, judged_run

SURE = 3.5
"""A constant is named when it is off by so many of its 1-sigma."""
LEAST = {
    "mounting.x": 0.01,
    "mounting.y": 0.01,
    "mounting.heading": 0.004,
    "clock_offset": 0.012,
    "range_bias": 0.006,
    "forward_scale": 0.01,
    "turn_scale": 0.01,
    "turn_per_m": 0.006,
}
"""And by at least this much, in SI units and radians: less does not explain anything that an engineer sees."""
MOVED_SIGMAS, MOVED_M = 4.0, 0.015
"""A reflector is named that stands so many 1-sigma, and so far [m], from its place."""
CELL_M = 0.05
"""Detections in squares of the floor that touch are of one thing [m]."""
FEWEST = 30
"""Detections below which nothing is said of a thing, nor of where a reflector stands."""
LEAST_SHARE = 0.01
"""Share of the scans in which a thing has to be seen, so that people who pass by are none."""
WIDEST_M = 0.15
"""A thing whose detections scatter more is none that stands [m]."""
NEAR_M = 0.6
"""A thing nearer to a reflector than this is taken for it, or for its double [m]."""
OWN_SHARE = 0.3
"""A reflector that is seen at its own place less often than this share of a thing beside it has moved there."""
MISSING_SHARE, DIRTY_SHARE = 0.05, 0.4
"""Shares of the usual number of sightings below which a reflector is missing, or dirty."""
FEWEST_EXPECTED = 50
"""Scans that promise a reflector below which nothing is said of it."""
NOISE_SMALL, NOISE_LARGE = 1.5, 2.0
"""A noise is named when it is too small by this factor, or too large by this one: a careful figure is no fault."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class DiagnosisInput(StudyInput):
    """All that a diagnosis reads."""

    calibration: Calibration
    """What the drive says of the constants."""
    figures: ReflectorFigures
    """What each reflector did in a run with the constants as found."""


class Suspicion(StrEnum):
    """What may be wrong with a reflector."""

    MOVED = "moved"
    MISSING = "missing"
    DIRTY = "dirty"
    DOUBLE = "double"


@dataclass(frozen=True, slots=True, kw_only=True)
class ReflectorDiagnosis:
    """One reflector of the map."""

    id: str
    """Its name."""
    expected: int
    """Scans in which it is in sight by the map."""
    seen: int
    """Scans with a detection within a metre of it."""
    accepted: int
    """Detections that corrected the estimate."""
    range_mean: float
    """Mean residual of its ranges [m]; NaN where it has none."""
    range_spread: float
    """Their standard deviation [m]."""
    across_mean: float
    """Mean residual across the beam, by the bearing times the range [m]."""
    across_spread: float
    """Their standard deviation [m]."""
    suspicion: Suspicion | None = None
    """What may be wrong; None: nothing."""
    off: tuple[float, float] = (0.0, 0.0)
    """How far from its place it, or what stands beside it, is seen, where it is suspected [m]."""
    text: str = ""
    """The same in words."""


@dataclass(frozen=True, slots=True, kw_only=True)
class OutlierCluster:
    """Something that stands on the floor and is no reflector of the map."""

    x: float
    """Its place [m], map frame."""
    y: float
    """Its place [m], map frame."""
    count: int
    """Detections of it."""
    from_x: float
    """Mean place of the scanner that saw it [m], map frame."""
    from_y: float
    """Mean place of the scanner that saw it [m], map frame."""
    near: str = ""
    """The reflector that it stands beside; empty: none."""

    @property
    def text(self) -> str:
        """Say what it probably is."""
        what = f"beside {self.near}" if self.near else "probably a shiny column or plate, or a reflector not in the map"
        return (
            f"something at {self.x:.2f}, {self.y:.2f} m looks like a reflector: {self.count} detections, "
            f"seen from about {self.from_x:.1f}, {self.from_y:.1f} m; {what}"
        )


@dataclass(frozen=True, slots=True)
class Cause:
    """One thing that is wrong everywhere in the drive."""

    key: str
    """The figure of the project that it concerns."""
    text: str
    """In words."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Diagnosis:
    """All that is named."""

    inputs: DiagnosisInput
    """What it was made of."""
    reflectors: tuple[ReflectorDiagnosis, ...]
    """All reflectors, suspected or not."""
    clusters: tuple[OutlierCluster, ...]
    """Things that stand and are no reflectors of the map, the most seen first."""
    causes: tuple[Cause, ...]
    """Constants that are off."""
    noise: tuple[Cause, ...]
    """Noise that is stated too small or too large."""

    @property
    def lines(self) -> tuple[str, ...]:
        """Say all that is named, a line each; nothing where the drive is as the project has it."""
        things = (each.text for each in self.clusters if not each.near)
        reflectors = (each.text for each in self.reflectors if each.suspicion is not None)
        return (*(each.text for each in (*self.causes, *self.noise)), *reflectors, *things)


def diagnosis_input(
    project: Project, calibration: Calibration, floor_map: FloorMap | None, progress: Progress = silent
) -> DiagnosisInput:
    """Localize with the constants as the drive has them, and count what each reflector does.

    Parameters
    ----------
    project : the one that was calibrated.
    calibration : what was found.
    floor_map : walls that hide reflectors.
    progress : told how far it is; may raise to cancel.
    """
    found = accepted(project, (each for each in calibration.values if not each.key.startswith("reflectors.")))
    inputs = calibration.inputs
    run = judged_run(RunInput.of(found, inputs.log, inputs.start), part(progress, 0.0, 0.6))
    figures = reflector_figures(ReflectorFiguresInput.of(run, floor_map), part(progress, 0.6, 1.0))
    return DiagnosisInput(calibration=calibration, figures=figures)


def diagnosis(inputs: DiagnosisInput) -> Diagnosis:
    """Name what is wrong.

    Parameters
    ----------
    inputs : calibration and reflectors.
    """
    found = inputs.calibration
    clusters = tuple(_clusters(found))
    return Diagnosis(
        inputs=inputs,
        reflectors=tuple(_reflectors(inputs, clusters)),
        clusters=clusters,
        causes=tuple(_causes(found)),
        noise=tuple(_noise(found)),
    )


def _clusters(found: Calibration) -> Iterator[OutlierCluster]:
    """Things that the detections stand for that are of no reflector."""
    drive, ids = found.problem.drive, [each.id for each in found.inputs.reflectors.reflectors]
    lost = np.flatnonzero(found.fit.reflector < 0)
    if len(lost) < FEWEST:
        return
    scanners, places, _ = places_of(drive, found.fit.point)
    places, scanners = places[lost], scanners[lost]
    fewest = max(FEWEST, LEAST_SHARE * len(drive.stamps_ns))
    mapped = drive.places + found.fit.point.constants[drive.layout.places :].reshape(-1, 2)
    for rows in heaps_of(places, CELL_M):
        if len(rows) < fewest:
            return
        middle, spread = middle_of(places[rows])
        if spread > WIDEST_M:
            continue
        near = nearest_of(mapped, middle, NEAR_M)
        x, y = scanners[rows, :2].mean(axis=0).tolist()
        yield OutlierCluster(
            x=float(middle[0]),
            y=float(middle[1]),
            count=len(rows),
            from_x=x,
            from_y=y,
            near=ids[near] if near >= 0 else "",
        )


def _reflectors(inputs: DiagnosisInput, clusters: tuple[OutlierCluster, ...]) -> Iterator[ReflectorDiagnosis]:
    """All reflectors with what is suspected of each."""
    figures, found = inputs.figures, inputs.calibration
    shares = figures.seen / np.maximum(figures.expected, 1)
    known = figures.expected >= FEWEST_EXPECTED
    usual = float(np.median(shares[known])) if known.any() else 1.0
    own = np.bincount(found.fit.reflector[found.fit.reflector >= 0], minlength=len(figures))
    beside = {each.near: each for each in reversed(clusters) if each.near}
    for index, name in enumerate(figures.names):
        suspicion, text, off = None, "", np.zeros(2)
        thing, moved = beside.get(name), _moved(found, index) if own[index] >= FEWEST else None
        if thing is not None and own[index] >= OWN_SHARE * thing.count:
            suspicion, text = Suspicion.DOUBLE, f"{name} is double: {thing.text}"
            off = np.array([thing.x, thing.y]) - figures.places[index]
        elif thing is not None:
            off = np.array([thing.x, thing.y]) - figures.places[index]
            suspicion, text = Suspicion.MOVED, _moved_text(name, off)
        elif moved is not None:
            suspicion, text, off = Suspicion.MOVED, _moved_text(name, moved), moved
        elif known[index] and shares[index] < DIRTY_SHARE * usual:
            missing = shares[index] < MISSING_SHARE * usual
            suspicion = Suspicion.MISSING if missing else Suspicion.DIRTY
            text = f"{name} is {suspicion.value}: seen in {figures.seen[index]} of {figures.expected[index]} scans"
        yield ReflectorDiagnosis(
            id=name,
            expected=int(figures.expected[index]),
            seen=int(figures.seen[index]),
            accepted=int(figures.accepted[index]),
            range_mean=float(figures.along_mean[index]),
            range_spread=float(figures.along_spread[index]),
            across_mean=float(figures.across_mean[index]),
            across_spread=float(figures.across_spread[index]),
            suspicion=suspicion,
            off=(float(off[0]), float(off[1])),
            text=text,
        )


def _moved(found: Calibration, index: int) -> FloatArray | None:
    """(2,) how far a reflector stands from its place [m]; None where that is no more than it is known."""
    rows = found.problem.drive.layout.places + 2 * index + np.arange(2)
    shift = found.fit.point.constants[rows]
    limit = MOVED_SIGMAS * np.hypot(found.fit.sigmas[rows], found.problem.prior[rows])
    return shift if np.any(np.abs(shift) > limit) and np.hypot(*shift) > MOVED_M else None


def _moved_text(name: str, off: FloatArray) -> str:
    return (
        f"{name} has moved by {MILLIMETRES.text(float(np.hypot(*off)))}: "
        f"{MILLIMETRES.text(float(off[0]), '+.0f')} in x, {MILLIMETRES.text(float(off[1]), '+.0f')} in y"
    )


def _causes(found: Calibration) -> Iterator[Cause]:
    """Constants that are off."""
    for value in found.values:
        name = next((each for each in LEAST if value.key.endswith(f".{each}")), None)
        if name is None or value.verdict is CalibrationVerdict.NOT_SHOWN:
            continue
        off = value.proposed - value.before
        if abs(off) > max(SURE * value.sigma, LEAST[name]):
            yield Cause(value.key, f"{_in_words(name, off, value)} (1-sigma {value.shown.text(value.sigma, '.2g')})")


def _in_words(name: str, off: float, value: Value) -> str:
    """Say what it means that a constant is off."""
    size = value.shown.text(abs(off), ".3g")
    scanner = value.key.removeprefix("scanners.").removesuffix(f".{name}")
    more = off > 0.0
    return {
        "mounting.x": f"scanner {scanner} is mounted {size} too far {'forward' if more else 'back'}",
        "mounting.y": f"scanner {scanner} is mounted {size} too far to the {'left' if more else 'right'}",
        "mounting.heading": f"scanner {scanner} is turned by {size} to the {'left' if more else 'right'}",
        "clock_offset": f"scans of {scanner} are stamped {size} too {'late' if more else 'early'}",
        "range_bias": f"ranges are {size} too {'long' if more else 'short'}",
        "forward_scale": f"the way is {size} {'longer' if more else 'shorter'} than odometry says (wheel size)",
        "turn_scale": f"turns are {size} {'larger' if more else 'smaller'} than odometry says (wheel separation)",
        "turn_per_m": f"the vehicle draws to the {'left' if more else 'right'} by {size} (wheels of unlike size)",
    }[name]


def _noise(found: Calibration) -> Iterator[Cause]:
    """Noise of detections that is stated too small or too large."""
    for value in found.values:
        if value.key not in {"observation.range_sigma", "observation.bearing_sigma"} or value.before <= 0.0:
            continue
        ratio = value.proposed / value.before
        kind = value.key.removeprefix("observation.").removesuffix("_sigma")
        if ratio > NOISE_SMALL:
            yield Cause(value.key, f"the 1-sigma of the {kind} is {ratio:.1f} times too small")
        elif ratio < 1.0 / NOISE_LARGE:
            yield Cause(value.key, f"the 1-sigma of the {kind} is {PERCENT.text(1.0 / ratio, '.0f')} of what is needed")

"""What goes wrong in one of many virtual drives, drawn by stated rates: a site with faults, and a vehicle carried away.

Each fault has random numbers of its own: switching one off leaves all others as they were. Faults of a finished
recording are those of `faults`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace

import numpy as np

from commission.errors import UsageError
from commission.geometry.arrays import BoolArray, IntArray, read_only
from commission.simulation.people import WalkableFloor
from commission.site.disturbances import ConstantErrors, CoveredPeriod, Disturbances, ShinyObject
from commission.site.project import Project
from commission.site.record_log import RecordLog
from commission.site.reflectors import Reflector, ReflectorMap
from commission.site.uncertainty import Uncertainty

STREAM = 6
"""Stream of random numbers of a seed, beside those of `scenario` and `constants`; the next number says which fault."""
COVERED, FALSE, MOVED, MISSING, DIRT, KIDNAPPING = range(1, 7)
COVERED_S = (2.0, 20.0)
"""Shortest and longest time for which all reflectors are covered [s]."""
FALSE_RADIUS = 0.05
"""Radius of what is taken for a reflector and is none: a wrapped post, a bare column [m]."""
MOST_UNCERTAIN = 0.1
"""Largest 1-sigma that constants are drawn by [m, rad, s]: what a file of disturbances may say."""
DIRT_SHARE = (0.2, 0.9)
"""Smallest and largest share of scans in which a dirty reflector is not seen."""
CARRIED_M = (0.2, 2.0)
"""Shortest and longest way that a vehicle is carried [m]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FaultRates:
    """How often each fault happens; 0 switches one off."""

    people: int | None = None
    """People walking about. None: as many as the project says."""
    glints: float | None = None
    """Mean number of random short reflections in a scan. None: as the project says."""
    covered: float = 2.0
    """Times per hour that all reflectors are covered, for 2 to 20 s each."""
    false: float = 0.5
    """Mean number of things on the floor of a drive that are taken for a reflector and are none."""
    moved: float = 0.01
    """Share of the reflectors that have been moved since the survey."""
    moved_sigma: float = 0.05
    """How far a moved reflector is from its place, along x and along y, 1-sigma [m]."""
    missing: float = 0.02
    """Share of the reflectors that are gone."""
    dirt: float = 0.05
    """Share of the reflectors that are dirty: each is not seen in 20 to 90 % of the scans."""
    slip: float = 0.5
    """Wheel slips per 100 m."""
    kidnapping: float = 0.5
    """Times per hour that the vehicle is carried 0.2 to 2 m along its route: its wheels stand, and it sees nothing."""
    constants: bool = True
    """Whether survey, mounting, range bias and clock are off, by the sigmas that the project's `uncertainty` states."""

    def __post_init__(self) -> None:
        for each in fields(self):
            value, is_share = getattr(self, each.name), each.name in {"moved", "missing", "dirt"}
            if value is None:
                continue
            if not (math.isfinite(value) and 0.0 <= value <= (1.0 if is_share else 1000.0)):
                expected = "a share of 0 to 1" if is_share else "a number of 0 to 1000"
                raise ValueError(f"--{each.name.replace('_', '-')} is {value:g}; expected {expected}")

    @staticmethod
    def none() -> FaultRates:
        """Return the rates at which nothing goes wrong."""
        return FaultRates(
            people=0,
            glints=0.0,
            covered=0.0,
            false=0.0,
            moved=0.0,
            missing=0.0,
            dirt=0.0,
            slip=0.0,
            kidnapping=0.0,
            constants=False,
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class DrawnFaults:
    """What goes wrong in one drive."""

    project: Project
    """The site as it is in this drive, but for the constants that the drive itself draws."""
    dirt: Mapping[str, float] = field(default_factory=dict)
    """Share of the scans in which a reflector is not seen, by its name."""
    moved: tuple[str, ...] = ()
    """Names of reflectors that stand elsewhere."""
    missing: tuple[str, ...] = ()
    """Names of reflectors that are gone."""


def draw_faults(
    project: Project, rates: FaultRates, seed: int, duration: float, floor: WalkableFloor | None = None
) -> DrawnFaults:
    """Draw what goes wrong in one drive, but for kidnapping.

    Parameters
    ----------
    project : the site; its own disturbances act as well, but for people, slips and constants, which the rates say.
    rates : how often.
    seed : of the drive.
    duration : about how long it takes [s].
    floor : of the project, where it is at hand: it takes longer than a drive.
    """
    known = project.reflectors.reflectors
    names = tuple(each.id for each in known)
    places = rates.moved_sigma * _rng(seed, MOVED, 1).standard_normal((len(known), 2))
    is_moved = _rng(seed, MOVED).random(len(known)) < rates.moved
    is_gone = _rng(seed, MISSING).random(len(known)) < rates.missing
    is_dirty = _rng(seed, DIRT).random(len(known)) < rates.dirt
    shares = _rng(seed, DIRT, 1).uniform(*DIRT_SHARE, len(known))
    reflectors = tuple(
        _moved(each, *place) if moved else each
        for each, place, moved, gone in zip(known, places.tolist(), is_moved, is_gone, strict=True)
        if not gone
    )
    own = walking(project, rates)
    disturbances = replace(
        own,
        shiny_objects=(*own.shiny_objects, *_false(project, rates, seed, floor)),
        covered=(*own.covered, *_covered(rates, seed, duration)),
        slips_per_100_m=rates.slip,
        constants=_constants(own.constants, project.uncertainty) if rates.constants else own.constants,
    )
    return DrawnFaults(
        project=replace(project, reflectors=ReflectorMap(reflectors), disturbances=disturbances),
        dirt={name: float(share) for name, share, dirty in zip(names, shares.tolist(), is_dirty, strict=True) if dirty},
        moved=tuple(name for name, moved, gone in zip(names, is_moved, is_gone, strict=True) if moved and not gone),
        missing=tuple(name for name, gone in zip(names, is_gone, strict=True) if gone),
    )


def walking(project: Project, rates: FaultRates) -> Disturbances:
    """Return the disturbances of a project with the people and glints that the rates say.

    Parameters
    ----------
    project : what it says itself.
    rates : what is said in its place.
    """
    own = project.disturbances
    return replace(
        own,
        people=own.people if rates.people is None else rates.people,
        glints_per_scan=own.glints_per_scan if rates.glints is None else rates.glints,
    )


def carried(log: RecordLog, rates: FaultRates, seed: int) -> tuple[RecordLog, tuple[float, ...]]:
    """Carry the vehicle along its route now and then: its wheels stand, and no scan is taken, until it is put down.

    Parameters
    ----------
    log : the drive.
    rates : how often.
    seed : of the drive.

    Returns
    -------
    log : the drive in which it happens; the true poses are the same.
    seconds : when it is put down, ascending, after the first record [s].
    """
    stamps = log.odometry_stamps_ns
    duration = 1e-9 * float(stamps[-1] - stamps[0])
    rng = _rng(seed, KIDNAPPING)
    times = np.sort(rng.uniform(0.0, duration, int(rng.poisson(rates.kidnapping * duration / 3600.0))))
    if not len(times):
        return log, ()
    way = np.cumsum(np.hypot(log.displacements[:, 0], log.displacements[:, 1]))
    stands = np.zeros(len(stamps), np.bool_)
    put_down: list[float] = []
    for time, far in zip(times.tolist(), rng.uniform(*CARRIED_M, len(times)).tolist(), strict=True):
        first = int(np.searchsorted(stamps, stamps[0] + 1e9 * time))
        last = min(int(np.searchsorted(way, way[first] + far)), len(stamps) - 1)
        stands[first : last + 1] = True
        put_down.append(1e-9 * float(stamps[last] - stamps[0]))
    displacements = np.where(stands[:, np.newaxis], 0.0, log.displacements)
    return _without_scans(replace(log, displacements=read_only(displacements)), stands), tuple(put_down)


def _without_scans(log: RecordLog, stands: BoolArray) -> RecordLog:
    """The same drive without what is seen while the vehicle is carried."""

    def seen(stamps: IntArray) -> BoolArray:
        return ~stands[np.minimum(np.searchsorted(log.odometry_stamps_ns, stamps), len(stands) - 1)]

    kept = seen(log.detection_stamps_ns)
    counts = np.diff(log.detection_offsets)
    return replace(
        log,
        scans=tuple(scans.chosen(np.flatnonzero(seen(scans.stamps_ns))) for scans in log.scans),
        detection_stamps_ns=read_only(log.detection_stamps_ns[kept]),
        detection_offsets=read_only(np.concatenate(([0], np.cumsum(counts[kept])))),
        range_bearing=read_only(log.range_bearing[np.repeat(kept, counts)]),
        detection_scanners=read_only(log.detection_scanners[kept]),
    )


def _moved(reflector: Reflector, dx: float, dy: float) -> Reflector:
    return replace(reflector, x=reflector.x + dx, y=reflector.y + dy)


def _false(project: Project, rates: FaultRates, seed: int, floor: WalkableFloor | None) -> tuple[ShinyObject, ...]:
    """Things on the free floor that are taken for reflectors."""
    rng = _rng(seed, FALSE)
    count = int(rng.poisson(rates.false))
    if not count:
        return ()
    floor = floor or WalkableFloor.of(project)
    if not len(floor.cells):
        return ()
    return tuple(ShinyObject(x, y, FALSE_RADIUS) for x, y in (floor.draw(rng).tolist() for _ in range(count)))


def _covered(rates: FaultRates, seed: int, duration: float) -> tuple[CoveredPeriod, ...]:
    """Times at which all reflectors are covered."""
    rng = _rng(seed, COVERED)
    count = int(rng.poisson(rates.covered * duration / 3600.0))
    starts, lengths = np.sort(rng.uniform(0.0, duration, count)), rng.uniform(*COVERED_S, count)
    return tuple(CoveredPeriod(*each) for each in zip(starts.tolist(), lengths.tolist(), strict=True))


def _constants(own: ConstantErrors, known: Uncertainty) -> ConstantErrors:
    """Draw by how well the project knows its constants; what else it says of them acts as well.

    More than a file of disturbances may say (0.1 m, rad, s) is refused: constants that are drawn smaller than the
    project knows them would flatter every figure.
    """
    sigmas = (known.survey, known.mounting_position, known.mounting_heading, known.range_bias, known.clock)
    if max(sigmas) > MOST_UNCERTAIN:
        raise UsageError(
            f"the project's uncertainty holds {max(sigmas):g}; expected at most {MOST_UNCERTAIN:g} (m, rad, s) where "
            "constants are drawn by it, or --no-constants"
        )
    return replace(
        own,
        survey_factor=1.0,
        survey_sigma=known.survey,
        mounting_sigma=(known.mounting_position, known.mounting_position, known.mounting_heading),
        range_bias_sigma=known.range_bias,
        clock_offset_sigma=known.clock,
    )


def _rng(seed: int, fault: int, part: int = 0) -> np.random.Generator:
    """Generator of one fault of a seed."""
    return np.random.default_rng((seed, STREAM, fault, part))

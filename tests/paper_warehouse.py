"""A virtual paper warehouse of 8,000 m2 as in Andreasson et al. 2011: reels that come and go, few things that stay."""

# pyright: basic

from __future__ import annotations

import dataclasses
from typing import NamedTuple

import numpy as np

from commission.localization.estimate import Belief
from commission.localization.run_columns import RunColumns
from commission.localization.setup import LocalizerSetup
from commission.localization.whole_run import run
from commission.simulation.drive import DriveOptions
from commission.simulation.scenario import start_of, virtual_drive
from commission.site.disturbances import Disturbances, Reel
from commission.site.floor_map import FREE, OCCUPIED, FloorMap
from commission.site.parameters import OdometryParameters, Parameters, SupervisorParameters, TemporaryParameters
from commission.site.path import MotionLimits
from commission.site.project import Project
from commission.site.record_log import RecordLog
from commission.site.reflectors import Reflector, ReflectorMap
from commission.site.routes import Route, Segment
from commission.site.scanner import Scanner
from commission.site.uncertainty import Uncertainty
from commission.site.vehicle import DifferentialVehicle

LENGTH, WIDTH = 100.0, 80.0
CELL = 0.2
SCANNER = Scanner(
    field_of_view_deg=(-135.0, 135.0), resolution_deg=0.5, rate=10.0, range=(0.1, 40.0), reflector_range=12.0
)
REEL = 0.6
CALIBRATED = OdometryParameters(
    forward_per_sqrt_m=0.01,
    lateral_per_sqrt_m=0.003,
    heading_per_sqrt_m=0.006,
    heading_per_sqrt_rad=0.01,
    acceleration=0.0,
    turn_acceleration=0.0,
)
"""What the wheels of the virtual vehicle are like."""
EXACT = Uncertainty(survey=0.0, mounting_position=0.0, mounting_heading=0.0, range_bias=0.0, clock=0.0)
"""Nothing is wrong in the same way all along, and nobody thinks so."""
UNSUPERVISED = SupervisorParameters(enabled=False, rejection_enabled=False)
SPOTS = np.array(
    [(15.0, 10.0), (50.0, 10.0), (85.0, 10.0), (95.0, 40.0), (85.0, 70.0), (50.0, 70.0), (15.0, 70.0), (5.0, 40.0)]
)
"""Where reflectors may stand: 5 m beside the way, at its corners and in the middle of its sides."""


def route() -> Route:
    """A loop of 244 m through the hall, at 3 m/s, its corners rounded with 8 m."""
    corners = [(15.0, 15.0), (85.0, 15.0), (85.0, 65.0), (15.0, 65.0)]
    points: list[np.ndarray] = []
    for index in range(5):
        here, after = np.array(corners[index % 4]), np.array(corners[(index + 1) % 4])
        before = np.array(corners[(index - 1) % 4])
        ahead, behind = (after - here) / np.linalg.norm(after - here), (before - here) / np.linalg.norm(before - here)
        if index:
            points += [here + 8.0 * behind, here + 2.0 * behind, here + 2.0 * ahead]
        if index < 4:
            points += [here + d * ahead for d in np.arange(8.0, np.linalg.norm(after - here) - 8.0, 6.0)]
    return Route(name="Loop", speed=3.0, segments=(Segment(control_points=np.array(points[:-1])),))


def reels(seed: int) -> tuple[Reel, ...]:
    """Stacks on both sides of the way: most of them stay, some come, some go, a few are carried."""
    rng, found = np.random.default_rng((seed, 8000)), []
    inner, outer = 3.2, -3.2
    sides = [
        ((15.0, 15.0), (1.0, 0.0), 70.0, (0.0, 1.0)),
        ((85.0, 15.0), (0.0, 1.0), 50.0, (-1.0, 0.0)),
        ((85.0, 65.0), (-1.0, 0.0), 70.0, (0.0, -1.0)),
        ((15.0, 65.0), (0.0, -1.0), 50.0, (1.0, 0.0)),
    ]
    for start, along, length, inwards in sides:
        for offset in (inner, outer):
            for way in np.arange(8.0, length - 7.0, 1.8):
                if rng.random() > 0.55:
                    continue
                at = np.array(start) + way * np.array(along) + (offset + rng.normal(0.0, 0.1)) * np.array(inwards)
                if np.min(np.hypot(*(SPOTS - at).T)) < 1.5:
                    continue
                fate, when = rng.random(), float(rng.uniform(5.0, 80.0))
                x, y = float(at[0]), float(at[1])
                if fate < 0.08:
                    found.append(Reel(x=x, y=y, radius=REEL, appears=when))
                elif fate < 0.16:
                    found.append(Reel(x=x, y=y, radius=REEL, vanishes=when))
                elif fate < 0.22:
                    to = at + 15.0 * np.array(inwards) * np.sign(offset)
                    speed = float(rng.uniform(0.1, 1.5))
                    found.append(
                        Reel(x=x, y=y, radius=REEL, carried=when, to_x=float(to[0]), to_y=float(to[1]), speed=speed)
                    )
                else:
                    found.append(Reel(x=x, y=y, radius=REEL))
    return tuple(found)


def floor() -> FloorMap:
    """Four walls."""
    cells = np.full((round(WIDTH / CELL), round(LENGTH / CELL)), FREE, np.int8)
    cells[0], cells[-1], cells[:, 0], cells[:, -1] = OCCUPIED, OCCUPIED, OCCUPIED, OCCUPIED
    return FloorMap(cells=cells, resolution=CELL)


def warehouse(seed: int, spots=range(8)) -> Project:
    """The site with pairs of reflectors at some of the spots."""
    pairs = [
        Reflector(id=f"R{k}{name}", x=float(SPOTS[k, 0] + dx), y=float(SPOTS[k, 1] + dy), radius=0.05)
        for k in spots
        for name, dx, dy in (("a", -0.9, 0.3), ("b", 0.9, -0.3))
    ]
    return Project(
        name="Paper",
        floor_map=floor(),
        reflectors=ReflectorMap(tuple(pairs)),
        routes=(route(),),
        vehicle=DifferentialVehicle(wheel_separation=1.5),
        scanners=(SCANNER,),
        disturbances=Disturbances(reels=reels(seed)),
        parameters=Parameters(odometry=CALIBRATED, supervisor=UNSUPERVISED),
        uncertainty=EXACT,
    )


LIMITS = MotionLimits()


class Drive(NamedTuple):
    project: Project
    log: RecordLog
    start: Belief


def drive(seed: int, spots=range(8)) -> Drive:
    project = warehouse(seed, spots)
    options = DriveOptions(limits=LIMITS)
    log = virtual_drive(project, "Loop", seed, options=options)
    start = start_of(project, "Loop", options)
    return Drive(project, log, Belief(0, start.pose, np.diag(start.sigmas**2)))


def localized(driven: Drive, most: int, **changes) -> RunColumns:
    """The run with up to so many temporary landmarks; 0: the kind is off."""
    own = TemporaryParameters(enabled=most > 0, most=most, **changes)
    parameters = dataclasses.replace(driven.project.parameters, temporary=own)
    setup = dataclasses.replace(LocalizerSetup.of(driven.project), parameters=parameters)
    return run(driven.log, setup, driven.start)


def yard(seed: int, reels: tuple[Reel, ...] | None = None, seconds: float = 12.0) -> Drive:
    """A short way at 1.5 m/s past two reflectors into a yard of nine reels, where there is nothing that stays."""
    if reels is None:
        reels = tuple(Reel(x=x, y=y, radius=REEL) for x in (10.0, 13.0, 16.0) for y in (-3.5, 3.5, 5.5))
    posts = ReflectorMap(
        (Reflector(id="A", x=3.0, y=3.0, radius=0.05), Reflector(id="B", x=3.0, y=-3.0, radius=0.05)),
    )
    way = Segment(control_points=np.array([(0.0, 0.0), (4.0, 0.0), (8.0, 0.5), (1.2 * seconds, 0.0)]))
    project = dataclasses.replace(
        warehouse(seed),
        floor_map=None,
        reflectors=posts,
        routes=(Route(name="Loop", speed=1.5, segments=(way,)),),
        disturbances=Disturbances(reels=reels),
    )
    log = virtual_drive(project, "Loop", seed)
    start = start_of(project, "Loop")
    return Drive(project, log, Belief(0, start.pose, np.diag(start.sigmas**2)))

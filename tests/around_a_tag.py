"""The drives of Dixon et al. 2010, Fig. 5: a square and a circle around a landmark at (1, 0), which is faced all along.

An omnidirectional vehicle with four wheels whose wheels slip, and a camera on it that sees the landmark with noise.
"""

from __future__ import annotations

import dataclasses
import math

import numpy as np

from commission.geometry import se2
from commission.geometry.arrays import FloatArray
from commission.localization.setup import LocalizerSetup
from commission.simulation.constants import draw_truth, true_site
from commission.simulation.drive import TrueMotion, measure
from commission.simulation.tags import tag_frames
from commission.site.disturbances import ConstantErrors, Disturbances, WheelNoise
from commission.site.parameters import OdometryParameters, Parameters
from commission.site.project import Project
from commission.site.record_log import RecordLog
from commission.site.records import Odometry, ReferencePose
from commission.site.tags import Tag, TagCamera
from commission.site.truth import TrueWheels
from commission.site.vehicle import OmnidirectionalVehicle

SPEED = 0.3
"""Of the vehicle [m/s]."""
PERIOD_NS = 20_000_000
SLIPS_PER_100_M = 50.0
"""One every two metres: each of one wheel, which turns by 20 to 60 % too fast for 0.1 to 0.3 s."""
LANDMARK = Tag(id="1", x=1.0, y=0.0, heading=math.pi, sigma=0.003, heading_sigma=0.003)
CAMERA = TagCamera(field_of_view_deg=60.0, range=(0.1, 4.0), position_sigma=0.03, heading_sigma=0.03)
# What slips add to the noise of the wheels, from their rate and size by hand: a slip lasts 0.2 s, a wheel of four is
# 40 % too fast, which is 0.4 v t / 2 = 12 mm, and 0.4 v t / (4 R) = 0.02 rad, where it rolls along the way; half of
# the squares on average over its directions, times half a slip a metre, are added to those of the noise.
ODOMETRY = OdometryParameters(
    forward_per_sqrt_m=0.0117, lateral_per_sqrt_m=0.0067, heading_per_sqrt_m=0.0117, heading_per_sqrt_rad=0.01
)
CONSTANTS = ConstantErrors(survey_factor=1.0, mounting_sigma=(0.002, 0.002, 0.001745), clock_offset_sigma=0.005)
"""As large as the project takes them to be (`Uncertainty`): drawn once for each seed."""
SITE = Project(
    vehicle=OmnidirectionalVehicle(),
    tags=(LANDMARK,),
    tag_camera=CAMERA,
    parameters=Parameters(odometry=ODOMETRY),
    disturbances=Disturbances(constants=CONSTANTS),
)


def places(shape: str, rounds: int) -> FloatArray:
    """(M, 2) way around the landmark [m], a step of one period apart."""
    step = SPEED * PERIOD_NS * 1e-9
    if shape == "circle":
        angles = np.arange(0.0, 2.0 * math.pi * rounds, step) + math.pi
        return np.stack((LANDMARK.x + np.cos(angles), LANDMARK.y + np.sin(angles)), axis=1)
    corners = np.array([(0.0, -1.0), (2.0, -1.0), (2.0, 1.0), (0.0, 1.0), (0.0, -1.0)])
    along = np.arange(0.0, 8.0 * rounds, step) % 8.0
    return np.stack([np.interp(along, np.arange(0.0, 9.0, 2.0), corners[:, axis]) for axis in (0, 1)], axis=1)


def motion(shape: str, rounds: int = 3) -> TrueMotion:
    """True motion: the vehicle looks at the landmark from wherever it is."""
    way = places(shape, rounds)
    poses = np.column_stack((way, np.arctan2(LANDMARK.y - way[:, 1], LANDMARK.x - way[:, 0])))
    twists = np.zeros_like(poses)
    twists[1:] = se2.log(se2.relative(poses[:-1], poses[1:])) / (PERIOD_NS * 1e-9)
    return TrueMotion(np.arange(len(poses), dtype=np.int64) * PERIOD_NS, poses, twists)


def recorded(true: TrueMotion, seed: int, site: Project = SITE, *, slips: float = SLIPS_PER_100_M) -> RecordLog:
    """Odometry of slipping wheels, what the camera sees, and the truth at each of its frames."""
    wheels, camera = (np.random.default_rng((seed, stream)) for stream in (1, 2))
    moved = measure(true, site.vehicle, TrueWheels(noise=WheelNoise()), slips, wheels)
    odometry = [Odometry(stamp, row) for stamp, row in zip(true.stamps_ns.tolist(), moved, strict=True)]
    constants = draw_truth(site, "", seed)
    late_s = constants.tag_camera.clock_offset
    frames = list(tag_frames(true_site(site, constants), true, camera, late_s=late_s))
    # A late stamp is of where the vehicle was: the filter is asked where it is at the stamp.
    stamps = np.minimum([frame.stamp_ns for frame in frames], true.duration_ns)
    truth = [ReferencePose(frame.stamp_ns, pose) for frame, pose in zip(frames, true.poses_at(stamps), strict=True)]
    return RecordLog.collect([*odometry, *frames, *truth])


def setup_of(site: Project = SITE, **filtering: object) -> LocalizerSetup:
    """The setup of a site, with another filter where one is asked for."""
    parameters = dataclasses.replace(site.parameters, filter=dataclasses.replace(site.parameters.filter, **filtering))
    return LocalizerSetup.of(dataclasses.replace(site, parameters=parameters))

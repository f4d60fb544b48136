"""What tags tell a camera at every point of the floor: where one is in sight, and how well one frame tells the pose.

The noise of a sighting alone: where a tag truly stands and how the camera is mounted does not average out, and is in
the predictions along routes.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from commission.geometry.angles import wrap
from commission.geometry.arrays import BoolArray, FloatArray, IntArray, read_only
from commission.geometry.raycast import RayCaster
from commission.geometry.se2 import compose
from commission.planning.coverage import Lattice
from commission.planning.dilution import FixOptions, Heading
from commission.progress import Progress, silent
from commission.site.floor_map import FloorMap
from commission.site.tags import Tag, TagCamera
from commission.site.walls import walls_of

BEFORE_THE_TAG = 0.1
"""How far before a tag its line of sight ends [m]: it may hang on a wall."""
POINTS_AT_ONCE = 4096
"""Points between two words of progress."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class TagCoverage:
    """What tags tell at each of N points of a lattice, at the heading, or the worst or best one, that is asked."""

    lattice: Lattice
    """The points: of base for a heading that is given, else of the camera."""
    seen: IntArray
    """(N,) tags in sight."""
    position_sigma: FloatArray
    """(N,) 1-sigma along the worst direction [m]; inf where no tag is in sight."""
    heading_sigma: FloatArray
    """(N,) 1-sigma [rad]; inf where no tag is in sight."""
    in_reach: IntArray
    """(N,) tags in sight of a camera that would look all round: one at least at some heading."""


def tag_coverage(  # noqa: PLR0917 - the site, and what is asked
    tags: Sequence[Tag],
    camera: TagCamera,
    floor: FloorMap | None,
    lattice: Lattice,
    options: FixOptions,
    progress: Progress = silent,
) -> TagCoverage:
    """Compute what tags tell over the floor.

    Parameters
    ----------
    tags : of the site.
    camera : on the vehicle.
    floor : walls that hide tags, where there is a map.
    lattice : the points.
    options : which headings are looked at; by scanner means the worst, unless the camera itself sees all round.
    progress : told how far it is; may raise to cancel.
    """
    points, walls = lattice.points(), walls_of(floor)
    poses = np.array([tag.pose for tag in tags], dtype=np.float64).reshape(-1, 3)
    headings, any_way = _headings(camera, options)
    found, reach = np.empty((len(points), 3)), np.empty(len(points), dtype=np.int64)
    for first in range(0, len(points), POINTS_AT_ONCE):
        progress(first / len(points), "tags over the floor")
        here = slice(first, min(first + POINTS_AT_ONCE, len(points)))
        at_heading: list[FloatArray] = []
        clear = np.zeros((here.stop - here.start, len(poses)), dtype=np.bool_)
        for heading in headings:
            lever = np.zeros(2)
            if options.heading is Heading.GIVEN:
                lever = compose(np.array((0.0, 0.0, heading)), camera.mounting)[:2]
            away = poses[np.newaxis, :, :2] - points[here, np.newaxis] - lever
            if not at_heading or options.heading is Heading.GIVEN:
                clear = _clear(away, points[here] + lever, camera, walls if floor is not None else None)
            turned = wrap(np.arctan2(away[..., 1], away[..., 0]) - heading - camera.mounting[2])
            seen = clear & (any_way | (np.abs(turned) <= 0.5 * math.radians(camera.field_of_view_deg)))
            at_heading.append(sigmas_of(away + lever, seen, camera))
        reach[here] = clear.sum(axis=1)
        worst, best = np.max(at_heading, axis=0), np.min(at_heading, axis=0)
        is_best = options.heading is Heading.BEST
        found[here, 1:] = (best if is_best else worst)[:, 1:]
        # Of tags more are better.
        found[here, 0] = (worst if is_best else best)[:, 0]
    return TagCoverage(
        lattice=lattice,
        seen=read_only(found[:, 0].astype(np.int64)),
        position_sigma=read_only(found[:, 1].copy()),
        heading_sigma=read_only(found[:, 2].copy()),
        in_reach=read_only(reach),
    )


def sigmas_of(away: FloatArray, seen: BoolArray, camera: TagCamera) -> FloatArray:
    """(N, 3) tags in sight, 1-sigma of the position along its worst direction [m] and of the heading [rad].

    Parameters
    ----------
    away : (N, T, 2) from base to each tag [m], map axes.
    seen : (N, T) whether it is in sight.
    camera : noise of a sighting.

    Notes
    -----
    Information of x, y and heading: sum of ((I, J d), ((J d)^T, d^2)) / s^2 and 1 / t^2 of the heading, with d from
    base to the tag, J d = (-d_y, d_x), s and t the 1-sigmas of place and heading: H^T R^-1 H with H of Dixon et al.
    2010, equations 17 to 20, in the map's axes.
    """
    place, turned = max(camera.position_sigma, 1e-9) ** -2, max(camera.heading_sigma, 1e-9) ** -2
    count = seen.sum(axis=1).astype(np.float64)
    across = np.stack((-away[..., 1], away[..., 0]), axis=-1) * seen[..., np.newaxis]
    mean = across.sum(axis=1)
    heading = place * (np.square(away).sum(axis=-1) * seen).sum(axis=1) + turned * count
    with np.errstate(divide="ignore", invalid="ignore"):
        # By blocks: C_tt = 1 / (I_tt - |I_tx|^2 / I_xx), C_xx = I / I_xx + m m^T C_tt with m the mean of J d.
        middle = mean / count[:, np.newaxis]
        c_tt = 1.0 / (heading - place * np.square(mean).sum(axis=1) / count)
        largest = 1.0 / (place * count) + np.square(middle).sum(axis=1) * c_tt
    none = count == 0.0
    return np.column_stack((count, np.where(none, math.inf, np.sqrt(largest)), np.where(none, math.inf, np.sqrt(c_tt))))


def _headings(camera: TagCamera, options: FixOptions) -> tuple[FloatArray, bool]:
    """Headings that are looked at, and whether the camera sees all round in each."""
    round_about = camera.field_of_view_deg >= 360.0
    if options.heading is Heading.ALL_ROUND or (round_about and options.heading is not Heading.GIVEN):
        return np.zeros(1), True
    if options.heading is Heading.GIVEN:
        return np.array([options.given_heading]), round_about
    return np.arange(options.headings, dtype=np.float64) * (2.0 * math.pi / options.headings), False


def _clear(away: FloatArray, cameras: FloatArray, camera: TagCamera, walls: RayCaster | None) -> BoolArray:
    """(N, T) whether each tag is within range of a camera (N, 2), and no wall hides it."""
    distances = np.hypot(away[..., 0], away[..., 1])
    near, far = camera.range
    clear = (distances >= near) & (distances <= far)
    if walls is not None and clear.any():
        n, t = np.nonzero(clear)
        part = np.maximum(distances[n, t] - BEFORE_THE_TAG, 0.0) / np.maximum(distances[n, t], 1e-9)
        ends = cameras[n] + part[:, np.newaxis] * away[n, t]
        clear[n, t] = walls.line_of_sight(cameras[n], ends)
    return clear

"""A virtual camera that looks for tags: what it reports of those in its field of view that no wall hides."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from commission.geometry import se2
from commission.geometry.angles import wrap
from commission.geometry.arrays import FloatArray
from commission.geometry.raycast import RayCaster
from commission.simulation.drive import TrueMotion
from commission.site.project import Project
from commission.site.records import TagSightings
from commission.site.walls import walls_of


def tag_frames(
    site: Project, motion: TrueMotion, rng: np.random.Generator, *, late_s: float = 0.0
) -> Iterator[TagSightings]:
    """Deliver the frames of a drive; none where the site has no tags.

    Parameters
    ----------
    site : tags where they stand, the camera as it is mounted, and walls.
    motion : true motion of base.
    rng : noise of the sightings.
    late_s : how much later than they were taken frames are stamped [s]; what is stamped before the drive is lost.

    Yields
    ------
    frame : also where it sees no tag. An anonymous tag has no id in it.
    """
    if not site.tags:
        return
    camera, late_ns = site.tag_camera, round(1e9 * late_s)
    stamps = np.arange(0, motion.duration_ns + 1, round(1e9 / camera.rate), dtype=np.int64)
    cameras = se2.compose(motion.poses_at(stamps), camera.mounting)
    tags = np.array([tag.pose for tag in site.tags])
    noise = np.array((camera.position_sigma, camera.position_sigma, camera.heading_sigma))
    said = np.where(noise > 0.0, noise, np.nan)
    walls = walls_of(site.floor_map)
    for stamp, T_map_camera in zip(stamps.tolist(), cameras, strict=True):
        # Of every tag, seen or not: what one of them draws does not depend on the others.
        draws = rng.standard_normal((len(tags), 3))
        poses = se2.relative(np.broadcast_to(T_map_camera, tags.shape), tags)
        seen = np.flatnonzero(_in_sight(site, T_map_camera, poses, walls))
        measured = poses[seen] + noise * draws[seen]
        measured[:, 2] = wrap(measured[:, 2])
        rows = np.concatenate([measured, np.broadcast_to(said, measured.shape)], axis=1)
        ids = tuple("" if site.tags[index].anonymous else site.tags[index].id for index in seen.tolist())
        if stamp + late_ns >= 0:
            yield TagSightings(stamp + late_ns, rows, ids)


def _in_sight(site: Project, T_map_camera: FloatArray, poses: FloatArray, walls: RayCaster) -> np.ndarray:
    """(T,) whether the camera sees each tag, from its pose in the camera's frame."""
    camera = site.tag_camera
    distances = np.hypot(poses[:, 0], poses[:, 1])
    bearings = np.abs(np.arctan2(poses[:, 1], poses[:, 0]))
    near, far = camera.range
    seen = (distances >= near) & (distances <= far) & (bearings <= 0.5 * math.radians(camera.field_of_view_deg))
    if site.floor_map is not None and seen.any():
        # Up to just before the tag: it may hang on a wall.
        toward = np.array([(tag.x, tag.y) for tag in site.tags]) - T_map_camera[:2]
        part = np.maximum(distances - 0.1, 0.0) / np.maximum(distances, 1e-9)
        ends = T_map_camera[:2] + part[:, np.newaxis] * toward
        seen &= walls.line_of_sight(np.broadcast_to(T_map_camera[:2], ends.shape), ends)
    return seen

"""Motion from a contour in vision: Alenya et al. 2005, sections III and V, with synthetic cameras of its setup.

7.7 m before an information board, 3.5 m of motion in 200 frames with small turnings; points to 0.3 pixels at a focal
length of 1,000, the laser to 2 mm and 0.5 mrad.
"""

import numpy as np

from commission.site.contour_track import ContourTrack
from commission.studies.vision import VisionInput, vision, vision_alone
from tests.virtual_camera import DEPTH, WAY, Camera, drive, increments, place, seen

LASER = np.array([0.002, 0.002, 0.0005])


def track_of(pixels, camera):
    stamps = 126_000_000 * np.arange(len(pixels), dtype=np.int64)
    names = tuple(map(str, range(pixels.shape[1])))
    return ContourTrack(stamps_ns=stamps, points=pixels / camera.focal_length, names=names)


def test_motion_is_within_three_percent_unbiased_and_the_camera_within_three_sigma(seeds):
    camera, base = Camera(), drive()
    true = {**camera.constants, "depth": DEPTH}
    truth = increments(place(base, camera))
    errors, alone, closed, off, ends, spread = [], [], [], [], [], []
    for seed in seeds(4, 40):
        rng = np.random.default_rng(seed)
        track = track_of(seen(base, camera, rng), camera)
        poses = base + rng.normal(size=base.shape) * LASER
        covariances = np.broadcast_to(np.diag(np.square(LASER)), (len(base), 3, 3))
        result = vision(VisionInput(track=track, poses=poses, covariances=covariances))
        errors.append(result.camera - truth)
        alone.append(vision_alone(track)[0] * [DEPTH, DEPTH, 1.0] - truth)
        closed.append(result.closed_form - truth)
        ends.append(errors[-1][-1, :2])
        spread.append(result.camera_covariances[-1, :2, :2])
        off.append([(each.value - true[each.name]) / each.sigma for each in result.constants])

    def share(found):
        return np.sqrt(np.mean(np.square(np.array(found)[..., :2]), axis=1)).max(axis=0) / WAY

    # In each drive: forward to a hundredth of what the paper differs by, sideways to less than it.
    assert (share(errors) < (0.003, 0.03)).all(), share(errors)
    assert (share(alone) < (0.003, 0.03 if len(off) < 10 else 0.045)).all(), share(alone)
    # What the paper itself computes from the same points is several times worse: 3 % and more.
    assert share(closed)[1] > 0.03
    assert np.abs(off).max() < (3.0 if len(off) < 10 else 4.0), np.round(off, 1)
    assert (np.abs(np.mean(off, axis=0)) < 3.0 / np.sqrt(len(off))).all(), np.mean(off, axis=0)
    # Unbiased: the mean of the last place is within three of its own sigmas.
    sigma = np.sqrt(np.mean(np.diagonal(spread, axis1=1, axis2=2), axis=0) / len(ends))
    assert (np.abs(np.mean(ends, axis=0)) < 3.0 * sigma).all(), (np.mean(ends, axis=0), sigma)

"""Dixon et al. 2010, Fig. 5: an omnidirectional vehicle whose wheels slip, around an all-state landmark at (1, 0)."""

# pyright: basic

import numpy as np
import pytest

from commission.geometry import se2
from commission.geometry.angles import wrap
from commission.localization.estimate import Belief, Mode
from commission.localization.whole_run import run
from tests.around_a_tag import CAMERA, motion, recorded, setup_of

START = np.array((0.02, 0.02, 0.01))


@pytest.mark.parametrize("shape", ["square", "circle"])
def test_the_estimate_follows_the_truth_where_odometry_does_not(shape, seeds):
    true = motion(shape)
    anees, errors, drifts, setup = [], [], [], setup_of()
    for seed in seeds(6, 40):
        log = recorded(true, seed)
        off = START * np.random.default_rng((seed, 9)).standard_normal(3)
        start = Belief(0, true.poses[0] + off, np.diag(START**2))
        columns = run(log, setup, start)
        error = columns.means - log.reference_poses
        error[:, 2] = wrap(error[:, 2])
        assert (columns.modes == Mode.OPERATIONAL).all()
        anees.append(np.mean(np.einsum("ki,kij,kj->k", error, np.linalg.inv(columns.covariances), error)) / 3.0)
        errors.append(np.sqrt(np.mean(np.sum(error[:, :2] ** 2, axis=1))))
        pose = start.mean
        for displacement in log.displacements:
            pose = se2.compose(pose, displacement)
        drifts.append(np.hypot(*(pose - true.poses[-1])[:2]))
    # Less than half of the noise of one sighting, and a fifth of what odometry alone is off at the end.
    assert np.mean(errors) < 0.5 * CAMERA.position_sigma
    assert np.mean(drifts) > 5.0 * np.mean(errors), (np.mean(drifts), np.mean(errors))
    assert 0.8 < np.mean(anees) < 1.25, np.mean(anees)

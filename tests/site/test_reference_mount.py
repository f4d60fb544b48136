"""A reference that measures another point than base, by another clock: against places by hand and differences."""

from __future__ import annotations

import math

import numpy as np
import pytest

from commission.site.reference_mount import BASE, ReferenceMount

QUARTER = 0.5 * math.pi


def test_an_antenna_in_front_and_to_the_left_is_taken_to_base_by_the_heading() -> None:
    mount = ReferenceMount(antenna=(1.0, 0.5, 2.2))
    # Facing along y, what is 1 m in front is 1 m further in y, and what is 0.5 m to the left is 0.5 m less in x.
    poses = np.array([[5.0, 3.0, 0.0], [5.0, 3.0, QUARTER], [5.0, 3.0, math.pi], [5.0, 3.0, math.nan]])
    expected = [[4.0, 2.5, 0.0], [5.5, 2.0, QUARTER], [6.0, 3.5, math.pi], [5.0, 3.0, math.nan]]
    np.testing.assert_allclose(mount.at_base(poses), expected, atol=1e-12)
    # Where the heading is unknown another one is taken; where it is known that one counts.
    headings = np.full(4, QUARTER)
    np.testing.assert_allclose(mount.at_base(poses, headings)[:, :2], [[4, 2.5], [5.5, 2], [6, 3.5], [5.5, 2]])


def test_a_clock_that_is_late_stamps_poses_later_than_they_were_measured() -> None:
    mount = ReferenceMount(clock_offset=0.025)
    assert mount.true_stamps(np.array([1_000_000_000, 2_000_000_000])).tolist() == [975_000_000, 1_975_000_000]


@pytest.mark.parametrize("heading", [-2.0, 0.3, 1.9])
def test_the_covariance_of_the_antenna_is_that_of_its_place_by_finite_differences(heading: float) -> None:
    mount = ReferenceMount(antenna=(0.8, -0.6))

    def place(pose: np.ndarray) -> np.ndarray:
        x, y, theta = pose
        c, s = math.cos(theta), math.sin(theta)
        return np.array([x + 0.8 * c + 0.6 * s, y + 0.8 * s - 0.6 * c, theta])

    pose, step = np.array([2.0, 3.0, heading]), 1e-6
    jacobian = np.stack([(place(pose + d) - place(pose - d)) / (2 * step) for d in step * np.eye(3)], axis=1)
    root = np.array([[0.02, 0.0, 0.0], [0.005, 0.03, 0.0], [0.002, -0.004, 0.01]])
    covariance = root @ root.T
    found = mount.at_antenna(covariance[np.newaxis], np.array([heading]))[0]
    np.testing.assert_allclose(found, jacobian @ covariance @ jacobian.T, rtol=1e-6, atol=1e-12)


def test_a_reference_of_base_is_left_as_it_is() -> None:
    poses, covariances = np.array([[1.0, 2.0, 0.3]]), np.eye(3)[np.newaxis]
    assert BASE.at_base(poses) is poses
    assert BASE.at_antenna(covariances, np.zeros(1)) is covariances


@pytest.mark.parametrize(
    ("mount", "message"),
    [
        ({"antenna": (1.0,)}, "reference.antenna has 1 numbers; expected x, y and maybe z"),
        ({"antenna": (1.0, math.nan)}, "reference.antenna is nan; expected"),
        ({"antenna": (1.0, 50.1)}, "reference.antenna is 50.1; expected -50 to 50 m"),
        ({"clock_offset": 3600.1}, "reference.clock_offset is 3600.1; expected -3600 to 3600 s"),
    ],
)
def test_what_no_vehicle_has_is_refused(mount: dict[str, object], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        ReferenceMount(**mount)  # pyright: ignore[reportArgumentType]

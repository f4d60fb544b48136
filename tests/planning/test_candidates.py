"""Candidates: on every face of walls and pillars, at allowed heights, outside keep-out areas, off the vehicle's way."""

import math

import numpy as np
import pytest

from commission.geometry.occupancy import OccupancyGrid
from commission.planning.candidates import clear_of, mounting_heights, wall_candidates
from commission.site.layout_brief import AllowedHeights, CandidateOptions


def pillar() -> OccupancyGrid:
    """A pillar from 3.5 to 4.5 and 2 to 3 m."""
    occupied = np.zeros((100, 160), dtype=np.bool_)
    occupied[40:60, 70:90] = True
    return OccupancyGrid(occupied, 0.05)


def test_candidates_stand_off_walls_at_their_spacing_and_outside_keep_out_areas():
    options = CandidateOptions(spacing=0.4, keep_out=((3.0, 0.0, 5.0, 2.5),))
    centers = wall_candidates(pillar(), options)
    outside = np.maximum(np.abs(centers - (4.0, 2.5)) - 0.5, 0.0)
    off = np.hypot(*outside.T)
    assert off.min() >= options.radius
    # A gap and a radius, and a cell and the diagonal of a half one by which centers of cells differ.
    assert off.max() <= options.radius + options.gap + 1.71 * 0.05
    assert centers[:, 1].min() > 2.5
    beside = (centers[:, 1] > 2.5) & (centers[:, 1] < 3.0)
    # Around a corner two faces may come nearer.
    for face in (np.abs(centers[:, 0] - 4.0) < 0.5, beside & (centers[:, 0] < 3.5), beside & (centers[:, 0] > 4.5)):
        on_it = centers[face]
        assert len(on_it) >= 1
        apart = np.hypot(*(on_it[:, np.newaxis] - on_it).transpose(2, 0, 1))[np.triu_indices(len(on_it), 1)]
        assert apart.min(initial=9.0) >= 0.4 * (1.0 - 1e-9)


def test_each_face_of_a_pillar_thinner_than_the_spacing_has_a_place():
    centers = wall_candidates(pillar(), CandidateOptions(spacing=3.0))
    assert len(centers) == 4
    directions = {tuple(np.round((center - (4.0, 2.5)) / 0.6).astype(int).tolist()) for center in centers}
    # To the right and left, above and below, wherever on the face.
    assert {direction[0] for direction in directions} >= {-1, 1}
    assert {direction[1] for direction in directions} >= {-1, 1}


def test_a_middle_is_put_at_the_allowed_height_nearest_to_the_beams():
    centers = np.array([[1.0, 1.0], [6.0, 1.0], [11.0, 1.0], [16.0, 1.0]])
    options = CandidateOptions(
        height=0.2,
        length=0.3,
        allowed_heights=(
            AllowedHeights(0.0, 2.0),
            AllowedHeights(0.3, 2.0, (5.0, 0.0, 7.0, 2.0)),
            AllowedHeights(0.4, 2.0, (12.0, 2.0, 10.0, 0.0)),
            AllowedHeights(0.0, 0.1, (15.0, 0.0, 17.0, 2.0)),
        ),
    )
    # At 0.3 m the lower end of 0.3 m is at 0.15 m, and is met; at 0.4 m it is not.
    np.testing.assert_allclose(mounting_heights(centers, options), [0.2, 0.3, math.nan, 0.1])


def test_there_are_no_candidates_where_no_allowed_height_meets_the_beams():
    high = AllowedHeights(1.0, 2.0, (0.0, 0.0, 4.0, 5.0))
    centers = wall_candidates(pillar(), CandidateOptions(spacing=0.3, allowed_heights=(high,)))
    assert len(centers) > 3
    assert centers[:, 0].min() > 4.0


@pytest.mark.parametrize("heights", [(2.0, 1.0), (-1.0, 1.0), (0.0, math.inf)])
def test_heights_out_of_order_are_refused(heights):
    with pytest.raises(ValueError, match="allowed_heights"):
        AllowedHeights(*heights)


def test_places_in_the_way_are_left_out():
    centers = np.array([[0.0, 1.0], [0.0, 3.0]])
    assert clear_of(centers, np.array([[0.0, 0.0], [1.0, 0.0]]), 2.0).tolist() == [False, True]
    assert clear_of(centers, np.empty((0, 2)), 2.0).all()

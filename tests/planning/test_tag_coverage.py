"""What tags tell over the floor, against closed forms and information by differences."""

# pyright: basic

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from commission.geometry import se2
from commission.geometry.angles import wrap
from commission.planning.coverage import Lattice
from commission.planning.dilution import FixOptions, Heading
from commission.planning.tag_coverage import tag_coverage
from commission.site.floor_map import FREE, OCCUPIED, FloorMap
from commission.site.tags import Tag, TagCamera

CAMERA = TagCamera(
    mounting=np.array((0.3, -0.1, 0.4)),
    field_of_view_deg=90.0,
    range=(0.2, 5.0),
    position_sigma=0.03,
    heading_sigma=0.02,
)
AHEAD, BESIDE = Tag(id="1", x=3.0, y=0.0, heading=2.0), Tag(id="2", x=1.0, y=3.0, heading=-1.0)
ALL_ROUND, WORST, BEST = (FixOptions(heading=each) for each in (Heading.ALL_ROUND, Heading.WORST, Heading.BEST))
HERE = Lattice(x=0.0, y=0.0, spacing=1.0, rows=1, columns=1)


def by_differences(pose, tags, mounting):
    """1-sigma of position and heading from the derivative of what the camera measures."""

    def sighted(at):
        return np.array([se2.relative(se2.compose(at, mounting), tag.pose) for tag in tags])

    steps = 1e-6 * np.eye(3)
    H = np.stack([(sighted(pose + d) - sighted(pose - d)) for d in steps], axis=-1)
    H[:, 2] = wrap(H[:, 2])
    H = H.reshape(-1, 3) / 2e-6
    weights = np.tile((CAMERA.position_sigma**-2, CAMERA.position_sigma**-2, CAMERA.heading_sigma**-2), len(tags))
    P = np.linalg.inv(H.T @ (weights[:, np.newaxis] * H))
    return math.sqrt(np.linalg.eigvalsh(P[:2, :2])[1]), math.sqrt(P[2, 2])


def test_a_tag_alone_tells_the_position_by_its_noise_and_the_heading_times_its_distance():
    found = tag_coverage((AHEAD,), CAMERA, None, HERE, ALL_ROUND)
    assert found.seen.tolist() == found.in_reach.tolist() == [1]
    assert found.position_sigma[0] == pytest.approx(math.hypot(0.03, 3.0 * 0.02))
    assert found.heading_sigma[0] == pytest.approx(0.02)


@pytest.mark.parametrize("heading", [-0.3, 0.2])
def test_several_tags_tell_what_the_derivative_of_the_sightings_says(heading):
    given = FixOptions(heading=Heading.GIVEN, given_heading=heading)
    wide = dataclasses.replace(CAMERA, field_of_view_deg=200.0)
    found = tag_coverage((AHEAD, BESIDE), wide, None, HERE, given)
    expected = by_differences(np.array((0.0, 0.0, heading)), (AHEAD, BESIDE), CAMERA.mounting)
    assert found.seen[0] == 2
    assert (found.position_sigma[0], found.heading_sigma[0]) == pytest.approx(expected, rel=1e-6)


def test_a_tag_is_seen_in_the_field_of_view_within_range_and_where_no_wall_hides_it():
    def seen(heading, tag=AHEAD, floor=None):
        given = FixOptions(heading=Heading.GIVEN, given_heading=heading)
        return int(tag_coverage((tag,), CAMERA, floor, HERE, given).seen[0])

    # The camera is turned by 0.4 rad and sees 45 degrees to either side; from (0.3, -0.1) the tag is nearly ahead.
    assert [seen(heading) for heading in (-1.1, -1.0, 0.3, 0.5)] == [0, 1, 1, 0]
    assert seen(0.0, dataclasses.replace(AHEAD, x=5.5)) == 0
    cells = np.full((80, 80), FREE, dtype=np.int8)
    cells[:, 60] = OCCUPIED
    wall = FloorMap(cells=cells, resolution=0.1, origin=np.array((-4.0, -4.0, 0.0)))
    # A wall at x = 2: before the tag it hides it, behind it, or where the tag hangs, it does not.
    assert [seen(0.0, dataclasses.replace(AHEAD, x=x), wall) for x in (3.0, 1.95)] == [0, 1]


def test_the_worst_heading_sees_none_and_the_best_one_what_is_in_reach():
    worst, best = (tag_coverage((AHEAD,), CAMERA, None, HERE, options) for options in (WORST, BEST))
    assert (worst.seen[0], worst.position_sigma[0], worst.in_reach[0]) == (0, math.inf, 1)
    assert (best.seen[0], best.in_reach[0]) == (1, 1)
    assert best.position_sigma[0] == pytest.approx(math.hypot(0.03, 3.0 * 0.02))
    nothing = tag_coverage((), CAMERA, None, HERE, BEST)
    assert (nothing.seen[0], nothing.heading_sigma[0]) == (0, math.inf)

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from commission.errors import UsageError
from commission.localization.estimate import Mode
from commission.site.project import Project
from commission.site.record_log import RecordLog
from commission.site.records import Detections, Odometry, ReferencePose
from commission.site.reflectors import Reflector, ReflectorMap
from commission.site.routes import Direction, Route, Segment
from commission.studies.start import DEFAULT_SIGMAS, StartOrigin, route_start, start_of

SECOND = 1_000_000_000


def recording(*references):
    records = [Odometry(5 * SECOND, [0.0, 0.0, 0.0]), Detections(6 * SECOND, np.empty((0, 2)))]
    return RecordLog.collect([*records, *(ReferencePose(round(s * SECOND), pose) for s, pose in references)])


def project_with_route(direction=Direction.FORWARD):
    segment = Segment(control_points=[[1.0, 2.0], [1.0, 2.0], [1.0, 4.0], [3.0, 4.0]], direction=direction)
    return Project(routes=(Route("Loop", (segment,)),))


def test_a_given_pose_wins_over_the_reference_and_is_wrapped():
    start = start_of(Project(), recording((5.0, [9.0, 9.0, 0.0])), (1.0, -2.0, 4.0), (0.1, 0.2, 0.3))
    assert start.origin is StartOrigin.GIVEN
    assert start.belief.stamp_ns == 5 * SECOND
    assert_allclose(start.belief.mean, [1.0, -2.0, 4.0 - 2.0 * math.pi])
    assert_allclose(start.belief.covariance, np.diag([0.01, 0.04, 0.09]))


def test_the_first_reference_with_a_heading_is_the_start():
    log = recording((5.0, [1.0, 1.0, math.nan]), (5.1, [2.0, 1.0, 0.5]), (5.2, [3.0, 1.0, 0.5]))
    start = start_of(project_with_route(), log)
    assert start.origin is StartOrigin.REFERENCE
    assert_allclose(start.belief.mean, [2.0, 1.0, 0.5])
    assert_allclose(np.sqrt(np.diag(start.belief.covariance)), DEFAULT_SIGMAS)


def test_a_reference_that_comes_too_late_is_not_the_start():
    start = start_of(project_with_route(), recording((6.1, [2.0, 1.0, 0.5])))
    assert start.origin is StartOrigin.ROUTE
    assert_allclose(start.belief.mean, [1.0, 2.0, math.pi / 2.0])


def test_a_route_that_starts_in_reverse_has_the_vehicle_face_backward():
    heading = route_start(project_with_route(Direction.REVERSE).routes[0])[2]
    assert_allclose(heading, math.pi * 1.5)


def test_where_nobody_says_where_a_recording_starts_the_vehicle_looks_for_itself():
    reflectors = ReflectorMap((Reflector(id="A", x=0.0, y=-1.0), Reflector(id="B", x=10.0, y=3.0)))
    start = start_of(Project(reflectors=reflectors), recording())
    assert start.origin is StartOrigin.SEARCH
    state = start.state()
    assert state.tracking.mode == Mode.INITIALIZING
    assert state.search is not None
    # Evenly spread over the rectangle around the reflectors and 5 m beyond, and over all headings.
    assert_allclose(start.belief.mean, [5.0, 1.0, 0.0])
    assert_allclose(start.belief.covariance, np.diag([20.0**2 / 12.0, 14.0**2 / 12.0, math.pi**2 / 3.0]))


def test_a_start_that_somebody_knows_is_tracked_from_the_first_record():
    state = start_of(project_with_route(), recording()).state()
    assert (state.tracking.mode, state.search) == (Mode.OPERATIONAL, None)


def test_an_empty_recording_is_refused():
    with pytest.raises(UsageError, match="no record"):
        start_of(project_with_route(), RecordLog.collect([]), (0.0, 0.0, 0.0))

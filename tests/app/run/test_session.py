from dataclasses import replace

import numpy as np
import pytest

from commission.app.run.session import Drive, Session
from commission.app.tune.reducer import with_parameter
from commission.localization import whole_run
from commission.localization.estimate import Mode
from commission.localization.setup import LocalizerSetup
from commission.site.project import Project
from commission.site.record_log import RecordLog
from commission.site.records import Detections, Odometry


@pytest.fixture
def session(drive: Drive, project: Project) -> Session:
    return Session(drive, LocalizerSetup.of(project), clock=lambda: 0.0)


def to_the_end(session: Session) -> None:
    session.advance(1e6)
    assert session.at_end


def test_playing_processes_what_is_due_and_nothing_else(session: Session) -> None:
    session.advance(1.05)
    stamps = session.view().series.times
    assert stamps[-1] == pytest.approx(1.0)
    assert len(stamps) == 11
    assert session.view().time == pytest.approx(1.05)


def test_played_in_slices_the_run_is_the_whole_run_to_the_last_bit(session: Session, project: Project) -> None:
    while not session.at_end:
        session.advance(0.37)
    run = whole_run.run(session.drive.log, LocalizerSetup.of(project), session.drive.initial)
    np.testing.assert_array_equal(session.view().series.means, run.means)


def test_a_step_processes_one_scan(session: Session) -> None:
    assert session.step()
    assert session.cycles == 1
    assert session.step()
    assert session.cycles == 2


def test_no_step_is_left_at_the_end(session: Session) -> None:
    to_the_end(session)
    assert not session.step()


def test_seeking_back_gives_what_was_there(session: Session) -> None:
    session.advance(3.0)
    then = session.view()
    session.advance(4.0)
    session.seek(3.0)
    session.advance(0.0)
    assert session.seeking is None
    np.testing.assert_array_equal(session.view().pose, then.pose)
    assert len(session.view().series) == len(then.series)


def test_a_long_seek_is_done_in_slices_and_says_how_far_it_is(drive: Drive, project: Project) -> None:
    now = iter(np.arange(0.0, 1e6, 0.004))
    session = Session(drive, LocalizerSetup.of(project), clock=lambda: float(next(now)))
    session.seek(8.0)
    shares = []
    while session.seeking is not None:
        shares.append(session.seeking)
        session.advance(0.0)
    assert len(shares) > 3
    assert shares == sorted(shares)
    assert session.view().time == pytest.approx(8.0)


def test_a_seek_beyond_the_end_ends_at_the_end(session: Session) -> None:
    session.seek(1e9)
    session.advance(0.0)
    assert session.at_end
    assert session.view().time == pytest.approx(session.view().duration)


def test_a_new_gate_acts_on_the_next_scan_and_the_filter_goes_on(session: Session, project: Project) -> None:
    session.advance(2.0)
    before = session.view()
    wider = with_parameter(project.parameters, "association.gate_probability", 0.9999)
    session.set_setup(LocalizerSetup.of(replace(project, parameters=wider)))
    np.testing.assert_array_equal(session.view().pose, before.pose)
    session.step()
    after = session.view()
    assert after.estimate is not None and before.estimate is not None
    assert after.estimate.gate > before.estimate.gate
    assert np.ptp(after.gates, axis=1).mean() > 1.5 * np.ptp(before.gates, axis=1).mean()
    assert len(after.series) == len(before.series) + 1


def test_covered_reflectors_end_in_fail_mode_and_uncovered_it_recovers_by_itself(
    session: Session, project: Project
) -> None:
    tight = with_parameter(project.parameters, "supervisor.position_limit", 0.03)
    session.set_setup(LocalizerSetup.of(replace(project, parameters=tight)))
    session.advance(1.0)
    assert session.view().mode is Mode.OPERATIONAL
    session.covered = True
    session.advance(6.0)
    assert session.view().mode is Mode.FAIL
    assert session.view().scan_map.size > 0
    session.covered = False
    session.advance(2.0)
    assert session.view().mode is Mode.OPERATIONAL
    (episode,) = session.view().episodes
    assert 1.0 < episode[0] < episode[1] < 9.0


def test_predicted_episodes_are_shown_for_what_lies_ahead_only(session: Session) -> None:
    session.advance(4.0)
    session.predicted = ((1.0, 2.0), (3.0, 5.0), (6.0, 7.0))
    assert session.view().episodes == ((4.0, 5.0), (6.0, 7.0))


def test_a_slow_machine_plays_slower_and_does_not_fall_behind(drive: Drive, project: Project) -> None:
    now = iter(np.arange(0.0, 1e6, 0.015))
    session = Session(drive, LocalizerSetup.of(project), clock=lambda: float(next(now)))
    session.advance(5.0)
    assert 0 < session.cycles < 10
    assert session.view().time < 1.0


def test_the_sensors_own_detections_need_no_scan(project: Project, drive: Drive) -> None:
    records = []
    for k in range(1, 6):
        records += [Odometry(k * 10**8, np.zeros(3)), Detections(k * 10**8, np.array([[3.0, 0.1]]))]
    session = Session(Drive(RecordLog.collect(records), drive.initial), LocalizerSetup.of(project))
    to_the_end(session)
    view = session.view()
    assert len(view.series) == 5
    assert view.scan_map.shape == (0, 2)
    assert np.isnan(view.series.error).all()


def test_before_the_first_scan_the_vehicle_stands_at_its_initial_pose(session: Session) -> None:
    view = session.view()
    assert view.estimate is None
    np.testing.assert_array_equal(view.pose, session.drive.initial.mean)
    assert len(view.series) == 0

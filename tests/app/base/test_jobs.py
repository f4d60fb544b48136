"""Background work as its owner sees it: reports in order, one result or one error, and a way to stop."""

from __future__ import annotations

import logging
import threading
from collections.abc import Iterator
from queue import SimpleQueue

import pytest

from commission.app.base.jobs import Job, JobReport, Jobs, JobState
from commission.errors import JobError, ProjectError
from commission.progress import Progress


class Owner:
    """Stands for the thread that owns the project: collects what is posted."""

    def __init__(self) -> None:
        self.queue: SimpleQueue[JobReport] = SimpleQueue()
        self.jobs = Jobs(self.queue.put)

    def reports_until_the_end_of(self, job: Job) -> list[JobReport]:
        """Reports about this job, in order; others that come first are dropped."""
        reports: list[JobReport] = []
        while not reports or reports[-1].job.state in (JobState.WAITING, JobState.RUNNING):
            report = self.queue.get(timeout=10)
            if report.job.number == job.number:
                reports.append(report)
        return reports


@pytest.fixture
def owner() -> Iterator[Owner]:
    owner = Owner()
    yield owner
    assert owner.jobs.close(timeout=10)


def until_stopped(progress: Progress) -> None:
    """Work that ends only when it is cancelled."""
    pause = threading.Event()
    while True:
        progress(0.5, "turning")
        pause.wait(0.002)


def test_a_job_waits_runs_and_delivers_its_result_once(owner: Owner) -> None:
    job = owner.jobs.start("Coverage", lambda progress: [1, 2, 3])
    reports = owner.reports_until_the_end_of(job)
    assert [report.job.state for report in reports] == [JobState.WAITING, JobState.RUNNING, JobState.DONE]
    assert [report.result for report in reports] == [None, None, [1, 2, 3]]
    assert reports[-1].job.fraction == 1.0
    assert owner.jobs.unfinished() == ()


def test_the_work_runs_in_another_thread(owner: Owner) -> None:
    job = owner.jobs.start("Coverage", lambda progress: threading.get_ident())
    assert owner.reports_until_the_end_of(job)[-1].result != threading.get_ident()


def test_every_new_message_is_reported_with_its_fraction(owner: Owner) -> None:
    def work(progress: Progress) -> None:
        progress(0.25, "rays")
        progress(0.75, "ellipses")

    reports = owner.reports_until_the_end_of(owner.jobs.start("Coverage", work))
    assert [(report.job.fraction, report.job.message) for report in reports[2:-1]] == [
        (0.25, "rays"),
        (0.75, "ellipses"),
    ]


def test_frequent_progress_does_not_flood_the_owner_but_is_kept(owner: Owner) -> None:
    seen: list[Job] = []

    def work(progress: Progress) -> None:
        for step in range(1000):
            progress(step / 1000, "rays")
        seen.extend(owner.jobs.unfinished())

    reports = owner.reports_until_the_end_of(owner.jobs.start("Coverage", work))
    # 1000 calls take a few milliseconds; even a hundred times slower they fill 10 intervals of 50 ms.
    assert len(reports) < 20
    assert seen[0].fraction == 0.999


def test_progress_beyond_its_range_is_clipped(owner: Owner) -> None:
    def work(progress: Progress) -> None:
        progress(-1e-9, "before")
        progress(1.0 + 1e-9, "after")

    reports = owner.reports_until_the_end_of(owner.jobs.start("Coverage", work))
    assert [report.job.fraction for report in reports[2:-1]] == [0.0, 1.0]


def test_a_job_cannot_claim_a_part_outside_zero_to_one() -> None:
    with pytest.raises(ValueError, match="expected 0 to 1"):
        Job(1, "Coverage", fraction=1.5)


def test_an_error_of_the_users_is_reported_as_it_is(owner: Owner, caplog: pytest.LogCaptureFixture) -> None:
    def work(progress: Progress) -> None:
        progress(0.4, "rays")
        raise ProjectError("route Loop has no segment;\n expected at least one")

    last = owner.reports_until_the_end_of(owner.jobs.start("Predict", work))[-1]
    assert last.job.state is JobState.FAILED
    assert last.job.error == "route Loop has no segment; expected at least one"
    assert last.job.fraction == 0.4
    assert last.result is None
    assert caplog.records == []


def test_an_error_of_ours_names_its_kind_and_is_logged_and_the_next_job_runs(
    owner: Owner, caplog: pytest.LogCaptureFixture
) -> None:
    with caplog.at_level(logging.ERROR):
        failed = owner.reports_until_the_end_of(owner.jobs.start("Predict", lambda progress: {}["rays"]))[-1]
    assert failed.job.error == "KeyError: 'rays'"
    assert caplog.records[0].exc_info is not None
    assert owner.reports_until_the_end_of(owner.jobs.start("Predict", lambda progress: 1))[-1].result == 1


def test_a_running_job_stops_at_its_next_progress(owner: Owner) -> None:
    job = owner.jobs.start("Coverage", until_stopped)
    while owner.queue.get(timeout=10).job.message != "turning":
        pass
    owner.jobs.cancel(job.number)
    last = owner.reports_until_the_end_of(job)[-1]
    assert last.job.state is JobState.CANCELLED
    assert last.job.error == ""


def test_a_waiting_job_that_is_cancelled_never_starts(owner: Owner) -> None:
    started: list[str] = []
    first = owner.jobs.start("Coverage", until_stopped)
    second = owner.jobs.start("Predict", lambda progress: started.append("second"))
    owner.jobs.cancel(second.number)
    owner.jobs.cancel(first.number)
    assert owner.reports_until_the_end_of(first)[-1].job.state is JobState.CANCELLED
    owner.reports_until_the_end_of(owner.jobs.start("Last", lambda progress: None))
    assert started == []


def test_a_result_that_comes_after_the_cancellation_is_not_delivered(owner: Owner) -> None:
    runs, go_on = threading.Event(), threading.Event()

    def deaf_work(progress: Progress) -> str:
        runs.set()
        assert go_on.wait(10)
        return "outdated"

    job = owner.jobs.start("Coverage", deaf_work)
    assert runs.wait(10)
    owner.jobs.cancel(job.number)
    go_on.set()
    last = owner.reports_until_the_end_of(job)[-1]
    assert (last.job.state, last.result) == (JobState.CANCELLED, None)


def test_a_new_job_replaces_the_unfinished_one_of_its_name_only(owner: Owner) -> None:
    other = owner.jobs.start("Predict", lambda progress: "kept")
    assert owner.reports_until_the_end_of(other)[-1].result == "kept"
    outdated = owner.jobs.start("Coverage", until_stopped)
    waiting = owner.jobs.start("Predict", lambda progress: "also kept")
    newest = owner.jobs.start("Coverage", lambda progress: "new")
    assert owner.reports_until_the_end_of(outdated)[-1].job.state is JobState.CANCELLED
    assert owner.reports_until_the_end_of(waiting)[-1].result == "also kept"
    assert owner.reports_until_the_end_of(newest)[-1].result == "new"


def test_cancelling_what_has_ended_or_never_was_does_nothing(owner: Owner) -> None:
    job = owner.jobs.start("Coverage", lambda progress: None)
    owner.reports_until_the_end_of(job)
    owner.jobs.cancel(job.number)
    owner.jobs.cancel(999)
    assert owner.queue.empty()


def test_closing_stops_what_runs_and_refuses_what_comes(owner: Owner) -> None:
    job = owner.jobs.start("Coverage", until_stopped)
    assert owner.jobs.close(timeout=10)
    assert owner.reports_until_the_end_of(job)[-1].job.state is JobState.CANCELLED
    with pytest.raises(JobError, match="Coverage cannot start"):
        owner.jobs.start("Coverage", until_stopped)

"""Background work as its owner sees it: reports in order, one result or one error, and a way to stop."""

from __future__ import annotations

import logging
import random
import threading
import time
from collections.abc import Iterator
from queue import Empty, SimpleQueue

import numba
import pytest

from commission.app.base.jobs import Job, JobReport, Jobs, JobState, Lane
from commission.errors import JobError, ProjectError
from commission.progress import Progress


class Owner:
    """Stands for the thread that owns the project: collects what is posted."""

    def __init__(self) -> None:
        self.queue: SimpleQueue[JobReport] = SimpleQueue()
        self.jobs = Jobs(self.queue.put, lambda job: f"{job.name}: {job.error}")

    def heard_until_the_end_of(self, job: Job) -> list[object]:
        """What follows from reports about this job, and from others that come before its end."""
        followed: list[object] = []
        ended = False
        while not ended:
            report = self.queue.get(timeout=10)
            followed.append(self.jobs.hear(report))
            ended = report.job.number == job.number and report.job.has_ended
        return [each for each in followed if each is not None]

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


def test_a_job_says_when_it_compiles_and_when_it_is_through(owner: Owner) -> None:
    # Of no cache: it would compile in the first run of the tests alone.
    inner = numba.njit(lambda x: 2.0 * x)
    kernel = numba.njit(lambda x: inner(x) + 1.0)

    def work(progress: Progress) -> float:
        progress(0.5, "halving")
        found = kernel(3.0)
        progress(0.6, "halved")
        # The second time nothing compiles.
        return found + kernel(4.0)

    reports = owner.reports_until_the_end_of(owner.jobs.start("Halve", work))
    assert [report.job.line for report in reports[2:]] == [
        *("Halve: halving 50%", "Halve: halving, compiling 50%", "Halve: halving 50%"),
        *("Halve: halved 60%", "Halve: halved 100%"),
    ]
    assert reports[-1].result == 16.0


def test_what_another_thread_compiles_is_not_said_of_a_job(owner: Owner) -> None:
    others = numba.njit(lambda x: 3.0 * x)

    def work(progress: Progress) -> None:
        progress(0.5, "waiting")
        thread = threading.Thread(target=others, args=(1.0,))
        thread.start()
        thread.join()

    reports = owner.reports_until_the_end_of(owner.jobs.start("Wait", work))
    assert not any(report.job.compiles for report in reports)


@pytest.mark.measures_time
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
        Job(number=1, name="Coverage", fraction=1.5)


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
    assert failed.job.error == "a fault of the program (KeyError); its log says where"
    assert caplog.records[0].exc_info is not None
    assert owner.reports_until_the_end_of(owner.jobs.start("Predict", lambda progress: 1))[-1].result == 1


def test_a_running_job_stops_at_its_next_progress(owner: Owner) -> None:
    job = owner.jobs.start("Coverage", until_stopped)
    while owner.queue.get(timeout=10).job.message != "turning":
        pass
    owner.jobs.stop(job.number)
    last = owner.reports_until_the_end_of(job)[-1]
    assert last.job.state is JobState.CANCELLED
    assert last.job.error == ""


def test_a_waiting_job_that_is_cancelled_never_starts(owner: Owner) -> None:
    started: list[str] = []
    first = owner.jobs.start("Coverage", until_stopped)
    second = owner.jobs.start("Predict", lambda progress: started.append("second"))
    owner.jobs.stop(second.number)
    owner.jobs.stop(first.number)
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
    owner.jobs.stop(job.number)
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


def test_stopping_what_has_ended_or_never_was_does_nothing(owner: Owner) -> None:
    job = owner.jobs.start("Coverage", lambda progress: None)
    owner.reports_until_the_end_of(job)
    owner.jobs.stop(job.number)
    owner.jobs.stop(999)
    assert owner.queue.empty()


def test_closing_stops_what_runs_and_refuses_what_comes(owner: Owner) -> None:
    job = owner.jobs.start("Coverage", until_stopped)
    assert owner.jobs.close(timeout=10)
    assert owner.reports_until_the_end_of(job)[-1].job.state is JobState.CANCELLED
    with pytest.raises(JobError, match="Coverage cannot start"):
        owner.jobs.start("Coverage", until_stopped)


def test_a_job_carries_what_follows_from_its_result(owner: Owner) -> None:
    job = owner.jobs.start("Coverage", lambda progress: 3, then=lambda result: f"drawn {result}")
    assert owner.heard_until_the_end_of(job) == ["drawn 3"]


def test_what_follows_is_decided_by_the_owner_thread(owner: Owner) -> None:
    job = owner.jobs.start("Coverage", lambda progress: None, then=lambda _: threading.get_ident())
    assert owner.heard_until_the_end_of(job) == [threading.get_ident()]


def test_a_failure_has_a_continuation_of_its_own_or_that_of_all_jobs(owner: Owner) -> None:
    def fail(_progress: Progress) -> None:
        raise ProjectError("no route; expected one")

    own = owner.jobs.start("Coverage", fail, then=lambda _: "done", failed=lambda job: f"own: {job.error}")
    assert owner.heard_until_the_end_of(own) == ["own: no route; expected one"]
    common = owner.jobs.start("Coverage", fail, then=lambda _: "done")
    assert owner.heard_until_the_end_of(common) == ["Coverage: no route; expected one"]


def test_who_stops_a_job_is_answered_and_who_cancels_it_is_not(owner: Owner) -> None:
    stopped = owner.jobs.start("Coverage", until_stopped, then=lambda _: "done", stopped=lambda: "stopped")
    owner.jobs.stop(stopped.number)
    assert owner.heard_until_the_end_of(stopped) == ["stopped"]
    cancelled = owner.jobs.start("Coverage", until_stopped, then=lambda _: "done", stopped=lambda: "stopped")
    owner.jobs.cancel("Coverage")
    assert owner.heard_until_the_end_of(cancelled) == []


def test_nothing_follows_from_a_job_that_is_cancelled_after_its_end(owner: Owner) -> None:
    job = owner.jobs.start("Coverage", lambda progress: 3, then=lambda result: result)
    reports = owner.reports_until_the_end_of(job)
    owner.jobs.cancel("Coverage")
    assert [owner.jobs.hear(report) for report in reports] == [None, None, None]


def test_of_two_jobs_of_one_key_only_the_newest_is_heard_of_whatever_their_names(owner: Owner) -> None:
    old = owner.jobs.start("Reading a.csv", lambda progress: "a", then=lambda result: result, key="reading")
    reports = owner.reports_until_the_end_of(old)
    new = owner.jobs.start("Reading b.csv", lambda progress: "b", then=lambda result: result, key="reading")
    assert [owner.jobs.hear(report) for report in reports] == [None, None, None]
    assert owner.heard_until_the_end_of(new) == ["b"]


def test_quick_work_does_not_wait_for_patient_work(owner: Owner) -> None:
    patient = owner.jobs.start("Suggestion", until_stopped, lane=Lane.PATIENT)
    quick = owner.jobs.start("Check", lambda progress: 1, lane=Lane.QUICK)
    assert owner.reports_until_the_end_of(quick)[-1].result == 1
    assert [job.name for job in owner.jobs.unfinished()] == ["Suggestion"]
    owner.jobs.stop(patient.number)


def test_the_page_is_shown_what_runs_but_for_what_is_too_quick(owner: Owner) -> None:
    started = [threading.Event() for _ in range(2)]

    def work(progress: Progress, event: threading.Event) -> None:
        event.set()
        until_stopped(progress)

    owner.jobs.start("Coverage", lambda progress: work(progress, started[0]))
    owner.jobs.start("Waiting", lambda progress: None)
    owner.jobs.start("Check", lambda progress: work(progress, started[1]), lane=Lane.QUICK, is_shown=False)
    assert all(event.wait(10) for event in started)
    assert [job.name for job in owner.jobs.running()] == ["Coverage"]
    for name in ("Coverage", "Check"):
        owner.jobs.cancel(name)


class Storm:
    """Starts, cancels and stops jobs at random, and keeps the books on what must follow."""

    def __init__(self, seed: int) -> None:
        self.random = random.Random(seed)
        self.queue: SimpleQueue[JobReport] = SimpleQueue()
        self.jobs = Jobs(self.queue.put, lambda job: (job.number, "failed"))
        self.expected: dict[str, int] = {}
        """Job of each key that must be heard of."""
        self.heard: list[int] = []
        self.reports: dict[int, list[JobState]] = {}
        self.busy: dict[Lane, int] = dict.fromkeys(Lane, 0)
        self.overlaps = 0

    def work(self, progress: Progress, lane: Lane, steps: int, fails: bool) -> int:
        self.busy[lane] += 1
        self.overlaps += self.busy[lane] != 1
        try:
            for step in range(steps):
                progress(step / steps, "turning")
                time.sleep(0.0005)
            if fails:
                raise ProjectError("no route; expected one")
            return steps
        finally:
            self.busy[lane] -= 1

    def start(self) -> None:
        key, lane = self.random.choice("abcde"), self.random.choice(list(Lane))
        steps, fails = self.random.randrange(4), self.random.random() < 0.2
        numbers: list[int] = []
        job = self.jobs.start(
            f"{key} {lane}",
            lambda progress: self.work(progress, lane, steps, fails),
            then=lambda result: (numbers[0], result),
            stopped=lambda: (numbers[0], "stopped"),
            key=key,
            lane=lane,
        )
        numbers.append(job.number)
        self.expected[key] = job.number

    def step(self) -> None:
        match self.random.randrange(5):
            case 0 | 1:
                self.start()
            case 2:
                key = self.random.choice("abcde")
                self.jobs.cancel(key)
                self.expected.pop(key, None)
            case 3:
                unfinished = self.jobs.unfinished()
                if unfinished:
                    self.jobs.stop(self.random.choice(unfinished).number)
            case _:
                time.sleep(0.002 * self.random.random())
        self.hear()

    def hear(self, timeout: float = 0.0) -> None:
        """Take one report, where there is one."""
        try:
            report = self.queue.get(timeout=timeout) if timeout else self.queue.get_nowait()
        except Empty:
            return
        self.reports.setdefault(report.job.number, []).append(report.job.state)
        if (followed := self.jobs.hear(report)) is not None:
            number, _ = followed  # type: ignore[misc]
            assert number in self.expected.values(), "a job was heard of that is not wanted any more"
            self.heard.append(number)
            self.expected = {key: value for key, value in self.expected.items() if value != number}


@pytest.mark.parametrize("seed", range(20))
def test_in_a_storm_the_newest_of_each_key_is_heard_of_once_and_no_other(seed: int) -> None:
    storm = Storm(seed)
    for _ in range(150):
        storm.step()
    end = time.monotonic() + 20.0
    while (storm.expected or storm.jobs.unfinished()) and time.monotonic() < end:
        storm.hear(timeout=0.1)
    assert storm.expected == {}
    assert storm.jobs.unfinished() == ()
    assert len(storm.heard) == len(set(storm.heard))
    assert storm.overlaps == 0
    assert storm.jobs.close(timeout=10)
    while not storm.queue.empty():
        storm.hear()
    for states in storm.reports.values():
        assert states[0] is JobState.WAITING
        assert sum(state not in (JobState.WAITING, JobState.RUNNING) for state in states) == 1
        assert states[-1] not in (JobState.WAITING, JobState.RUNNING)
        assert all(state is JobState.RUNNING for state in states[1:-1])


@pytest.mark.parametrize("seed", range(5))
def test_a_storm_that_is_closed_ends_at_once_and_nothing_follows_from_it(seed: int) -> None:
    storm = Storm(seed)
    for _ in range(60):
        storm.step()
    assert storm.jobs.close(timeout=10)
    assert storm.jobs.unfinished() == ()
    heard = list(storm.heard)
    while not storm.queue.empty():
        storm.hear()
    assert storm.heard == heard
    with pytest.raises(JobError, match="the program is closing"):
        storm.start()

"""A kept result is that of the newest input, whatever came in between."""

from __future__ import annotations

import random
import threading
import time
from collections.abc import Iterator
from queue import Empty, SimpleQueue

import pytest

from commission.app.base.actions import Report
from commission.app.base.jobs import JobReport, Jobs, Lane
from commission.app.base.kept import Kept
from commission.errors import ProjectError
from commission.progress import Progress


class Owner:
    """Keeps the square of a number, computed by jobs that a test may hold up."""

    def __init__(self) -> None:
        self.queue: SimpleQueue[JobReport] = SimpleQueue()
        self.jobs = Jobs(self.queue.put)
        self.kept = Kept[int, int]("Square", self.jobs, Lane.QUICK)
        self.computed: list[int] = []
        self.go_on = threading.Event()
        self.go_on.set()
        self.followed: list[object] = []

    def study(self, number: int, progress: Progress) -> int:
        self.computed.append(number)
        while not self.go_on.wait(0.001):
            progress(0.5, "squaring")
        if number < 0:
            raise ProjectError(f"number is {number}; expected 0 or more")
        return number * number

    def keep(self, number: int) -> None:
        self.kept.keep(number, lambda progress: self.study(number, progress))

    def ask(self, request: int, number: int) -> None:
        self.kept.ask(request, number, lambda progress: self.study(number, progress))

    def hear(self) -> None:
        """Take all reports until no job is left."""
        end = time.monotonic() + 10.0
        while self.jobs.unfinished() or not self.queue.empty():
            assert time.monotonic() < end
            try:
                followed = self.jobs.hear(self.queue.get(timeout=0.01))
            except Empty:
                continue
            if followed is not None:
                self.followed.append(followed)

    def until_computing(self, number: int) -> None:
        end = time.monotonic() + 10.0
        while number not in self.computed:
            assert time.monotonic() < end
            time.sleep(0.001)


@pytest.fixture
def owner() -> Iterator[Owner]:
    owner = Owner()
    yield owner
    owner.go_on.set()
    assert owner.jobs.close(timeout=10)


def test_it_is_computed_once_for_one_input_and_again_for_another(owner: Owner) -> None:
    for number in (3, 3, 4, 4):
        owner.keep(number)
        owner.hear()
        assert owner.kept.result == number * number
        assert owner.kept.is_of(number)
    assert owner.computed == [3, 4]


def test_a_running_job_goes_on_when_the_input_changes_and_another_follows(owner: Owner) -> None:
    owner.go_on.clear()
    owner.keep(3)
    owner.until_computing(3)
    owner.keep(4)
    owner.keep(5)
    owner.go_on.set()
    owner.hear()
    assert (owner.kept.result, owner.kept.inputs) == (9, 3)
    owner.keep(5)
    owner.hear()
    assert owner.kept.result == 25
    assert owner.computed == [3, 5]


def test_what_is_dropped_never_arrives(owner: Owner) -> None:
    owner.go_on.clear()
    owner.keep(3)
    owner.until_computing(3)
    owner.kept.drop()
    owner.go_on.set()
    owner.hear()
    assert (owner.kept.result, owner.kept.inputs, owner.kept.is_running) == (None, None, False)
    owner.keep(3)
    owner.hear()
    owner.kept.drop()
    assert owner.kept.result is None


def test_what_has_ended_and_is_dropped_before_it_is_heard_of_never_arrives(owner: Owner) -> None:
    owner.keep(3)
    while owner.jobs.unfinished():
        time.sleep(0.001)
    owner.kept.drop()
    owner.hear()
    assert owner.kept.result is None


def test_what_failed_is_told_and_not_tried_again_until_the_input_changes(owner: Owner) -> None:
    owner.keep(-1)
    owner.hear()
    assert owner.followed == [Report("Square: number is -1; expected 0 or more")]
    owner.keep(-1)
    owner.hear()
    assert owner.computed == [-1]
    assert owner.kept.result is None
    owner.keep(2)
    owner.hear()
    assert owner.kept.result == 4


def test_what_a_person_stopped_is_not_tried_again_until_the_input_changes(owner: Owner) -> None:
    owner.go_on.clear()
    owner.keep(3)
    (job,) = owner.jobs.unfinished()
    owner.jobs.stop(job.number)
    owner.hear()
    owner.go_on.set()
    owner.keep(3)
    assert not owner.jobs.unfinished()
    owner.keep(4)
    owner.hear()
    assert owner.kept.result == 16


def test_a_request_is_answered_once_whatever_changes_afterwards(owner: Owner) -> None:
    owner.ask(1, 3)
    owner.hear()
    owner.ask(1, 4)
    owner.hear()
    assert owner.kept.result == 9
    assert not owner.kept.is_of(4)
    owner.ask(2, 4)
    owner.hear()
    assert owner.kept.result == 16


def test_a_newer_request_ends_the_one_before(owner: Owner) -> None:
    owner.go_on.clear()
    owner.ask(1, 3)
    owner.until_computing(3)
    owner.ask(2, 4)
    owner.go_on.set()
    owner.hear()
    assert (owner.kept.result, owner.kept.inputs) == (16, 4)


def test_what_was_brought_up_to_date_in_place_is_not_computed(owner: Owner) -> None:
    owner.keep(3)
    owner.hear()
    owner.kept.follow(4)
    owner.keep(4)
    assert not owner.jobs.unfinished()
    assert owner.kept.is_of(4)


@pytest.mark.parametrize("seed", range(20))
def test_in_a_storm_the_result_always_is_that_of_its_input_and_at_last_of_the_newest(owner: Owner, seed: int) -> None:
    chance = random.Random(seed)
    number = 0
    for _ in range(200):
        match chance.randrange(6):
            case 0 | 1 | 2:
                number = chance.randrange(5)
            case 3:
                owner.kept.drop()
            case _:
                time.sleep(0.0005 * chance.random())
        owner.keep(number)
        if not owner.queue.empty() and chance.random() < 0.7:
            owner.jobs.hear(owner.queue.get())
        if owner.kept.result is not None:
            assert owner.kept.inputs is not None
            assert owner.kept.result == owner.kept.inputs**2
    for _ in range(2):  # one that is still under way, and the one that follows
        owner.hear()
        owner.keep(number)
    owner.hear()
    assert (owner.kept.result, owner.kept.inputs) == (number**2, number)

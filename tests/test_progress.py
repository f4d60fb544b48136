"""Progress of a part is progress of the whole."""

from __future__ import annotations

import pytest

from commission.errors import JobCancelled
from commission.progress import part, silent


def test_a_part_runs_from_its_beginning_to_its_end_of_the_whole() -> None:
    told: list[tuple[float, str]] = []
    of_part = part(lambda fraction, message: told.append((fraction, message)), 0.2, 0.6)
    for fraction in (0.0, 0.5, 1.0):
        of_part(fraction, "floor")
    assert told == [(0.2, "floor"), (0.4, "floor"), (pytest.approx(0.6), "floor")]


def test_a_part_of_a_part_lies_inside_both() -> None:
    told: list[float] = []
    whole = part(lambda fraction, _: told.append(fraction), 0.5, 1.0)
    part(whole, 0.5, 1.0)(0.5, "")
    assert told == [0.875]


def test_work_that_is_stopped_hears_of_it_in_a_part() -> None:
    def stop(_fraction: float, _message: str) -> None:
        raise JobCancelled("the job was stopped")

    with pytest.raises(JobCancelled):
        part(stop, 0.0, 0.5)(0.1, "")


def test_nothing_comes_of_progress_that_nobody_follows() -> None:
    assert silent(0.5, "floor") is None

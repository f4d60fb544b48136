"""What the panel of problems says above its list."""

from __future__ import annotations

import dataclasses

import pytest

from commission.app.problems.problems_panel import MOST_SHOWN, summary
from commission.studies.problems import Problem, Severity, Subject

PROBLEM = Problem(severity=Severity.WARNING, text="a route meets a wall", subject=Subject.ROUTE)
NOTE = dataclasses.replace(PROBLEM, severity=Severity.NOTE)


@pytest.mark.parametrize(
    ("found", "said"),
    [
        ((), "None."),
        ((PROBLEM,), "1 problem of the site; a click goes there."),
        ((NOTE, NOTE), "2 notes of the site; a click goes there."),
        ((PROBLEM, NOTE, PROBLEM), "2 problems, 1 note of the site; a click goes there."),
        (
            (PROBLEM,) * (MOST_SHOWN + 1),
            f"{MOST_SHOWN + 1} problems of the site; the first {MOST_SHOWN} shown; a click goes there.",
        ),
    ],
)
def test_problems_are_counted_as_at_the_tab_and_notes_beside_them(found: tuple[Problem, ...], said: str) -> None:
    assert summary(found) == said

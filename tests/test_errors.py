"""What a library raises about a file is told in words."""

from __future__ import annotations

import pytest

from commission.errors import reason_of


@pytest.mark.parametrize(
    ("error", "told"),
    [
        (KeyError("5"), "it refers to '5', which is not in it"),
        (KeyError(), "KeyError"),
        (ValueError(" no number "), "no number"),
        (AssertionError(), "AssertionError"),
        (IndexError("list index out of range"), "list index out of range"),
    ],
)
def test_a_reason_is_never_a_bare_key_or_nothing(error: Exception, told: str) -> None:
    assert reason_of(error) == told

"""Whatever a browser says, in thousands of ways; 100,000 of them by `python -m tests.tools.fuzz_seam`."""

from __future__ import annotations

import pytest

from tests.app.base.widgets import Desk
from tests.tools.fuzz_seam import BAD, fuzz, good_messages


def test_thousands_of_bad_values_disturb_nobody_are_all_told_and_leave_nothing() -> None:
    desk = Desk()
    found = fuzz(desk, 3_000, seed=20260731)
    assert found.told == found.sent
    assert found.pictures == 15
    # The browser that was refused so often is still one: what it says well is heard.
    desk.guest.update(desk.widgets["count"], 12)
    desk.until(lambda: desk.changed == [("count", 12)])
    desk.close()


def test_every_kind_of_widget_and_message_is_tried(monkeypatch: pytest.MonkeyPatch) -> None:
    from commission.app.base import wire

    desk = Desk()
    assert set(BAD) == set(desk.widgets)
    assert set(good_messages(desk)) == {message.__name__ for message in wire.MESSAGES}
    desk.close()


def test_what_is_spoiled_was_good_before() -> None:
    """A message that is refused anyway would prove nothing when it is spoiled."""
    desk = Desk()
    desk.widgets["button"].on_hold(callback_hz=10.0)(lambda _event: None)
    for kind, fields in good_messages(desk).items():
        desk.guest.send(type=kind, **fields)
    desk.guest.hear_all(0.5)
    assert desk.guest.refusals == []
    desk.close()

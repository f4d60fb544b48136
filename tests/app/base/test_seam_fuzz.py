"""Whatever a browser says, in thousands of ways; 100,000 of them by `python -m tests.tools.fuzz_seam`."""

from __future__ import annotations

import pytest

from tests.app.base.widget_bench import WidgetBench
from tests.tools.fuzz_seam import BAD, fuzz, good_messages


def test_thousands_of_bad_values_disturb_nobody_are_all_told_and_leave_nothing() -> None:
    bench = WidgetBench()
    found = fuzz(bench, 3_000, seed=20260731)
    assert found.told == found.sent
    assert found.pictures == 15
    # The browser that was refused so often is still one: what it says well is heard.
    bench.guest.update(bench.widgets["count"], 12)
    bench.until(lambda: bench.changed == [("count", 12)])
    bench.close()


def test_every_kind_of_widget_and_message_is_tried(monkeypatch: pytest.MonkeyPatch) -> None:
    from commission.app.base import wire

    bench = WidgetBench()
    assert set(BAD) == set(bench.widgets)
    assert set(good_messages(bench)) == {message.__name__ for message in wire.MESSAGES}
    bench.close()


def test_what_is_spoiled_was_good_before() -> None:
    """A message that is refused anyway would prove nothing when it is spoiled."""
    bench = WidgetBench()
    bench.widgets["button"].on_hold(callback_hz=10.0)(lambda _event: None)
    for kind, fields in good_messages(bench).items():
        bench.guest.send(type=kind, **fields)
    bench.guest.hear_all(0.5)
    assert bench.guest.refusals == []
    bench.close()

"""What the browser leaves behind; a module of its own, because the browser of the one before has ended here."""

from __future__ import annotations

import asyncio


def test_other_tests_can_use_an_event_loop_after_the_browser() -> None:
    """A browser of the whole session would make this fail in every test that follows; see the fixture."""
    assert asyncio.run(asyncio.sleep(0, "ran")) == "ran"

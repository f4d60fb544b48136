"""What a person enters arrives, or is refused in words, however it came into the field."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import pytest

from commission.app.base.widget_values import LONGEST_TEXT
from tests.app.sites import room
from tests.browser.page import OpenPage
from tests.browser.serving import Served
from tests.conftest import few_of


@pytest.fixture(scope="module")
def served() -> Iterator[Served]:
    opened = Served(room())
    yield opened
    opened.close()


@pytest.fixture(scope="module")
def page(served: Served, lasting_window: Callable[..., OpenPage]) -> OpenPage:
    """One window for all tests, which leave it as it was."""
    opened = lasting_window(served.server)
    opened.open()
    return opened


def test_a_number_that_was_taken_back_can_be_entered_again_without_a_key_or_a_click(
    served: Served, page: OpenPage
) -> None:
    page.open_tab("Tune")
    for _ in range(3):
        # `fill` focuses the field by itself and puts the text in, as do dictation and text that is dropped.
        page.fill("Gate", "99.99")
        served.until(lambda: len(served.state.undo) == 1, 10.0)
        assert served.state.project.parameters.association.gate_probability == pytest.approx(0.9999)
        page.page.get_by_role("button", name="Undo").first.click()
        served.until(lambda: served.state.undo == (), 10.0)
        page.page.wait_for_function("id => document.getElementById(id).ariaValueNow === '95'", arg=_thumb(page))
        assert page.value_of("Gate") == "95"
    assert page.errors == []


def _thumb(page: OpenPage) -> str:
    """Name the handle of the slider, which shows its value."""
    return str(page.row("Gate").locator("[role=slider]").evaluate("e => e.id = e.id || 'gate-handle'"))


@pytest.mark.parametrize(
    "letters", few_of((LONGEST_TEXT + 1, 6_000_000), (6_000_000,)), ids=["just over", "more than a message holds"]
)
def test_a_text_that_is_too_long_is_refused_in_words_and_the_connection_lives_on(
    served: Served, page: OpenPage, letters: int
) -> None:
    clients = list(served.server.get_clients())
    page.open_tab("Site")
    page.unfold("Exchange", "At most 32 MB")
    page.page.evaluate("window.__notes.length = 0")
    pasted = page.row("Paste a table").locator("textarea")
    pasted.evaluate(
        """(field, letters) => {
          const write = Object.getOwnPropertyDescriptor(HTMLTextAreaElement.prototype, 'value').set;
          write.call(field, 'ä'.repeat(letters));  // two bytes each
          field.focus();
          field.dispatchEvent(new Event('input', {bubbles: true}));
          field.blur();
        }""",
        letters,
    )
    page.wait_until_told("Paste a table: found more than 1,000,000 letters; expected at most as many")
    page.page.wait_for_function("field => field.value === ''", arg=pasted.element_handle())
    assert list(served.server.get_clients()) == clients
    assert page.errors == []

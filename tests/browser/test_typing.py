"""An entry is finished when the engineer says so: drafts, Enter, Escape, refusals; each number, key by key."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import pytest
from playwright.sync_api import Locator

from commission.app.base import state as page_state
from commission.app.base.actions import Envelope
from commission.app.base.viser_private import widget_of
from commission.app.runtime import Message, Runtime
from commission.app.tune.actions import ResetParameters
from tests.app.sites import room
from tests.browser.page import OpenPage
from tests.browser.serving import Served
from tests.conftest import Seeds

OF_EACH_KIND = 1
"""Numbers of each kind of widget, unit and place in it that are typed in the test command; with all seeds, all are."""

_NUMBERS = """() => [...document.querySelectorAll('.mantine-NumberInput-input')].filter(e => e.offsetParent).map(e => {
  let field = e.parentElement;
  while (!field.querySelector('label[for]')) field = field.parentElement;
  const inputs = [...field.querySelectorAll('.mantine-NumberInput-input')];
  return [field.querySelector('label[for]').htmlFor, inputs.indexOf(e)];
})"""
"""Identifier of the widget of each number that can be seen, and which of the widget's numbers it is."""

_FOLDED = """() => [...document.querySelectorAll('.mantine-Paper-root[data-with-border]')].filter(
  e => e.offsetParent && e.innerText && !e.innerText.includes('\\n')).map(e => e.innerText)"""
"""Names of the folders that are closed."""


@dataclass
class Heard:
    """What browsers asked for, in its order."""

    envelopes: list[Envelope] = field(default_factory=list)

    def fields(self) -> list[str]:
        """Widgets in which something was entered."""
        return [envelope.sender.widget for envelope in self.envelopes if envelope.sender.widget]


@pytest.fixture
def heard(monkeypatch: pytest.MonkeyPatch) -> Heard:
    """Listens to the owner thread."""
    said, handle = Heard(), Runtime.handle

    def listening(runtime: Runtime, message: Message) -> None:
        if isinstance(message, Envelope) and message.sender.browser is not None:
            said.envelopes.append(message)
        handle(runtime, message)

    monkeypatch.setattr(Runtime, "handle", listening)
    return said


@pytest.fixture(scope="module")
def served() -> Iterator[Served]:
    opened = Served(room())
    yield opened
    opened.close()


@pytest.fixture(scope="module")
def opened(served: Served, lasting_window: Callable[..., OpenPage]) -> OpenPage:
    """One window for all tests: opening one is what takes longest."""
    page = lasting_window(served.server)
    page.open()
    return page


@pytest.fixture(scope="module")
def other(served: Served, lasting_window: Callable[..., OpenPage]) -> OpenPage:
    """A second browser; its tests are the last, since each window that is open has to be drawn."""
    page = lasting_window(served.server)
    page.open()
    page.open_tab("Tune")
    return page


@pytest.fixture(autouse=True)
def each_entry_is_a_step(monkeypatch: pytest.MonkeyPatch) -> None:
    """Edits that follow each other at once are steps of their own: no test has to wait, and no second entry hides."""
    monkeypatch.setattr(page_state, "MERGE_WITHIN_S", -1.0)


@pytest.fixture
def page(opened: OpenPage, served: Served, heard: Heard) -> OpenPage:
    """The window with the project as it was opened, and without what was said to the test before."""
    opened.forget_refusals()
    served.runtime.post(ResetParameters())
    served.until(lambda: served.state.project.parameters == room().parameters, 10.0)
    heard.envelopes.clear()
    return opened


def gate(served: Served) -> float:
    return served.state.project.parameters.association.gate_probability


def typed_into(page: OpenPage, label: str, text: str) -> Locator:
    """Type over what stands in a field, key by key, and stay in it."""
    entry = page.row(label).locator("input").last
    entry.click()
    page.page.keyboard.press("Control+A")
    page.page.keyboard.type(text, delay=20)
    return entry


def test_a_number_acts_when_it_is_finished_and_not_with_its_first_digit(
    page: OpenPage, served: Served, heard: Heard
) -> None:
    page.open_tab("Tune")
    steps = len(served.state.undo)
    entry = typed_into(page, "Gate", "97.5")
    page.page.wait_for_timeout(300)
    assert heard.fields() == []
    assert page.row("Gate").get_attribute("data-draft") == ""
    entry.press("Enter")
    served.until(lambda: gate(served) == pytest.approx(0.975), 10.0)
    page.page.wait_for_timeout(300)
    assert len(heard.fields()) == 1
    assert len(served.state.undo) == steps + 1
    assert page.row("Gate").get_attribute("data-draft") is None
    assert page.errors == []


def test_what_was_written_into_a_field_before_its_first_key_and_is_drawn_after_it_does_not_undo_the_entry(
    page: OpenPage, served: Served, heard: Heard
) -> None:
    page.open_tab("Tune")
    entry = typed_into(page, "Gate", "9")
    entry.press("Escape")
    # viser keeps what the program writes until its next picture; here the first key comes between the two.
    uuid = page.row("Gate").locator("label[for]").first.get_attribute("for")
    late = """(input, [uuid, written, typed]) => {
      window.__viserMutable.messageQueue.push({type: 'GuiUpdateMessage', uuid, updates: {value: written}});
      document.execCommand('selectAll');
      document.execCommand('insertText', false, typed);
      window.__viserMutable.requestRender();
    }"""
    for written, typed, held in ((95, "97.5", 0.975), (80, "96", 0.96)):
        entry.evaluate(late, [uuid, written, typed])
        page.page.wait_for_function("() => window.__viserMutable.messageQueue.length === 0")
        page.page.wait_for_timeout(100)
        assert entry.input_value() == typed
        entry.press("Enter")
        served.until(lambda held=held: gate(served) == pytest.approx(held), 10.0)
    # Who takes the entry back sees what was written meanwhile.
    entry.evaluate(late, [uuid, 90, "97"])
    page.page.wait_for_function("() => window.__viserMutable.messageQueue.length === 0")
    entry.press("Escape")
    page.page.wait_for_timeout(250)
    assert entry.input_value() == "90"
    assert len(heard.fields()) == 2
    assert page.errors == []


def test_escape_shows_again_what_held_and_nothing_has_happened(page: OpenPage, served: Served, heard: Heard) -> None:
    page.open_tab("Tune")
    undo = served.state.undo
    for text in ("97.5", "9", "-", ""):
        entry = typed_into(page, "Gate", text)
        if not text:
            page.page.keyboard.press("Delete")
        entry.press("Escape")
        page.page.wait_for_timeout(250)
        assert entry.input_value() == "95"
        assert page.row("Gate").get_attribute("data-draft") is None
    entry.press("Tab")
    page.page.wait_for_timeout(250)
    assert heard.fields() == []
    assert served.state.undo == undo


@pytest.mark.parametrize("text", ["120", "1", "0.5"])
def test_a_number_beyond_its_bounds_is_refused_at_the_field_and_never_clamped(
    page: OpenPage, served: Served, text: str
) -> None:
    page.open_tab("Tune")
    undo = served.state.undo
    entry = typed_into(page, "Gate", text)
    entry.press("Tab")
    page.page.wait_for_function(
        "text => [...document.querySelectorAll('[data-refused]')].some(e => e.dataset.refused.includes(text))",
        arg=f"{text}",
    )
    page.page.wait_for_function("field => field.value === '95'", arg=entry.element_handle())
    assert gate(served) == pytest.approx(0.95)
    assert served.state.undo == undo
    assert served.state.faults == ()


def test_what_is_no_number_is_refused_at_the_field(page: OpenPage, served: Served, heard: Heard) -> None:
    page.open_tab("Tune")
    entry = typed_into(page, "Gate", "-")
    entry.press("Enter")
    assert page.row("Gate").get_attribute("data-refused") == 'found "-"; expected a number'
    assert entry.input_value() == "95"
    assert heard.fields() == []
    assert served.state.faults == ()


def test_a_click_elsewhere_finishes_the_entry_before_it_does_anything(
    page: OpenPage, served: Served, heard: Heard
) -> None:
    page.open_tab("Tune")
    page.fill("Gate", "99")
    served.until(lambda: gate(served) == pytest.approx(0.99), 10.0)
    typed_into(page, "Gate", "97.5")
    heard.envelopes.clear()
    page.page.get_by_role("button", name="Undo").first.click()
    served.until(lambda: len(served.state.redo) == 1, 10.0)
    assert [type(envelope.action).__name__ for envelope in heard.envelopes] == ["SetParameter", "Undo"]
    assert gate(served) == pytest.approx(0.99)


def test_a_text_that_is_refused_does_not_stay_in_its_field(page: OpenPage, served: Served, heard: Heard) -> None:
    page.open_tab("Site")
    page.fold("Vehicle")
    entry = page.row("Outline").locator("input")
    before, undo = entry.input_value(), served.state.undo
    typed_into(page, "Outline", "1 2").press("Enter")
    page.page.wait_for_function("() => document.querySelector('[data-refused]') !== null")
    page.page.wait_for_function("([field, text]) => field.value === text", arg=[entry.element_handle(), before])
    page.page.wait_for_timeout(300)
    assert len(heard.fields()) == 1
    assert served.state.undo == undo


def test_what_was_refused_for_one_reflector_is_not_said_of_the_next_one(page: OpenPage, served: Served) -> None:
    first, second = served.state.project.reflectors.reflectors[:2]
    assert first.radius == second.radius  # the field need not be written anew
    page.click_at((first.x, first.y))
    page.wait_for_text(f"Reflector {first.id}")
    typed_into(page, "Radius [mm]", "-").press("Enter")
    page.page.wait_for_function("() => document.querySelector('[data-refused]') !== null")
    assert "expected a number" in (page.row("Radius [mm]").get_attribute("data-refused") or "")
    page.click_at((second.x, second.y))
    page.wait_for_text(f"Reflector {second.id}")
    page.page.wait_for_function("() => document.querySelector('[data-refused]') === null", timeout=5_000)


@pytest.mark.parametrize("tab", ["Site", "Plan", "Run", "Tune"])
def test_each_number_typed_key_by_key_is_one_entry(
    page: OpenPage, served: Served, heard: Heard, tab: str, seeds: Seeds
) -> None:
    page.open_tab(tab)
    for _ in range(3):  # a folder may hold others
        for name in page.page.evaluate(_FOLDED):
            page.fold(name)
    numbers = page.page.evaluate(_NUMBERS)
    seen = dict[object, int]()
    for widget, index in numbers:
        handle = widget_of(served.server.gui, widget)
        if handle is None or handle.disabled or not handle.label:
            continue
        kind = type(handle), handle.label.rpartition("[")[2], index
        if seeds.all or seen.get(kind, 0) < OF_EACH_KIND:
            _is_one_entry(page, served, heard, (handle, widget, index))
            seen[kind] = seen.get(kind, 0) + 1
    assert sum(seen.values()) > 3
    assert page.errors == []


def _is_one_entry(page: OpenPage, served: Served, heard: Heard, number: tuple[object, str, int]) -> None:
    """Type another value and check what was heard."""
    handle, widget, index = number
    before = handle.value if not isinstance(handle.value, tuple) else handle.value[index]
    step, low, high = handle.step, getattr(handle, "min", None), getattr(handle, "max", None)
    low, high = (bound[index] if isinstance(bound, tuple) else bound for bound in (low, high))
    after = before + 3 * step if high is None or before + 3 * step <= high else before - 3 * step
    assert low is None or after >= low
    row = page.page.locator(f'label[for="{widget}"]').locator("xpath=ancestor::*[contains(@class,'Flex-root')][1]")
    entry = row.locator(".mantine-NumberInput-input").nth(index)
    entry.click()
    page.page.keyboard.press("Control+A")
    heard.envelopes.clear()
    page.page.keyboard.type(f"{after:.10g}", delay=5)
    page.page.wait_for_timeout(50)
    assert heard.envelopes == [], f"{handle.label} tells of keys"
    steps = len(served.state.undo)
    page.page.keyboard.press("Enter")

    def is_entered() -> bool:
        return (handle.value[index] if isinstance(handle.value, tuple) else handle.value) == pytest.approx(
            after, rel=1e-6
        )

    served.until(is_entered, 10.0)
    page.page.wait_for_timeout(80)  # a second entry would come now
    assert is_entered(), handle.label
    assert heard.fields() in ([widget], []), handle.label
    assert len(served.state.undo) <= steps + 1, handle.label


def test_a_text_that_seeks_in_a_list_tells_of_every_key(page: OpenPage, served: Served) -> None:
    page.open_tab("Reflectors")
    count = len(served.state.project.reflectors)
    page.wait_for_text(f"{count} of {count} reflectors")
    typed_into(page, "Find", "no such reflector")
    page.wait_for_text(f"0 of {count} reflectors")
    assert page.errors == []


def test_what_held_before_can_be_entered_where_another_value_has_come(
    page: OpenPage, other: OpenPage, served: Served
) -> None:
    page.open_tab("Tune")
    typed_into(page, "Gate", "9")
    other.fill("Gate", "92")
    served.until(lambda: gate(served) == pytest.approx(0.92), 10.0)
    page.page.wait_for_timeout(300)
    typed_into(page, "Gate", "95").press("Enter")
    served.until(lambda: gate(served) == pytest.approx(0.95), 10.0)


def test_nothing_is_written_into_a_field_that_is_typed_into(page: OpenPage, other: OpenPage, served: Served) -> None:
    page.open_tab("Tune")
    entry = typed_into(page, "Gate", "97")
    other.fill("Gate", "99")
    served.until(lambda: gate(served) == pytest.approx(0.99), 10.0)
    page.page.wait_for_timeout(400)
    assert entry.input_value() == "97"
    page.page.keyboard.type(".5")
    assert entry.input_value() == "97.5"
    entry.press("Escape")
    page.page.wait_for_function("field => field.value === '99'", arg=entry.element_handle())
    assert gate(served) == pytest.approx(0.99)

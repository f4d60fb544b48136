"""Audits of the whole page: what cannot be used says why, what is accepted is seen first, no number drags a tail."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

import commission
from commission.app.base.actions import Action
from commission.app.base.inputs import NOT_NOW
from commission.app.base.server import start_server
from commission.app.base.state import AppState
from commission.app.exchange import actions as exchange
from commission.app.floor_map import actions as floor_map
from commission.app.layouts import actions as layouts
from commission.app.run import variant_actions as variants
from commission.errors import CommissionError
from commission.site.project import Project
from tests.app.asking import after, joined
from tests.app.test_shown_inputs import PageBench

APP = Path(commission.__file__).parent / "app"
STATES: dict[str, Callable[[AppState], AppState]] = {
    "empty": lambda state: replace(state, project=Project(), saved=Project()),
    "as opened": lambda state: state,
    "read-only": lambda state: replace(state, read_only="it is edited by somebody else"),
    "changed": lambda state: replace(state, saved=Project()),
}


def has_tail(number: float) -> bool:
    """Whether a number has more than six digits, and more behind the point than a hundredth of a millimetre takes."""
    return number != float(f"{number:.6g}") and len(repr(number).partition(".")[2]) > 5


@pytest.fixture(scope="module")
def server() -> Iterator[Any]:
    made = start_server("127.0.0.1", 0)
    yield made
    made.stop()


@pytest.fixture(scope="module")
def bench(server: Any) -> PageBench:
    from tests.app.sites import room

    return PageBench(server, room())


@pytest.mark.parametrize("name", STATES)
def test_whatever_cannot_be_used_says_why(bench: PageBench, name: str) -> None:
    bench.draw(STATES[name](bench.state))
    disabled = [widget for widget in bench.widgets if getattr(widget, "disabled", False) and widget.visible]
    if name in ("empty", "read-only"):
        assert disabled, "there is something that cannot be used"
    assert [widget.label for widget in disabled if NOT_NOW not in (widget.hint or "")] == []
    bench.draw(bench.state)


def test_only_what_says_why_switches_a_widget_off() -> None:
    found = {
        path.name
        for path in APP.rglob("*.py")
        if re.search(r"\.disabled = |disabled=True", path.read_text(encoding="utf-8"))
    }
    assert found == {"inputs.py"}


ACCEPTS: tuple[tuple[type[Action], Callable[[], Action]], ...] = (
    (exchange.AcceptImport, exchange.AcceptImport),
    (floor_map.AlignMap, floor_map.AlignMap),
    (layouts.SwitchLayout, lambda: layouts.SwitchLayout(1)),
    (variants.UseVariant, lambda: variants.UseVariant("A")),
)
"""What puts something up that the program has made or read, and how a browser asks for it unseen."""


@pytest.mark.parametrize("ask", [ask for _, ask in ACCEPTS], ids=[kind.__name__ for kind, _ in ACCEPTS])
def test_nothing_is_accepted_that_was_not_shown(project: Project, ask: Callable[[], Action]) -> None:
    state = joined(AppState(project=project, saved=project))
    try:
        outcome = after(state, ask())
    except (CommissionError, ValueError):
        return
    assert outcome.state.project is project
    assert outcome.state.undo == ()


BEFORE_AND_AFTER = {
    "Accept": "import and suggestion: counts and values of both",
    "Load as the floor map": "the picture lies on the floor, with size and cells",
    "Move and turn": "distances on the map and in the plant",
    "Switch": "figures of both layouts",
    "Replace it": "what lies there",
}


def test_what_is_accepted_is_offered_only_once_there_is_something_to_see(bench: PageBench) -> None:
    bench.draw(bench.state)
    offered = {
        getattr(widget, "label", "")
        for widget in bench.widgets
        if widget.visible and not getattr(widget, "disabled", False)
    }
    groups = {
        option for widget in bench.widgets if widget.visible for option in (getattr(widget, "options", None) or ())
    }
    assert (offered | {str(option) for option in groups}) & set(BEFORE_AND_AFTER) == set()


def test_no_number_of_the_page_drags_a_tail_of_digits(bench: PageBench) -> None:
    bench.draw(bench.state)
    held = [(getattr(widget, "label", ""), getattr(widget, "value", None)) for widget in bench.widgets]
    numbers = [(label, each) for label, value in held for each in (value if isinstance(value, tuple) else (value,))]
    assert [(label, each) for label, each in numbers if isinstance(each, float) and has_tail(each)] == []

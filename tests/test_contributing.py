"""The panel that CONTRIBUTING adds as an example works, exactly as it stands there."""

from __future__ import annotations

import importlib
import re
import sys
import textwrap
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

import commission.app
from commission.app.base.actions import Action, Sender
from commission.app.base.reducer import reduce
from commission.app.base.server import start_server
from commission.app.base.state import AppState
from commission.app.base.view import view_of
from commission.app.launch import FEATURES
from commission.app.page import Page
from tests.app.asking import taking
from tests.app.sites import room
from tests.conftest import REPOSITORY

_FILE = re.compile(r"^    # (commission/app/order/\w+\.py)\n((?:    .*\n|\n)+)", re.MULTILINE)


@pytest.fixture(scope="module")
def order(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    """The example's modules, by their names."""
    folder = tmp_path_factory.mktemp("app")
    text = (REPOSITORY / "CONTRIBUTING.md").read_text(encoding="utf-8")
    files = {Path(name): textwrap.dedent(content) for name, content in _FILE.findall(text)}
    (folder / "order").mkdir()
    (folder / "order" / "__init__.py").write_text("")
    for name, content in files.items():
        (folder / "order" / name.name).write_text(content)
    commission.app.__path__.append(str(folder))
    yield SimpleNamespace(**{name.stem: importlib.import_module(f"commission.app.order.{name.stem}") for name in files})
    commission.app.__path__.remove(str(folder))
    for name in [name for name in sys.modules if name.startswith("commission.app.order")]:
        del sys.modules[name]


@pytest.fixture
def state() -> AppState:
    project = room()
    return AppState(project=project, saved=project)


def test_its_action_changes_what_the_feature_keeps(order: Any, state: AppState) -> None:
    after = reduce(order.actions.SetOrder("spares", 0.5), state, Sender()).state
    assert state.part(order.state.Order).spares == 0.1
    assert after.part(order.state.Order).spares == 0.5
    with pytest.raises(ValueError, match=r"spares is 1\.5; expected 0 to 1"):
        reduce(order.actions.SetOrder("spares", 1.5), state, Sender())


def test_its_panel_posts_what_is_moved_and_shows_what_it_comes_to(order: Any, state: AppState) -> None:
    server = start_server("127.0.0.1", 0)
    try:
        actions: list[Action] = []
        panel = order.order_panel.OrderPanel(server.gui, taking(actions))
        assert (panel._spares.label, panel._spares.value) == ("Spares [%]", 10.0)
        panel._spares._impl.value = 50.0
        for callback in panel._spares._impl.update_cb:
            callback(SimpleNamespace(client=SimpleNamespace(client_id=1), client_id=1, target=panel._spares))
        assert actions == [order.actions.SetOrder("spares", 0.5)]
        count = len(state.project.reflectors)
        assert count > 1
        panel.draw_slowly(view_of(state.with_part(replace(order.state.Order(), spares=0.5))))
        assert panel._spares.value == 50.0
        assert panel._text.content == f"{count} reflectors and {-(-count // 2)} spare ones"
    finally:
        server.stop()


def test_the_page_shows_it_once_it_is_in_the_list(order: Any, state: AppState) -> None:
    server = start_server("127.0.0.1", 0)
    try:
        page = Page(server, taking([]), state, (*FEATURES, order.feature.FEATURE))
        page.draw(view_of(state), slowly=True)
    finally:
        server.stop()

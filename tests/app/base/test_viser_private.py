"""viser's private names: each is there, and nobody but one module uses them."""

from __future__ import annotations

import ast
import asyncio
import threading
from collections import deque
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import viser

import commission
from commission.app.base import viser_private
from commission.app.base.viser_private import LoopEvent
from tests.app.base.widget_bench import WidgetBench

PACKAGE = Path(commission.__file__).parent
OTHERS_OWN = {"_exit", "_replace", "_asdict", "_fields"}
"""Names with an underscore that are public in spite of it: of `os` and of named tuples."""


def private_names(path: Path) -> set[str]:
    """Names with a leading underscore that a module takes from something other than its own objects."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    found: set[str] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Attribute) and node.attr.startswith("_") and not node.attr.endswith("__"):
            is_own = isinstance(node.value, ast.Name) and node.value.id in ("self", "cls")
            found |= set() if is_own else {node.attr}
        if isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] == "viser":
            found |= {name.name for name in node.names if name.name.startswith("_")}
            found |= {part for part in (node.module or "").split(".") if part.startswith("_")}
    return found


def test_only_one_module_uses_private_names_of_viser() -> None:
    users = {path.name: private_names(path) - OTHERS_OWN for path in (PACKAGE / "app").rglob("*.py")}
    ours = {name for name, used in users.items() if used}
    assert ours == {"viser_private.py"}


def test_each_private_name_of_viser_is_there() -> None:
    """One that is missing says so here, and not in the middle of a drive."""
    bench = WidgetBench()
    server, client = bench.server, bench.server.get_clients()[0]
    socket, button = server._websock_server, bench.widgets["button"]
    have: tuple[object, ...] = (
        viser,
        server,
        server.gui,
        server.scene,
        client,
        socket,
        socket.get_message_buffer(),
        socket._client_state_from_id[0],
        button,
        button._button_impl,
        bench.gizmo,
        viser._scene_api,
        viser._viser,
        server.gui.add_slider("", 0.0, 1.0, 0.1, 0.5)._impl.props,
    )
    used = private_names(PACKAGE / "app" / "base" / "viser_private.py")
    assert len(used) > 20
    assert {name for name in used if not any(name in dir(owner) for owner in have)} == set()
    for module in (viser._scene_api, viser._viser):
        assert hasattr(module, "print_awaited_callback_error")
    bench.close()


def test_what_a_browser_can_say_has_the_fields_that_viser_reads() -> None:
    from dataclasses import MISSING, fields

    from commission.app.base import wire

    for ours in wire.MESSAGES:
        theirs = {field.name: field for field in fields(getattr(viser._messages, ours.__name__))}
        assert set(ours.__struct_fields__) == set(theirs), ours.__name__
        optional = {name for name, field in theirs.items() if field.default is not MISSING}
        assert set(ours.__struct_fields__[len(ours.__struct_fields__) - len(ours.__struct_defaults__) :]) == optional


class Watched(deque[Any]):
    """Those who wait for an event; notes which threads go through them."""

    def __init__(self) -> None:
        super().__init__()
        self.threads: set[int] = set()

    def __iter__(self) -> Iterator[Any]:
        self.threads.add(threading.get_ident())
        return super().__iter__()


def push(event: asyncio.Event, loop: asyncio.AbstractEventLoop) -> None:
    """Do what viser does when a thread writes a message: set the event there, and have it set by the loop."""
    event.set()
    loop.call_soon_threadsafe(event.set)


def threads_that_wake(event: asyncio.Event, loop: asyncio.AbstractEventLoop) -> set[int]:
    """Set an event from another thread while a task of a loop waits for it; return who went through the waiting."""
    event._waiters = watched = Watched()

    async def wait() -> None:
        while not event.is_set():
            await asyncio.wait([asyncio.ensure_future(event.wait())], timeout=0.1)

    thread = threading.Timer(0.05, push, (event, loop))
    thread.start()
    loop.run_until_complete(asyncio.wait_for(wait(), 5.0))
    thread.join()
    return watched.threads - {threading.get_ident()}


def test_who_waits_for_an_event_is_woken_by_the_loop_alone() -> None:
    """A thread that goes through a list while the loop changes it: "deque mutated during iteration"."""
    loop = asyncio.new_event_loop()
    assert threads_that_wake(LoopEvent(loop), loop) == set()
    assert len(threads_that_wake(asyncio.Event(), loop)) == 1  # as viser does it
    loop.close()


def test_the_events_of_all_buffers_are_of_that_kind() -> None:
    bench = WidgetBench()
    server = bench.server._websock_server
    buffers = [server.get_message_buffer(), *(s.message_buffer for s in server._client_state_from_id.values())]
    assert len(buffers) == 3
    assert {type(buffer.message_event) for buffer in buffers} == {LoopEvent}
    bench.close()


def test_messages_that_belong_together_wake_the_loop_once_at_their_end() -> None:
    bench = WidgetBench()
    server = bench.server._websock_server
    buffer, woken = server.get_message_buffer(), []
    ask = buffer.event_loop.call_soon_threadsafe
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(buffer.event_loop, "call_soon_threadsafe", lambda *asked: woken.append(asked[0]) or ask(*asked))
        with bench.server.atomic():
            for value in range(3):
                bench.widgets["count"].value = 20 + value
            assert woken == []
        assert woken == [buffer.message_event.set]
    bench.close()


@pytest.mark.parametrize("name", ["notify", "show_value", "send"])
def test_nothing_happens_when_a_connection_has_gone(name: str) -> None:
    bench = WidgetBench()
    if name == "notify":
        viser_private.notify(bench.server, 99, title="t", text="x", seconds=1.0)
    elif name == "show_value":
        viser_private.show_value(bench.server, 99, bench.widgets["count"])
    else:
        viser_private.send(bench.server, 99, None)
    bench.close()

"""A server with one widget, node and command of every kind that a browser can speak of, and two browsers."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import viser

from commission.app.base.server import PageServer, start_server
from tests.app.raw_client import RawClient


class WidgetBench:
    """The server, its widgets by name, a browser that may say anything, and an innocent one."""

    def __init__(self) -> None:
        self.server: PageServer = start_server("127.0.0.1", 0)
        gui, scene = self.server.gui, self.server.scene
        self.changed: list[tuple[str, Any]] = []
        self.widgets: dict[str, Any] = {
            "button": gui.add_button("Press"),
            "group": gui.add_button_group("Group", ("one", "two")),
            "checkbox": gui.add_checkbox("Switch", False),
            "dropdown": gui.add_dropdown("Choice", ("a", "b")),
            "multi_slider": gui.add_multi_slider("Ends", 0.0, 10.0, 0.5, (2.0, 8.0)),
            "count": gui.add_number("Seed", 7),
            "bounded": gui.add_number("Count", 20, min=10, max=60),
            "height": gui.add_number("Height", 0.5),
            "rgb": gui.add_rgb("Color", (1, 2, 3)),
            "rgba": gui.add_rgba("Veil", (1, 2, 3, 4)),
            "slider": gui.add_slider("Speed", 0.0, 5.0, 0.1, 1.0),
            "text": gui.add_text("Name", "hall"),
            "lines": gui.add_text("Table", "", multiline=True),
            "vector2": gui.add_vector2("Place", (1.0, 2.0), min=(0.0, 0.0), max=(10.0, 10.0)),
            "vector3": gui.add_vector3("Point", (1.0, 2.0, 3.0)),
            "progress": gui.add_progress_bar(10.0),
            "disabled": gui.add_button("Not now", disabled=True),
        }
        self.upload = gui.add_upload_button("Upload")
        self.form = gui.add_form("Form")
        self.command = gui.add_command("Undo", hotkey="Z", modifier="cmd/ctrl")
        self.box = scene.add_box("/box")
        self.gizmo = scene.add_transform_controls("/gizmo")
        self.clock = gui.add_html("0")
        for name, widget in self.widgets.items():
            listen = widget.on_click if name == "group" else getattr(widget, "on_update", None)
            if listen is not None:
                listen(lambda event, name=name: self.changed.append((name, event.target.value)))
        self.guest, self.innocent = RawClient(self.server), RawClient(self.server)
        self.until(lambda: len(self.server.get_clients()) == 2)

    @property
    def values(self) -> dict[str, Any]:
        """What each widget holds."""
        return {name: widget.value for name, widget in self.widgets.items()}

    @property
    def kept(self) -> set[tuple[str, str, str]]:
        """What the server sends to every browser that comes: type, entity, and which attributes."""
        buffer = self.server._websock_server.get_message_buffer()
        with buffer.buffer_lock:
            messages = tuple(buffer.message_from_id.values())
        clock = self.clock._impl.uuid
        return {
            (type(message).__name__, str(getattr(message, "uuid", getattr(message, "name", ""))), _attributes(message))
            for message in messages
            if getattr(message, "uuid", None) != clock
        }

    def until(self, reached: Callable[[], bool], seconds: float = 10.0) -> None:
        """Wait until something has happened on the server."""
        end = time.monotonic() + seconds
        while not reached():
            assert time.monotonic() < end, f"it did not happen within {seconds} s"
            time.sleep(0.01)

    def draw(self) -> None:
        """Write something new to the page, and let the innocent browser see it."""
        self.clock.content = now = str(int(self.clock.content) + 1)
        self.innocent.hear_until(lambda message: message.get("updates") == {"content": now}, 30.0)

    def begin_anew(self) -> None:
        """Let another browser take the place of the one that may say anything, and forget what was heard."""
        self.guest.close()
        self.until(lambda: len(self.server.get_clients()) == 1)
        self.guest = RawClient(self.server)
        self.until(lambda: len(self.server.get_clients()) == 2)
        self.changed.clear()
        self.innocent.heard.clear()

    def close(self) -> None:
        """End it all."""
        for client in (self.guest, self.innocent):
            client.close()
        self.server.stop()


def _attributes(message: viser._messages.Message) -> str:
    return ",".join(sorted(getattr(message, "updates", ())))
